"""The third door: `ndof.diagnose(recordings, robot=urdf, simulate=f)` with f of the nominal MuJoCo robot, its controller inside.

    python3 tests/joints/function_door.py FOLDER [--count 12] [--half tuning|held-back|practice] [--out FILE]

The recording gets the reference angles that the controller followed (`reference_JOINT`), which are f's inputs; f(inputs, added_effort, parameters)
gives `torque_JOINT` and `angle_JOINT` of the nominal robot that follows them with the added torques at its joints. `parameters` may change the
links' masses (`mass_JOINT`, kg), the inertias with them. Needs the Python package, and tests/joints/requirements.txt.
"""

import argparse
import json
import pathlib
import time

import numpy as np
from scipy.interpolate import CubicSpline

import mark as marking
import robots
import tasks


def simulation(robot, rate_hz, step_s=5e-4):
    """f(inputs, added_effort, parameters) -> outputs, all sampled at rate_hz."""

    def simulate(inputs, added_effort, parameters):
        own = robot
        for number, link in enumerate(robot.links):
            if f"mass_{link.joint}" in parameters:
                mass = parameters[f"mass_{link.joint}"]
                own = own.with_link(number, mass=mass, inertia=tuple(mass / link.mass * i for i in link.inertia))
        reference = np.column_stack([inputs[f"reference_{j}"] for j in robot.joints])
        samples, every = len(reference), round(1 / rate_hz / step_s)
        path = CubicSpline(np.arange(samples) / rate_hz, reference)
        t = np.arange((samples - 1) * every + 2) * step_s  # a step more, which ends the last
        angle, speed, acceleration = path(t), path(t, 1), path(t, 2)
        # The controller's model is the nominal one, whatever the robot's parameters are.
        feed = tasks.inverse(tasks.nominal(robot, step_s), angle, speed, acceleration)
        task = tasks.Task(robot, step_s, angle, speed, feed, *tasks.gains(robot, step_s))
        added = [added_effort.get(f"torque_{j}", added_effort.get(j, np.zeros(samples))) for j in robot.joints]
        added = np.column_stack([np.interp(t, np.arange(samples) / rate_hz, column) for column in added])
        run = tasks.simulate(task, tasks.nominal(own, step_s), (len(t) - 1) * step_s, pushes(added), warm_up_s=0.0)
        out = {f"torque_{j}": run.effort[::every, i] for i, j in enumerate(robot.joints)}
        return out | {f"angle_{j}": run.angle[::every, i] for i, j in enumerate(robot.joints)}

    return simulate


def pushes(added):
    """Forces on the joints for `tasks.simulate`, which asks each of them once a step."""
    joints, at = added.shape[1], [0]

    def push(joint):
        def force(q, v, u):
            torque = added[at[0], joint]
            at[0] += joint == joints - 1
            return joint, torque

        return force

    return [push(joint) for joint in range(joints)] if added.any() else ()


def channels(folder, truth):
    """The log's channels and the reference angles."""
    robot = robots.ROBOTS[truth["robot"]]
    with open(folder / "log.csv") as file:
        names = file.readline().strip().split(",")
        log = np.loadtxt(file, delimiter=",")
    made = dict(zip(names[1:], log.T[1:]))
    task = tasks.task(robot, np.random.default_rng([truth["seed"], 1]), truth["step_s"])
    rows = (round(tasks.WARM_UP_S / truth["step_s"]) + np.round(log[:, 0] / truth["step_s"]).astype(int)) % len(task.angle)
    return made | {f"reference_{j} [rad]": task.angle[rows, i] for i, j in enumerate(robot.joints)}


def main():
    import ndof

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--count", type=int, default=12)
    parser.add_argument("--half", choices=("tuning", "held-back", "practice"), default="tuning")
    parser.add_argument("--out", type=pathlib.Path, help="file that the table is added to")
    options = parser.parse_args()
    truths = [json.loads(path.read_text()) for path in sorted(options.folder.glob("*/question.json"))]
    marks, proved, failed = [], [], 0
    for truth in [t for t in truths if t["half"] == options.half][: options.count]:
        recording = ndof.Recording(channels(options.folder / truth["id"], truth), truth["rate_hz"], name=truth["id"])
        began, answer, error = time.monotonic(), None, None
        try:
            nominal = simulation(robots.ROBOTS[truth["robot"]], truth["rate_hz"])
            said = ndof.diagnose([recording], robot=options.folder / truth["id"] / "robot.urdf", simulate=nominal)
            answer = said.to_dict()
            failed += said.rerun is None
            if marking.mark(truth, {"result": answer, "error": None, "seconds": 0.0}, "columns").exactly and truth["causes"] and said.rerun:
                before, after = (np.linalg.norm(said.rerun[f"nrmse_{when}"]) for when in ("before", "after"))
                proved.append((truth["id"], after / before))
        except ndof.NdofError as told:
            error = str(told)
        marks.append(marking.mark(truth, {"result": answer, "error": error, "seconds": time.monotonic() - began}, "columns"))
    told = f"door: function; half: {options.half}; {len(marks)} questions\n" + marking.table(marks)
    told += f"\nthe simulator failed with what was found: {failed} of {len(marks)}\n"
    if proved:
        shares = sorted(share for _, share in proved)
        told += f"the simulator's own run with what was found, in {len(shares)} exact answers: its error over that before, median {shares[len(shares) // 2]:.2f}, largest {shares[-1]:.2f}\n"
    print(told, end="")
    if options.out:
        with options.out.open("a") as out:
            out.write("\n" + told)


if __name__ == "__main__":
    main()
