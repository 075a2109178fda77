"""Robot files from Python."""

import os
import pickle
import subprocess
import sys
import warnings
from pathlib import Path

import pytest

import scram


@pytest.fixture(scope="module")
def robot(root: Path) -> scram.Robot:
    return scram.Robot(root / "robot.toml")


def test_a_robot_has_name_and_quantities(robot: scram.Robot) -> None:
    assert robot.name == "scram-26" and robot.has_body
    resistance = robot.quantities["motor.resistance_ohm"]
    assert resistance.low <= resistance.value <= resistance.high
    assert resistance.source


def test_overrides_change_what_they_name_and_nothing_else(root: Path, robot: scram.Robot) -> None:
    other = scram.Robot(root / "robot.toml", **{"motor.resistance_ohm": 18.5})
    changed = {path for path, quantity in other.quantities.items() if quantity != robot.quantities[path]}
    assert changed == {"motor.resistance_ohm"}
    assert other.quantities["motor.resistance_ohm"].value == 18.5
    assert robot.replace(**{"motor.resistance_ohm": 18.5}).text == other.text


@pytest.mark.parametrize(
    ("overrides", "says"),
    [
        ({"motor.resistence_ohm": 18.0}, "help: near are motor.resistance_ohm"),
        ({"motor.resistance_ohm": -1.0}, "motor.resistance_ohm=-1"),
        ({"motor.resistance_ohm": float("nan")}, "not a finite number"),
        ({"motor.resistance_ohm": "much"}, "not a finite number"),
        ({"motor.resistance_ohm": "18"}, "motor.resistance_ohm='18': not a finite number"),
        ({"alpha": 90.0}, "help: near are backbone.alpha_deg"),
    ],
)
def test_a_wrong_override_says_what_to_do(robot: scram.Robot, overrides: dict[str, float], says: str) -> None:
    with pytest.raises(scram.InputError, match=says):
        robot.replace(**overrides)


def test_a_missing_file_is_a_file_not_found_error(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="no such file") as caught:
        scram.Robot(tmp_path / "none.toml")
    assert isinstance(caught.value, scram.ScramError)


def test_an_implausible_override_is_warned_of(root: Path, robot: scram.Robot) -> None:
    says = r"motor.resistance_ohm=18 is outside the 12.75 … 17.25 that the robot file thinks plausible"
    for make in (robot.replace, lambda **overrides: scram.Robot(root / "robot.toml", **overrides)):
        with pytest.warns(UserWarning, match=says) as told:
            make(**{"motor.resistance_ohm": 18.0, "ground.friction": 0.7})
        assert len(told) == 1 and told[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        robot.replace(**{"motor.resistance_ohm": 17.25})


def test_a_table_is_no_robot_file_and_says_so_in_a_few_lines(tmp_path: Path) -> None:
    table = tmp_path / "run.csv"
    table.write_text("t_s,duty,adc\n" + "".join(f"{0.001 * i:.3f},1,1000\n" for i in range(2000)))
    with pytest.raises(scram.InputError, match=r"(?s)run\.csv:1: .*other mistakes: is this a robot file") as caught:
        scram.Robot(table)
    assert str(caught.value).count("\n") < 25


def test_a_broken_file_says_line_and_field(tmp_path: Path, root: Path) -> None:
    text = (root / "robot.toml").read_text().replace("resistance_ohm = { value = ", "resistance_ohm = { value = -")
    broken = tmp_path / "broken.toml"
    broken.write_text(text)
    with pytest.raises(ValueError, match=r"broken\.toml:\d+: motor\.resistance_ohm"):
        scram.Robot(broken)


@pytest.mark.parametrize("seed", [-1, 2**64])
def test_a_seed_is_a_number_that_the_engine_holds(robot: scram.Robot, seed: int) -> None:
    with pytest.raises(scram.InputError, match=f"seed: {seed} is not a whole number from 0 to 18446744073709551615"):
        robot.draw(seed)
    with pytest.raises(TypeError):
        robot.draw(1.5)  # type: ignore[arg-type]


def test_draws_stay_within_the_spreads_and_come_again(robot: scram.Robot) -> None:
    one, again, other = robot.draw(3), robot.draw(3), robot.draw(4)
    assert one.text == again.text != other.text
    resistance, spread = one.quantities["motor.resistance_ohm"], robot.quantities["motor.resistance_ohm"]
    assert resistance.value != spread.value
    assert spread.low <= resistance.value <= spread.high
    tick = "controller.tick_s"
    assert one.quantities[tick] == robot.quantities[tick]


def test_a_file_that_cannot_be_written_is_no_wrong_input(robot: scram.Robot, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(scram.ScramError, match="cannot be written") as caught:
        robot.write(tmp_path / "file" / "robot.toml")
    assert not isinstance(caught.value, scram.InputError)


def test_a_robot_with_a_base_survives_a_pickle_in_any_directory(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = Path("robots", "motor-136.toml")
    assert "base = " in (root / file).read_text()
    robot = scram.Robot(file).replace(**{"motor.resistance_ohm": 18.0})
    (tmp_path / "robot.pickle").write_bytes(pickle.dumps(robot))
    # It was found by a path that leads nowhere from here.
    monkeypatch.chdir(tmp_path)
    assert pickle.loads(pickle.dumps(robot)).quantities == robot.quantities
    again = robot.replace(**{"motor.resistance_ohm": 19.0})
    assert again.quantities["motor.resistance_ohm"].value == 19.0
    program = "import pickle; print(pickle.load(open('robot.pickle', 'rb')).quantities['motor.resistance_ohm'].value)"
    elsewhere = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, env=os.environ, check=True, capture_output=True, text=True
    )
    assert elsewhere.stdout == "18.0\n"


def test_a_robot_survives_a_file_and_a_pickle(robot: scram.Robot, tmp_path: Path) -> None:
    drawn = robot.draw(5)
    drawn.write(tmp_path / "drawn.toml")
    assert scram.Robot(tmp_path / "drawn.toml").quantities == drawn.quantities
    assert pickle.loads(pickle.dumps(drawn)).quantities == drawn.quantities
