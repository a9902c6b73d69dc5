"""The exam of `ndof diagnose`: puts recordings with something hidden to the command line and marks its answers.

    python3 tests/exam/score.py [--quick | --practice | --final] [--data FOLDER] [--python INTERPRETER] [--out FILE] …

Without a flag it takes the tuning set; --quick some minutes of it; --practice its families with other seeds, three times as many questions;
--final the families and seeds that are held back. Makes the recordings (with cargo, and with MuJoCo where the interpreter has it), asks the
program once for each, and prints the table. Standard library only; MuJoCo's plants and the rivals need an interpreter with
tests/exam/requirements.txt. See book/src/validation/exam.md.
"""

import argparse
import json
import pathlib
import subprocess
import sys

import agreement
import marks as marking
import measured
import tables
from ask import Program, diagnose

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0], formatter_class=argparse.RawDescriptionHelpFormatter, epilog="\n".join(__doc__.splitlines()[4:]))
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--quick", action="store_const", dest="set", const="quick", help="some minutes")
    which.add_argument("--practice", action="store_const", dest="set", const="practice", help="the tuning set's families, three times as many questions")
    which.add_argument("--final", action="store_const", dest="set", const="final", help="what is held back")
    parser.add_argument("--program", default=ROOT / "target/release/ndof", help="the binary to be examined")
    parser.add_argument("--folder", default=ROOT / "target/exam", type=pathlib.Path, help="where recordings and answers are kept")
    parser.add_argument("--python", default=None, help="an interpreter with tests/exam/requirements.txt; without it MuJoCo's plants and rivals are left out")
    parser.add_argument("--rivals", action="store_true", help="put the same recordings to PySINDy and to a correlation rule")
    parser.add_argument("--data", default=None, type=pathlib.Path, help="folder of measured records, to be marked as well")
    parser.add_argument("--only", default="", help="questions whose name, kind, plant or family holds this")
    parser.add_argument("--jobs", default=2, type=int, help="questions asked at once, each on one thread")
    parser.add_argument("--no-making", action="store_true", help="take the recordings that are there")
    parser.add_argument("--out", default=None, type=pathlib.Path, help="file for the table")
    parser.add_argument("--verbose", action="store_true", help="every wrong answer and every disagreement")
    return parser.parse_args()


def make(options, which, folder):
    """Recordings that are not there yet."""
    subprocess.run(["cargo", "run", "--quiet", "--release", "-p", "ndof-challenge", "--example", "exam", "--", which, str(folder), "--threads", str(options.jobs)], cwd=ROOT, check=True)
    if options.python and which != "quick":
        subprocess.run([options.python, str(HERE / "mujoco_plants.py"), which, str(folder), "--jobs", str(options.jobs)], check=True)


def fit(truth, answer):
    """Options that put the data of a baseline to `ndof fit`."""
    return ["fit", *agreement.fitted(truth["files"], answer), *truth["arguments"], "--threads", "1"]


def wrong(mark):
    """A line about an answer that earns nothing, or nothing where it does."""
    good = {"single": mark.first_right, "other": mark.first_right, "against": mark.first_right, "noise": mark.first_right, "null": not mark.named, "background": not mark.named,
            "pair": mark.both, "outside": not mark.confident_wrong, "robot": not mark.on_the_limb}[mark.kind]
    if good and mark.answer is not None:
        return None
    told = [f"{n.effect}[{n.side} {n.axis}] {n.probability if n.probability is None else round(n.probability, 2)} {sorted(n.beside) or ''}" for n in mark.named]
    return f"{mark.truth['id']} {mark.kind} {mark.truth['family']} ({mark.truth['plant']}, {mark.strength}): {mark.verdict} {told}"


def main():
    options = arguments()
    which = options.set or "tuning"
    folder = options.folder / which
    if not options.no_making:
        make(options, which, folder)
    truths = [json.loads(path.read_text()) for path in sorted(folder.glob("*.truth.json"))]
    truths = [t for t in truths if options.only in " ".join((t["id"], t["kind"], t["plant"], t["family"]))]
    program = Program(options.program, options.folder / "answers", options.jobs)
    said = lambda done, all: print(f"\r{done} of {all}", end="", file=sys.stderr) if sys.stderr.isatty() else None
    found = program.answers([(diagnose(t), folder) for t in truths], said)
    marks = [marking.mark(t, f) for t, f in zip(truths, found)]
    repeats = lambda t: t.get("periodic", False) and not any(e["effect"] == "periodic-disturbance" for e in t["effects"])
    answered = [m for m in marks if m.answer]
    judged = [(m.truth["id"], m.answer, repeats(m.truth)) for m in answered]
    free = [m for m in answered if not m.truth["baseline"]]
    of = {m.truth["id"]: f["result"] for m, f in zip(free, program.answers([(fit(m.truth, m.answer), folder) for m in free]))}
    fits = [of.get(m.truth["id"]) for m in answered]
    text = ""
    if options.data:
        lines, more = measured.report(program, options.data)
        judged, fits = judged + more, fits + [None] * len(more)
        text = "\nmeasured records\n" + lines
    text = f"set: {which}\n" + tables.text(marks, judged, fits, options.verbose) + text
    if options.rivals and options.python:
        done = subprocess.run([options.python, str(HERE / "rivals.py"), str(folder), *(t["id"] for t in truths)], check=True, capture_output=True, text=True)
        text += "\n" + tables.rivals(marks, json.loads(done.stdout))
    if options.verbose:
        text += "\nearned nothing\n" + "".join(f"{line}\n" for line in map(wrong, marks) if line)
    print(text, end="")
    if options.out:
        options.out.write_text(text)


if __name__ == "__main__":
    main()
