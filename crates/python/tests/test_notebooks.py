"""The notebooks run, and the book's pages are theirs."""

import pathlib
import sys

import nbformat
import pytest

NOTEBOOKS = sorted((pathlib.Path(__file__).parents[1] / "notebooks").glob("*.ipynb"))
sys.path.insert(0, str(NOTEBOOKS[0].parent))

import to_book  # noqa: E402


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_and_its_page_shows_its_cells(notebook, root):
    # Cells that assert what the text claims raise here.
    made = to_book.page(notebook)
    page = (root / "book" / "src" / "notebooks" / f"{notebook.stem}.md").read_text(encoding="utf-8")
    for cell in nbformat.read(notebook, as_version=4).cells:
        assert to_book.source(cell) in page, "the page is older than the notebook: run notebooks/to_book.py"
        assert not cell.get("outputs"), "a notebook is kept without outputs"
    for file in made:
        assert (root / "book" / "src" / "notebooks" / file).exists()
    assert f"notebooks/{notebook.stem}.md" in (root / "book" / "src" / "SUMMARY.md").read_text(encoding="utf-8")
