"""A planar robot behind a stiff transducer holding a limb, by MuJoCo: seconds of processor time per simulated second at the
largest step that keeps a relative error of 1e-6, for its integrator of order 4 and its usual one (which does not reach that in
32 steps a sample). Prints `name value` lines.

The model has the parts of ours: two driven links, a transducer (spring and damper between the tip and the hand, in both
directions), and a hand with mass, and springs and dampers to the ground in three directions, which make a full symmetric
stiffness. A proportional-derivative hold acts every 2 ms on what was measured then. Errors are against the fourth-order
integrator at 1/256 of a sample; a step is a whole part of the 2 ms for which a command is held.
"""
import os
os.environ["OMP_NUM_THREADS"] = "1"
import time
import mujoco
import numpy as np

# Steps that are too long diverge, which the error tells.
mujoco.set_mju_user_warning(lambda message: None)

FAR = 1000.0
STIFFNESS, DAMPING = 1.0e6, 800.0


def xml(q):
    l1, l2 = 0.4064, 0.51435
    tip = l1 * np.array([np.cos(q[0]), np.sin(q[0])]) + l2 * np.array([np.cos(q.sum()), np.sin(q.sum())])
    sites, tendons = "", ""
    # K = sum k d d^T over the directions d: 300 and 520 N/m, -60 N/m across.
    for name, angle, k, b in (("x", 0.0, 240.0, 9.0), ("y", 90.0, 460.0, 13.0), ("c", 135.0, 120.0, 4.0)):
        d = FAR * np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
        sites += f'<site name="g{name}" pos="{tip[0] + d[0]:.17g} {tip[1] + d[1]:.17g} 0"/>'
        tendons += f'<spatial stiffness="{k}" damping="{b}"><site site="g{name}"/><site site="hand"/></spatial>'
    return f"""<mujoco><option gravity="0 0 0"><flag contact="disable" constraint="disable"/></option><worldbody>{sites}
    <body><joint name="a" axis="0 0 1"/><inertial pos="0.2 0 0" mass="1" diaginertia="0.1 0.1 0.1"/>
     <body pos="{l1} 0 0"><joint name="b" axis="0 0 1"/><inertial pos="0.2 0 0" mass="0.8" diaginertia="0.08 0.08 0.08"/>
      <body pos="{l2} 0 0"><joint name="u" type="slide" axis="1 0 0" stiffness="{STIFFNESS}" damping="{DAMPING}"/>
       <joint name="w" type="slide" axis="0 1 0" stiffness="{STIFFNESS}" damping="{DAMPING}"/>
       <inertial pos="0 0 0" mass="2" diaginertia="0.001 0.001 0.001"/><site name="hand"/></body></body></body></worldbody>
    <tendon>{tendons}</tendon>
    <actuator><motor joint="a"/><motor joint="b"/></actuator></mujoco>"""


def run(q, command, steps, integrator):
    """Hand positions at every sample and the processor time; `steps` steps a sample."""
    model = mujoco.MjModel.from_xml_string(xml(q))
    model.opt.timestep = 0.002 / steps
    model.opt.integrator = integrator
    data = mujoco.MjData(model)
    data.qpos[:2] = q
    mujoco.mj_forward(model, data)
    hand = data.site("hand").xpos
    rest, out = hand.copy(), np.empty((len(command), 2))
    joint, rate, ctrl = data.qpos[:2], data.qvel[:2], data.ctrl
    begun = time.thread_time()
    for k, torque in enumerate(command):
        ctrl[:] = torque - 60.0 * (joint - q) - 2.0 * rate
        mujoco.mj_step(model, data, steps)
        out[k] = hand[:2] - rest[:2]
    return out, time.thread_time() - begun


def main():
    rng = np.random.default_rng(1)
    q = np.radians([20.0, 110.0])
    seconds = 4.0
    n = int(seconds * 500)
    # Noise below 15 Hz.
    lines = rng.standard_normal((2, n // 2 + 1)) + 1j * rng.standard_normal((2, n // 2 + 1))
    lines[:, np.fft.rfftfreq(n, 0.002) > 15] = 0
    command = np.fft.irfft(lines, n).T
    command *= 1.6 / command.std()
    reference = run(q, command, 256, mujoco.mjtIntegrator.mjINT_RK4)[0]
    if not np.isfinite(reference).all():
        raise SystemExit("the reference diverged")
    for name, integrator in (("rk4", mujoco.mjtIntegrator.mjINT_RK4), ("implicitfast", mujoco.mjtIntegrator.mjINT_IMPLICITFAST)):
        for steps in (1, 2, 4, 8, 16, 32):
            out, spent = run(q, command, steps, integrator)
            error = np.sqrt(np.sum((out - reference) ** 2) / np.sum(reference**2)) if np.isfinite(out).all() else float("inf")
            print(f"mujoco.{name}.{steps}.error {error:.3e}")
            print(f"mujoco.{name}.{steps}.seconds {spent / seconds:.6f}", flush=True)
            if error < 1e-6:
                break


main()
