"""Runs from Python are those of the command line, bit for bit."""

import subprocess
from pathlib import Path

import numpy as np
import pytest

import scram


@pytest.fixture(scope="module")
def robot(root: Path) -> scram.Robot:
    return scram.Robot(root / "robot.toml")


def test_a_walk_is_the_command_lines(robot: scram.Robot, command: str, root: Path, tmp_path: Path) -> None:
    arguments = ["sim", "--drive", "freq:-7", "--seconds", "0.5", "--seed", "3", "--out", str(tmp_path / "sim")]
    subprocess.run([command, *arguments], cwd=root, check=True, capture_output=True)
    run = scram.simulate(robot, "freq:-7", seconds=0.5, seed=3)
    for name in ("run.csv", "run.mcap"):
        run.write(tmp_path / name)
        assert (tmp_path / name).read_bytes() == (tmp_path / "sim" / name).read_bytes(), name


def test_faults_and_the_bench(robot: scram.Robot) -> None:
    run = scram.simulate(robot, "freq:7", seconds=1.0, bench=True, faults="sensor-open@0.5")
    assert "x_m" not in run
    assert run.metrics["faults"][0]["injected"] == "sensor-open"
    assert run["state"][-1] == "Fault" and not run["enable"][-1]
    assert run["state"][400] == "Speed" and run["enable"][400]


def test_another_controller_decides_otherwise(robot: scram.Robot) -> None:
    other = robot.replace(**{"motor.resistance_ohm": 25.0})
    own = scram.simulate(other, "freq:3", seconds=1.0, bench=True)
    given = scram.simulate(other, "freq:3", seconds=1.0, bench=True, designed_from=robot)
    assert np.any(own["duty"] != given["duty"])


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"drive": "freq:99"}, "the frequency must be from"),
        ({"drive": "spin:3"}, "help: freq:HZ"),
        ({"seconds": 0.0}, "seconds must be a number above 0"),
        ({"seconds": float("nan")}, "seconds must be a number above 0"),
        ({"faults": "sensor-open"}, "no `@SECONDS`"),
        ({"faults": "sensor-open@9"}, "it would never come"),
        ({"seed": -1}, "seed: -1 is not a whole number from 0 to 18446744073709551615"),
    ],
)
def test_wrong_input_says_what_to_do(robot: scram.Robot, arguments: dict[str, object], says: str) -> None:
    with pytest.raises(scram.InputError, match=says):
        scram.simulate(robot, **arguments)  # type: ignore[arg-type]


def test_a_script_that_is_not_there(robot: scram.Robot) -> None:
    with pytest.raises(FileNotFoundError, match="check the name after script:"):
        scram.simulate(robot, "script:/nowhere/at/all")


def test_a_gait_by_its_name_is_found_beside_the_robot(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for file in (root / "robot.toml", root / "robots" / "thesis.toml"):
        robot = scram.Robot(file)
        run = scram.simulate(robot, "gait:turn-right", seconds=0.2)
        assert run.commands[-1][1] == "gait turn-right"
        scram.Controller(robot).command("gait turn-right")
    with pytest.raises(scram.MissingFileError, match=r"(?s)no gait `none`: there is no robots/gaits/none\.toml and no .*turn-right"):
        scram.simulate(robot, "gait:none")
    with pytest.raises(scram.MissingFileError, match="no gait `mine.toml`"):
        scram.simulate(robot, "gait:mine.toml")
    (tmp_path / "mine.toml").write_text("name = 3\n")
    with pytest.raises(scram.InputError, match=r"mine\.toml:1: name"):
        scram.simulate(robot, "gait:mine.toml")


def test_the_controllers_time_does_not_go_backwards(robot: scram.Robot) -> None:
    controller = scram.Controller(robot)
    sample = {"angle": 2048, "battery": 2600}
    controller.tick(time_us=1000, **sample)
    controller.tick(time_us=1000, **sample)
    with pytest.raises(scram.InputError, match="time_us: 999 is before 1000, the time of the last tick"):
        controller.tick(time_us=999, **sample)
    assert controller.telemetry["time_us"] == 1000


def test_help_says_what_is_there(robot: scram.Robot) -> None:
    """Every figure of a walk, every member of the telemetry, every fault, and the forms of a drive."""
    run = scram.simulate(robot, seconds=0.2)
    said = scram.Recording.metrics.__doc__ or ""
    assert all(f"``{name}``" in said for name in (*run.metrics, *run.metrics["walk"]) if name != "clamped")
    said = scram.Controller.telemetry.__doc__ or ""
    assert all(f"``{name}``" in said for name in scram.Controller(robot).telemetry)
    said = scram.simulate.__doc__ or ""
    with pytest.raises(scram.InputError) as caught:
        scram.simulate(robot, faults="none@1")
    faults = str(caught.value).partition("the names are ")[2].split(", ")
    assert len(faults) > 10 and all(f"``{name.removeprefix('second-')}``" in said for name in faults)
    assert "gait:NAME" in said and "different specimens" in said


def test_the_controller_decides_a_recording_again_bit_for_bit(robot: scram.Robot) -> None:
    run = scram.simulate(robot, "oscillate:-100..100", seconds=1.0, faults="link-lost@0.6")
    controller = scram.Controller(robot)
    commands = iter([*run.commands, (len(run), "", False)])
    row, words, _ = next(commands)
    time_us, adc, battery = (run[name].astype(np.uint64) for name in ("time_us", "adc", "battery_adc"))
    duty = np.empty(len(run))
    enable = np.empty(len(run), dtype=bool)
    for tick in range(len(run)):
        while row == tick:
            controller.command(words, int(time_us[tick]))
            row, words, _ = next(commands)
        actuation = controller.tick(int(time_us[tick]), int(adc[tick]), int(battery[tick]))
        duty[tick], enable[tick] = actuation.duty, actuation.enable
    assert duty.tobytes() == run["duty"].tobytes()
    assert np.array_equal(enable, run["enable"])
    assert np.count_nonzero(duty) > 500


def test_a_controller_refuses_what_the_robot_refuses(robot: scram.Robot) -> None:
    controller = scram.Controller(robot)
    with pytest.raises(scram.InputError, match="the robot refuses `freq 99`: the frequency must be from"):
        controller.command("freq:99")
    sample = {"time_us": 0, "angle": 2048, "battery": 2600}
    for name, value in [("angle", 70_000), ("battery", -1), ("time_us", -1), ("second", 65_536)]:
        with pytest.raises(scram.InputError, match=f"{name}: {value} is not a whole number from 0 to"):
            controller.tick(**{**sample, name: value})
    with pytest.raises(scram.InputError, match="time_us: -5 is not"):
        controller.command("freq:7", time_us=-5)
    assert controller.tick_s == pytest.approx(1e-3)
    assert controller.telemetry["state"] == "Idle"
