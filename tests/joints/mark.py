"""Puts the questions to a program and marks its answers:

    python3 tests/joints/mark.py FOLDER --bin PROGRAM [--door log|columns] [--half tuning|held-back|practice] [--seeds 0-299] [--out FILE] [--verbose]

The door `log` is `diagnose log.csv --robot robot.urdf`, `columns` is `diagnose log.csv --simulated sim.csv --robot robot.urdf`. An answer stands as diagnosis.json and
diagnosis-columns.json in the question's folder and is asked for again only when the program or the recording changed. Standard library only.
"""

import argparse
import json
import pathlib
import sys
from dataclasses import dataclass, field

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(1, str(HERE.parent / "exam"))

import alike
from ask import Program
from statistics_of import quantile
from tables import Row

DOORS = {
    "log": (["diagnose", "log.csv", "--robot", "robot.urdf"], "diagnosis.json"),
    "columns": (["diagnose", "log.csv", "--simulated", "sim.csv", "--robot", "robot.urdf"], "diagnosis-columns.json"),
}
WITHIN = 0.05


@dataclass
class Mark:
    truth: dict
    answer: dict | None
    error: str | None
    seconds: float
    right: list = field(default_factory=list)  # by named cause: (number of the true cause, rule) or None
    placed: list = field(default_factory=list)  # by named cause: whether an effect is right, wherever it sits
    parameters: list = field(default_factory=list)  # (effect, name, relative error, inside or None)
    unknown: list = field(default_factory=list)  # (effect, name) that the truth has not
    missing: list = field(default_factory=list)  # (effect, name) that the answer has not

    @property
    def named(self):
        return self.answer["causes"] if self.answer else []

    @property
    def first(self):
        return bool(self.right) and self.right[0] is not None

    @property
    def itself(self):
        return self.first and self.right[0][1] == ""

    @property
    def all(self):
        return {r[0] for r in self.right if r} == set(range(len(self.truth["causes"])))

    @property
    def exactly(self):
        return self.all and len(self.named) == len(self.truth["causes"])

    @property
    def strengths(self):
        return [c["strength"] for c in self.truth["causes"]]


def axis_of(named):
    return (named.get("site") or {}).get("axis") or ""


def mark(truth, found, door):
    """The mark of an answer as `ask` gives it."""
    document = found["result"]
    answer = document.get("result", document) if document else None
    out = Mark(truth, answer if answer and "causes" in answer else None, found["error"], found["seconds"])
    allowed = [alike.allowed(truth, cause, door) for cause in truth["causes"]]
    taken = set()
    for named in out.named:
        fits = [(k, rule) for k, ways in enumerate(allowed) for effect, axes, rule in ways if effect == named["effect"] and (axes is None or axis_of(named) in (*axes, *([""] if effect == "payload" else [])))]
        free = sorted((f for f in fits if f[0] not in taken), key=lambda f: f[1] != "")
        out.right.append(free[0] if free else None)
        out.placed.append(any(effect == named["effect"] for ways in allowed for effect, _, _ in ways))
        if free:
            taken.add(free[0][0])
            if free[0][1] == "":
                numbers(out, truth, truth["causes"][free[0][0]], named)
    return out


def size(truth, cause, name):
    """What an error of a parameter is relative to: itself; a scale's distance from one; the whole tilt; an angle's travel."""
    true = cause["parameters"][name]
    if name == "scale":
        return abs(true - 1)
    if name.startswith("tilt_"):
        return sum(v * v for k, v in cause["parameters"].items() if k.startswith("tilt_") and k in cause["scored"]) ** 0.5
    if name == "stop_rad":
        return truth["travel_rad"][truth["joints"].index(cause["axis"])]
    return abs(true)


def numbers(out, truth, cause, named):
    said = {p["name"]: p for p in named.get("parameters", [])}
    for name in cause["scored"]:
        value = said.get(name, {}).get("value")
        if not isinstance(value, (int, float)) or isinstance(value, bool):
            out.missing.append((cause["effect"], name))
            continue
        true, ci = cause["parameters"][name], said[name].get("ci95")
        inside = None if not ci or None in ci else ci[0] <= true <= ci[1]
        out.parameters.append((cause["effect"], name, abs(value - true) / size(truth, cause, name), inside))
    out.unknown += [(cause["effect"], name) for name in said if name not in cause["parameters"]]


def share(what, marks, hit):
    marks = list(marks)
    return Row(what, sum(bool(hit(m)) for m in marks), len(marks)).text()


def table(marks, verbose=False):
    single, pairs, nothing = ([m for m in marks if m.truth["kind"] == kind] for kind in ("single", "pair", "nothing"))
    graded = lambda strength: [m for m in single if m.strengths == [strength]]
    lines = []
    for strength in ("clear", "weak"):
        lines.append(share(f"one hidden, {strength}: cause and joint right first", graded(strength), lambda m: m.first))
        lines.append(share("    of these by a name that means the same", [m for m in graded(strength) if m.first], lambda m: not m.itself))
        lines.append(share("    the effect right first, at whatever joint", graded(strength), lambda m: bool(m.placed) and m.placed[0]))
        lines.append(share("    exactly it and nothing else", graded(strength), lambda m: m.exactly))
    for what, test in (("both clear", lambda m: "weak" not in m.strengths), ("one weak", lambda m: "weak" in m.strengths)):
        some = [m for m in pairs if test(m)]
        lines.append(share(f"two hidden, {what}: both named with their joints", some, lambda m: m.all))
        lines.append(share("    exactly the two", some, lambda m: m.exactly))
        lines.append(share("    one of them first", some, lambda m: m.first))
    lines.append(share("nothing hidden: a cause named", nothing, lambda m: m.named))
    lines.append(share("something hidden: nothing named", single + pairs, lambda m: m.answer and not m.named))
    lines.append(share("no answer", marks, lambda m: m.answer is None))
    lines.append(share("a confident wrong name (above 0.9)", marks, lambda m: any(r is None and (n.get("probability") or 0) > 0.9 for n, r in zip(m.named, m.right))))
    lines.append("\nparameter, of causes named by their own name: within 5 %, inside its interval, of those with one, median relative error")
    found = {}
    for m in marks:
        for effect, name, error, inside in m.parameters:
            found.setdefault((effect, name), []).append((error, inside))
    for (effect, name), told in sorted(found.items()):
        judged = [i for _, i in told if i is not None]
        lines.append(f"{effect + ' ' + name:44} {sum(e <= WITHIN for e, _ in told):3} of {len(told):3}   {sum(judged):3} of {len(judged):3}   {quantile([e for e, _ in told], 0.5):8.4f}")
    everything = [v for told in found.values() for v in told]
    judged = [i for _, i in everything if i is not None]
    lines.append(share("all parameters: within 5 %", everything, lambda v: v[0] <= WITHIN))
    lines.append(share("all parameters: inside their intervals", judged, lambda i: i))
    for what, key in (("parameters that the truth has not", "unknown"), ("parameters that were asked for and not given", "missing")):
        told = sorted({f"{effect} {name}" for m in marks for effect, name in getattr(m, key)})
        lines += [f"{what}: {', '.join(told)}"] if told else []
    lines.append("\none hidden, right first, by cause and variant (* the engine's own): clear, weak")
    kinds = sorted({(c["effect"], c["variant"], c["engine"]) for m in single for c in m.truth["causes"]})
    for effect, variant, engine in kinds:
        of = lambda s: [m.first for m in graded(s) if (m.truth["causes"][0]["effect"], m.truth["causes"][0]["variant"]) == (effect, variant)]
        lines.append(f"{effect + ' ' + variant + (' *' if engine else ''):44} {sum(of('clear')):3} of {len(of('clear')):3}   {sum(of('weak')):3} of {len(of('weak')):3}")
    lines.append("\none hidden, right first, by robot: clear, weak; seconds of a diagnosis (median, 90 %)")
    for robot in sorted({m.truth["robot"] for m in marks}):
        of = lambda s: [m.first for m in graded(s) if m.truth["robot"] == robot]
        seconds = [m.seconds for m in marks if m.truth["robot"] == robot]
        lines.append(f"{robot:44} {sum(of('clear')):3} of {len(of('clear')):3}   {sum(of('weak')):3} of {len(of('weak')):3}   {quantile(seconds, 0.5):7.2f} {quantile(seconds, 0.9):7.2f}")
    lines.append("\nhidden -> named first")
    firsts = {}
    for m in single + nothing:
        hidden = m.truth["causes"][0]["effect"] if m.truth["causes"] else "nothing"
        said = "no answer" if m.answer is None else m.named[0]["effect"] + ("" if m.first or not m.placed[0] else " (other joint)") if m.named else f"nothing ({m.answer.get('verdict')})"
        counts = firsts.setdefault(hidden, {})
        counts[said] = counts.get(said, 0) + 1
    for hidden, counts in sorted(firsts.items()):
        lines.append(f"{hidden:24} " + ", ".join(f"{said} {count}" for said, count in sorted(counts.items(), key=lambda c: -c[1])))
    if verbose:
        lines.append("\nearned less than all")
        lines += [line for line in map(short, marks) if line]
    return "\n".join(lines) + "\n"


def short(m):
    """A line about an answer that is not exactly right."""
    if m.answer is not None and (m.exactly if m.truth["causes"] else not m.named):
        return None
    hidden = ", ".join(f"{c['effect']}/{c['variant']}@{c['axis'] or '-'} {c['strength']}" for c in m.truth["causes"]) or "nothing"
    said = ", ".join(f"{n['effect']}@{axis_of(n) or '-'}{'' if r else ' (wrong)'}" for n, r in zip(m.named, m.right)) or m.error or (m.answer or {}).get("verdict")
    return f"{m.truth['id']} {m.truth['robot']}: {hidden} -> {said}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--bin", required=True, type=pathlib.Path, help="the program that is examined")
    parser.add_argument("--door", choices=tuple(DOORS), default="log")
    parser.add_argument("--half", choices=("tuning", "held-back", "practice"))
    parser.add_argument("--seeds", default="0-999")
    parser.add_argument("--robot", default=None)
    parser.add_argument("--only", default="", help="questions where one of the hidden causes' names holds this")
    parser.add_argument("--option", action="append", default=[], help="more for the program, one a time: --option=--threads --option=1")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=pathlib.Path, default=None, help="file that the table is written to as well")
    parser.add_argument("--append", action="store_true", help="to what the file has")
    parser.add_argument("--verbose", action="store_true", help="a line for each answer that is not exactly right")
    options = parser.parse_args()
    first, last = (int(s) for s in (options.seeds.split("-") * 2)[:2])
    truths = [json.loads(path.read_text()) for path in sorted(options.folder.glob("*/question.json"))]
    truths = [t for t in truths if first <= t["seed"] <= last and options.half in (None, t["half"]) and options.robot in (None, t["robot"]) and (not options.only or any(options.only in c["effect"] for c in t["causes"]))]
    if not truths:
        sys.exit(f"{options.folder} has no such questions: make them with tests/joints/make.py")
    arguments, file = DOORS[options.door]
    program = Program(options.bin, options.folder / "answers", options.jobs)
    said = lambda done, all: print(f"\r{done} of {all}", end="", file=sys.stderr) if sys.stderr.isatty() else None
    found = program.answers([([*arguments, *options.option], options.folder / t["id"]) for t in truths], said)
    for truth, answer in zip(truths, found):
        (options.folder / truth["id"] / file).write_text(json.dumps(answer["result"], indent=1))
    marks = [mark(truth, answer, options.door) for truth, answer in zip(truths, found)]
    text = f"door: {options.door}; half: {options.half or 'both'}; {len(marks)} questions\n{'':70} {'measured':>21}   95 % interval\n" + table(marks, options.verbose)
    print(text, end="")
    if options.out:
        options.out.write_text((options.out.read_text() + "\n" if options.append and options.out.exists() else "") + text)


if __name__ == "__main__":
    main()
