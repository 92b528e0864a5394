"""The notebook runs from its first cell to its last, and gives what it shows."""

from __future__ import annotations

import os

import pytest


def texts(cell):
    """Texts that a cell gives; pictures are not compared."""
    shown = []
    for output in cell.get("outputs", []):
        text = output.get("text", output.get("data", {}).get("text/plain", ""))
        shown.append("".join(text) if "image/png" not in output.get("data", {}) else "a picture")
    return shown


def test_the_notebook_gives_what_it_shows(root, tmp_path):
    for package in "nbclient", "ipykernel", "matplotlib", "pandas":
        pytest.importorskip(package)
    import nbformat
    from nbclient import NotebookClient

    path = root / "examples" / "axis.ipynb"
    stored = nbformat.read(path, as_version=4)
    fresh = nbformat.read(path, as_version=4)
    NotebookClient(fresh, timeout=300, kernel_name="python3", resources={"metadata": {"path": str(tmp_path)}}).execute()
    for cell in fresh.cells:
        # Times of execution differ from run to run.
        cell.metadata.pop("execution", None)
    if os.environ.get("UPDATE_EXPECT"):
        nbformat.write(fresh, path)
        return
    code = [(old, new) for old, new in zip(stored.cells, fresh.cells) if old.cell_type == "code"]
    assert len(code) >= 8
    for old, new in code:
        assert texts(new) == texts(old), old.source
    assert [text for _, new in code for text in texts(new)].count("a picture") >= 1
