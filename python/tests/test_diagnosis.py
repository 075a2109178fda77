"""Diagnosis and identification from Python."""

import math
from collections.abc import Callable
from dataclasses import FrozenInstanceError, fields
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import pytest

import scram


@pytest.fixture(scope="module")
def example(root: Path) -> tuple[scram.Robot, list[Path]]:
    folder = root / "examples" / "hidden-effect"
    return scram.Robot(folder / "robot.toml"), sorted(folder.glob("*.csv"))


@pytest.fixture(scope="module")
def diagnosis(example: tuple[scram.Robot, list[Path]]) -> scram.Diagnosis:
    robot, runs = example
    return scram.diagnose(robot, runs[:-1], runs[-1:])


def test_the_hidden_effect_is_named(diagnosis: scram.Diagnosis) -> None:
    assert diagnosis.verdict == "explained"
    assert [cause.effect for cause in diagnosis.causes] == ["gravity_tilt"]
    assert diagnosis.after_rad < 0.5 * diagnosis.before_rad
    assert any(path.startswith("effects.gravity_tilt.") for path in diagnosis.robot.quantities)
    value, low, high = diagnosis.percent_removed
    assert low <= value <= high
    with pytest.raises(FrozenInstanceError):
        diagnosis.verdict = "nothing"  # type: ignore[misc]


def test_a_notebook_shows_the_report(diagnosis: scram.Diagnosis) -> None:
    shown = diagnosis._repr_html_()
    assert shown.startswith("<iframe srcdoc=") and "gravity_tilt" in shown
    assert "<script" not in diagnosis.html and diagnosis.html.startswith("<!DOCTYPE html>")


def test_a_run_is_fitted_on_or_judged_by(example: tuple[scram.Robot, list[Path]]) -> None:
    robot, runs = example
    last = len(runs) - 1
    with pytest.raises(scram.InputError, match=rf"{runs[-1].name} is there twice: it is fit\[{last}\] and holdout\[0\]"):
        scram.diagnose(robot, runs, runs[-1:])
    walker = scram.Robot("robot.toml")
    run = scram.simulate(walker, seconds=0.5)
    with pytest.raises(scram.InputError, match=r"^a run is there twice: it is fit\[0\] and holdout\[0\]"):
        scram.diagnose(walker, [run], [run])
    with pytest.raises(scram.InputError, match="no recording is held out"):
        scram.diagnose(robot, runs, [])
    with pytest.raises(scram.InputError, match="the effects of a shaft are"):
        scram.diagnose(robot, runs[:-1], runs[-1:], also_try=["gravity"])


def test_one_run_is_given_as_it_is(example: tuple[scram.Robot, list[Path]]) -> None:
    robot, runs = example
    run = scram.read(runs[0])
    for one in (run, runs[0], str(runs[0])):
        for what in (scram.diagnose, scram.identify_motor):
            with pytest.raises(scram.InputError, match=rf"{runs[0].name} is there twice: it is fit\[0\] and holdout\[0\]"):
                what(robot, one, one)
    with pytest.raises(scram.MissingFileError, match=r"none\.csv"):
        scram.diagnose(robot, "none.csv", run)
    with pytest.raises(scram.MissingFileError, match=r"none\.csv"):
        scram.identify_backbone(scram.Robot("robot.toml"), "none.csv")


@pytest.mark.parametrize(
    "result",
    [
        scram.BackboneFit,
        scram.Batch,
        scram.Cause,
        scram.Diagnosis,
        scram.MotorFit,
        scram.Number,
        scram.PotentiometerFit,
        scram.Release,
        scram.RobotFit,
        scram.WalkDiagnosis,
    ],
)
def test_help_says_what_every_field_is(result: type) -> None:
    said = {name.strip() for line in (result.__doc__ or "").splitlines() for name in line.split(",")}
    assert {field.name for field in fields(result)} <= said


def test_a_recording_of_another_rig_is_refused(root: Path, example: tuple[scram.Robot, list[Path]]) -> None:
    _, runs = example
    with pytest.raises(scram.InputError, match="is this the right robot file"):
        scram.diagnose(scram.Robot(root / "robots" / "motor-136.toml"), runs[:-1], runs[-1:])


def test_a_potentiometer_is_calibrated(root: Path) -> None:
    robot = scram.Robot(root / "robot.toml")
    run = scram.simulate(robot, "duty:1", seconds=2.5, bench=True)
    fit = scram.identify_potentiometer(robot, run)
    assert fit.after_rms_deg < 0.5 * fit.before_rms_deg
    assert fit._repr_html_().count("<svg") == 1
    better = scram.simulate(fit.robot, "freq:7", seconds=1.0, bench=True)
    plain = scram.simulate(robot, "freq:7", seconds=1.0, bench=True)
    assert better.metrics["estimate_rms_deg"] < plain.metrics["estimate_rms_deg"]


def test_a_motor_is_identified(example: tuple[scram.Robot, list[Path]]) -> None:
    robot, runs = example
    fit = scram.identify_motor(robot, runs[:-1], runs[-1:], resistance_ohm=robot.quantities["motor.resistance_ohm"].value)
    paths = {number.path for number in fit.numbers}
    assert {"motor.resistance_ohm", "motor.torque_constant_nm_per_a"} <= paths
    assert fit.noise_rad > 0.0 and all(one.low <= one.value <= one.high for one in fit.numbers)
    assert "motor.resistance_ohm" in fit._repr_html_()


def test_a_backbone_swings_the_same_from_a_file_and_from_arrays(root: Path) -> None:
    robot = scram.Robot(root / "robot.toml")
    files = sorted((root / "examples" / "backbone").glob("release-*.csv"))
    from_files = scram.identify_backbone(robot, files[:2])
    assert any(number.told for number in from_files.numbers)
    assert all(robot.quantities[one.path].value == one.file for one in from_files.numbers)

    def release(file: Path) -> scram.Release:
        table = np.genfromtxt(file, delimiter=",", names=True)
        names = [name for name in table.dtype.names or () if name.startswith("angle_")]
        axes = {name: axis for axis, name in enumerate("xyz")}
        angles = np.full((len(table), 3), np.nan)
        for name in names:
            _, axis, unit = name.split("_")
            angles[:, axes[axis]] = table[name] if unit == "rad" else np.radians(table[name])
        # Against the pose at rest, which of a file is taken from its last tenth.
        angles -= np.nanmean(angles[-len(angles) // 10 :], axis=0)
        return scram.Release(file.stem, table["t_s"], angles)

    from_arrays = scram.identify_backbone(robot, [release(file) for file in files[:2]])
    for one, other in zip(from_files.numbers, from_arrays.numbers, strict=True):
        # A file's three angles are made one rotation, those of arrays are one already: nearly the same where they are small.
        assert one.value == pytest.approx(other.value, rel=0.05)
    with pytest.raises(scram.InputError, match="wrong shape"):
        scram.identify_backbone(robot, [scram.Release("a", [0.0, 1.0], np.zeros((2, 2)))])


def test_the_walk_of_a_robot_that_is_its_file_lacks_nothing(root: Path) -> None:
    robot = scram.Robot(root / "robot.toml")
    rows: list[tuple[float, ...]] = []
    for alpha_deg in (30.0, 90.0):
        for f_hz in (-8.0, -6.0, 6.0, 8.0):
            walks = scram.simulate_batch(
                robot,
                f"freq:{f_hz:g}",
                parameters={"alpha": [alpha_deg]},
                seeds=range(2),
                seconds=0.4,
                turned_by="ideal",
                phase_noise_deg=0.0,
            )
            speeds = zip(walks.vx_mm_per_s[0], walks.vy_mm_per_s[0], walks.yaw_deg_per_s[0], strict=True)
            rows += [(f_hz, alpha_deg, *map(float, run)) for run in speeds]
    names = ("f_hz", "alpha_deg", "vx_mm_per_s", "vy_mm_per_s", "yaw_deg_per_s")
    measured = pandas.DataFrame(rows, columns=names)
    found = scram.diagnose_walk(robot, measured, holdout=[(-6.0, 90.0)], window_s=(0.2, 0.4))
    assert (found.verdict, found.causes) == ("nothing", ())
    assert found.log10_evidence_against_nothing < 2.0
    assert len(found.before) == 3 and found.before == found.after
    assert "Diagnosis of the walk" in found.html and "scram sweep --robot" not in found.html
    assert found._repr_html_().startswith("<iframe srcdoc=")
    with pytest.raises(scram.InputError, match="no run of 7 Hz and 90°"):
        scram.diagnose_walk(robot, measured, holdout=[(7.0, 90.0)])


def test_speeds_that_tell_nothing_are_refused(root: Path) -> None:
    robot = scram.Robot(root / "robot.toml")
    with pytest.raises(scram.InputError, match="no column alpha_deg"):
        scram.identify_robot(robot, {"f_hz": [7.0]})
    one = {name: [1.0] for name in ("f_hz", "alpha_deg", "vx_mm_per_s", "vy_mm_per_s", "yaw_deg_per_s")}
    with pytest.raises(scram.InputError, match="conditions with a speed"):
        scram.identify_robot(robot, one)


#: Of conditions enough for a fit.
CONDITIONS: dict[str, list[float]] = {
    "f_hz": [6.0, 7.0, 8.0] * 3,
    "alpha_deg": [60.0] * 3 + [90.0] * 3 + [120.0] * 3,
    **{name: [1.0] * 9 for name in ("vx_mm_per_s", "vy_mm_per_s", "yaw_deg_per_s")},
}


@pytest.mark.parametrize("call", [scram.identify_robot, scram.diagnose_walk])
@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"window_s": (2.0, 1.0)}, "speeds are not told from 2 s to 1 s"),
        ({"window_s": (1.0, 1.0)}, "the second one later, by 0.05 s at least"),
        ({"window_s": (0.0, math.inf)}, "speeds are not told from 0 s to inf s"),
        ({"window_s": (math.nan, 1.0)}, "speeds are not told"),
        ({"seed": -1}, "seed: -1 is not a whole number from 0"),
        ({"threads": -1}, "threads: -1 is not a whole number from 0"),
        ({"draws": -1}, "draws: -1 is not a whole number from 0"),
    ],
)
def test_numbers_that_a_walk_cannot_have_are_refused(
    root: Path, call: Callable[..., object], arguments: dict[str, Any], says: str
) -> None:
    with pytest.raises(scram.InputError, match=says):
        call(scram.Robot(root / "robot.toml"), CONDITIONS, **arguments)


@pytest.mark.parametrize("name", ["resistance_ohm", "inertia_kg_m2"])
@pytest.mark.parametrize("value", [0.0, -14.8, math.nan, math.inf])
def test_what_is_known_of_a_motor_is_a_positive_number(
    example: tuple[scram.Robot, list[Path]], name: str, value: float
) -> None:
    robot, runs = example
    with pytest.raises(scram.InputError, match=f"{name}: a positive number is expected"):
        scram.identify_motor(robot, runs[:1], runs[1:2], **{name: value})  # type: ignore[arg-type]


def test_whole_numbers_of_the_other_calls(example: tuple[scram.Robot, list[Path]]) -> None:
    robot, runs = example
    for call in (scram.diagnose, scram.identify_motor):
        with pytest.raises(scram.InputError, match="threads: -1 is not"):
            call(robot, runs[:1], runs[1:2], threads=-1)
        with pytest.raises(scram.InputError, match="seed: -1 is not"):
            call(robot, runs[:1], runs[1:2], seed=-1)
    with pytest.raises(scram.InputError, match="module: -1 is not"):
        scram.identify_backbone(robot, [], module=-1)


def test_speeds_come_from_a_capture(tmp_path: Path) -> None:
    table = tmp_path / "run.csv"
    # Along a heading of 30 degrees at 10 mm/s, and 3 mm/s to its left; it turns by 4 degrees a second.
    turned = np.deg2rad(30.0)
    lines = ["Time,x_mm,y_mm,yaw_deg"]
    for t_s in np.arange(0.0, 2.005, 0.01):
        ahead, left = 10.0 * t_s, 3.0 * t_s
        x, y = ahead * np.cos(turned) - left * np.sin(turned), ahead * np.sin(turned) + left * np.cos(turned)
        # It begins to turn when it is first looked at.
        lines.append(f"{t_s},{x},{y},{30.0 + 4.0 * max(0.0, t_s - 0.5)}")
    table.write_text("\n".join(lines))
    found = scram.captured_speeds(table, window_s=(0.5, 2.0), columns={"t_s": "Time"})
    assert found == pytest.approx((10.0, 3.0, 4.0), abs=1e-6)
    with pytest.raises(scram.InputError, match="is not seen with a heading from 1 s to 5 s"):
        scram.captured_speeds(table, window_s=(1.0, 5.0), columns={"t_s": "Time"})
    with pytest.raises(scram.InputError, match="window_s is two times"):
        scram.captured_speeds(table, window_s=(2.0, 1.0))
    with pytest.raises(scram.MissingFileError):
        scram.captured_speeds(tmp_path / "no.csv")
