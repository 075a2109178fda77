"""Recordings in numpy, pandas, Arrow, and back in files."""

import pickle
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import pytest

import scram


@pytest.fixture(scope="module")
def walk(root: Path) -> scram.Recording:
    return scram.simulate(scram.Robot(root / "robot.toml"), "freq:7", seconds=0.4, seed=2)


@pytest.mark.parametrize("name", ["run.csv", "run.mcap"])
def test_what_is_read_is_what_was_written_and_is_written_the_same(
    walk: scram.Recording, tmp_path: Path, name: str
) -> None:
    walk.write(tmp_path / name)
    read = scram.read(tmp_path / name)
    assert read.columns == walk.columns
    for column in walk.columns:
        assert read[column].dtype == walk[column].dtype
        np.testing.assert_array_equal(read[column], walk[column], column)
    assert read.metadata == walk.metadata and read.metadata["seed"] == 2
    assert read.commands == walk.commands
    assert read.notes == []
    again = tmp_path / f"again-{name}"
    read.write(again)
    # What viewers draw of a simulated run included.
    assert again.read_bytes() == (tmp_path / name).read_bytes()
    assert all((scram.read(again)[column] == walk[column]).all() for column in ("t_s", "x_m", "adc"))


def test_columns_are_numpy_arrays(walk: scram.Recording) -> None:
    assert walk["t_s"].shape == (400,) and walk["t_s"].dtype == np.float64
    assert walk["enable"].dtype == np.bool_
    assert np.isnan(walk["estimate_angle_rad"][0]), "nothing is believed before the angle is acquired"
    assert {"x_m", "y_m", "yaw_rad", "truth_angle_rad", "battery_adc", "state"} <= set(walk.columns)
    with pytest.raises(KeyError, match="no column `speed`; there are t_s"):
        walk["speed"]


def test_nobody_writes_to_a_column_and_each_is_made_once(walk: scram.Recording) -> None:
    for name in walk.columns:
        assert walk[name] is walk[name]
        with pytest.raises(ValueError, match="read-only"):
            walk[name][:] = walk[name]
    own = walk["duty"].copy()
    own[:] = 0.0
    assert np.any(walk["duty"] != 0.0)
    # Of a table in pandas everybody has a copy.
    frame = walk.to_pandas()
    frame.loc[:, "duty"] = 0.0
    assert np.any(walk["duty"] != 0.0)


def test_a_recording_survives_a_pickle(walk: scram.Recording, tmp_path: Path) -> None:
    walk.write(tmp_path / "run.csv")
    (tmp_path / "noted.csv").write_text("t_s,duty,angle_rad,colour\n0,0.5,0,red\n0.001,0.5,,red\n")
    numbers = {name: walk[name] for name in ("t_s", "duty", "adc", "battery_adc")}
    noted = scram.read(tmp_path / "noted.csv")
    assert noted.notes
    part = scram.read(tmp_path / "run.csv", from_s=0.1, to_s=0.2)
    made = scram.Recording(numbers, name="bench", metadata={"robot": "scram-26"})
    for run in (walk, scram.read(tmp_path / "run.csv"), part, noted, made):
        again = pickle.loads(pickle.dumps(run))
        assert again.columns == run.columns
        for column in run.columns:
            np.testing.assert_array_equal(again[column], run[column], column)
        for name in ("commands", "metadata", "metrics", "notes"):
            assert getattr(again, name) == getattr(run, name), name
    # It is called what it was called.
    robot = scram.Robot("robots/motor-136.toml")
    with pytest.raises(scram.InputError, match="bench: recorded on `scram-26`"):
        scram.identify_potentiometer(robot, pickle.loads(pickle.dumps(made)))


def test_pandas_and_arrow_have_every_column(walk: scram.Recording) -> None:
    frame, table = walk.to_pandas(), walk.to_arrow()
    assert list(frame.columns) == walk.columns == table.column_names
    assert len(frame) == len(walk) == table.num_rows
    np.testing.assert_array_equal(frame["duty"].to_numpy(), walk["duty"])


def test_a_missing_library_says_what_to_install(walk: scram.Recording, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(scram.ScramError, match=r"pip install 'scram\[arrow\]'"):
        walk.to_arrow()


def test_a_part_of_a_recording(walk: scram.Recording, tmp_path: Path) -> None:
    walk.write(tmp_path / "run.csv")
    part = scram.read(tmp_path / "run.csv", from_s=0.1, to_s=0.2)
    inside = (walk["t_s"] >= 0.1) & (walk["t_s"] <= 0.2)
    np.testing.assert_array_equal(part["duty"], walk["duty"][inside])


@pytest.mark.parametrize(
    ("name", "text", "error", "says"),
    [
        ("none.csv", None, FileNotFoundError, "none.csv"),
        ("run.txt", "t_s\n", ValueError, "run.txt"),
        ("run.csv", "t_s,duty,angle_rad\n0,0.5,x\n", ValueError, "line 2.*angle_rad.*`x` is not a number"),
        ("run.csv", "t_s,duty\n0,0.5\n", ValueError, "angle_rad"),
    ],
)
def test_a_file_that_cannot_be_used_says_why(
    tmp_path: Path, name: str, text: str | None, error: type[Exception], says: str
) -> None:
    if text is not None:
        (tmp_path / name).write_text(text)
    with pytest.raises(error, match=says) as caught:
        scram.read(tmp_path / name)
    assert isinstance(caught.value, scram.ScramError)


def test_a_file_that_cannot_be_written_says_why(walk: scram.Recording, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(scram.ScramError, match=r"run\.\w+: Not a directory"):
        walk.write(tmp_path / "file" / "run.csv")
    with pytest.raises(scram.ScramError, match="run.txt"):
        walk.write(tmp_path / "run.txt")


def test_columns_in_memory_are_a_recording_as_a_file_of_them_is(walk: scram.Recording, tmp_path: Path) -> None:
    numbers = [name for name in walk.columns if name not in ("state", "fault", "tracking")]
    columns = {name: walk[name] for name in numbers}
    made = scram.Recording(columns, metadata=walk.metadata)
    framed = scram.Recording(pandas.DataFrame(columns))
    assert set(made.columns) == set(framed.columns) == set(numbers)
    for column in numbers:
        np.testing.assert_array_equal(made[column], walk[column], column)
        np.testing.assert_array_equal(framed[column], walk[column], column)
    assert made.metadata == walk.metadata
    made.write(tmp_path / "made.csv")
    assert (scram.read(tmp_path / "made.csv")["adc"] == walk["adc"]).all()


def test_a_recordings_own_columns_make_it_again(walk: scram.Recording, tmp_path: Path) -> None:
    """Words and truth values included, by a mapping, by a data frame, and by the file that pandas writes of one."""
    walk.to_pandas().to_csv(tmp_path / "run.csv", index=False)
    mapping = scram.Recording({name: walk[name] for name in walk.columns})
    for made in (mapping, scram.Recording(walk.to_pandas()), scram.read(tmp_path / "run.csv")):
        assert made.columns == walk.columns
        assert made.notes == []
        for name in walk.columns:
            assert made[name].dtype.kind == walk[name].dtype.kind
            np.testing.assert_array_equal(made[name], walk[name], name)
    frame = pandas.read_csv(tmp_path / "run.csv")
    assert (scram.Recording(frame)["state"] == walk["state"]).all(), "an empty column of words is one of NaN there"


def test_columns_of_words_are_ignored_and_named() -> None:
    t_s = np.arange(5) * 1e-3
    columns: dict[str, Any] = {"t_s": t_s, "duty": t_s, "angle_rad": t_s, "enable": t_s > 1e-3, "colour": ["red"] * 5, "warm": t_s > 2e-3}
    for given in (columns, pandas.DataFrame(columns)):
        made = scram.Recording(given)
        assert made.columns == ["t_s", "enable", "duty", "angle_rad", "warm"]
        assert made["enable"].tolist() == [False, False, True, True, True]
        assert made["warm"].tolist() == [0.0, 0.0, 0.0, 1.0, 1.0]
        assert len(made.notes) == 1 and "colour" in made.notes[0]
    with pytest.raises(scram.InputError, match="column `duty`: it has words, and numbers are expected"):
        scram.Recording({**columns, "duty": ["much"] * 5})


def test_columns_that_are_no_recording_are_refused() -> None:
    t_s = np.arange(5) * 1e-3
    with pytest.raises(scram.InputError, match="no column `angle_rad`"):
        scram.Recording({"t_s": t_s, "duty": t_s})
    with pytest.raises(scram.InputError, match="`t_s` has 5 values, `duty` 4"):
        scram.Recording({"t_s": t_s, "duty": t_s[1:], "angle_rad": t_s})
    for duty in (np.zeros((5, 2)), 0.5, [[1.0], [1.0, 2.0]]):
        with pytest.raises(scram.InputError, match="column `duty`"):
            scram.Recording({"t_s": t_s, "duty": duty, "angle_rad": t_s})
    with pytest.raises(scram.InputError, match="column 0: its name is no text"):
        scram.Recording(pandas.DataFrame(np.zeros((5, 3))))
    with pytest.raises(scram.InputError, match="bench-3, entry 2, column `duty`.*7 is outside"):
        scram.Recording({"t_s": t_s, "duty": [0, 7, 0, 0, 0], "angle_rad": t_s}, name="bench-3")
