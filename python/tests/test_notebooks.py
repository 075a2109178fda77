"""The notebooks run from begin to end, and are stored without their outputs."""

import json
import os
import re
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
from conftest import peer

nbformat = peer("nbformat")
nbclient = peer("nbclient")

NOTEBOOKS = sorted((Path(__file__).resolve().parents[1] / "notebooks").glob("*.ipynb"))

# Where the notebook on a real servo looks for its recordings.
SERVO = os.environ.get("SCRAM_XL330", "../shared/data/xl330_csv")


def test_there_are_five() -> None:
    assert len(NOTEBOOKS) == 5


def read(path: Path, root: Path) -> Any:
    """A notebook, if what it reads is there."""
    if path.stem == "a_real_servo" and not (root / SERVO).is_dir():
        pytest.skip(f"{SERVO} is no folder: the recordings are not part of the project")
    return nbformat.read(path, as_version=4)


def execute(notebook: Any, directory: Path) -> None:
    nbclient.NotebookClient(notebook, timeout=600, resources={"metadata": {"path": str(directory)}}).execute()


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_begins_where_jupyter_begins(path: Path, root: Path) -> None:
    """In its own folder: its first cell finds the project's root, where the others then are."""
    notebook = read(path, root)
    notebook.cells = [cell for cell in notebook.cells if cell.cell_type == "code"][:1]
    notebook.cells.append(nbformat.v4.new_code_cell("print(Path.cwd())"))
    execute(notebook, path.parent)
    assert notebook.cells[-1].outputs[0].text == f"{root}\n"


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path: Path, root: Path) -> None:
    notebook = read(path, root)
    execute(notebook, root)
    outputs = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    assert any("image/png" in output.get("data", {}) for output in outputs), "no figure was drawn"
    assert not [output for output in outputs if output.get("name") == "stderr"], "something was said on stderr"


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_stored_without_outputs(path: Path) -> None:
    cells = [cell for cell in json.loads(path.read_text())["cells"] if cell["cell_type"] == "code"]
    assert cells and all(cell["outputs"] == [] and cell["execution_count"] is None for cell in cells)


def test_the_extra_brings_what_opens_and_runs_a_notebook(root: Path) -> None:
    extras = tomllib.loads((root / "python" / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    ours = [requirement for requirement in extras["notebook"] if requirement.startswith("scram[")]
    others = [extra for requirement in ours for extra in re.findall(r"\w+", requirement)[1:]]
    requirements = [requirement for extra in ("notebook", *others) for requirement in extras[extra]]
    brought = {"scram", "numpy"}.union(*(re.findall(r"^\w+", requirement) for requirement in requirements))
    assert "jupyterlab" in brought
    cells = [cell for path in NOTEBOOKS for cell in json.loads(path.read_text())["cells"] if cell["cell_type"] == "code"]
    lines = [line for cell in cells for line in cell["source"]]
    imported = {match[1] for line in lines if (match := re.match(r"(?:import|from) (\w+)", line))}
    assert imported - set(sys.stdlib_module_names) <= brought
