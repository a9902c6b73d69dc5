"""The exam's own rules, without the program that it examines: what is hidden is what it says, the robot's file is the simulated robot, marks are just.

    python3 tests/joints/test_joints.py

What simulates is left out where MuJoCo is missing (tests/joints/requirements.txt); marks need the standard library alone.
"""

import pathlib
import tempfile
import unittest

import mark as marking

try:
    import mujoco
    import numpy as np

    import causes
    import function_door
    import make
    import oracle
    import plan
    import robots
    import tasks
except ImportError:
    mujoco = None

# Two implementations of one formula in double precision.
SAME = 1e-10
simulated = unittest.skipUnless(mujoco, "needs MuJoCo")


def random_motion(robot, seed=0, samples=50):
    rng = np.random.default_rng(seed)
    n = len(robot.links)
    return [rng.uniform(-size, size, (samples, n)) for size in (3.0, 4.0, 20.0)]


def links_of(robot):
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "robot.urdf"
        path.write_text(robots.urdf(robot))
        return oracle.read_urdf(path)


@simulated
class TheFileIsTheRobot(unittest.TestCase):
    def test_newton_and_euler_on_the_file_agree_with_the_simulated_robot(self):
        for robot in robots.ROBOTS.values():
            motion = random_motion(robot)
            torque = tasks.inverse(tasks.nominal(robot), *motion)
            told = oracle.newton_euler(links_of(robot), *motion)
            self.assertLess(np.abs(torque - told).max() / np.abs(torque).max(), SAME, robot.name)

    def test_the_engine_reads_the_file_as_the_same_robot(self):
        for robot in robots.ROBOTS.values():
            motion = random_motion(robot)
            read = mujoco.MjModel.from_xml_string(robots.urdf(robot))
            read.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT
            torque = tasks.inverse(tasks.nominal(robot), *motion)
            self.assertLess(np.abs(torque - tasks.inverse(read, *motion)).max() / np.abs(torque).max(), SAME, robot.name)

    def test_the_pendulum_is_the_one_on_paper(self):
        robot = robots.ROBOTS["pendulum"]
        (link,), motion = robot.links, random_motion(robot)
        q, _, a = motion
        length = -link.centre[2]
        paper = (link.inertia[1] + link.mass * length**2) * a + link.mass * robots.GRAVITY * length * np.sin(q)
        self.assertLess(np.abs(tasks.inverse(tasks.nominal(robot), *motion) - paper).max() / np.abs(paper).max(), SAME)

    def test_energy_is_kept_without_torque(self):
        """Semi-implicit Euler's energy of a free fall oscillates by an error of the first order of the step."""
        for robot in robots.ROBOTS.values():
            drift = []
            for step_s in (4e-4, 1e-4):
                model = tasks.nominal(robot, step_s)
                model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
                data = mujoco.MjData(model)
                data.qpos[:] = robot.middle
                data.qpos[0] += 0.5
                mujoco.mj_forward(model, data)
                began, moving = data.energy.sum(), 0.0
                for _ in range(round(0.4 / step_s)):
                    mujoco.mj_step(model, data)
                    moving = max(moving, data.energy[1])
                mujoco.mj_forward(model, data)
                drift.append(abs(data.energy.sum() - began) / moving)
            self.assertLess(drift[1], 0.01, robot.name)
            self.assertLess(drift[1], 0.5 * drift[0], robot.name)

    def test_movements_stay_inside_reach_and_speed(self):
        for robot in robots.ROBOTS.values():
            for seed in range(20):
                t = np.arange(0, 10, 0.01)
                q, v, a = tasks.movement(robot, np.random.default_rng(seed), t)
                self.assertTrue((np.abs(q - robot.middle) <= np.array(robot.reach) + 1e-9).all())
                self.assertTrue((np.abs(v) <= np.array(robot.speed) + 1e-9).all())
                for derivative, of in ((v, q), (a, v)):
                    central = (of[2:] - of[:-2]) / 0.02
                    # The error of a central difference: h² / 6 of the third derivative, at most the fastest harmonic's.
                    self.assertLess(np.abs(central - derivative[1:-1]).max(), 0.01**2 / 6 * (np.pi) ** 2 * 5 * np.abs(derivative).max())


@simulated
class Hidden(unittest.TestCase):
    def scene(self, robot, variant, seed=3):
        step_s = make.FINE_STEP_S if variant.series else make.STEP_S
        return make.tasks_of(robots.ROBOTS[robot], seed, 100)(step_s)

    def test_nothing_is_changed_at_dial_zero(self):
        for robot in robots.ROBOTS:
            for variant in causes.VARIANTS:
                task, scene = self.scene(robot, variant)
                nominal = tasks.simulate(task, tasks.nominal(task.robot, task.step_s), 0.06, warm_up_s=0.02)
                for joint in range(len(task.robot.links)):
                    put, _ = causes.hidden(scene, [(causes.Choice(variant, joint, "0"), 0.0)])
                    model = put.model()
                    made = tasks.simulate(task, model, 0.06, put.stepping(model), warm_up_s=0.02)
                    what = f"{robot} {variant.effect} {variant.variant} {joint}"
                    self.assertLess(np.abs(made.angle - nominal.angle).max(), SAME, what)
                    self.assertLess(np.abs(put.report(made.effort) - nominal.effort).max(), 1e-8 * scene.torque.max(), what)

    def test_what_is_hidden_is_what_its_parameters_say(self):
        """The torque that the nominal model lacks in a simulation, against formulas of the true parameters, low-passed alike. The engine's dry
        friction holds a joint at rest for a while where the formula turns at once; its limit has an inertia of a thousandth
        and a little damping; dry friction of a formula turns within a hundredth of the speed, which is not in the formula's parameters."""
        left_most = {"frictionloss": 0.15, "stribeck-frictionloss": 0.3}
        rate_hz = 500
        for robot, joint in (("pendulum", 0), ("planar", 1)):
            for variant in (v for v in causes.VARIANTS if v.effect != "backlash"):
                task, scene = self.scene(robot, variant)
                choice = causes.Choice(variant, joint, "1")
                made, put, (parameters,) = make.run(task, scene, [(choice, 1.0)], 10.0)
                rows = slice(None, None, round(1 / rate_hz / task.step_s))
                sos = oracle.butter(4, oracle.BAND_HZ, fs=rate_hz, output="sos")
                low = lambda x: oracle.sosfiltfilt(sos, x, axis=0)
                q, v, a = oracle.moved(made.angle[rows], rate_hz, low)
                links = links_of(task.robot)
                needed = oracle.newton_euler(links, q, v, a)
                told = low(put.report(made.effort)[rows])
                lack = told - low(needed)
                cause = {"effect": variant.effect, "variant": variant.variant, "axis": choice.axis(task.robot), "parameters": parameters}
                left = lack - low(oracle.explained(links, cause, q, v, a, needed, rate_hz, low, told))
                inner = slice(rate_hz, -rate_hz)
                share = np.sqrt((left[inner] ** 2).sum() / (lack[inner] ** 2).sum())
                self.assertLess(share, left_most.get(variant.variant, 0.1), f"{robot} {variant.effect} {variant.variant} {joint}")

    def test_play_leaves_half_its_width_on_the_side_that_the_load_pulls_to(self):
        """A motor that holds a pendulum bears its weight at the angle at which it hangs in the play."""
        variant = next(v for v in causes.VARIANTS if v.effect == "backlash")
        task, scene = self.scene("pendulum", variant)
        put, (parameters,) = causes.hidden(scene, [(causes.Choice(variant, 0, "1"), 1.0)])
        task.angle[:], task.speed[:], task.effort[:] = 1.0, 0.0, 0.0
        made = tasks.simulate(task, put.model(), 1.0, warm_up_s=4.0)
        link = task.robot.links[0]
        weight = link.mass * robots.GRAVITY * -link.centre[2] * np.sin(made.angle[-1, 0] - parameters["gap_rad"] / 2)
        # The wall gives way by less than a hundredth of the play.
        self.assertAlmostEqual(made.effort[-1, 0] / weight, 1.0, delta=0.01)

    def test_a_limit_of_the_engine_is_the_spring_that_it_should_be(self):
        """Pressed by a constant torque, it gives way by the torque over its stiffness."""
        variant = next(v for v in causes.VARIANTS if v.variant == "limit")
        task, scene = self.scene("pendulum", variant)
        put, (parameters,) = causes.hidden(scene, [(causes.Choice(variant, 0, "5"), 1.0)])
        model = put.model()
        model.opt.gravity[:] = 0
        data = mujoco.MjData(model)
        stop = parameters["stop_rad"]
        side = 1 if stop > 0 else -1
        data.qpos[0], data.ctrl[0] = stop, side * 2.0
        for _ in range(200000):
            mujoco.mj_step(model, data)
            data.qvel *= 0.999
        self.assertAlmostEqual(side * (data.qpos[0] - stop) * parameters["stiffness_nm_per_rad"], 2.0, delta=0.01)


@simulated
class TheFunction(unittest.TestCase):
    def test_it_follows_its_reference_with_the_torque_that_this_needs_and_bears_what_is_added(self):
        robot, rate_hz = robots.ROBOTS["planar"], 200
        t = np.arange(0, 2, 1 / rate_hz)
        q, v, a = tasks.movement(robot, np.random.default_rng(2), t)
        f, inputs = function_door.simulation(robot, rate_hz), {f"reference_{j}": q[:, i] for i, j in enumerate(robot.joints)}
        plain = f(inputs, {}, {})
        needed = tasks.inverse(tasks.nominal(robot), q, v, a)
        for i, joint in enumerate(robot.joints):
            self.assertEqual(len(plain[f"torque_{joint}"]), len(t))
            # The ends of a cubic spline know the second derivative worse.
            error = plain[f"torque_{joint}"][20:-20] - needed[20:-20, i]
            self.assertLess(np.abs(error).max() / np.abs(needed[:, i]).max(), 0.01)
        added = f(inputs, {"torque_elbow": np.full(len(t), 0.5)}, {})
        # What is added is what the motor's torque lacks of what the motion needs.
        angle = np.column_stack([added[f"angle_{j}"] for j in robot.joints])
        speed = np.gradient(angle, 1 / rate_hz, axis=0)
        needed = tasks.inverse(tasks.nominal(robot), angle, speed, np.gradient(speed, 1 / rate_hz, axis=0))
        self.assertAlmostEqual(np.mean((needed[:, 1] - added["torque_elbow"])[-200:-20]), 0.5, delta=0.01)
        heavy = f(inputs, {}, {"mass_elbow": 2 * robot.links[1].mass})
        self.assertGreater(np.abs(heavy["torque_elbow"] - plain["torque_elbow"]).max(), 0.5)


@simulated
class Plan(unittest.TestCase):
    def test_halves_are_alike_and_keep_apart(self):
        questions = plan.questions()
        self.assertEqual([q.seed for q in questions], list(range(300)))
        for half in ("tuning", "held-back", "practice"):
            found = [q for q in questions if q.half == half]
            kinds = [q.kind for q in found]
            self.assertEqual((len(found), kinds.count("nothing"), kinds.count("pair")), (100, 20, 20))
            singles = [(q.hidden[0], q.robot) for q in found if q.kind == "single"]
            self.assertEqual(len(singles), len(set(singles)))
            self.assertEqual([strength for (_, strength), _ in singles].count("clear"), 30)
            self.assertLessEqual([q.robot for q in found].count("six"), 36)
        for q in questions:
            if q.half != "held-back":
                self.assertFalse([e for e, _ in q.hidden if plan.held_back(e, q.robot)])
        families = {(e, q.robot) for q in questions if q.half == "held-back" and q.kind == "single" for e, _ in q.hidden}
        self.assertEqual(families, {(e, r) for e in causes.EFFECTS for r in plan.ROBOTS})

    def test_each_cause_outside_backlash_has_a_variant_for_tuning(self):
        for effect in causes.EFFECTS:
            self.assertEqual(effect == "backlash", all(v.held_back for v in causes.VARIANTS if v.effect == effect))


def truth(*hidden, robot="six", kind=None, noise=0.01):
    joints = {"pendulum": ["pivot"], "planar": ["shoulder", "elbow"], "six": ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"]}[robot]
    listed = [
        {"effect": effect, "variant": variant, "engine": True, "axis": axis, "strength": "clear", "share": 0.1, "parameters": parameters, "scored": list(parameters)}
        for effect, variant, axis, parameters in hidden
    ]
    return {"id": "000", "seed": 0, "half": "tuning", "robot": robot, "joints": joints, "kind": kind or ("nothing", "single", "pair")[len(hidden)], "causes": listed,
            "torque_spread": [0.5] * len(joints), "noise_share": noise, "travel_rad": [2.0] * len(joints)}


def said(effect, axis, **parameters):
    listed = [{"name": name, "value": value, "ci95": list(ci) if ci else None} for name, (value, ci) in parameters.items()]
    return {"effect": effect, "site": {"side": "robot", "axis": axis}, "probability": 0.95, "parameters": listed}


def marked(truth, *named, door="log"):
    return marking.mark(truth, {"result": {"result": {"verdict": "explained", "causes": list(named)}}, "error": None, "seconds": 1.0}, door)


class Marks(unittest.TestCase):
    def test_a_cause_at_its_joint_is_right_and_elsewhere_is_not(self):
        asked = truth(("viscous-friction", "damping", "elbow", {"viscous_nm_s_per_rad": 2.0}))
        for named, first, placed in ((said("viscous-friction", "elbow"), True, True), (said("viscous-friction", "wrist_1"), False, True), (said("coulomb-friction", "elbow"), False, False)):
            m = marked(asked, named)
            self.assertEqual((m.first, m.placed[0]), (first, placed))
        self.assertFalse(marked(asked).first)
        self.assertIsNone(marking.mark(asked, {"result": None, "error": "no", "seconds": 0.0}, "log").answer)

    def test_the_second_name_does_not_count_as_first(self):
        asked = truth(("torque-offset", "constant", "elbow", {}))
        m = marked(asked, said("torque-delay", "elbow"), said("torque-offset", "elbow"))
        self.assertFalse(m.first)
        self.assertTrue(m.all)
        self.assertFalse(m.exactly)

    def test_pairs_need_both_and_one_name_is_not_two(self):
        asked = truth(("viscous-friction", "damping", "elbow", {}), ("viscous-friction", "damping", "wrist_1", {}))
        self.assertTrue(marked(asked, said("viscous-friction", "wrist_1"), said("viscous-friction", "elbow")).exactly)
        self.assertFalse(marked(asked, said("viscous-friction", "elbow"), said("viscous-friction", "elbow")).all)

    def test_causes_without_a_joint(self):
        for axis in ("", None):
            self.assertTrue(marked(truth(("base-tilt", "gravity", "", {})), said("base-tilt", axis)).first)
        self.assertTrue(marked(truth(("payload", "ball", "", {})), said("payload", "wrist_3")).first)

    def test_what_cannot_be_told_apart(self):
        alike = lambda asked, named, door="log": (lambda m: (m.first, m.itself))(marked(asked, named, door=door))
        on_one = truth(("torque-scale", "factor", "pivot", {}), robot="pendulum")
        self.assertEqual(alike(on_one, said("link-parameters", "pivot")), (True, False))
        self.assertEqual(alike(truth(("torque-scale", "factor", "elbow", {}), robot="planar"), said("link-parameters", "elbow")), (False, False))
        self.assertEqual(alike(truth(("payload", "ball", "", {})), said("link-parameters", "wrist_3")), (True, False))
        self.assertEqual(alike(truth(("payload", "ball", "", {})), said("link-parameters", "elbow")), (False, False))
        self.assertEqual(alike(truth(("payload", "ball", "", {})), said("link-parameters", "elbow"), "columns"), (True, False))
        self.assertEqual(alike(truth(("link-parameters", "mass", "elbow", {})), said("link-parameters", "wrist_1"), "columns"), (False, False))
        self.assertEqual(alike(truth(("motor-inertia", "armature", "shoulder_pan", {})), said("link-parameters", "shoulder_pan")), (True, False))
        self.assertEqual(alike(truth(("motor-inertia", "armature", "elbow", {})), said("link-parameters", "elbow")), (False, False))
        steady = truth(("load-friction", "share", "elbow", {}), noise=0.06)  # 0.5 * 0.1 < 0.06
        self.assertEqual(alike(steady, said("coulomb-friction", "elbow")), (True, False))
        self.assertEqual(alike(truth(("load-friction", "share", "elbow", {})), said("coulomb-friction", "elbow")), (False, False))

    def test_parameters_against_what_they_are_measured_by(self):
        asked = truth(("torque-scale", "factor", "elbow", {"scale": 1.1}))
        (_, _, error, inside), = marked(asked, said("torque-scale", "elbow", scale=(1.12, (1.09, 1.15)))).parameters
        self.assertAlmostEqual(error, 0.2)
        self.assertTrue(inside)
        stop = truth(("end-stop", "spring", "elbow", {"stop_rad": 0.01, "stiffness_nm_per_rad": 50.0}))
        m = marked(stop, said("end-stop", "elbow", stop_rad=(0.03, None), other=(1.0, None)))
        self.assertEqual([(name, round(error, 9), inside) for _, name, error, inside in m.parameters], [("stop_rad", 0.01, None)])
        self.assertEqual(m.unknown, [("end-stop", "other")])
        self.assertEqual(m.missing, [("end-stop", "stiffness_nm_per_rad")])
        tilt = truth(("base-tilt", "gravity", "", {"tilt_x_rad": 0.03, "tilt_y_rad": 0.04}))
        self.assertEqual([round(e, 9) for _, _, e, _ in marked(tilt, said("base-tilt", "", tilt_x_rad=(0.03, None), tilt_y_rad=(0.03, None))).parameters], [0.0, 0.2])

    def test_numbers_under_another_name_are_not_marked(self):
        m = marked(truth(("payload", "ball", "", {"mass_kg": 1.0})), said("link-parameters", "wrist_3", mass_kg=(7.0, None)))
        self.assertEqual((m.parameters, m.unknown, m.missing), ([], [], []))

    def test_the_table_counts(self):
        right = marked(truth(("torque-offset", "constant", "elbow", {"offset_nm": 1.0})), said("torque-offset", "elbow", offset_nm=(1.02, (0.9, 1.1))))
        wrong = marked(truth(("torque-offset", "constant", "elbow", {"offset_nm": 1.0})))
        false = marked(truth(), said("torque-offset", "elbow"))
        text = marking.table([right, wrong, false], verbose=True)
        row = lambda start: next(line for line in text.splitlines() if line.startswith(start))
        self.assertIn("1 of 2", row("one hidden, clear: cause and joint"))
        self.assertIn("1 of 1", row("nothing hidden: a cause named"))
        self.assertIn("1 of 2", row("something hidden: nothing named"))
        self.assertIn("1 of   1     1 of   1", row("torque-offset offset_nm"))


if __name__ == "__main__":
    unittest.main()
