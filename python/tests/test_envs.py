"""The environments as Gymnasium uses them."""

import math
import threading
import time
import warnings
import webbrowser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium")

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


def test_the_three_ways_to_reset() -> None:
    """Next step, same step and disabled, beside Gymnasium's SyncVectorEnv."""
    for mode in AutoresetMode:
        many = gymnasium.make_vec("scram/Turn-v0", num_envs=2, autoreset_mode=mode, **SHORT, **VARIED)
        assert many.metadata["autoreset_mode"] is mode
        make = [lambda: gymnasium.make("scram/Turn-v0", **SHORT, **VARIED)] * 2
        same = SyncVectorEnv(make, autoreset_mode=mode)
        np.testing.assert_array_equal(many.reset(seed=2)[0], same.reset(seed=2)[0])
        for step in range(13):
            given = np.array([actions(i, step) for i in range(2)])
            mine, theirs = many.step(given), same.step(given)
            for ours, expected in zip(mine[:4], theirs[:4], strict=True):
                np.testing.assert_array_equal(ours, expected)
            assert set(mine[4]) == set(theirs[4])
            if mine[3].any() and mode is AutoresetMode.SAME_STEP:
                np.testing.assert_array_equal(mine[4]["final_obs"][1], theirs[4]["final_obs"][1])
                np.testing.assert_array_equal(mine[4]["final_info"]["pose"], theirs[4]["final_info"]["pose"])
            if mine[3].any() and mode is AutoresetMode.DISABLED:
                with pytest.raises(ValueError, match="have ended"):
                    many.step(given)
                mask = {"reset_mask": np.array([True, True])}
                np.testing.assert_array_equal(many.reset(options=mask)[0], same.reset(options=mask)[0])


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
    assert env.reset()[1]["episode_seed"] != first
    assert env.reset(seed=1)[1]["episode_seed"] == first


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


def test_wrong_actions_and_seeds_are_refused() -> None:
    envs = gymnasium.make_vec("scram/Turn-v0", num_envs=2).unwrapped
    with pytest.raises(ValueError, match="3 for 2 environments"):
        envs.reset(seed=[1, 2, 3])
    envs.reset(seed=1)
    with pytest.raises(scram.InputError, match="no action 10"):
        envs.step(np.array([0, 10]))
    with pytest.raises(scram.InputError, match="1 actions for 2"):
        envs.step(np.array([0]))


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


def test_a_person_gets_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    page = tmp_path / "walk.html"
    env = gymnasium.make("scram/Turn-v0", render_mode="human", page_path=page, **SHORT)
    env.reset(seed=1)
    for _ in range(5):
        env.step(7)
    assert not page.exists()
    env.reset()
    text = page.read_text(encoding="utf-8")
    # Five steps of 40 ms, a frame every 5 ms, and the start.
    assert '"frames":41' in text
    env.step(7)
    env.close()
    assert '"frames":9' in page.read_text(encoding="utf-8")
    assert opened == [page.as_uri()]


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
