"""Runs the notebooks and writes them as pages of the book: python to_book.py (from anywhere, with ndof installed)

Text and tables stand in the pages; pictures beside them as SVG.
"""

import base64
import pathlib
import re
import sys

import nbclient
import nbformat

HERE = pathlib.Path(__file__).parent
BOOK = HERE.parents[2] / "book" / "src" / "notebooks"

# Pictures as SVG whose bytes do not depend on the day or the run.
SETUP = """
import matplotlib
import matplotlib_inline.backend_inline
matplotlib_inline.backend_inline.set_matplotlib_formats("svg")
matplotlib.rcParams["svg.hashsalt"] = "ndof"
"""


def run(notebook):
    """The notebook with its outputs; an error in a cell is raised."""
    read = nbformat.read(notebook, as_version=4)
    read.cells.insert(0, nbformat.v4.new_code_cell(SETUP))
    nbclient.NotebookClient(read, timeout=600, kernel_name="python3").execute()
    del read.cells[0]
    return read


def source(cell):
    """A cell as the page shows it."""
    return cell.source if cell.cell_type == "markdown" else f"```python\n{cell.source}\n```"


def outputs(cell, name, pictures):
    """What a cell gave: text as text, tables as HTML, pictures as files whose names are returned in `pictures`."""
    for output in cell.get("outputs", []):
        data = output.get("data", {})
        if output.output_type == "stream":
            yield f"```text\n{output.text.rstrip()}\n```"
        elif "image/svg+xml" in data:
            file = f"{name}-{len(pictures) + 1}.svg"
            pictures[file] = without_date(data["image/svg+xml"])
            yield f"![]({file})"
        elif "text/html" in data:
            plain = re.sub(r"<style.*?</style>| style=\"[^\"]*\"", "", data["text/html"], flags=re.S)
            yield "\n".join(line for line in plain.splitlines() if line.strip())
        elif "text/plain" in data:
            yield f"```text\n{data['text/plain']}\n```"


def without_date(svg):
    """The picture without the day on which it was drawn."""
    if not svg.lstrip().startswith("<"):
        svg = base64.b64decode(svg).decode()
    return "\n".join(line.rstrip() for line in svg.splitlines() if "<dc:date>" not in line) + "\n"


def page(notebook):
    """The page and its pictures by file name."""
    name, pictures = notebook.stem, {}
    blocks = []
    for cell in run(notebook).cells:
        blocks += [source(cell), *outputs(cell, name, pictures)]
    blocks.append(f"*This page is the notebook `crates/python/notebooks/{notebook.name}`, run by `crates/python/notebooks/to_book.py`.*")
    return {f"{name}.md": "\n\n".join(blocks) + "\n", **pictures}


if __name__ == "__main__":
    wanted = sys.argv[1:] or [path.stem for path in sorted(HERE.glob("*.ipynb"))]
    BOOK.mkdir(exist_ok=True)
    for stem in wanted:
        for file, text in page(HERE / f"{stem}.ipynb").items():
            (BOOK / file).write_text(text, encoding="utf-8")
            print(BOOK / file)
