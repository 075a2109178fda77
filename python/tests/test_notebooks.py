"""The notebooks run from begin to end, and are stored without their outputs."""

import json
import os
from pathlib import Path

import pytest
from conftest import peer

nbformat = peer("nbformat")
nbclient = peer("nbclient")

NOTEBOOKS = sorted((Path(__file__).resolve().parents[1] / "notebooks").glob("*.ipynb"))

# Where the notebook on a real servo looks for its recordings.
SERVO = os.environ.get("SCRAM_XL330", "../shared/data/xl330_csv")


def test_there_are_five() -> None:
    assert len(NOTEBOOKS) == 5


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path: Path, root: Path) -> None:
    if path.stem == "a_real_servo" and not (root / SERVO).is_dir():
        pytest.skip(f"{SERVO} is no folder: the recordings are not part of the project")
    notebook = nbformat.read(path, as_version=4)
    nbclient.NotebookClient(notebook, timeout=600, resources={"metadata": {"path": str(root)}}).execute()
    outputs = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    assert any("image/png" in output.get("data", {}) for output in outputs), "no figure was drawn"
    assert not [output for output in outputs if output.get("name") == "stderr"], "something was said on stderr"


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_stored_without_outputs(path: Path) -> None:
    cells = [cell for cell in json.loads(path.read_text())["cells"] if cell["cell_type"] == "code"]
    assert cells and all(cell["outputs"] == [] and cell["execution_count"] is None for cell in cells)
