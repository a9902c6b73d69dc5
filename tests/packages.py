"""Whether what is published fits together: packages, versions, changelog, citation, workflows, paper. Needs Python 3.11 and nothing else.

    python3 tests/packages.py                    all that can be checked at any time
    python3 tests/packages.py --release [TAG]    and what a release needs: a dated section of the changelog, the tag of the version
    python3 tests/packages.py --online           and that the references of the paper exist
    python3 tests/packages.py --changes          prints the changelog's section of this version
"""
import json
import re
import subprocess
import sys
import tomllib
import urllib.request
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
# Those of crates.io that fit; another one is added here when it is checked at https://crates.io/category_slugs.
CATEGORIES = {"command-line-utilities", "mathematics", "parser-implementations", "science", "science::robotics", "simulation", "visualization"}
INHERITED = ("version", "edition", "rust-version", "license", "repository", "homepage")
MOST_WORDS_OF_THE_PAPER = 1000
# What workflows and the container build with. The oldest compiler that works is rust-version, which `.ci/run lowest` holds.
BUILT_WITH = "1.95"


def text(path):
    return (ROOT / path).read_text(encoding="utf-8")


def toml(path):
    return tomllib.loads(text(path))


WORKSPACE = toml("Cargo.toml")
VERSION = WORKSPACE["workspace"]["package"]["version"]
PUBLISHED = {name: entry["path"] for name, entry in WORKSPACE["workspace"]["dependencies"].items() if isinstance(entry, dict) and "path" in entry}


def metadata():
    """Each package that is published says what it is, for people, search and documentation; each other one says that it is not."""
    for name, folder in {**PUBLISHED, "ndof": "."}.items():
        manifest = toml(f"{folder}/Cargo.toml")
        package, where = manifest["package"], f"{folder}/Cargo.toml"
        if package["name"] != name or package.get("publish") is False:
            yield f"{where}: {name} is a dependency of what is published, so it must be, under this name"
        for key in INHERITED:
            if package.get(key) != {"workspace": True}:
                yield f"{where}: {key} is not the workspace's"
        if not 20 <= len(package.get("description", "")) <= 200:
            yield f"{where}: a description of 20 to 200 characters is missing"
        keywords = package.get("keywords", [])
        if not 3 <= len(keywords) <= 5 or any(not re.fullmatch(r"[a-z][a-z0-9-]{0,19}", word) for word in keywords):
            yield f"{where}: three to five keywords of at most 20 small letters, digits and dashes, not {keywords}"
        if not package.get("categories") or not set(package["categories"]) <= CATEGORIES:
            yield f"{where}: categories are {package.get('categories')}, of {sorted(CATEGORIES)}"
        if package.get("metadata", {}).get("docs", {}).get("rs", {}).get("all-features") is not True:
            yield f"{where}: [package.metadata.docs.rs] must ask for all features"
        included = package.get("include", [])
        for file in ("README.md", "LICENSE-MIT", "LICENSE-APACHE"):
            if not (ROOT / folder / file).is_file() or not {f"/{file}", "/LICENSE-*"} & set(included):
                yield f"{where}: {file} is not there or not included"
        if manifest.get("features") and "#![cfg_attr(docsrs, feature(doc_cfg))]" not in text(f"{folder}/src/lib.rs"):
            yield f"{folder}/src/lib.rs: features are not marked in the documentation: #![cfg_attr(docsrs, feature(doc_cfg))]"
        for own, entry in manifest.get("dev-dependencies", {}).items():
            if own.startswith("ndof") and "path" not in entry:
                yield f"{where}: tests name {own} by its version, which must then be published before; name it by its path"
        yield from needs_only_published(where, manifest)
    for manifest in sorted([*ROOT.glob("crates/*/Cargo.toml"), ROOT / "fuzz/Cargo.toml"]):
        package = tomllib.loads(manifest.read_text(encoding="utf-8"))["package"]
        if package["name"] not in PUBLISHED and package.get("publish") is not False:
            yield f"{manifest.relative_to(ROOT)}: publish = false is missing, or the crate is not in [workspace.dependencies]"


def needs_only_published(where, manifest):
    for name in {**manifest.get("dependencies", {}), **manifest.get("build-dependencies", {})}:
        if name.startswith("ndof-") and name not in PUBLISHED:
            yield f"{where} depends on {name}, which is not published"


def examples_of_documentation(folder):
    """Doc examples, without the lines that rustdoc hides."""
    for file in (ROOT / folder).rglob("*.rs"):
        for body in re.findall(r"^ *//[/!] ```\w*\n((?:^ *//[/!].*\n)*?)^ *//[/!] ```$", file.read_text(encoding="utf-8"), re.M):
            lines = re.sub(r"^ *//[/!] ?", "", body, flags=re.M).splitlines()
            yield "\n".join(line for line in lines if not line.startswith("# "))


def readmes():
    """The example of each crate's README is one of its documentation, where `cargo test` runs it."""
    for name, folder in PUBLISHED.items():
        shown = re.findall(r"^```rust\n(.*?)\n```$", text(f"{folder}/README.md"), re.S | re.M)
        tested = set(examples_of_documentation(f"{folder}/src"))
        if not shown and name != "ndof-cli":
            yield f"{folder}/README.md shows no example"
        for example in shown:
            if example not in tested:
                yield f"{folder}/README.md: its example is not (any more) one of the crate's documentation; copy it from there: {example.splitlines()[0]}"


def versions():
    """One version everywhere; one oldest Rust version, and one that everything is built with."""
    rust = WORKSPACE["workspace"]["package"]["rust-version"]
    for name, entry in WORKSPACE["workspace"]["dependencies"].items():
        if name in PUBLISHED and entry["version"] != VERSION:
            yield f"Cargo.toml: {name} is asked for as {entry['version']}, the version is {VERSION}"
    package = toml("crates/python/Cargo.toml")["package"]
    if package["version"] != VERSION or package["rust-version"] != rust:
        yield f"crates/python/Cargo.toml has version {package['version']} and Rust {package['rust-version']}, the workspace {VERSION} and {rust}"
    for path, line in [
        ("CITATION.cff", f"version: {VERSION}"),
        ("conda/recipe.yaml", f'  version: "{VERSION}"'),
        ("Containerfile", f"FROM docker.io/library/rust:{BUILT_WITH}-slim AS build"),
    ]:
        if line not in text(path).splitlines():
            yield f"{path} lacks the line: {line}"
    for path in ["README.md", "book/src/tutorials/planar_arm.md"]:
        for named in re.findall(r"\((1\.\d+) or newer\)", text(path)) or ["none"]:
            if named != rust:
                yield f"{path} names Rust {named}, the workspace {rust}"
    for path in sorted(str(p.relative_to(ROOT)) for p in ROOT.glob(".github/workflows/*.yml")):
        for named in re.findall(r"(?:toolchain install |rustup default |rust-toolchain: \")(1\.\d+)", text(path)):
            if named != BUILT_WITH:
                yield f"{path} names Rust {named}, not {BUILT_WITH}"
    if missing := {f"Rust {rust}", f"Rust {BUILT_WITH}"} - set(re.findall(r"Rust 1\.\d+", text("book/src/versions.md"))):
        yield f"book/src/versions.md does not say {sorted(missing)}"


def section_of_changes():
    found = re.search(rf"^## \[{re.escape(VERSION)}\].*?\n(.*?)(?=^## \[|^\[)", text("CHANGELOG.md"), re.S | re.M)
    return found[1].strip() if found else ""


def changelog():
    headings = re.findall(r"^## (.*)$", text("CHANGELOG.md"), re.M)
    if headings[:1] != ["[Unreleased]"]:
        yield "CHANGELOG.md does not begin with [Unreleased]"
    for heading in headings[1:]:
        if not re.fullmatch(r"\[\d+\.\d+\.\d+\]( - \d{4}-\d\d-\d\d)?", heading):
            yield f"CHANGELOG.md: \"{heading}\" is not [VERSION] - YEAR-MONTH-DAY"
    for name in re.findall(r"\[([^\]]+)\]", " ".join(headings)):
        if not re.search(rf"^\[{re.escape(name)}\]: https://", text("CHANGELOG.md"), re.M):
            yield f"CHANGELOG.md has no link for [{name}]"
    if not section_of_changes():
        yield f"CHANGELOG.md says nothing of {VERSION}"


def release(tag):
    if not re.search(rf"^## \[{re.escape(VERSION)}\] - \d{{4}}-\d\d-\d\d$", text("CHANGELOG.md"), re.M):
        yield f"CHANGELOG.md: the section of {VERSION} has no date"
    if tag and tag != f"v{VERSION}":
        yield f"the tag is {tag}, the version {VERSION}"


def citation():
    """CITATION.cff and .zenodo.json say the same; `cffconvert --validate` checks the first one's form."""
    cff, zenodo = text("CITATION.cff"), json.loads(text(".zenodo.json"))
    title = re.search(r'^title: "(.*)"$', cff, re.M)
    if not title or title[1] != zenodo["title"]:
        yield "title of CITATION.cff and .zenodo.json"
    names = re.findall(r'^  - name: "(.*)"$', cff, re.M)
    if not names or names != [creator["name"] for creator in zenodo["creators"]]:
        yield f"authors of CITATION.cff ({names}) and .zenodo.json"
    licences = re.findall(r"^  - (\S+)$", re.search(r"^license:\n((?:  - .*\n)+)", cff, re.M)[1], re.M)
    if " OR ".join(licences) != WORKSPACE["workspace"]["package"]["license"]:
        yield f"licences of CITATION.cff: {licences}"
    for key, field in [("repository-code", "repository"), ("url", "homepage")]:
        if f'{key}: "{WORKSPACE["workspace"]["package"][field]}"' not in cff:
            yield f"{key} of CITATION.cff is not the workspace's {field}"


def workflows():
    """Every part of `.ci/run` is run by the workflow, and what binstall looks for is what a release makes. Their form is jactionlint's to check."""
    parts = set(subprocess.run(["bash", ROOT / ".ci/run", "--list"], check=True, capture_output=True, text=True).stdout.split())
    run = set(re.search(r"^        parts:\n((?:          - .*\n)+)", text(".github/workflows/ci.yml"), re.M)[1].replace("- ", "").split())
    if parts != run:
        yield f".github/workflows/ci.yml does not run {sorted(parts - run)}, and names {sorted(run - parts)}, which .ci/run has not"
    for path in ROOT.glob(".github/workflows/*.yml"):
        for script in re.findall(r"(?:bash|python3) ((?:\.ci|tests|fuzz)/[\w./-]+)", path.read_text(encoding="utf-8")):
            if not (ROOT / script).is_file():
                yield f"{path.name} runs {script}, which there is not"
    binstall = WORKSPACE["package"]["metadata"]["binstall"]
    targets = set(re.findall(r"target: ([a-z0-9_]+-[a-z0-9-]+)", text(".github/workflows/release.yml")))
    zipped = {target for target, override in binstall["overrides"].items() if override["pkg-fmt"] == "zip"}
    if zipped != {target for target in targets if "windows" in target}:
        yield f"[package.metadata.binstall]: zip for {sorted(zipped)}"
    for piece in ("name=ndof-$version-$target", "$name.tgz", "$name.zip"):
        if piece not in text(".ci/archive"):
            yield f".ci/archive does not make what [package.metadata.binstall] looks for: {piece}"


def book_pages():
    """Text of the book's pages, files that they include in place."""
    for page in sorted((ROOT / "book/src").rglob("*.md")):
        whole = page.read_text(encoding="utf-8")
        for place in re.findall(r"\{\{#include ([^}:]+)\}\}", whole):
            whole += (page.parent / place).read_text(encoding="utf-8")
        yield whole


def paper():
    """Length, references, and that each figure stands in the book, on a page with the same command."""
    body = re.sub(r"\A---\n.*?\n---\n", "", text("paper/paper.md"), flags=re.S)
    if len(body.split()) > MOST_WORDS_OF_THE_PAPER:
        yield f"paper/paper.md has {len(body.split())} words, more than {MOST_WORDS_OF_THE_PAPER}"
    entries = dict(re.findall(r"^@\w+\{(\w+),\n(.*?)^\}", text("paper/paper.bib"), re.S | re.M))
    cited = set(re.findall(r"@(\w+)", re.sub(r"`[^`]*`", "", body)))
    if cited != set(entries):
        yield f"paper: cited and not in the bibliography {sorted(cited - set(entries))}, or the other way {sorted(set(entries) - cited)}"
    for key, fields in entries.items():
        for field in ("author", "title", "year", "doi"):
            if not re.search(rf"^  {field} *= ", fields, re.M):
                yield f"paper/paper.bib: {key} has no {field}"
    pages = list(book_pages())
    items = re.findall(r"^- \*\*.*?(?=^- |\n\n)", re.search(r"^# Validation\n(.*?)^# ", body, re.S | re.M)[1], re.S | re.M)
    if len(items) < 3:
        yield "paper/paper.md: items of # Validation"
    for item in items:
        command = " ".join(re.search(r"`((?:cargo|bash) [^`]*)`", item)[1].split())
        shown = [page for page in pages if command in page]
        numbers = re.findall(r"\d+(?:\.\d+)?", re.sub(r"`[^`]*`", "", item))
        if not any(all(re.search(rf"(?<![\d.]){re.escape(number)}(?![\d]|\.\d)", page) for number in numbers) for page in shown):
            yield f"paper/paper.md: no page of the book has `{command}` with all of {', '.join(numbers)}"


def online():
    for doi in re.findall(r"doi *[=:] *\{?(10\.[^},\s]+)", text("paper/paper.bib") + text("CITATION.cff")):
        request = urllib.request.Request(f"https://doi.org/api/handles/{doi}", headers={"User-Agent": "ndof"})
        try:
            with urllib.request.urlopen(request, timeout=30) as answer:
                known = json.load(answer)["responseCode"] == 1
        except OSError as error:
            known = False
            print(f"{doi}: {error}")
        if not known:
            yield f"{doi} is not registered"


def main():
    words = sys.argv[1:]
    if words == ["--changes"]:
        print(section_of_changes())
        return
    checks = [metadata, readmes, versions, changelog, citation, workflows, paper]
    if words[:1] == ["--release"]:
        checks.append(lambda: release("".join(words[1:2])))
    elif words == ["--online"]:
        checks.append(online)
    elif words:
        sys.exit(__doc__)
    faults = [fault for check in checks for fault in check()]
    print("\n".join(faults) or f"{len(PUBLISHED) + 1} packages, versions, changelog, citation, workflows and paper fit together ({VERSION})")
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
