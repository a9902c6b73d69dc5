"""Runs the README's example in an environment that holds the wheel alone, beside the command line on the same recordings.

python tests/readme.py (with the program in $NDOF)
"""

import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

package = pathlib.Path(__file__).resolve().parents[1]
example = re.search(r"```python\n(.*?)```", (package / "README.md").read_text(encoding="utf-8"), re.S).group(1)
for page in (package.parents[1] / "README.md", package.parents[1] / "book/src/tutorials/python.md"):
    if example not in page.read_text(encoding="utf-8"):
        sys.exit(f"{page}: its Python example is another one")
found = {}
exec(compile(example, "README.md", "exec"), found)

with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    ndof = os.environ["NDOF"]
    subprocess.run([ndof, "simulate", "arm", "--seed", "1", "--out", "trial.csv", "--quiet"], check=True)
    arm = found["arm"]
    pathlib.Path("arm.toml").write_text("".join(f"{key} = {json.dumps(value)}\n" for key, value in arm.items()))
    trials = [f"trial-{k}.csv" for k in range(1, 7)]
    spectral = ["--nperseg", "2048", "--noverlap", "1536", "--nfft", "8192", "--quiet", "--json", "-"]
    run = lambda *arguments: json.loads(subprocess.run([ndof, *arguments, *spectral], check=True, capture_output=True).stdout)
    estimate = run("estimate", *trials)
    fit = run("fit", *trials, "--band", "0.5-8", "--kinematics", "arm.toml")

projected = found["ndof"].project(found["fit"], arm).to_dict()
different = [name for name, ours, theirs in (("estimate", found["response"].to_dict(), estimate), ("fit", projected, fit)) if ours != theirs]
modules = sorted(name for name in ("pandas", "matplotlib", "scipy", "xarray") if name in sys.modules)
if different or modules:
    sys.exit(f"the README's example: different from the command line: {different}; needless imports: {modules}")
print("the README's example gives the numbers of the command line, to the last bit")
