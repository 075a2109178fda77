"""The environments as Gymnasium uses them."""

import dataclasses
import math
import os
import shutil
import subprocess
import sys
import threading
import time
import warnings
import webbrowser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import peer

gymnasium = peer("gymnasium")

from gymnasium.utils.env_checker import check_env  # noqa: E402
from gymnasium.vector import AutoresetMode, SyncVectorEnv  # noqa: E402
from gymnasium.wrappers.vector import RecordEpisodeStatistics  # noqa: E402

import scram  # noqa: E402
import scram.envs  # noqa: E402

NAMES = ["scram/Turn-v0", "scram/Straight-v0", "scram/Maze-v0"]
SHORT: dict[str, Any] = {"interval_s": 0.04, "episode_s": 0.2}
VARIED: dict[str, Any] = {"randomize": 1.0, "start_position_m": 0.01, "start_heading_rad": 0.3}


def actions(environment: int, step: int) -> int:
    """Of environment i, whatever company it has."""
    return (3 * environment + 7 * step + step * step) % 10


@pytest.mark.parametrize("definition", [scram.envs.Turn, scram.envs.Straight, scram.envs.Maze])
def test_every_default_is_the_engines(definition: type[scram.envs.Definition]) -> None:
    defaults = dataclasses.asdict(definition())
    engines = scram._scram.environment_defaults(definition.task)
    assert {name: list(value) if isinstance(value, tuple) else value for name, value in defaults.items()} == engines


@pytest.mark.parametrize("drive", ["exact", "motor"])
@pytest.mark.parametrize("name", NAMES)
def test_gymnasiums_checker_has_nothing_to_say(name: str, drive: str) -> None:
    env = gymnasium.make(name, drive=drive, render_mode="rgb_array", **SHORT)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped)


@pytest.mark.parametrize("name", NAMES)
def test_make_vec_is_the_engines_own(name: str) -> None:
    envs = gymnasium.make_vec(name, num_envs=5, **SHORT)
    assert isinstance(envs.unwrapped, scram.envs.RobotVectorEnv)
    assert envs.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    observations, infos = envs.reset(seed=3)
    assert envs.observation_space.contains(observations)
    assert infos["pose"].shape == (5, 3)
    observations, rewards, terminated, truncated, _ = envs.step(envs.action_space.sample())
    assert observations.dtype == np.float32
    assert rewards.dtype == np.float64
    assert terminated.dtype == truncated.dtype == np.bool_
    assert np.isfinite(rewards).all()


@pytest.mark.parametrize("drive", ["exact", "motor"])
def test_an_episode_does_not_depend_on_the_number_of_environments(drive: str) -> None:
    """Environment i of 1, of 3 and of 8: equal in every bit, over the end of an episode."""

    def history(count: int, first_seed: int, followed: int) -> list[bytes]:
        envs = gymnasium.make_vec("scram/Turn-v0", num_envs=count, drive=drive, **SHORT, **VARIED)
        observations, _ = envs.reset(seed=first_seed)
        rows = [observations[followed].tobytes()]
        for step in range(12):
            given = np.array([actions(first_seed + i, step) for i in range(count)])
            observations, rewards, _, truncated, infos = envs.step(given)
            of_one = [observations[followed], rewards[followed], truncated[followed], infos["pose"][followed]]
            rows += [np.asarray(value).tobytes() for value in of_one]
        return rows

    alone = history(1, 5, 0)
    assert history(3, 4, 1) == alone
    assert history(8, 0, 5) == alone
    assert history(1, 6, 0) != alone


def test_one_environment_is_one_of_many() -> None:
    """``make`` and Gymnasium's own SyncVectorEnv of it give what ``make_vec`` gives."""
    many = gymnasium.make_vec("scram/Straight-v0", num_envs=3, **SHORT, **VARIED)
    make = [lambda: gymnasium.make("scram/Straight-v0", **SHORT, **VARIED)] * 3
    same = SyncVectorEnv(make)
    np.testing.assert_array_equal(many.reset(seed=11)[0], same.reset(seed=11)[0])
    for step in range(12):
        given = np.array([actions(i, step) for i in range(3)])
        for mine, theirs in zip(many.step(given)[:4], same.step(given)[:4], strict=True):
            np.testing.assert_array_equal(mine, theirs)


def assert_same(mine: Any, theirs: Any, place: str) -> None:
    """Equal in every value and type, dictionaries and arrays of objects included."""
    if isinstance(theirs, dict):
        assert set(mine) == set(theirs), place
        for key in theirs:
            assert_same(mine[key], theirs[key], f"{place}[{key!r}]")
    elif isinstance(theirs, tuple) or (isinstance(theirs, np.ndarray) and theirs.dtype == object):
        assert type(mine) is type(theirs), place
        for i, (one, other) in enumerate(zip(mine, theirs, strict=True)):
            assert_same(one, other, f"{place}[{i}]")
    else:
        assert type(mine) is type(theirs) and getattr(mine, "dtype", None) == getattr(theirs, "dtype", None), place
        np.testing.assert_array_equal(mine, theirs, place)


@pytest.fixture(scope="module")
def weak(root: Path) -> scram.Robot:
    """A robot whose motor cannot turn its shaft: the supervisor stops it after a time that differs from episode to episode."""
    return scram.Robot(root / "robot.toml", **{"motor.resistance_ohm": 120.0})


@pytest.mark.parametrize("drive", ["exact", "motor"])
@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_the_three_ways_to_reset(mode: AutoresetMode, drive: str, weak: scram.Robot) -> None:
    """Next step, same step and disabled, beside Gymnasium's SyncVectorEnv: the same in everything, ends at different times and faults
    included.
    """
    options = {**VARIED, "interval_s": 0.04, "episode_s": 0.26, "drive": drive, "robot": weak, "randomized": ["ground"]}
    many = gymnasium.make_vec("scram/Turn-v0", num_envs=4, autoreset_mode=mode, **options)
    assert many.metadata["autoreset_mode"] is mode
    same = SyncVectorEnv([lambda: gymnasium.make("scram/Turn-v0", **options)] * 4, autoreset_mode=mode)
    assert_same(many.reset(seed=2), same.reset(seed=2), "reset")

    def reset(mask: list[bool], seed: Any = None) -> None:
        mine, theirs = (envs.reset(seed=seed, options={"reset_mask": np.array(mask)}) for envs in (many, same))
        assert_same(mine, theirs, f"reset of {mask}")

    ended, faults = [], set()
    for step in range(20):
        given = np.array([actions(i, step) for i in range(4)])
        mine, theirs = many.step(given), same.step(given)
        assert_same(mine, theirs, f"step {step}")
        over = mine[2] | mine[3]
        ended += [over.tolist()] if over.any() else []
        faults |= set(mine[4].get("final_info", mine[4]).get("fault", ())) - {None}
        if over.any() and mode is AutoresetMode.DISABLED:
            with pytest.raises(ValueError, match="have ended"):
                many.step(given)
            reset(over.tolist())
        if step == 2:
            # From here on they end at different times.
            reset([False, True, False, True], [None, 7, None, None])
    assert not all(map(all, ended)), "never only some of them"
    assert np.all(np.sum(ended, axis=0) >= 2), "every one of them ended, and again"
    assert bool(faults) == (drive == "motor"), faults


def test_statistics_of_episodes_are_gymnasiums() -> None:
    envs = RecordEpisodeStatistics(gymnasium.make_vec("scram/Turn-v0", num_envs=2, **SHORT))
    envs.reset(seed=1)
    for _ in range(4):
        envs.step(np.array([1, 8]))
    infos = envs.step(np.array([1, 8]))[4]
    assert infos["episode"]["l"].tolist() == [5, 5]
    assert (infos["episode"]["r"] < 0).all()


def test_the_reward_is_equation_5_5() -> None:
    env = gymnasium.make("scram/Turn-v0", direction="right", yaw_rate_rad_per_s=0.3, k_rot=2.0, k_pos=500.0).unwrapped
    _, info = env.reset(seed=4)
    start = before = info["pose"]
    for step in range(30):
        observation, reward, _, _, info = env.step(actions(1, step))
        x, y, heading = info["pose"]
        turned = math.remainder(heading - before[2], 2.0 * math.pi) / env.definition.interval_s
        # ω is clockwise here, θ counter-clockwise.
        expected = -((turned + 0.3) ** 2) * 2.0 - ((x - start[0]) ** 2 + (y - start[1]) ** 2) * 500.0
        assert reward == pytest.approx(expected, rel=1e-9)
        seen = np.array([(x - start[0]) / 0.01, (y - start[1]) / 0.01, heading])
        np.testing.assert_allclose(observation, seen, rtol=1e-5, atol=1e-6)
        before = info["pose"]


def test_there_are_ten_frequencies_of_both_signs() -> None:
    env = gymnasium.make("scram/Turn-v0").unwrapped
    assert env.action_space == gymnasium.spaces.Discrete(10)
    frequencies = np.array(env.definition.frequencies_hz)
    np.testing.assert_array_equal(frequencies, -frequencies[::-1])
    assert ((np.abs(frequencies) >= 6) & (np.abs(frequencies) <= 8)).all()


def test_an_unseeded_environment_goes_its_own_way() -> None:
    episodes = {gymnasium.make("scram/Turn-v0").reset()[1]["episode_seed"] for _ in range(3)}
    assert len(episodes) == 3
    env = gymnasium.make("scram/Turn-v0")
    first = env.reset(seed=1)[1]["episode_seed"]
    assert first == 1
    assert env.reset()[1]["episode_seed"] != first
    assert env.reset(seed=1)[1]["episode_seed"] == first


def test_any_episode_comes_again_by_its_seed() -> None:
    def walked(env: Any, **seed: int) -> tuple[int, list[bytes]]:
        observation, info = env.reset(**seed)
        return info["episode_seed"], [observation.tobytes(), *(env.step(actions(1, k))[0].tobytes() for k in range(5))]

    options = {"drive": "motor", **SHORT, **VARIED}
    env = gymnasium.make("scram/Turn-v0", **options)
    walked(env, seed=3)
    seed, third = walked(env)[0], walked(env)
    assert seed != third[0]
    assert walked(gymnasium.make("scram/Turn-v0", **options), seed=third[0]) == third
    # One that began by itself among many, too.
    many = gymnasium.make_vec("scram/Turn-v0", num_envs=2, autoreset_mode=AutoresetMode.SAME_STEP, **options)
    many.reset(seed=5)
    for step in range(5):
        observations, *_, infos = many.step(np.array([actions(1, step)] * 2))
    seed, rows = infos["episode_seed"][1], [observations[1].tobytes()]
    rows += [many.step(np.array([actions(1, step)] * 2))[0][1].tobytes() for step in range(4)]
    assert walked(env, seed=int(seed))[1][:5] == rows


def test_another_robot_file(root: Path) -> None:
    file = root / "robots" / "uneven-courier.toml"
    given = [gymnasium.make("scram/Straight-v0", robot=robot) for robot in (file, scram.Robot(file), None)]
    ends = []
    for env in given:
        env.reset(seed=1)
        for _ in range(20):
            last = env.step(8)[4]["pose"]
        ends.append(last)
    np.testing.assert_array_equal(ends[0], ends[1])
    assert not np.array_equal(ends[0], ends[2])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"drive": "magic"}, "drive: there is no `magic`"),
        ({"observe": ("pose", "smell")}, "observe: there is no `smell`"),
        ({"observe": "pose"}, "observe: .*`str`.*\n  help: .*also one of several, are a list"),
        ({"interval_s": "much"}, "interval_s: .*number"),
        ({"yaw_rate_rad_per_s": "much"}, "yaw_rate_rad_per_s: .*number"),
        ({"robot": "robots/bench-linear.toml"}, r"has no \[body\].*\n  help: name the robot file of a robot with \[body\]"),
        ({"observe": ("walls",)}, "only a maze has walls"),
        ({"interval_s": 0.0}, "interval_s: 0 is not positive"),
        ({"randomize": 1.0, "randomized": ["motor.colour"]}, r"randomized: `scram-26` has no `motor\.colour`"),
        ({"drive": "motor", "frequencies_hz": (7.0, 40.0)}, "refuses 40 Hz"),
        ({"robot": "none.toml"}, "no such file"),
    ],
)
def test_what_is_wrong_is_said(options: dict[str, Any], said: str) -> None:
    with pytest.raises(scram.ScramError, match=said):
        gymnasium.make("scram/Turn-v0", **options)


@pytest.mark.parametrize("make", [gymnasium.make, gymnasium.make_vec])
def test_a_step_needs_an_episode(make: Any) -> None:
    env = make("scram/Turn-v0", **SHORT).unwrapped
    with pytest.raises(gymnasium.error.ResetNeeded, match=r"call reset\(\) before step\(\)"):
        env.step(np.array([7]))
    env.reset(seed=1)
    env.step(np.array([7]))


def test_every_one_of_many_needs_an_episode() -> None:
    envs = gymnasium.make_vec("scram/Turn-v0", num_envs=2, **SHORT)
    envs.reset(options={"reset_mask": np.array([True, False])})
    with pytest.raises(gymnasium.error.ResetNeeded):
        envs.step(np.array([7, 7]))


def test_wrong_actions_and_seeds_are_refused() -> None:
    envs = gymnasium.make_vec("scram/Turn-v0", num_envs=2).unwrapped
    with pytest.raises(ValueError, match="3 for 2 environments"):
        envs.reset(seed=[1, 2, 3])
    envs.reset(seed=1)
    with pytest.raises(scram.InputError, match="no action 10"):
        envs.step(np.array([0, 10]))
    with pytest.raises(scram.InputError, match="no action -1 among 10"):
        envs.step(np.array([0, -1]))
    with pytest.raises(scram.InputError, match="1 actions for 2"):
        envs.step(np.array([0]))
    for fractions in (np.array([0.0, 7.9]), [1.0, 2.0], np.array([True, False])):
        with pytest.raises(scram.InputError, match="is no type of whole numbers"):
            envs.step(fractions)
    env = gymnasium.make("scram/Turn-v0").unwrapped
    for seed in (-1, 2**63):
        for one in (env, envs):
            with pytest.raises(scram.InputError, match=f"seed: {seed} is not a whole number from 0 to"):
                one.reset(seed=seed)
    env.reset(seed=2**63 - 1)
    for action in (7.9, np.float32(7), np.array([7.0])):
        with pytest.raises(scram.InputError, match="is no type of whole numbers"):
            env.step(action)
    for whole in (7, np.int64(7), np.array(7), np.array([7], dtype=np.uint8)):
        env.step(whole)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"num_envs": -1}, "num_envs: -1 is not a whole number from 0"),
        ({"num_envs": 2, "threads": -1}, "threads: -1 is not a whole number from 0"),
        ({"num_envs": 2, "maze": "random", "columns": -3}, "columns: -3 is not a whole number from 0"),
        ({"num_envs": 2, "maze": "random", "maze_seed": 2**64}, "maze_seed: 18446744073709551616 is not a whole number"),
    ],
)
def test_numbers_below_0_are_refused(options: dict[str, Any], says: str) -> None:
    with pytest.raises(scram.InputError, match=says):
        scram.envs.MazeVectorEnv(**options)


def test_no_threads_are_one_a_core(root: Path) -> None:
    """What 0 means wherever threads are counted."""
    program = """
import os, sys, time
import scram.envs
def threads():
    time.sleep(0.3)  # Those that end do so by themselves.
    return len(os.listdir("/proc/self/task"))
# What is there once for all.
del (envs := [scram.envs.TurnVectorEnv(8)])[:]
before = threads()
envs.append(scram.envs.TurnVectorEnv(8, threads=int(sys.argv[1])))
print(threads() - before)
"""
    if not Path("/proc/self/task").is_dir():
        pytest.skip("no /proc to count threads in")
    environment = {**os.environ, "RAYON_NUM_THREADS": "3"}

    def more(threads: int) -> int:
        command = [sys.executable, "-c", program, str(threads)]
        return int(subprocess.run(command, cwd=root, env=environment, check=True, capture_output=True).stdout)

    assert (more(1), more(2), more(0)) == (0, 2, 3)


@pytest.mark.parametrize("name", NAMES)
def test_a_picture_has_the_robot_in_it(name: str) -> None:
    env = gymnasium.make(name, render_mode="rgb_array", render_size=(320, 240))
    env.reset(seed=1)
    before = env.render()
    for _ in range(30):
        env.step(8)
    after = env.render()
    assert before.shape == after.shape == (240, 320, 3)
    assert before.dtype == np.uint8
    assert len(np.unique(before.reshape(-1, 3), axis=0)) > 50
    assert (before != after).any(axis=2).mean() > 0.005
    many = gymnasium.make_vec(name, num_envs=2, render_mode="rgb_array", render_size=(64, 48))
    many.reset(seed=1)
    assert [picture.shape for picture in many.render()] == [(48, 64, 3)] * 2


@pytest.mark.parametrize("size", [(640, 480), (1280, 960), (900, 300), (200, 500)])
def test_a_picture_has_the_whole_maze_and_its_exit_in_it(size: tuple[int, int]) -> None:
    env = gymnasium.make(
        "scram/Maze-v0", maze="random", columns=4, rows=4, render_mode="rgb_array", render_size=size
    )
    env.reset(seed=1)
    picture = env.render()
    # Ground, its lines and shades of both are light, walls and robot are not.
    dark = (picture < 170).any(axis=2)
    edge = np.concatenate([dark[0], dark[-1], dark[:, 0], dark[:, -1]])
    assert dark.any() and not edge.any(), "something leaves the frame"
    exit_colour = np.abs(picture.astype(int) - [190, 226, 200]).max(axis=2) <= 2
    assert 0.002 < exit_colour.mean() < 0.1


def test_a_person_gets_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    page = tmp_path / "walk.html"
    env = gymnasium.make("scram/Turn-v0", render_mode="human", page_path=page, **SHORT)
    env.reset(seed=1)
    for _ in range(4):
        env.step(7)
    assert not page.exists()
    env.step(7)
    # Five steps of 40 ms, a frame every 5 ms, and the start.
    assert '"frames":41' in page.read_text(encoding="utf-8")
    page.unlink()
    env.reset()
    assert not page.exists(), "it was written at the end"
    env.step(7)
    env.reset()
    assert '"frames":9' in page.read_text(encoding="utf-8"), "an episode that a reset breaks off"
    env.step(7)
    env.step(7)
    env.close()
    assert '"frames":17' in page.read_text(encoding="utf-8")
    assert opened == [page.as_uri()]


@pytest.mark.parametrize("make", [gymnasium.make, gymnasium.make_vec])
def test_the_place_of_the_page_is_known(make: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(webbrowser, "open", lambda _: None)

    def walked(**options: Any) -> Any:
        """The environment after the pages of two episodes."""
        env = make("scram/Turn-v0", **options, **SHORT).unwrapped
        for _ in range(2):
            env.reset(seed=1)
            env.step(np.array([7]))
            env.render()
        return env

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert walked(render_mode="human", page_path=tmp_path / "walk.html").page_path == tmp_path / "walk.html"
        assert walked(render_mode="rgb_array", page_path=tmp_path / "walk.html").page_path is None
    with pytest.warns(UserWarning, match="which stays there: page_path=FILE") as told:
        page = walked(render_mode="human").page_path
    assert page.read_text(encoding="utf-8") and str(page) in str(told[0].message) and len(told) == 1
    shutil.rmtree(page.parent)


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_the_page_of_one_of_many_ends_with_its_episode(
    mode: AutoresetMode, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(webbrowser, "open", lambda _: None)
    page = tmp_path / "walk.html"
    envs = gymnasium.make_vec(
        "scram/Turn-v0", num_envs=2, autoreset_mode=mode, render_mode="human", page_path=page, **SHORT
    )
    envs.reset(seed=1)
    for _ in range(5):
        assert not page.exists()
        envs.step(np.array([7, 3]))
    assert '"frames":41' in page.read_text(encoding="utf-8")
    if mode is AutoresetMode.DISABLED:
        envs.reset(options={"reset_mask": np.array([True, True])})
    else:
        envs.step(np.array([7, 3]))
    assert '"frames":41' in page.read_text(encoding="utf-8")


def test_other_threads_go_on_while_robots_walk() -> None:
    """The engine holds no lock of the interpreter: a thread counts while a long step runs."""
    env = gymnasium.make("scram/Turn-v0", interval_s=4.0, episode_s=40.0, precision="double").unwrapped
    env.reset(seed=1)
    ticks: list[float] = []
    stop = threading.Event()

    def count() -> None:
        while not stop.wait(0.001):
            ticks.append(time.perf_counter())

    thread = threading.Thread(target=count)
    thread.start()
    begin = time.perf_counter()
    env.step(7)
    end = time.perf_counter()
    stop.set()
    thread.join()
    assert sum(begin < tick < end for tick in ticks) >= 3, f"{end - begin} s"
