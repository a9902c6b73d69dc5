"""What a robot does and what is logged: Fourier-series movements under a computed-torque and PD controller, in MuJoCo."""

import math
from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.signal import butter, lfilter, sosfiltfilt

import robots

BASE_HZ = 0.1
HARMONICS = 5
WARM_UP_S = 2.0  # before the log begins: what begins at rest has settled
POLE_RAD_S = 12.0  # of the PD controller on a joint's inertia
BAND_HZ = 10.0  # of what is called a joint's torque when strengths are measured


@dataclass
class Task:
    """Reference over one period, from the beginning of the warm-up, and the nominal torque along it."""

    robot: robots.Robot
    step_s: float
    angle: np.ndarray  # steps × joints
    speed: np.ndarray
    effort: np.ndarray
    kp: np.ndarray
    kd: np.ndarray


@dataclass
class Run:
    """Noise-free logs at every step, the warm-up left out: motor-side angles and speeds, the motors' torques."""

    step_s: float
    angle: np.ndarray
    speed: np.ndarray
    effort: np.ndarray


def nominal(robot, step_s=5e-4):
    return mujoco.MjModel.from_xml_string(robots.mjcf(robot, robots.Parts(step_s=step_s)))


def inverse(model, angle, speed, acceleration):
    """Torque by joint that the motion needs, N m."""
    data, out = mujoco.MjData(model), np.empty_like(angle)
    for k in range(len(angle)):
        data.qpos[:], data.qvel[:], data.qacc[:] = angle[k], speed[k], acceleration[k]
        mujoco.mj_inverse(model, data)
        out[k] = data.qfrc_inverse
    return out


def movement(robot, rng, t):
    """Angle, speed and acceleration of a random Fourier series (five harmonics of 0.1 Hz) inside the robot's reach and speed."""
    n, w = len(robot.links), 2 * math.pi * BASE_HZ * np.arange(1, HARMONICS + 1)
    # Falling with the square root of the harmonic: neither the slowest hides the rest in angle, nor the fastest in acceleration.
    a = rng.standard_normal((HARMONICS, n)) / np.sqrt(np.arange(1, HARMONICS + 1))[:, None]
    b = rng.standard_normal((HARMONICS, n)) / np.sqrt(np.arange(1, HARMONICS + 1))[:, None]
    c, s, w1 = np.cos(np.outer(t, w)), np.sin(np.outer(t, w)), w[:, None]
    angle, speed, acceleration = c @ a + s @ b, c @ (b * w1) - s @ (a * w1), -c @ (a * w1**2) - s @ (b * w1**2)
    most = np.minimum(np.array(robot.reach) / np.abs(angle).max(0), np.array(robot.speed) / np.abs(speed).max(0))
    size = most * rng.uniform(0.85, 1.0, n)
    return robot.middle + angle * size, speed * size, acceleration * size


def inertia(robot, step_s):
    """Mass matrix in the middle of the movements."""
    model = nominal(robot, step_s)
    data, full = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    data.qpos[:] = robot.middle
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, full)
    return full


def gains(robot, step_s):
    """Of the PD controller: both poles of each joint alone at POLE_RAD_S."""
    own = np.diag(inertia(robot, step_s))
    return own * POLE_RAD_S**2, 2 * own * POLE_RAD_S


def task(robot, rng, step_s=5e-4):
    model = nominal(robot, step_s)
    t = np.arange(round(1 / BASE_HZ / step_s)) * step_s
    angle, speed, acceleration = movement(robot, rng, t)
    return Task(robot, step_s, angle, speed, inverse(model, angle, speed, acceleration), *gains(robot, step_s))


def simulate(task, model, duration_s, forces=(), warm_up_s=WARM_UP_S):
    """Runs the task; each of `forces` is f(angle, speed, torque) -> (joint's number, torque on it), in steps, by the joints of the motors.

    Semi-implicit Euler's second difference of the angles is the acceleration of the force of the middle step, so angle and torque of one step
    belong together; the speed that belongs to them is the mean of the steps before and after.
    """
    n, period, steps = len(task.robot.links), len(task.angle), round((duration_s + warm_up_s) / task.step_s)
    at = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name) for name in task.robot.joints]
    data = mujoco.MjData(model)
    data.qpos[at], data.qvel[at] = task.angle[0], task.speed[0]
    angles, efforts = np.empty((steps + 1, n)), np.empty((steps + 1, n))
    plain = at == list(range(model.nv))
    q, v, control, applied = data.qpos, data.qvel, data.ctrl, data.qfrc_applied
    for k in range(steps + 1):
        i = k % period
        angle, speed = (q, v) if plain else (q[at], v[at])
        effort = task.effort[i] + task.kp * (task.angle[i] - angle) + task.kd * (task.speed[i] - speed)
        control[:] = effort
        angles[k], efforts[k] = angle, effort
        if forces:
            applied[:] = 0
            for force in forces:
                joint, torque = force(angle, speed, effort)
                applied[at[joint]] += torque
        mujoco.mj_step(model, data)
    if not np.isfinite(angles).all() or np.abs(angles).max() > 50:
        raise FloatingPointError("the simulation diverged")
    speeds = np.empty_like(angles)
    speeds[1:-1] = (angles[2:] - angles[:-2]) / (2 * task.step_s)
    speeds[0], speeds[-1] = speeds[1], speeds[-2]
    kept = slice(round(warm_up_s / task.step_s), -1)
    return Run(task.step_s, angles[kept], speeds[kept], efforts[kept])


def lacking(robot, run):
    """What the nominal model's torque lacks along the run's own motion, and that torque, both below 10 Hz and at 200 Hz; steps × joints."""
    sos = butter(4, BAND_HZ, fs=1 / run.step_s, output="sos")
    low = lambda x: sosfiltfilt(sos, x, axis=0)
    angle = low(run.angle)
    every, h = round(5e-3 / run.step_s), run.step_s
    edge = round(0.5 / h)
    at = np.arange(edge, len(angle) - edge, every)
    speed, acceleration = (angle[at + 1] - angle[at - 1]) / (2 * h), (angle[at + 1] - 2 * angle[at] + angle[at - 1]) / h**2
    needed = inverse(nominal(robot), angle[at], speed, acceleration)
    return low(run.effort)[at] - needed, needed


def rms(x):
    return np.sqrt(np.mean(np.square(x), axis=0))


@dataclass
class Instruments:
    """How a run is logged."""

    rate_hz: int
    bits: int  # of an encoder's turn
    noise_share: float  # torque noise as a share of the joint's torque
    coloured: bool  # at 10 Hz
    speeds: bool  # whether there are columns of speed

    @staticmethod
    def draw(rng, rates=(100, 200, 250, 500)):
        return Instruments(int(rng.choice(rates)), int(rng.integers(12, 18)), float(rng.uniform(0.005, 0.02)), bool(rng.random() < 0.5), bool(rng.random() < 0.25))


def logged(run, instruments, rng, report=None):
    """Columns of the log: time, torques, angles, speeds or None. `report` turns torques at every step into what the drives say of them."""
    every = round(1 / instruments.rate_hz / run.step_s)
    rows = np.arange(0, len(run.angle), every)
    effort = (report(run.effort) if report else run.effort)[rows]
    white = rng.standard_normal((len(rows) + 1000, effort.shape[1]))
    if instruments.coloured:
        keep = math.exp(-2 * math.pi * 10.0 / instruments.rate_hz)
        white = lfilter([math.sqrt(1 - keep**2)], [1, -keep], white, axis=0)
    effort = effort + instruments.noise_share * rms(run.effort) * white[1000:]
    step = 2 * math.pi / 2**instruments.bits
    angle = np.round(run.angle[rows] / step) * step
    speed = run.speed[rows]
    speed = speed + 0.005 * rms(speed) * rng.standard_normal(speed.shape) if instruments.speeds else None
    return rows * run.step_s, effort, angle, speed


def write_log(path, robot, t, effort, angle, speed=None):
    names = ["t [s]"] + [f"torque_{j} [N m]" for j in robot.joints] + [f"angle_{j} [rad]" for j in robot.joints]
    columns = [t[:, None], effort, angle]
    forms = ["%.4f"] + ["%.6g"] * len(robot.links) + ["%.7f"] * len(robot.links)
    if speed is not None:
        names += [f"vel_{j} [rad/s]" for j in robot.joints]
        columns.append(speed)
        forms += ["%.6g"] * len(robot.links)
    rows = np.hstack(columns).tolist()
    line = ",".join(forms) + "\n"
    with open(path, "w") as file:
        file.write(",".join(names) + "\n")
        file.writelines(line % tuple(row) for row in rows)
