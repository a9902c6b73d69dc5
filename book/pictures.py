"""Draws the picture at the front of the README, those of the gallery and those of the tutorial of the moving arm, from what the program writes.

    python3 book/pictures.py [--bin target/release]
    python3 book/pictures.py --check                    compares what the pages say, and writes nothing

Needs Python, the program and its example (`cargo build --release --bin ndof --example moving_arm`), about 20 s and a folder for temporary files.
`bash book/reference` runs it. The numbers in
`front.svg` are those of the diagnosis' JSON, its curves those of the CSV files beside the report's own pictures. Each picture of the gallery is one of a
report, written by the commands that the page shows; the output that it shows is compared, as in `follow_tutorials.py`. So are the numbers that README,
introduction and gallery say of the first picture. The tutorial's commands run as far as those that draw.
"""
import argparse
import csv
import json
import os
import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

from follow_tutorials import ANSI, NUMBER, alike, listings, missing, put_tools

ROOT = Path(__file__).resolve().parents[1]
PICTURES = ROOT / "book/src/pictures"
GALLERY = ROOT / "book/src/gallery.md"
TUTORIAL = ROOT / "book/src/tutorials/moving_arm.md"

# Okabe and Ito's colours, as in the program's reports.
MEASURED, WRONG, RIGHT, INK, GREY = "#a9b1bd", "#d55e00", "#0072b2", "#1c2430", "#5b6675"
STYLE = f"""text{{font-family:Helvetica,Arial,'DejaVu Sans',sans-serif;fill:{INK};font-size:14px}}.head{{font-weight:600;font-size:15px}}.small{{font-size:13px;fill:{GREY}}}\
.big{{font-size:22px;font-weight:600}}.line{{fill:none;stroke-width:2;stroke-linejoin:round;stroke-linecap:round}}.grid{{stroke:#e3e7ed}}.axis{{stroke:#9aa4b2}}"""


def texts(x, y, *lines, step=20, kind="small", anchor="start"):
    return "".join(f'<text class="{kind}" x="{x}" y="{y + step * k}" text-anchor="{anchor}">{line}</text>' for k, line in enumerate(lines))


def panel(left, top, width, height, x_range, y_range, x_ticks, y_ticks, x_label, y_label):
    """A frame with ticks, and how a curve becomes a path in it."""
    def at(x, y):
        return left + (x - x_range[0]) / (x_range[1] - x_range[0]) * width, top + (y_range[1] - y) / (y_range[1] - y_range[0]) * height

    drawn = [texts(left, top - 8, y_label), texts(left + width, top + height + 36, x_label, anchor="end")]
    for value in y_ticks:
        y = at(x_range[0], value)[1]
        drawn.append(f'<path class="grid" d="M{left} {y:.1f}h{width}"/>' + texts(left - 6, round(y + 4, 1), f"{value:g}".replace("-", "−"), anchor="end"))
    for value in x_ticks:
        drawn.append(texts(round(at(value, 0)[0], 1), top + height + 18, f"{value:g}".replace("-", "−"), anchor="middle"))
    drawn.append(f'<path class="axis" d="M{left} {top + height}h{width}"/>')

    def curve(points, color, dash="none", width=2):
        path = " ".join("{:.1f} {:.1f}".format(*at(x, y)) for x, y in points)
        return f'<path class="line" stroke="{color}" style="stroke-width:{width}" stroke-dasharray="{dash}" d="M{path}"/>'

    return "".join(drawn), curve


def legend(x, y, *entries):
    return "".join(f'<path class="line" stroke="{color}" stroke-dasharray="{dash}" d="M{x + dx} {y - 5}h22"/>' + texts(x + dx + 28, y, label)
                   for dx, label, color, dash in entries)


def columns(file):
    """Each column of a CSV of curves over one abscissa, by the words of its heading."""
    rows = [row for row in csv.reader(open(file, encoding="utf-8")) if not row[0].startswith("#")]
    return {heading.strip(" |"): [float(row[k]) for row in rows[1:] if row[k]] for k, heading in enumerate(rows[0])}


def says(page, sentence):
    """Ends the program unless a page of the book, or the README, says this; numbers up to two units of the last digit, as in `follow_tutorials.py`."""
    pattern = NUMBER.pattern.join(map(re.escape, NUMBER.split(sentence)))
    if not any(alike(found, sentence) for found in re.findall(pattern, (ROOT / page).read_text(encoding="utf-8"))):
        sys.exit(f"{page} should say\n    {sentence}")


def front(found, truth, plots):
    cause = found["causes"][0]
    shift = next(shift for shift in found["extended"]["parameter_shift"] if shift["name"] == "K_x_x")
    hidden = truth["experiment"]["effects"][0]
    limb = truth["experiment"]["limb"]["K"][0][0]
    assert len(found["causes"]) == 1 and cause["effect"] == hidden["name"], found["causes"]
    stiffness, given_mm = cause["parameters"][0], cause["parameters"][1]
    half = (stiffness["ci95"][1] - stiffness["ci95"][0]) / 2
    before, after, floor = (100 * e["nrmse"][0] for e in (found["baseline"]["held_out"], found["extended"]["held_out"], found["noise_floor"]))

    traces = columns(plots / "held-out.csv")
    # Four seconds in which both models err by as much as over the whole trial.
    time, from_s, to_s = traces["Time [s]"], 45.0, 49.0
    within = [k for k, t in enumerate(time) if from_s <= t <= to_s][::2]
    drawn = [texts(40, 34, "1. Push the limb, measure its motion, predict it", kind="head"),
             legend(40, 58, (0, "measured", MEASURED, "none"), (104, "linear model", WRONG, "6 4"), (228, "with the named cause", RIGHT, "none"))]
    frame, curve = panel(40, 96, 460, 184, (from_s, to_s), (-12, 13), [45, 46, 47, 48, 49], [-10, -5, 0, 5, 10], "time of a trial that no fit has seen, s", "motion x, mm")
    drawn.append(frame)
    for name, color, dash, width in [("measured", MEASURED, "none", 5), ("with the causes", RIGHT, "none", 1.8), ("baseline", WRONG, "6 4", 2)]:
        values = traces[f"pos_x [m] | {name}"]
        drawn.append(curve([(time[k], 1e3 * values[k]) for k in within], color, dash, width))

    loops = {}
    for row in csv.reader(open(plots / "missing-effort.csv", encoding="utf-8")):
        if row[1] == "Missing effort x [N]":
            loops.setdefault(row[2], []).append((1e3 * float(row[3]), float(row[4])))
    drawn.append(texts(560, 34, "2. Name what it misses", kind="head"))
    drawn.append(legend(560, 58, (0, "force that is missing", MEASURED, "none"), (172, "the named law", RIGHT, "none")))
    frame, curve = panel(560, 96, 300, 184, (-11, 11), (-1, 1), [-10, -5, 0, 5, 10], [-1, -0.5, 0, 0.5, 1], "displacement x, mm", "force x, N")
    drawn.append(frame)
    for way in ("forth", "back"):
        drawn.append(curve(loops[f"missing, moving {way}"], MEASURED, "none", 5))
        drawn.append(curve(loops[f"explained by the causes, moving {way}"], RIGHT, "none", 1.8))
    drawn.append(texts(640, 138, "moving forth", anchor="middle") + texts(800, 250, "moving back", anchor="middle"))

    drawn.append('<path class="grid" d="M24 334H856"/>')
    for x, head, big, small in [
        (40, "Named cause", cause["effect"], f"{stiffness['value']:.1f} ± {half:.1f} N/m, yields at {1e3 * given_mm['value']:.2f} mm; "
            f"hidden: {hidden['parameters']['stiffness_n_per_m']:g} N/m, {1e3 * hidden['parameters']['yield_m']:g} mm"),
        (350, "Error of the prediction of x", f"{before:.1f} % → {after:.1f} %", f"noise alone: {floor:.1f} %"),
        (620, "Stiffness of the limb", f"{shift['before']:.0f} → {shift['after']:.0f} N/m", f"simulated: {limb:g} N/m"),
    ]:
        drawn.append(texts(x, 364, head) + texts(x, 392, big, kind="big") + texts(x, 416, *small.split("; ")))
    said = f"A {cause['effect']} hidden in a simulated limb is named; the error of the prediction falls from {before:.1f} to {after:.1f} %"
    for page in ("README.md", "book/src/introduction.md"):
        says(page, f"![{said}]")
    says("README.md", f"{shift['before']:.0f} N/m in place of {limb:g}")
    says("book/src/gallery.md", f"falls from {before:.1f} to {after:.1f} %; noise alone makes {floor:.1f} %")
    return (f'<svg xmlns="http://www.w3.org/2000/svg" role="img" aria-labelledby="t" width="880" height="456" viewBox="0 0 880 456"><title id="t">{said}.</title>'
            f'<style>{STYLE}</style><rect width="880" height="456" rx="8" fill="#fff"/>{"".join(drawn)}</svg>\n')


def named(text):
    """Name and source of each picture of a page that says in a comment what it is made of."""
    return re.findall(r"!\[[^\]]*\]\((?:\.\./)?pictures/([\w/.-]+)\)\s*<!-- (\S+) -->", text)


def of_tutorial(bin):
    text = TUTORIAL.read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as tools, tempfile.TemporaryDirectory() as work:
        put_tools(tools, bin)
        environment = {**os.environ, "PATH": f"{tools}{os.pathsep}{os.environ['PATH']}"}
        commands = [body for language, body in listings(text) if language == "sh"]
        last = max(k for k, body in enumerate(commands) if "--plots" in body)
        for body in commands[: last + 1]:
            subprocess.run(["bash", "-euc", body], cwd=work, env=environment, check=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        return {name: (Path(work) / source).read_text(encoding="utf-8") for name, source in named(text)}


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--bin", type=Path, default=Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release", help="where the program is")
    arguments.add_argument("--check", action="store_true", help="write no picture")
    chosen = arguments.parse_args()
    bin = chosen.bin.resolve()
    pictures = of_tutorial(bin)
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        (work / "examples").symlink_to(ROOT / "examples")
        environment = {**os.environ, "PATH": f"{bin}{os.pathsep}{os.environ['PATH']}"}
        here = {"cwd": work, "env": environment, "check": True, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
        text = GALLERY.read_text(encoding="utf-8")
        printed = ""
        for language, body in listings(text):
            if language == "sh":
                printed = subprocess.run(["bash", "-euc", body], **here).stdout
            elif (line := missing(body, ANSI.sub("", printed))) is not None:
                sys.exit(f"gallery.md: what should print it does not\n    {line}\nbut\n{printed}")
        for name, source in named(text):
            pictures[name] = (work / source).read_text(encoding="utf-8")
        subprocess.run(shlex.split("ndof diagnose trial-1.csv trial-2.csv trial-3.csv --json diagnosis.json --plots front"), **here)
        found, truth = (json.loads((work / file).read_text(encoding="utf-8")) for file in ("diagnosis.json", "trial.truth.json"))
        pictures["front.svg"] = front(found, truth, work / "front")
    for name, picture in pictures.items():
        if not chosen.check:
            (PICTURES / name).parent.mkdir(exist_ok=True)
            (PICTURES / name).write_text(picture, encoding="utf-8")
    print(f"{len(pictures)} pictures, {sum(map(len, pictures.values())) // 1000} kB")


if __name__ == "__main__":
    main()
