"""Follows the tutorials of the book to the letter: runs the commands that a page prints and compares with what it says comes out.

    python3 book/follow_tutorials.py [--bin target/release] [PAGE…]

Each page has a folder of its own that looks like a fresh clone, and one shell in which its `sh` listings run from top to bottom; a command that
fails ends the page. What a `text` listing shows must be printed by the `sh` listing before it, in that order, with `…` for what is left out: words
alike, numbers alike up to two units of the last digit that the page prints (processors round differently).

`ndof` and `cargo run --release` are the program in --bin, `cargo run --release --example NAME` is its example, `git clone` gives the folder,
and `cargo test …` is not run a second time here: it must name a test that there is.
"""
import argparse
import os
import re
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TUTORIALS = ROOT / "book" / "src" / "tutorials"
# Driven by crates/python/test, with its own environment, and by `.ci/run octave`.
ELSEWHERE = {"python", "simulator", "dask", "spark", "julia_and_matlab"}
MARK = "\x1e"
ANSI = re.compile(r"\x1b\[[0-9;]*m")
NUMBER = re.compile(r"[-+−±]?\d+(?:\.\d+)?(?:e[-+]?\d+)?%?")

CARGO = """#!/bin/sh
case "$*" in
  "run --release -- "*) shift 3; exec ndof "$@" ;;
  "run --release --example "*) name=$4; shift 4; exec "{bin}/examples/$name" "$@" ;;
  "test --release "*) for word in "$@"; do
      test -n "$(find "{root}/tests" "{root}"/crates/*/tests -maxdepth 1 \\( -name "$word.rs" -o -name "$word" \\))" && exit 0
    done
    echo "no such test: cargo $*" >&2; exit 1 ;;
  *) echo "this page may not say: cargo $*" >&2; exit 1 ;;
esac
"""
GIT = """#!/bin/sh
test "$1" = clone || exit 1
mkdir -p "${{3:-ndof}}" && cp -rs "{root}/examples" "${{3:-ndof}}/" && ln -s "{root}/crates" "{root}/book" "${{3:-ndof}}/"
"""


def listings(text):
    """(language, body) of each fenced listing, in order."""
    return re.findall(r"^```([a-z,]*)\n(.*?)^```", text, re.S | re.M)


def unit_of_last_digit(number):
    mantissa, _, exponent = number.rstrip("%").partition("e")
    decimals = len(mantissa.partition(".")[2])
    return 10.0 ** (int(exponent or 0) - decimals)


def value(number):
    return float(number.rstrip("%").lstrip("±").replace("−", "-"))


def alike(said, printed):
    """Whether a line of the page is one of the output."""
    words, found = NUMBER.split(" ".join(said.split())), NUMBER.split(" ".join(printed.split()))
    if [w.strip() for w in words] != [w.strip() for w in found]:
        return False
    pairs = zip(NUMBER.findall(said), NUMBER.findall(printed))
    return all(abs(value(a) - value(b)) <= 2.000001 * unit_of_last_digit(a) for a, b in pairs)


def missing(said, printed):
    """The first line of a `text` listing that the output does not have, if any."""
    lines, at = printed.splitlines(), 0
    for line in said.splitlines():
        if not line.strip() or line.strip() == "…":
            continue
        while at < len(lines) and not alike(line, lines[at]):
            at += 1
        if at == len(lines):
            return line
        at += 1
    return None


def follow(page, tools):
    """What is wrong on a page, as sentences."""
    parts, expected = ["set -eu"], {}
    for language, body in listings(page.read_text(encoding="utf-8")):
        if language == "sh":
            parts.append(f"printf '{MARK}'\n{body}")
        elif language == "text" and len(parts) > 1:
            expected.setdefault(len(parts) - 1, []).append(body)
    if len(parts) == 1:
        return [f"{page.name} prints no command"]
    with tempfile.TemporaryDirectory() as folder:
        # Where a page does not clone by itself, it starts in the clone.
        place = Path(folder) / "work"
        place.mkdir()
        environment = {**os.environ, "PATH": f"{tools}{os.pathsep}{os.environ['PATH']}", "HOME": folder}
        if "git clone" not in parts[1]:
            subprocess.run(["git", "clone", "", "."], cwd=place, env=environment, check=True)
        done = subprocess.run(["bash", "-c", "\n".join(parts)], cwd=place, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL)
    outputs = ANSI.sub("", done.stdout.decode("utf-8", "replace")).split(MARK)
    if done.returncode:
        return [f"{page.name}: listing {len(outputs) - 1} ends with {done.returncode}:\n{outputs[-1]}"]
    faults = []
    for number, bodies in expected.items():
        for body in bodies:
            if (line := missing(body, outputs[number])) is not None:
                faults.append(f"{page.name}: listing {number} does not print\n    {line}\nbut\n{outputs[number]}")
    return faults


def put_tools(folder, bin):
    """The programs that a page may call, where `PATH` finds them."""
    for name, text in {"cargo": CARGO, "git": GIT}.items():
        tool = Path(folder) / name
        tool.write_text(text.format(bin=bin.resolve(), root=ROOT))
        tool.chmod(0o755)
    (Path(folder) / "ndof").symlink_to(bin.resolve() / "ndof")


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    arguments.add_argument("--bin", type=Path, default=target / "release", help="where the program and the folder of its examples are")
    arguments.add_argument("pages", nargs="*", help="names without suffix; all where none is given")
    chosen = arguments.parse_args()
    names = chosen.pages or sorted(p.stem for p in TUTORIALS.glob("*.md") if p.stem not in ELSEWHERE)
    unknown = ELSEWHERE - {p.stem for p in TUTORIALS.glob("*.md")}
    faults = [f"{name}.md is gone" for name in unknown]
    with tempfile.TemporaryDirectory() as tools:
        put_tools(tools, chosen.bin)

        def timed(name):
            start = time.monotonic()
            found = follow(TUTORIALS / f"{name}.md", tools)
            print(f"{name}: {'wrong' if found else 'as it says'}, {time.monotonic() - start:.1f} s", flush=True)
            return found

        for name in names:
            faults += timed(name)
    print("\n\n".join(faults) or f"{len(names)} tutorials give what they say")
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
