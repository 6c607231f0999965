"""Each notebook of the examples runs in a kernel, and prints the numbers that it shows."""

import json
from pathlib import Path

import pytest

NOTEBOOKS = sorted((Path(__file__).resolve().parent.parent / "examples").glob("*.ipynb"))


def printed(cell):
    """Text of a cell's outputs, the representation of a value included."""
    outputs = [out.get("text") or out["data"]["text/plain"] for out in cell["outputs"]]
    return "".join(text if isinstance(text, str) else "".join(text) for text in outputs)


@pytest.mark.long
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_shows_what_it_shows_again(path):
    nbclient, nbformat = pytest.importorskip("nbclient"), pytest.importorskip("nbformat")
    kept = [cell for cell in json.loads(path.read_text("utf-8"))["cells"] if cell["cell_type"] == "code"]
    notebook = nbformat.read(path, as_version=4)
    nbclient.NotebookClient(notebook, resources={"metadata": {"path": path.parent}}).execute()
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert [printed(cell) for cell in cells] == [printed(cell) for cell in kept]
    pages = [
        out["data"]["text/html"]
        for cell in cells
        for out in cell.outputs
        if "text/html" in out.get("data", {})
    ]
    assert any("<table" in page and "<img" in page for page in pages), "a result is shown with its picture"


def test_there_are_three():
    assert len(NOTEBOOKS) == 3
