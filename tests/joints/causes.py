"""What is hidden in a robot: each cause with its name, its joint, its true parameters and a dial for its strength.

`VARIANTS` lists them. What MuJoCo has of its own (damping, frictionloss, armature, limits, extra joints, bodies, gravity) is the engine's; the
rest is a torque of the formulas below, applied at each step, or a change of what the drives report. At dial zero nothing is changed.
"""

import math
from dataclasses import dataclass, field
from random import Random

import mujoco
import numpy as np

import robots


@dataclass
class Scene:
    """Sizes of the nominal task by joint: rms of torque, speed and acceleration, ends of the angle, effective inertia."""

    robot: robots.Robot
    step_s: float
    rate_hz: int
    torque: np.ndarray
    speed: np.ndarray
    acceleration: np.ndarray
    low: np.ndarray
    high: np.ndarray
    inertia: np.ndarray
    positive: np.ndarray  # share of the time in which the torque is positive

    @property
    def half(self):
        return (self.high - self.low) / 2


@dataclass
class Put:
    """A robot with what is hidden in it."""

    robot: robots.Robot
    parts: robots.Parts
    after: list = field(default_factory=list)  # f(model), once it is compiled
    forces: list = field(default_factory=list)  # f(angles, speeds, torques) -> (joint's number, torque on it)
    before: list = field(default_factory=list)  # f(model, angles, speeds), at each step
    reports: list = field(default_factory=list)  # f(torques at every step) -> what the drives report

    def model(self):
        model = mujoco.MjModel.from_xml_string(robots.mjcf(self.robot, self.parts))
        for change in self.after:
            change(model)
        return model

    def stepping(self, model):
        """Forces for `tasks.simulate`, changes of the model in their first place."""
        changes = [lambda q, v, u, change=change: (0, change(model, q, v) or 0.0) for change in self.before]
        return changes + self.forces

    def report(self, effort):
        for change in self.reports:
            effort = change(effort)
        return effort

    def attributes(self, joint, **values):
        self.parts.joint.setdefault(joint, {}).update(values)


def name(scene, j):
    return scene.robot.links[j].joint


def width(scene, j, level):
    """Speed over which dry friction changes its sign: small beside the motion's, and not so steep that an explicit step of the joint's inertia,
    which is up to a third less elsewhere, overshoots."""
    return max(0.01 * scene.speed[j], 1.5 * level * scene.step_s / scene.inertia[j])


def viscous(put, scene, j, dial, draw):
    coefficient = 0.1 * dial * scene.torque[j] / scene.speed[j]
    put.attributes(name(scene, j), damping=coefficient)
    return {"viscous_nm_s_per_rad": coefficient}


def friction(curve):
    """Applied dry friction with the level `curve(speed)`."""

    def put_in(put, scene, j, dial, draw):
        level = 0.1 * dial * scene.torque[j]
        soft = width(scene, j, 2 * level)
        at, parameters = curve(scene, j, level, draw)
        put.forces.append(lambda q, v, u: (j, -at(v[j]) * math.tanh(v[j] / soft) if level else 0.0))
        return {"level_nm": level} | parameters

    return put_in


def constant(scene, j, level, draw):
    return (lambda v: level), {}


def stribeck(scene, j, level, draw):
    """level + (stribeck_level - level) exp(-(v / stribeck_velocity)²)."""
    top, speed = level * draw.uniform(1.3, 1.8), scene.speed[j] * draw.uniform(0.1, 0.25)
    return (lambda v: level + (top - level) * math.exp(-((v / speed) ** 2))), {"stribeck_level_nm": top, "stribeck_velocity_rad_per_s": speed}


# Four steps: as stiff as the engine's dry friction may be.
DRY = "0.002 1"


def frictionloss(curve):
    """The engine's dry friction, its level given anew at each step where it depends on the speed."""

    def put_in(put, scene, j, dial, draw):
        level = 0.1 * dial * scene.torque[j]
        at, parameters = curve(scene, j, level, draw)
        if level:
            put.attributes(name(scene, j), frictionloss=level, solreffriction=DRY)
        if level and parameters:

            def change(model, q, v):
                model.dof_frictionloss[model.jnt_dofadr[model.joint(name(scene, j)).id]] = at(v[j])

            put.before.append(change)
        return {"level_nm": level} | parameters

    return put_in


def load_friction(put, scene, j, dial, draw):
    """The link's torque is the motor's less c |link's torque| sign(v); solved for the link's, since 1 ± c is positive."""
    c = 0.1 * dial
    soft = width(scene, j, c * 2 * scene.torque[j])

    def force(q, v, u):
        side = math.tanh(v[j] / soft) * math.copysign(1.0, u[j])
        return j, u[j] / (1 + c * side) - u[j]

    put.forces.append(force)
    return {"coefficient": c}


def motor_inertia(put, scene, j, dial, draw):
    rotor = 0.1 * dial * scene.torque[j] / scene.acceleration[j]
    put.attributes(name(scene, j), armature=rotor)
    return {"rotor_kg_m2": rotor}


def column(j, change):
    def report(effort):
        effort = effort.copy()
        effort[:, j] = change(effort[:, j])
        return effort

    return report


def offset(put, scene, j, dial, draw):
    """The drive reports the torque and an offset."""
    value = draw.choice((-1, 1)) * 0.1 * dial * scene.torque[j]
    put.reports.append(column(j, lambda u: u + value))
    return {"offset_nm": value}


def scale(put, scene, j, dial, draw):
    """The drive reports so many times the torque."""
    value = 1 + draw.choice((-1, 1)) * 0.1 * dial
    put.reports.append(column(j, lambda u: value * u))
    return {"scale": value}


def delay(put, scene, j, dial, draw):
    """The drive reports the torque of some time ago; the dial counts two samples of the log."""
    delay_s = 2 * dial / scene.rate_hz
    steps = delay_s / scene.step_s
    put.reports.append(column(j, lambda u: np.interp(np.arange(len(u)) - steps, np.arange(len(u)), u)))
    return {"delay_s": delay_s}


def payload(put, scene, j, dial, draw):
    mass = 0.1 * dial * sum(link.mass for link in scene.robot.links[-2:])
    place = np.array(scene.robot.flange) + [draw.uniform(-0.05, 0.05) for _ in range(3)]
    if dial:
        inertia = 0.4 * mass * 0.04**2  # of a ball of 4 cm
        put.parts.load += f'<body pos="{robots.text(place)}"><inertial pos="0 0 0" mass="{mass}" diaginertia="{inertia} {inertia} {inertia}"/></body>'
    return {"mass_kg": mass, "x_m": place[0], "y_m": place[1], "z_m": place[2]}


def link_parameters(part):
    """The robot's link is not the file's: its mass, with the inertia; its centre; or its inertia."""

    def put_in(put, scene, j, dial, draw):
        link = put.robot.links[j]
        factor = 1 + draw.choice((-1, 1)) * 0.2 * dial
        if part == "centre":
            changed = dict(centre=tuple(factor * c for c in link.centre))
        else:
            changed = dict(inertia=tuple(factor * i for i in link.inertia))
            if part == "mass":
                changed["mass"] = factor * link.mass
        put.robot = put.robot.with_link(j, **changed)
        return {f"{part}_factor": factor}

    return put_in


def tilt(put, scene, j, dial, draw):
    """The base is turned by the rotation vector (x, y, 0) against what is horizontal. Arms in a vertical plane see only y."""
    about = draw.uniform(0, 2 * math.pi) if len(scene.robot.links) == 6 else draw.choice((1, -1)) * draw.uniform(1.2, 1.9)
    angle = math.radians(3 * dial)
    vector = (angle * math.cos(about), angle * math.sin(about), 0.0)
    put.parts.gravity = tuple(robots.turned(vector).T @ (0, 0, -robots.GRAVITY))
    return {"tilt_x_rad": vector[0], "tilt_y_rad": vector[1]}


# A motor that turns by itself has 1.5 % of its joint's inertia: less than what is called a weak motor inertia.
ROTOR_SHARE = 0.015


def flexibility(put, scene, j, dial, draw):
    """A spring between motor and link, of 3 to 6 % of critical damping; the encoder is the motor's."""
    if not dial:
        return {"stiffness_nm_per_rad": math.inf}
    stiffness = 10 * scene.torque[j] / dial
    damping = 2 * draw.uniform(0.03, 0.06) * math.sqrt(stiffness * scene.inertia[j])
    put.parts.behind[name(scene, j)] = dict(stiffness=stiffness, damping=damping)
    put.parts.rotor[name(scene, j)] = ROTOR_SHARE * scene.inertia[j]
    return {"stiffness_nm_per_rad": stiffness}


def backlash(put, scene, j, dial, draw):
    """Play between motor and link, the width of it all; the encoder is the motor's."""
    gap = 0.1 * dial
    if dial:
        put.parts.behind[name(scene, j)] = dict(limited="true", range=f"{-gap / 2} {gap / 2}", solreflimit="0.001 1")
        put.parts.rotor[name(scene, j)] = ROTOR_SHARE * scene.inertia[j]
    return {"gap_rad": gap}


def stop(scene, j, dial, draw):
    """Side, angle and stiffness of a stop that the movement reaches; the dial is how far it goes in."""
    side, stiffness = draw.choice((-1, 1)), draw.uniform(5, 20) * scene.torque[j] / scene.half[j]
    depth = 0.1 * dial * scene.half[j]
    return side, (scene.high[j] - depth) if side > 0 else (scene.low[j] + depth), stiffness


def end_stop(put, scene, j, dial, draw):
    side, at, stiffness = stop(scene, j, dial, draw)
    if dial:
        put.forces.append(lambda q, v, u: (j, -side * stiffness * max(0.0, side * (q[j] - at))))
    return {"stop_rad": at, "stiffness_nm_per_rad": stiffness}


# Where the impedance d is small, a limit is a spring: MuJoCo's torque on a joint is then solref's stiffness times the depth over the joint's
# inverse weight.
SOFT = (0.001, 0.001, 0.001, 0.5, 2)


def end_limit(put, scene, j, dial, draw):
    side, at, stiffness = stop(scene, j, dial, draw)
    if dial:
        put.attributes(name(scene, j), limited="true", range=f"-20 {at}" if side > 0 else f"{at} 20")

        def soften(model):
            joint = model.joint(name(scene, j)).id
            rate = stiffness * model.dof_invweight0[model.jnt_dofadr[joint]]
            model.jnt_solref[joint] = (-rate, -0.01 * math.sqrt(rate))
            model.jnt_solimp[joint] = SOFT

        put.after.append(soften)
    return {"stop_rad": at, "stiffness_nm_per_rad": stiffness}


def cable(put, scene, j, dial, draw):
    """A spring that hardens about a rest angle."""
    rest = (scene.low[j] + scene.high[j]) / 2 + draw.uniform(-0.4, 0.4) * scene.half[j]
    half, size = scene.half[j], 0.1 * dial * scene.torque[j]
    linear, cubic = draw.uniform(0.2, 0.6) * size / half, draw.uniform(1.5, 3.0) * size / half**3
    put.forces.append(lambda q, v, u: (j, -linear * (q[j] - rest) - cubic * (q[j] - rest) ** 3))
    return {"rest_rad": rest, "linear_nm_per_rad": linear, "cubic_nm_per_rad3": cubic}


def dress_pack(put, scene, j, dial, draw):
    """Hoses that are slack on one side and taut on the other: -k w log(1 + exp((q - rest) / w))."""
    side, half = draw.choice((-1, 1)), scene.half[j]
    rest = (scene.low[j] + scene.high[j]) / 2 + side * draw.uniform(-0.2, 0.4) * half
    stiffness, soft = 0.3 * dial * scene.torque[j] / half, draw.uniform(0.1, 0.2) * half
    put.forces.append(lambda q, v, u: (j, -side * stiffness * soft * math.log1p(math.exp(side * (q[j] - rest) / soft))))
    return {"rest_rad": rest, "taut_nm_per_rad": stiffness, "soft_rad": soft, "side": side}


def presliding(shares):
    """Springs that slip, side by side: (share of the level, yield as a multiple of the presliding distance)."""

    def put_in(put, scene, j, dial, draw):
        level, distance = 0.1 * dial * scene.torque[j], draw.uniform(0.05, 0.15) * scene.half[j]
        parts = [(share * level, share * level / (times * distance)) for share, times in shares]
        state, before = [0.0] * len(parts), []

        def force(q, v, u):
            moved = q[j] - before[0] if before else 0.0
            before[:] = [float(q[j])]
            for i, (most, stiffness) in enumerate(parts):
                state[i] = min(max(state[i] + stiffness * moved, -most), most)
            return j, -sum(state)

        put.forces.append(force)
        return {"level_nm": level, "stiffness_nm_per_rad": sum(stiffness for _, stiffness in parts)}

    return put_in


@dataclass(frozen=True)
class Variant:
    effect: str
    variant: str
    put: object
    own: bool  # the engine's own, not a formula of this file
    held_back: bool = False  # only in the held-back half
    most: float = 6.0  # of the dial
    scored: tuple = ()  # parameters that an answer is asked for
    everywhere: bool = False  # at no joint
    series: bool = False  # between motor and link: fine steps
    reported: bool = False  # of the torque channel alone


VARIANTS = (
    Variant("viscous-friction", "damping", viscous, True, scored=("viscous_nm_s_per_rad",)),
    Variant("coulomb-friction", "tanh", friction(constant), False, scored=("level_nm",)),
    Variant("coulomb-friction", "stribeck-tanh", friction(stribeck), False, scored=("level_nm",)),
    Variant("coulomb-friction", "frictionloss", frictionloss(constant), True, scored=("level_nm",)),
    Variant("coulomb-friction", "stribeck-frictionloss", frictionloss(stribeck), True, held_back=True, scored=("level_nm",)),
    Variant("load-friction", "share", load_friction, False, scored=("coefficient",)),
    Variant("motor-inertia", "armature", motor_inertia, True, scored=("rotor_kg_m2",)),
    Variant("torque-offset", "constant", offset, False, scored=("offset_nm",), reported=True),
    Variant("torque-scale", "factor", scale, False, scored=("scale",), reported=True),
    Variant("torque-delay", "late", delay, False, most=5.0, scored=("delay_s",), reported=True),
    Variant("payload", "ball", payload, True, scored=("mass_kg",), everywhere=True),
    Variant("link-parameters", "mass", link_parameters("mass"), True, most=3.0),
    Variant("link-parameters", "centre", link_parameters("centre"), True, most=3.0),
    Variant("link-parameters", "inertia", link_parameters("inertia"), True, most=3.0),
    Variant("base-tilt", "gravity", tilt, True, most=1.9, scored=("tilt_x_rad", "tilt_y_rad"), everywhere=True),
    Variant("joint-flexibility", "spring", flexibility, True, scored=("stiffness_nm_per_rad",), series=True),
    Variant("backlash", "play", backlash, True, held_back=True, most=1.5, scored=("gap_rad",), series=True),
    Variant("end-stop", "spring", end_stop, False, scored=("stop_rad", "stiffness_nm_per_rad")),
    Variant("end-stop", "limit", end_limit, True, held_back=True, scored=("stop_rad", "stiffness_nm_per_rad")),
    Variant("cable-force", "hardening", cable, False),
    Variant("cable-force", "dress-pack", dress_pack, False, held_back=True),
    Variant("gear-hysteresis", "one-element", presliding(((1.0, 1.0),)), False, scored=("level_nm", "stiffness_nm_per_rad")),
    Variant("gear-hysteresis", "three-elements", presliding(((0.5, 0.3), (0.3, 1.0), (0.2, 2.0))), False, held_back=True, scored=("level_nm",)),
)
EFFECTS = tuple(dict.fromkeys(v.effect for v in VARIANTS))


@dataclass(frozen=True)
class Choice:
    """A variant at a joint with its random numbers, which the dial does not change."""

    variant: Variant
    joint: int
    seed: str

    def possible(self, scene):
        """Play shows where the torque changes its sign; under a load that never lifts it is an angle and nothing else. Dry friction that must
        turn slowly for the engine's steps is hardly dry."""
        j = self.joint
        if self.variant.variant in ("tanh", "stribeck-tanh", "share"):
            return width(scene, j, 0.3 * scene.torque[j]) < 0.04 * scene.speed[j]
        return self.variant.effect != "backlash" or 0.15 < scene.positive[j] < 0.85

    def axis(self, robot):
        return "" if self.variant.everywhere else robot.links[self.joint].joint

    def hide(self, put, scene, dial):
        return self.variant.put(put, scene, self.joint, dial, Random(self.seed))

    def scored(self, robot):
        """An arm in a vertical plane does not see a tilt about x."""
        return [p for p in self.variant.scored if len(robot.links) == 6 or p != "tilt_x_rad"]


def hidden(scene, dialled):
    """A robot with choices at their dials, and their true parameters."""
    put = Put(scene.robot, robots.Parts(step_s=scene.step_s))
    return put, [choice.hide(put, scene, dial) for choice, dial in dialled]
