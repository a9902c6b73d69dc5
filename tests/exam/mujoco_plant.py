"""One of MuJoCo's plants with its robot, its sensors and what is hidden in it."""

import math
import random

import mujoco
import numpy as np
from scipy.signal import butter, sosfilt

import balance
from mujoco_models import PLANTS, ROTATIONAL, Parts, hide, model
from mujoco_paper import NAMES

TICK_S = 2e-3  # of the controller, times the plant's slowness
STEPS = 4  # of the engine in a tick
WINDOW_S = 2.0  # of a plant without a spring


def noise(rng, count, cutoff, rms, order):
    """Band-limited noise; cutoff as a share of the rate."""
    x = sosfilt(butter(order, 2 * cutoff, output="sos"), rng.uniform(-1, 1, count + 2000))[2000:]
    return x * rms / np.std(x)


class Plant:
    def __init__(self, question, seed, severity, own, quiet=False):
        self.question, self.seed, self.severity, self.quiet = question, seed, severity, quiet
        self.constants = constants = PLANTS[question.plant]
        self.n = len(constants["axes"])
        self.slow = question.slow
        self.tick_s = TICK_S * self.slow
        self.rate_hz = 1 / (self.tick_s * question.every)
        # Whole seconds of the slowest beat; not every slow plant is given all the time that it would take.
        self.duration_s = 50.0 * self.slow if self.slow <= 2 else 25.0 * self.slow
        self.ticks = round(self.duration_s / self.tick_s / question.every) * question.every
        draw = random.Random(seed)
        around = lambda values: [v * math.exp(0.1 * draw.gauss(0, 1)) for v in values]
        self.size = {key: around(constants[key]) for key in "MBK"}
        self.turn = draw.uniform(-0.12, 0.12) if question.plant == "planar" else 0.0
        self.axis = draw.randrange(self.n)
        self.own = (0.0 if quiet else own) * draw.uniform(0.004, 0.012) * constants["f"]
        m, b, k = (self.size[key][self.axis] for key in "MBK")
        x, f = constants["x"], constants["f"]
        if question.plant == "arm":
            x, f = x / 0.35, f * 0.35  # joint angles and torques
        self.sizes = {"m": m, "b": b, "k": k or 300.0, "x": x, "f": f}
        parts = Parts()
        self.parameters = {}
        if severity > 0:
            kind = "slide" if question.plant in ("slide", "free", "planar") else "hinge"
            self.parameters = hide(parts, self.sizes, kind, f"j{self.axis}", question.effect, question.form, severity, self.slow, draw)
        self.model = mujoco.MjModel.from_xml_string(model(question.plant, self.size, self.slow, self.turn, parts, self.axis))
        c, s = math.cos(self.turn), math.sin(self.turn)
        self.turned = np.array([[c, -s], [s, c]])
        self.hand = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_SITE, "hand")
        self.drawn = draw.random()
        self.effect_of_time()

    def effect_of_time(self):
        """Numbers of what acts in time or in channels."""
        s, effect = self.severity if self.severity > 0 else 0.0, self.question.effect
        active = lambda name: s if effect == name else 0.0
        self.delay_s = active("measurement-delay") * 0.012 * self.slow
        self.lag_s = active("channel-filter") / (2 * math.pi * 12.0) * self.slow
        self.angle = math.radians(15 * active("sensor-misalignment"))
        self.drift = active("stiffness-drift") * 0.8 / self.duration_s
        self.creep = active("posture-drift") * 2 * self.sizes["x"] / self.duration_s
        self.tremor = (active("periodic-disturbance") * 0.6 * self.constants["f"], (2 + 5 * self.drawn) / self.slow)
        self.knock = (active("transient-disturbance") * 12 * self.constants["f"], (0.1 + 0.5 * self.drawn) * self.duration_s)
        self.clip = self.constants["command"] * (2.2 - 1.6 * s) if effect == "actuator-saturation" and s > 0 else math.inf
        self.step = 0.25 * s * self.constants["x"] if effect == "quantisation" else 0.0
        self.reflex = (active("reflex-delay") * self.sizes["b"] * 2 * self.slow, (0.03 + 0.03 * self.drawn) * self.slow)
        self.parameters |= {
            "measurement-delay": {"delay": self.delay_s}, "channel-filter": {"cutoff": 1 / (2 * math.pi * self.lag_s) if self.lag_s else None},
            "sensor-misalignment": {"angle": self.angle}, "stiffness-drift": {"fraction_per_s": self.drift}, "posture-drift": {"rate": self.creep},
            "periodic-disturbance": {"frequency": self.tremor[1], "amplitude": self.tremor[0]}, "quantisation": {"step": self.step},
            "actuator-saturation": {"level": self.clip},
        }.get(effect, {})

    def tolerated(self):
        """Latencies below what instruments may have, angles and steps below theirs."""
        late = 0.8e-3 * 12.0 / (self.constants["band"] / self.slow)
        effect = self.question.effect
        if effect in ("measurement-delay", "channel-filter"):
            return max(self.delay_s, self.lag_s) < late
        return effect == "sensor-misalignment" and abs(self.angle) < math.radians(2)

    # What moves.

    def commands(self, rng):
        constants, q = self.constants, self.question
        cutoff = {"free": 2.0, "slide": 12.0, "pendulum": 8.0, "arm": 12.0}.get(q.plant, 15.0) * TICK_S
        count = self.ticks // 10 if q.periodic else self.ticks
        command = np.array([noise(rng, count, cutoff, constants["command"], 4) for _ in range(self.n)])
        if q.periodic:
            command = np.tile(command, 10)
        if q.sampling == "held":
            command = np.repeat(command[:, :: q.every], q.every, axis=1)
        return command[:, : self.ticks]

    def disturbances(self, rng, trial):
        """Forces on the joints that nobody commands; the first is the limb's own."""
        size = self.own * (0.35 if self.question.plant == "arm" else 1.0)
        own = np.array([noise(rng, self.ticks, 2.0 * TICK_S, 1.0, 2) for _ in range(self.n)]) * size
        t = np.arange(self.ticks) * self.tick_s
        other = np.zeros_like(own)
        amplitude, frequency = self.tremor
        phase = rng.uniform(0, 2 * math.pi) + np.cumsum(0.01 * rng.standard_normal(self.ticks))
        other[self.axis] += amplitude * np.sin(2 * math.pi * frequency * t + phase)
        size, at = self.knock
        if trial == 0:
            since = (t - at) / (0.2 * self.slow)
            other[self.axis] += np.where((since >= 0) & (since < 1), size * np.sin(math.pi * since.clip(0, 1)) ** 2, 0.0)
        return own, other

    def place(self, data):
        """Measured position by axis."""
        if self.question.plant == "arm":
            mujoco.mj_kinematics(self.model, data)
            return data.site_xpos[self.hand, :2].copy()
        return self.turned @ data.qpos[: self.n] if self.turn else data.qpos[: self.n].copy()

    def start(self):
        data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, data)
        return data, self.place(data)

    def tick(self, data, k, force, disturbance, past):
        """One tick of the controller with a force by axis."""
        if self.drift:
            stiffness = self.size["K"][self.axis] * (1 + self.drift * ((k + 0.5) * self.tick_s - self.duration_s / 2))
            self.model.jnt_stiffness[self.axis] = stiffness
        if self.creep:
            self.model.qpos_spring[self.axis] = self.creep * ((k + 0.5) * self.tick_s - self.duration_s / 2)
        data.ctrl[: self.n] = force
        if self.reflex[0]:
            past.append(data.qvel[self.axis])
            back = len(past) - 1 - round(self.reflex[1] / self.tick_s)
            data.ctrl[self.n] = -self.reflex[0] * past[back] if back >= 0 else 0.0
        data.qfrc_applied[: self.n] = disturbance
        mujoco.mj_step(self.model, data, STEPS)

    def run(self, force_of, disturbance, ticks=None, data=None, first=0):
        """Ticks of a free or controlled run; positions at each tick, the last included, and forces that acted."""
        zero = self.start()[1]
        if data is None:
            data, _ = self.start()
        ticks = ticks or self.ticks
        places, forces, past, states = [self.place(data) - zero], [], [], {}
        for k in range(first, first + ticks):
            if k % round(WINDOW_S / self.tick_s) == 0:
                states[k] = (data.qpos.copy(), data.qvel.copy(), data.act.copy())
            force = force_of(k, places)
            self.tick(data, k, force, disturbance[:, k], past)
            forces.append(force)
            places.append(self.place(data) - zero)
        # The engine's force of a step acts at the step's beginning (semi-implicit Euler): positions are half a step ahead of the force.
        places, early = np.array(places).T, 0.5 / STEPS
        places[:, 1:] = (1 - early) * places[:, 1:] + early * places[:, :-1]
        return places, np.array(forces).T, states

    def held(self, command):
        """The soft robot's force at a tick: the command and its hold."""
        kp, kd = self.constants["hold"][0], self.constants["hold"][1] * self.slow
        position = self.question.plant == "free"

        def force(k, places):
            now, before = places[-1], places[-2] if len(places) > 1 else places[-1]
            wanted, pushed = (command[:, k], 0.0) if position else (0.0, command[:, k])
            return pushed + kp * (wanted - now) - kd * (now - before) / self.tick_s

        return force

    def acting(self, force):
        """What the actuator makes of a force that is told to it, and recorded: a queue, a lag, a limit."""
        if self.question.form == "queue":
            return self.late(force)
        if self.question.form == "actuator":
            return self.lagging(force)
        return np.clip(force, -self.clip, self.clip)

    def late(self, channel):
        at = np.arange(channel.shape[1]) - self.delay_s / self.tick_s
        return np.array([np.interp(at, np.arange(len(row)), row, left=row[0]) for row in channel])

    def lagging(self, channel):
        if not self.lag_s:
            return channel
        keep = math.exp(-self.tick_s / self.lag_s)
        out = np.empty_like(channel)
        level = channel[:, 0]
        for k in range(channel.shape[1]):
            level = keep * level + (1 - keep) * channel[:, k]
            out[:, k] = level
        return out

    # What is recorded.

    def sampled(self, ticks, instants):
        """Samples of a channel that is held in each tick, or that is known at each tick and the one after the last: means over the
        sample (mean), values in the middle of its first tick (instant), or at the sample's beginning where the force is held in it (held)."""
        every, sampling = self.question.every, self.question.sampling
        if instants:
            ticks = ticks[:, :-1] if sampling == "held" else 0.5 * (ticks[:, :-1] + ticks[:, 1:])
        rows = ticks.reshape(len(ticks), -1, every)
        return rows.mean(axis=2) if sampling == "mean" else rows[:, :, 0]

    def sensed(self, force):
        """The force channels from the force that acted, before noise and steps."""
        if self.question.form in ("queue", "actuator"):
            return force
        out = self.lagging(self.late(force))
        if self.angle and self.n == 2:
            c, s = math.cos(self.angle), math.sin(self.angle)
            out = np.array([[c, -s], [s, c]]) @ out
        return out

    def read(self, rng, effort, motion):
        """Channels with the noise and the steps of their instruments."""
        if self.quiet:
            steps = [self.step if i == self.axis else 0.0 for i in range(self.n)]
            return effort, np.array([np.round(row / step) * step if step else row for row, step in zip(motion, steps)])
        f_noise, f_step, x_step = self.constants["steps"]
        steps = [self.step if self.step and i == self.axis else x_step for i in range(self.n)]
        effort = np.round((effort + f_noise * rng.standard_normal(effort.shape)) / f_step) * f_step
        return effort, np.array([np.round((row + 0.25 * x_step * rng.standard_normal(len(row))) / step) * step for row, step in zip(motion, steps)])

    def trial(self, number):
        """One recording and what happened."""
        rng = np.random.default_rng([self.seed, number])
        q = self.question
        if q.plant == "ankle":
            return self.imposed(rng, number)
        command = self.commands(rng)
        own, other = self.disturbances(rng, number)
        open_loop = self.constants["hold"] == (0.0, 0.0)
        if open_loop:
            acted = self.acting(command)
            places, _, states = self.run(lambda k, _: acted[:, k], own + other)
            told = command
        else:
            places, acted, states = self.run(self.held(command), own + other)
            told = acted
        clean = self.sampled(self.sensed(told), False)
        motion = self.sampled(places, True)
        effort, seen = self.read(rng, clean, motion)
        words = ("torque", "angle", "N m", "rad") if q.plant in ROTATIONAL else ("force", "pos", "N", "m")
        axes = self.constants["axes"]
        names = [f"{words[0]}_{a} [{words[2]}]" for a in axes] + [f"{words[1]}_{a} [{words[3]}]" for a in axes]
        names += [f"cmd_{a} [{words[3] if q.plant == 'free' else words[2]}]" for a in axes]
        channels = [*effort, *seen, *self.sampled(command, False)]
        left = self.left(effort, seen, 0.5 / self.rate_hz if q.sampling == "held" else 0.0)
        left["steps"] = self.step / math.sqrt(12) / np.std(seen[self.axis])
        return dict(names=names, channels=channels, left=left, effort=effort, clean=clean, motion=motion, seen=seen, acted=acted, other=other, states=states, trial=number)

    def imposed(self, rng, number):
        """Torque that an imposed angle needs, by the engine's inverse dynamics."""
        count = self.ticks // 10 if self.question.periodic else self.ticks
        hz = np.fft.rfftfreq(count, self.tick_s)
        lines = np.where((hz > 0) & (hz < 12 / self.slow), 1 / (1 + (hz * self.slow / 3) ** 2), 0) * np.exp(2j * np.pi * rng.random(len(hz)))
        path = self.derivatives(lines, hz, count, self.constants["x"])
        if self.question.periodic:
            path = np.tile(path, 10)
        own, other = self.disturbances(rng, number)
        torque = self.inverse(path)[None] + own + other
        angle = path[0][None]
        pick = lambda row: row[:, :: self.question.every] if self.question.sampling == "instant" else row.reshape(1, -1, self.question.every).mean(axis=2)
        effort, seen = self.read(rng, pick(self.sensed(torque)), pick(angle))
        left = self.left(effort, seen, 0.0)
        return dict(names=["angle_ankle [rad]", "torque_ankle [N m]"], channels=[*seen, *effort], left=left, effort=effort, seen=seen, own=own, trial=number)

    @staticmethod
    def derivatives(lines, hz, count, rms=None):
        """Displacement, velocity and acceleration of these lines."""
        s = 2j * np.pi * hz
        path = np.array([np.fft.irfft(lines * s**order, count) for order in range(3)])
        return path * (rms / np.std(path[0]) if rms else 1.0)

    def inverse(self, path):
        data, torque = mujoco.MjData(self.model), []
        for k in range(path.shape[1]):
            if self.drift:
                self.model.jnt_stiffness[0] = self.size["K"][0] * (1 + self.drift * ((k + 0.5) * self.tick_s - self.duration_s / 2))
            if self.creep:
                self.model.qpos_spring[0] = self.creep * ((k + 0.5) * self.tick_s - self.duration_s / 2)
            data.qpos[0], data.qvel[0], data.qacc[0] = path[:, k]
            mujoco.mj_inverse(self.model, data)
            torque.append(data.qfrc_inverse[0])
        return np.array(torque)

    def left(self, effort, seen, lead_s):
        """Residual powers of M, B, K; motion that is sampled before the middle of what the force stands for is moved there."""
        band = (0.5 if self.question.plant == "free" else 0.1) / self.slow, self.constants["band"] / self.slow
        slow = "drift" in (self.question.effect or "")
        hz, effort, orders = balance.lines(effort, seen, self.rate_hz, band, lead_s, slow)
        rest, coefficients = balance.left(effort, orders)
        motion = orders[0]
        given = self.question.plant == "ankle"
        predicted = rest if given else balance.through(hz, rest, coefficients)
        outputs = effort if given else motion
        rows = range(self.n) if self.question.plant == "arm" or self.question.effect == "sensor-misalignment" else [self.axis]
        return {
            "effort": sum(balance.power(rest[i]) for i in rows), "all_effort": sum(balance.power(effort[i]) for i in rows),
            "output": sum(balance.power(predicted[i]) for i in rows), "all_output": sum(balance.power(outputs[i]) for i in rows),
        }

    # What is true.

    def arguments(self):
        return ["--input", "angle_ankle", "--output", "torque_ankle"] if self.question.plant == "ankle" else []

    def told(self):
        """The effect as the truth has it."""
        q = self.question
        side = {"measurement-delay": ["sensor", "actuator"], "channel-filter": ["sensor", "actuator"], "quantisation": ["sensor"], "sensor-misalignment": ["sensor"],
                "actuator-saturation": ["actuator", "sensor"], "posture-drift": ["limb", "sensor"], "extra-resonance": ["limb", "sensor"]}
        outside = ("periodic-disturbance", "transient-disturbance", "end-stop", "asymmetric-stiffness")
        names = NAMES.get(q.effect, [q.effect])
        # A command that is late or slow is one channel against the other, whoever made it so.
        if q.form == "queue":
            names = ["measurement-delay", "actuation-delay"]
        whole = q.plant == "arm" or q.effect in ("measurement-delay", "channel-filter", "sensor-misalignment")
        return {
            "effect": q.effect, "form": q.form, "names": names, "sides": side.get(q.effect, ["limb", "environment"] if q.effect in outside else ["limb"]),
            "axis": None if whole else self.constants["axes"][self.axis], "severity": self.severity,
            "parameters": self.parameters if q.kind == "single" and q.plant != "arm" and q.effect != "transient-disturbance" else {}, "one_directional": None,
        }

    def truth(self, trials):
        """The true model's held-out error: the same engine, driven by what was measured, without the limb's own force."""
        if self.tremor[0]:
            return None
        held_out = trials if len(trials) == 1 else trials[-math.ceil(len(trials) / 3) :]
        error, own, outputs = [], [], []
        for trial in held_out:
            count = trial["effort"].shape[1]
            first = int(0.7 * count) if len(trials) == 1 else 0
            if self.question.plant == "free":
                pairs = self.windows(trial, first)
            else:
                pairs = self.whole(trial, first, first + round(min(2 * self.rate_hz, 0.05 * (count - first))))
            for y, told, happened in pairs:
                error.append(y - told)
                own.append(happened - told)
                outputs.append(y)
        error, own, outputs = (np.concatenate(parts, axis=1) for parts in (error, own, outputs))
        spread = np.std(outputs, axis=1)
        rms = lambda rows: (np.sqrt(np.mean(rows**2, axis=1)) / spread).tolist()
        return {"nrmse": rms(error), "own_force": rms(own), "how": "the same engine, driven by what was measured"}

    def noisy(self, trial):
        """The force that acted, with the noise of its sensor held for a sample."""
        return trial["acted"] + np.repeat(trial["effort"] - trial["clean"], self.question.every, axis=1)

    def whole(self, trial, first, scored):
        if self.question.plant == "ankle":
            told, y, happened = self.from_angle(trial), trial["effort"], None
        else:
            force = self.noisy(trial)
            places, _, _ = self.run(lambda k, _: force[:, k], trial["other"])
            told, y, happened = self.sampled(places, True), trial["seen"], trial["motion"]
        happened = y if happened is None else happened
        rest = lambda rows: rows[:, scored:] - np.mean(rows[:, first:scored] - told[:, first:scored], axis=1, keepdims=True)
        return [(rest(y), told[:, scored:], rest(happened))]

    def from_angle(self, trial):
        """The torque of the measured angle within the band of the perturbation."""
        seen = trial["seen"][0]
        hz = np.fft.rfftfreq(len(seen), 1 / self.rate_hz)
        lines = np.where(hz < 1.02 * 12 / self.slow, np.fft.rfft(seen), 0)
        fine = np.zeros(self.ticks // 2 + 1, complex)
        fine[: len(lines)] = lines * self.question.every
        all_hz = np.fft.rfftfreq(self.ticks, self.tick_s)
        if self.question.sampling == "mean":
            half = np.pi * all_hz * self.tick_s
            shape = np.where(fine != 0, np.sin(half * self.question.every) / np.maximum(self.question.every * np.sin(half), 1e-12), 1.0)
            shape[0] = 1.0
            fine = fine / shape * np.exp(-1j * half * (self.question.every - 1))
        torque = self.sensed(self.inverse(self.derivatives(fine, all_hz, self.ticks))[None])
        every = self.question.every
        return torque[:, ::every] if self.question.sampling == "instant" else torque.reshape(1, -1, every).mean(axis=2)

    def windows(self, trial, first):
        """Windows of a mass without a spring, whose first displacement and velocity are fitted."""
        force, every = self.noisy(trial), self.question.every
        ticks = round(WINDOW_S / self.tick_s) // every * every
        still = np.zeros((1, self.ticks))
        for k, (qpos, qvel, act) in trial["states"].items():
            at = k // every
            if at < first or k % every or k + ticks > self.ticks:
                continue

            def told(dx, dv):
                data, _ = self.start()
                data.qpos[:], data.qvel[:], data.act[:] = qpos, qvel, act
                data.qpos[0] += dx
                data.qvel[0] += dv
                mujoco.mj_forward(self.model, data)
                return self.sampled(self.run(lambda j, _: force[:, j], still, ticks, data, k)[0], True)

            x, v = 1e-3 * self.constants["x"], 1e-2 * self.constants["x"]
            base = told(0, 0)
            columns = np.array([(told(x, 0) - base)[0], (told(0, v) - base)[0]]).T
            y = trial["seen"][:, at : at + base.shape[1]]
            fitted = base + (columns @ np.linalg.lstsq(columns, (y - base)[0], rcond=None)[0])[None]
            yield y, fitted, trial["motion"][:, at : at + base.shape[1]]
