"""Every notebook runs from top to bottom, in a folder of its own, and is kept without outputs."""

from __future__ import annotations

from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

FOLDER = Path(__file__).parents[1] / "notebooks"
# What runs smaller here than in the notebook.
SMALLER = {
    "2_your_recordings.ipynb": ("motors=200", "motors=100"),
    "4_sweep.ipynb": ("MOTORS = 24", "MOTORS = 2"),
}
NOTEBOOKS = sorted(path.name for path in FOLDER.glob("*.ipynb"))


def test_exact_there_are_four() -> None:
    assert len(NOTEBOOKS) == 4


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_tool_a_notebook_runs(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path))
    notebook = nbformat.read(FOLDER / name, as_version=4)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert code and not any(cell.outputs or cell.execution_count for cell in code)
    if name in SMALLER:
        (cell,) = (cell for cell in code if SMALLER[name][0] in cell.source)
        cell.source = cell.source.replace(*SMALLER[name])
    NotebookClient(notebook, timeout=120, resources={"metadata": {"path": str(tmp_path)}}).execute()
