"""An arm in MuJoCo and a log of the real one: what does the simulation get wrong?  python what_is_wrong.py

Writes log.csv and simulated.csv for the command line.
"""

import pathlib

import mujoco
import numpy as np

import ndof

HERE = pathlib.Path(__file__).parent
JOINTS = ["shoulder", "elbow"]
RATE = 200.0


# ANCHOR: simulate
def simulate(inputs, added_effort, parameters, model=HERE / "arm.xml"):
    commands = np.column_stack([inputs[f"cmd_{joint}"] for joint in JOINTS])
    push = np.column_stack([added_effort.get(f"torque_{joint}", np.zeros(len(commands))) for joint in JOINTS])
    return follow(mujoco.MjModel.from_xml_path(str(model)), commands, push)
# ANCHOR_END: simulate


def follow(model, commands, push):
    """The arm follows angles by a controller of 1 kHz, and logs torque and angle of each joint; ``push`` are torques beside the controller's."""
    data = mujoco.MjData(model)
    data.qpos[:] = commands[0]
    steps = round(1.0 / RATE / model.opt.timestep)
    wanted = np.stack([commands, np.gradient(commands, 1.0 / RATE, axis=0), push])
    torques, angles = np.empty_like(commands), np.empty_like(commands)
    for k in range(len(commands)):
        change = (wanted[:, min(k + 1, len(commands) - 1)] - wanted[:, k]) / steps
        for step in range(steps):
            angle, rate, data.qfrc_applied[:] = wanted[:, k] + change * step
            data.ctrl[:] = 60.0 * (angle - data.qpos) + 3.0 * (rate - data.qvel)
            if step == 0:
                angles[k], torques[k] = data.qpos, data.ctrl
            mujoco.mj_step(model, data)
    log = {f"torque_{joint}": torques[:, j] for j, joint in enumerate(JOINTS)}
    return log | {f"angle_{joint}": angles[:, j] for j, joint in enumerate(JOINTS)}


def measured(seed=1):
    """The real arm: a load of 0.2 kg sits on its forearm, which the file does not know; torques and angles as its sensors give them."""
    motion = ndof.design(robot=HERE / "arm.xml", duration_s=30, sample_rate_hz=RATE, speed_limit=2).recordings[0]
    commands = np.column_stack([motion[f"angle_{joint}"] for joint in JOINTS])
    real = mujoco.MjModel.from_xml_path(str(HERE / "arm.xml"))
    real.body("lower").mass[:] += 0.2
    log = follow(real, commands, np.zeros_like(commands))
    random, step = np.random.default_rng(seed), 2 * np.pi / 2**14
    for joint in JOINTS:
        log[f"torque_{joint}"] = log[f"torque_{joint}"] + 0.02 * random.standard_normal(len(commands))
        log[f"angle_{joint}"] = np.round(log[f"angle_{joint}"] / step) * step
    return ndof.Recording(log | {f"cmd_{joint} [rad]": commands[:, j] for j, joint in enumerate(JOINTS)}, RATE, name="log")


def main():
    # ANCHOR: diagnose
    log = measured()
    found = ndof.diagnose(log, robot=HERE / "arm.xml", simulate=simulate)
    print(found)
    for cause in found.causes:
        for parameter in cause["parameters"]:
            low, high = parameter["ci95"]
            print(f"{parameter['name']} {parameter['value']:.4f} [{low:.4f} {high:.4f}]")
    for output, before, after in zip(*found.rerun.values()):
        print(f"{output}: MuJoCo's own run misses {100 * before:.1f} %, with what was found {100 * after:.1f} %")
    # ANCHOR_END: diagnose
    log.write("log.csv")
    ndof.Recording(simulate(log, {}, {}), RATE).write("simulated.csv")


if __name__ == "__main__":
    main()
