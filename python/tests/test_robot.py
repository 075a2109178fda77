"""Robot files from Python."""

from pathlib import Path

import pytest

import scram


def test_a_robot_has_its_name(root: Path) -> None:
    assert scram.Robot(root / "robot.toml").name == "scram-26"


def test_a_missing_file_is_a_file_not_found_error(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="no such file") as caught:
        scram.Robot(tmp_path / "none.toml")
    assert isinstance(caught.value, scram.ScramError)
