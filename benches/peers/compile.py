"""What each dependency of the default build costs: builds everything from nothing with `cargo build --release --timings` into a
folder of its own and prints, for each dependency that we name ourselves, the compiler's seconds for it and for everything that
comes with it alone."""
import glob
import json
import os
import re
import subprocess
import tempfile
import time

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")

with tempfile.TemporaryDirectory() as folder:
    begun = time.time()
    environment = {**os.environ, "CARGO_TARGET_DIR": folder, "CARGO_INCREMENTAL": "0"}
    subprocess.run(["cargo", "build", "--release", "--timings", "--quiet"], cwd=ROOT, check=True, env=environment)
    took = time.time() - begun
    size = os.path.getsize(os.path.join(folder, "release", "ndof")) / 1e6
    with open(sorted(glob.glob(os.path.join(folder, "cargo-timings", "cargo-timing*.html")))[-1]) as file:
        units = json.loads(re.search(r"const UNIT_DATA = (\[.*?\]);", file.read(), re.S)[1])
seconds = {}
for unit in units:
    seconds[unit["name"]] = seconds.get(unit["name"], 0) + unit["duration"]

metadata = json.loads(subprocess.run(["cargo", "metadata", "--format-version", "1"], cwd=ROOT, check=True, capture_output=True, text=True).stdout)
name = {package["id"]: package["name"] for package in metadata["packages"]}
edges = {}
for node in metadata["resolve"]["nodes"]:
    kinds = [d["pkg"] for d in node["deps"] if any(kind["kind"] != "dev" for kind in d["dep_kinds"])]
    edges[node["id"]] = [d for d in kinds if name[d] in seconds]
members = [m for m in metadata["workspace_members"] if name[m] in seconds]


def reach(without=None):
    found, todo = set(), list(members)
    while todo:
        package = todo.pop()
        if package not in found and package != without:
            found.add(package)
            todo += edges.get(package, [])
    return found


everything = reach()
direct = {d for m in members for d in edges[m] if d not in members}
rows = []
for dependency in direct:
    alone = everything - reach(dependency)
    rows.append((sum(seconds[n] for n in {name[p] for p in alone}), seconds[name[dependency]], name[dependency], len(alone) - 1))
print(f"\n### What each dependency costs\n\nFrom nothing: {took:.0f} s on {os.cpu_count()} CPUs (load {os.getloadavg()[0]:.1f}); the program is {size:.1f} MB "
      f"(asked: 180 s, 25 MB). Seconds of compiling, several crates at once:\n\n| dependency | itself | with what only it needs | crates that only it needs |\n|---|---|---|---|")
for total, itself, label, crates in sorted(rows, reverse=True):
    print(f"| {label} | {itself:.1f} | {total:.1f} | {crates} |")
print(f"| our own crates | | {sum(seconds[name[m]] for m in members):.1f} | |")
