"""Measured records of others, marked by what is known of them: from the README beside the records and from nothing else.

A record that is not at hand is said to be absent. A cause counts as right if it is named first, or as not to be told from the first.
"""

from dataclasses import dataclass, field

import agreement


@dataclass
class Record:
    name: str
    files: list
    options: list
    right: tuple  # names of which one must be first; empty where none is asked
    wrong: tuple = ()  # names that must not be said for sure
    periodic: bool = False
    relations: list = field(default_factory=list)  # (sentence, function of (answer, fit) that is True, False, or None where it cannot be asked)
    robot: str | None = None


def vaf(model, output=0):
    return lambda answer: answer[model]["held_out"]["vaf_percent"][output]


def nrmse(model, output=0):
    return lambda answer: answer[model]["held_out"]["nrmse"][output]


def at_least(value, least):
    return lambda answer, fit: None if value(answer) is None else value(answer) >= least


def at_most(value, most):
    return lambda answer, fit: None if value(answer) is None else value(answer) <= most


def between(value, low, high):
    return lambda answer, fit: None if value(answer) is None else low <= value(answer) <= high


def parameter(effect, name):
    """A parameter of a named cause; none where the cause is not named."""

    def value(answer):
        for cause in answer["causes"]:
            if cause["effect"] == effect:
                return next((p["value"] for p in cause["parameters"] if p["name"].startswith(name)), None)
        return None

    return value


def of_model(model, name):
    return lambda answer: next((p["value"] for p in answer[model]["parameters"] if p["name"] == name), None)


def says(words):
    return lambda answer, fit: answer["verdict"] == "adequate" or any(words in note for note in answer["discrepancy"]["notes"])


RECORDS = [
    Record("ankle, strong reflex", ["ankle/z_pf.csv"], ["--input", "angle_ankle", "--output", "torque_ankle"], ("reflex-delay",), relations=[
        ("a plain model explains 59.9 % (55 to 65)", between(vaf("baseline"), 55, 65)),
        ("the extended model more than a linear reflex: above 83.6 %", at_least(vaf("extended"), 83.6)),
        ("the extended model as much as the reflex one way: 90.8 % (89 or more)", at_least(vaf("extended"), 89.0)),
        ("the reflex is one-directional", lambda answer, fit: None if parameter("reflex-delay", "one_directional")(answer) is None else bool(parameter("reflex-delay", "one_directional")(answer))),
        ("its delay 40 to 50 ms (30 to 60)", between(parameter("reflex-delay", "delay"), 0.03, 0.06)),
    ]),
    Record("ankle, hardly any reflex", ["ankle/z_df2.csv"], ["--input", "angle_ankle", "--output", "torque_ankle"], (), ("coulomb-friction", "hysteresis"), relations=[
        ("94.4 to 96.1 % are explained once the intrinsic path is right", at_least(vaf("extended"), 94.0)),
        ("says that little is missing", says("little is missing")),
    ]),
    Record("positioning drive", ["emps/DATA_EMPS.csv"], [], ("coulomb-friction",), relations=[
        ("friction 20.39 N within 10 %", between(parameter("coulomb-friction", "level"), 18.4, 22.4)),
        ("mass 95.11 kg within 3 %", between(of_model("extended", "M"), 92.3, 98.0)),
        ("damping 203.5 N s/m within 15 %", between(of_model("extended", "B"), 173.0, 234.0)),
    ]),
    Record("compact-disc arm", ["cd_player_arm/cd_player_arm.csv"], ["--sample-rate", "1"], (), ("cross-coupling",)),
    Record("flexible arm", ["robot_arm/robot_arm.csv"], ["--sample-rate", "1", "--channels", "acc_arm=acc_arm [rad/s^2]", "--input", "torque_reaction", "--output", "acc_arm"], ("extra-resonance",), relations=[
        ("fit 79 % with two modes: NRMSE 0.21 (0.25 or less)", at_most(nrmse("extended"), 0.25)),
    ]),
    Record("damper with a magnetised fluid", ["mr_damper/magneto_est.csv", "mr_damper/magneto_val.csv"], ["--input", "vel_piston", "--output", "force_damper"], ("hysteresis",), relations=[
        ("linear damping explains 41 % (30 to 55)", between(vaf("baseline"), 30, 55)),
    ]),
    Record("anklebot without a person", ["anklebot/female.csv"], [], ("coulomb-friction",), ("measurement-delay", "channel-filter"), relations=[
        # A model without a stiffness says so as well.
        ("no spring: |K_ie| below 1 N m/rad", lambda answer, fit: abs(of_model("extended", "K_ie_ie")(answer) or 0.0) <= 1.0),
        ("friction of some 0.5 N m (0.2 to 1.2)", between(parameter("coulomb-friction", "level"), 0.2, 1.2)),
    ]),
    Record("ankle in movement", ["ankle_moving_cycles/small.csv"], ["--input", "angle_ankle", "--output", "torque_ankle"], ("stiffness-drift",), relations=[
        ("not called adequate", lambda answer, fit: answer["verdict"] != "adequate"),
    ]),
    Record("ankle in movement, told of its cycles", ["ankle_moving_cycles/small.csv"], ["--input", "angle_ankle", "--output", "torque_ankle", "--schedule", "phase", "--cycle", "1.5"], ("varying-stiffness",), relations=[
        ("matrices over the cycle explain 89.5 % of the deviation from its mean", at_least(vaf("extended"), 89.5)),
    ]),
    Record("band damper, 30 lb", ["damper_backlash/30lb.csv"], ["--input", "pos_x", "--output", "force_x"], ("coulomb-friction", "dead-zone", "hysteresis"), ("periodic-disturbance",), True, relations=[
        ("friction behind a play leaves 0.362 of the force (0.42 or less)", at_most(nrmse("extended"), 0.42)),
    ]),
    Record("band damper, 80 lb", ["damper_backlash/80lb.csv"], ["--input", "pos_x", "--output", "force_x"], ("coulomb-friction", "dead-zone", "hysteresis"), ("periodic-disturbance",), True),
    Record("electronic Duffing oscillator", ["silverbox/multisine.csv"], [], ("cubic-stiffness",), relations=[
        ("error no more than 1.1 times that of the engine in time, 0.0175", at_most(nrmse("extended"), 1.1 * 0.0175)),
    ]),
    Record("Bouc-Wen benchmark", ["boucwen/multisine.csv"], [], ("hysteresis",)),
    Record("joint of a Fairino arm", ["joint_friction/fairino_1.csv"], ["--input", "angle_1", "--output", "torque_1"], ("coulomb-friction",)),
    Record("joint of a Franka arm", ["joint_friction/franka_2.csv"], ["--input", "angle_2", "--output", "torque_2"], ("coulomb-friction",)),
    Record("UR10e, six joints", ["ur10e/six_joints.csv"], [], ("coulomb-friction",), robot="ur10e/ur10e.urdf", relations=[
        ("friction named at every joint", lambda answer, fit: len({c["site"]["axis"] for c in answer["causes"] if c["effect"] == "coulomb-friction"}) == 6),
    ]),
]


def marks(record, answer):
    """Whether the cause is right, none where none is asked, and names that were wrongly said for sure."""
    beside = [set(group["effects"]) for group in answer["confusable"]]
    named = [c for c in answer["causes"] if c["effect"] != "limb-noise"]
    with_it = lambda effect: {effect}.union(*(group for group in beside if effect in group))
    right = bool(named) and bool(with_it(named[0]["effect"]) & set(record.right)) if record.right else None
    sure = [c["effect"] for c in named if c["effect"] in record.wrong and (c["probability"] or 0) > 0.9 and with_it(c["effect"]) == {c["effect"]}]
    return right, sure


def report(program, folder):
    """Lines on all records, and (name, answer, whether the input repeats) of each for the checks of agreement."""
    lines, judged, first, asked, kept, relations_asked = [], [], 0, 0, 0, 0
    here = [r for r in RECORDS if all((folder / name).is_file() for name in r.files)]
    lines += [f"{r.name}: absent" for r in RECORDS if r not in here]
    reach = lambda r: ["--robot", r.robot] if r.robot and program.knows("--robot") else []
    answers = program.answers([(["diagnose", *r.files, *r.options, *reach(r), "--threads", "1"], folder) for r in here])
    fits = program.answers([(["fit", *agreement.fitted(r.files, found["result"]), *r.options, "--threads", "1"], folder) for r, found in zip(here, answers)])
    for record, found, fit in zip(here, answers, fits):
        answer = found["result"]
        if answer is None:
            asked += bool(record.right)
            lines.append(f"{record.name}: no answer: {(found['error'] or '').splitlines()[-1:]}")
            continue
        right, sure = marks(record, answer)
        asked += right is not None
        first += bool(right)
        told = ", ".join(f"{c['effect']} {c['probability'] if c['probability'] is None else round(c['probability'], 2)}" for c in answer["causes"]) or "nothing"
        error = lambda model: "/".join("–" if v is None else f"{v:.4g}" for v in answer[model]["held_out"]["nrmse"])
        word = {True: "right", False: "wrong", None: "none asked"}[right]
        lines.append(f"{record.name}: {answer['verdict']}, {told}: {word}; error {error('baseline')} -> {error('extended')}; {found['seconds']:.1f} s")
        lines += [f"    said for sure, and wrong: {effect}" for effect in sure]
        for sentence, holds in [*record.relations, ("the baseline is what `fit` finds", agreement.like_the_fit)]:
            held = holds(answer, fit["result"])
            relations_asked += held is not None
            kept += bool(held)
            lines.append(f"    {'yes' if held else 'cannot be asked' if held is None else 'no '} {sentence}")
        lines += [f"    disagrees: {sentence}" for sentence in agreement.checks(answer, record.periodic)]
        judged.append((record.name, answer, record.periodic))
    lines.append(f"cause first, or not to be told from the first: {first} of {asked}; relations that hold: {kept} of {relations_asked}")
    return "\n".join(lines) + "\n", judged
