"""What tests and doctests need."""

import os
import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def root() -> Path:
    """The project's root, with robot.toml, robots/ and examples/."""
    return ROOT


@pytest.fixture(scope="session")
def command() -> str:
    """The `scram` command, to compare with: $SCRAM, or what was built last in the project."""
    built = [os.environ.get("SCRAM", ""), *(str(ROOT / "target" / profile / "scram") for profile in ("debug", "release"))]
    found = next(filter(None, map(shutil.which, built)), None)
    if found is None:
        pytest.skip("no `scram` to compare with: cargo build -p scram, or name one by $SCRAM")
    return found


@pytest.fixture(autouse=True)
def _in_the_root(monkeypatch: pytest.MonkeyPatch) -> None:
    """Paths in examples are those that a person in the project's root types."""
    monkeypatch.chdir(ROOT)
