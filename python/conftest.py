"""What tests and doctests need."""

import os
import shutil
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

import pytest

ROOT = Path(__file__).resolve().parents[1]


def missing(what: str) -> NoReturn:
    """Skips, and says so; where ``SCRAM_ALL_PEERS`` is 1, as on the machine that checks every change, it fails."""
    if os.environ.get("SCRAM_ALL_PEERS") == "1":
        pytest.fail(f"{what} (SCRAM_ALL_PEERS is 1)")
    pytest.skip(what, allow_module_level=True)


def peer(name: str) -> Any:
    """A module that some tests need and the package does not."""
    try:
        return import_module(name)
    except ImportError as error:
        missing(f"{name} is not installed: {error}")


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
        missing("no `scram` to compare with: cargo build -p scram, or name one by $SCRAM")
    return found


@pytest.fixture(autouse=True)
def _in_the_root(monkeypatch: pytest.MonkeyPatch) -> None:
    """Paths in examples are those that a person in the project's root types."""
    monkeypatch.chdir(ROOT)
