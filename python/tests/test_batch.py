"""Batches are sweeps."""

import csv
import subprocess
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

import scram


@pytest.fixture(scope="module")
def robot(root: Path) -> scram.Robot:
    return scram.Robot(root / "robot.toml")


def test_a_batch_measures_what_a_sweep_measures(
    robot: scram.Robot, command: str, root: Path, tmp_path: Path
) -> None:
    axes = ["--axis", "ground.friction=0.6,0.8", "--axis", "f=-7,7"]
    options = ["--seconds", "0.4", "--repeats", "2", "--seed", "5", "--out", str(tmp_path)]
    subprocess.run([command, "sweep", *axes, *options], cwd=root, check=True, capture_output=True)
    with (tmp_path / "sweep.csv").open() as table:
        rows = list(csv.DictReader(table))
    friction = np.array([0.6, 0.6, 0.8, 0.8])
    drives = ["freq:-7", "freq:7"] * 2
    batch = scram.simulate_batch(
        robot, drives, parameters={"ground.friction": friction}, seeds=[5, 6], seconds=0.4, one_robot=True
    )
    assert batch.vx_mm_per_s.shape == (4, 2)
    for name in ("vx_mm_per_s", "vy_mm_per_s", "yaw_deg_per_s", "energy_j", "roundness"):
        measured = np.array([float(row[name]) for row in rows]).reshape(4, 2)
        np.testing.assert_array_equal(getattr(batch, name), measured, name)
    assert batch.path_mm.shape == (4, 2, 201, 2) and batch.path_s[-1] == 0.4
    assert np.all(batch.path_mm[:, :, 0] == 0.0) and np.all(np.isfinite(batch.path_mm))


def test_a_batch_is_a_data_frame_with_a_row_for_each_point_and_seed(robot: scram.Robot) -> None:
    friction = np.array([0.6, 0.8])
    batch = scram.simulate_batch(
        robot, ["freq:7", "freq:-7"], parameters={"ground.friction": friction}, seeds=[3, 4, 5], seconds=0.2, turned_by="ideal"
    )
    assert repr(batch) == "<scram.Batch of 2 points with 3 seeds, paths of 201 times>"
    frame = batch.to_pandas()
    assert list(frame["drive"]) == ["freq:7"] * 3 + ["freq:-7"] * 3
    assert list(frame["ground.friction"]) == [0.6] * 3 + [0.8] * 3
    assert list(frame["seed"]) == [3, 4, 5] * 2
    measures = [field.name for field in fields(batch) if getattr(batch, field.name).__class__ is np.ndarray]
    measures = [name for name in measures if name not in ("seeds", "path_mm", "path_s")]
    assert list(frame.columns) == ["drive", "ground.friction", "seed", *measures]
    for name in measures:
        np.testing.assert_array_equal(frame[name], getattr(batch, name).ravel(), name)


def test_threads_change_nothing(robot: scram.Robot) -> None:
    def run(threads: int) -> scram.Batch:
        seeds = np.arange(12)
        return scram.simulate_batch(robot, seeds=seeds, seconds=0.2, turned_by="ideal", threads=threads)

    one, two = run(1), run(2)
    np.testing.assert_array_equal(one.path_mm, two.path_mm)
    assert len(np.unique(one.vx_mm_per_s)) == 12, "every seed is a run of its own"


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"parameters": {"ground.frictoin": 0.5}}, "no such quantity"),
        ({"parameters": {"f": [6, 7]}}, "what the shaft does is said by `drive`"),
        ({"parameters": {"alpha": [0, 60, 90]}, "drive": ["freq:7", "freq:8"]}, "there are 3 points, but drive has 2"),
        ({"parameters": {"alpha": [[0, 60]]}}, "shape"),
        ({"parameters": {"alpha": []}}, "not empty"),
        ({"drive": "position:30"}, "a batch turns or swings"),
        ({"drive": "freq:99"}, "99"),
        ({"seeds": [0.5]}, "whole numbers"),
        ({"seeds": [-1]}, "whole numbers"),
        ({"seconds": 0.0}, "seconds must be"),
        ({"threads": -1}, "threads: -1 is not a whole number from 0"),
        ({"step_s": 3e-4}, "does not go into"),
        ({"turned_by": "hand"}, "`motor` or `ideal`"),
    ],
)
def test_wrong_input_says_what_to_do(robot: scram.Robot, arguments: dict[str, object], says: str) -> None:
    with pytest.raises(scram.InputError, match=says):
        scram.simulate_batch(robot, **arguments)  # type: ignore[arg-type]


def test_a_robot_without_a_body_cannot_walk(root: Path) -> None:
    bench = scram.Robot(root / "robots" / "bench-linear.toml")
    with pytest.raises(scram.InputError, match="body"):
        scram.simulate_batch(bench)
