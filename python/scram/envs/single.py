"""One environment a call: ``gymnasium.make``."""

from pathlib import Path
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from scram._scram import Environments, Robot
from scram.envs.definitions import Definition, Maze, Straight, Turn
from scram.envs.rendering import RENDER_MODES, SIZE, Renderer
from scram.envs.shared import RESET_NEEDED, action_indices, chosen_robot, drawn_seed, observation_space, seed_of

Observation = NDArray[np.float32]


class RobotEnv(gymnasium.Env[Observation, np.int64]):
    """A robot and a task. Keyword arguments are the fields of ``definition_type``; ``robot`` is a robot file or its path.

    ``render_mode="rgb_array"`` draws pictures of ``render_size`` pixels, ``"human"`` writes the page of an episode to ``page_path``.
    """

    metadata: dict[str, Any] = {"render_modes": RENDER_MODES, "render_fps": 25}  # noqa: RUF012
    definition_type: ClassVar[type[Definition]]

    def __init__(
        self,
        *,
        robot: Robot | str | Path | None = None,
        render_mode: str | None = None,
        render_size: tuple[int, int] = SIZE,
        page_path: str | Path | None = None,
        **options: Any,
    ) -> None:
        self.definition = self.definition_type(**options)
        self._environments = Environments(self.definition, 1, chosen_robot(robot), threads=1)
        self.metadata = {**self.metadata, "render_fps": round(1.0 / self.definition.interval_s)}
        self.observation_space = observation_space(self._environments)
        self.action_space = spaces.Discrete(self.definition.actions)
        self.render_mode = render_mode
        self._renderer = Renderer(self._environments, 0, render_mode, render_size, page_path)
        self._all = np.ones(1, dtype=np.bool_)
        self._episode_seed: int | None = None

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Observation, dict[str, Any]]:
        """Begins the episode of a seed, or without one that of a seed that the last given one draws."""
        begun = None if seed is None else seed_of(seed)
        super().reset(seed=begun)
        self._episode_seed = drawn_seed(self.np_random) if begun is None else begun
        self._renderer.leave()
        self._environments.reset(self._all, np.array([self._episode_seed]))
        return self._environments.observations()[0], self._info()

    def step(self, action: np.int64 | int) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Holds a frequency for Δt.

        Raises
        ------
        gymnasium.error.ResetNeeded
            No episode has begun.
        InputError
            There is no such action.
        """
        if self._episode_seed is None:
            raise gymnasium.error.ResetNeeded(RESET_NEEDED)
        observations, rewards, terminated, truncated = self._environments.step(action_indices(action))
        if terminated[0] or truncated[0]:
            self._renderer.end()
        return observations[0], float(rewards[0]), bool(terminated[0]), bool(truncated[0]), self._info()

    def render(self) -> NDArray[np.uint8] | None:
        """A picture (``rgb_array``), or the page of the episode so far (``human``)."""
        if self.render_mode is None:
            gymnasium.logger.warn("render() shows nothing: make the environment with render_mode='rgb_array' or 'human'")
            return None
        return self._renderer.render()

    def close(self) -> None:
        """Writes the last episode's page, in ``human`` mode."""
        self._renderer.leave()

    @property
    def page_path(self) -> Path | None:
        """Where ``render_mode="human"`` writes its page; None in the other modes."""
        return self._renderer.page_path

    @property
    def shaft_acceleration_rad_per_s2(self) -> float:
        """How fast the exact drive's shaft changes its speed."""
        return self._environments.shaft_acceleration_rad_per_s2

    def mjcf(self) -> str:
        """The robot of the present episode as a MuJoCo model."""
        return self._environments.mjcf(0)

    def _info(self) -> dict[str, Any]:
        info = {"pose": self._environments.poses()[0], "episode_seed": self._episode_seed}
        (fault,) = self._environments.faults()
        return info if fault is None else {**info, "fault": fault}


class TurnEnv(RobotEnv):
    """``scram/Turn-v0``: turning in place."""

    definition_type = Turn


class StraightEnv(RobotEnv):
    """``scram/Straight-v0``: walking along a line."""

    definition_type = Straight


class MazeEnv(RobotEnv):
    """``scram/Maze-v0``: finding the way through a maze."""

    definition_type = Maze
