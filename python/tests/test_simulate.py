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
