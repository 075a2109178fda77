"""Many environments a call: ``gymnasium.make_vec``. The engine advances all of them together, over threads."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from scram._scram import Environments, Robot
from scram.envs.definitions import Definition, Maze, Straight, Turn
from scram.envs.rendering import RENDER_MODES, SIZE, Renderer
from scram.envs.shared import RESET_NEEDED, action_indices, chosen_robot, drawn_seed, observation_space, seed_of
from scram.errors import InputError

Observations = NDArray[np.float32]
Flags = NDArray[np.bool_]
StepResult = tuple[Observations, NDArray[np.float64], Flags, Flags, dict[str, Any]]


class RobotVectorEnv(VectorEnv[Observations, NDArray[np.int64], NDArray[Any]]):
    """Robots side by side, all with one task.

    ``autoreset_mode`` is one of Gymnasium's three and stands in ``metadata["autoreset_mode"]``. ``threads`` is how many advance
    the robots; 0 for one a core. ``rgb_array`` draws every robot, ``human`` writes the page of the first to ``page_path``.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012
        "render_modes": RENDER_MODES,
        "render_fps": 25,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }
    definition_type: ClassVar[type[Definition]]

    def __init__(
        self,
        num_envs: int = 1,
        *,
        robot: Robot | str | Path | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        threads: int = 0,
        render_mode: str | None = None,
        render_size: tuple[int, int] = SIZE,
        page_path: str | Path | None = None,
        **options: Any,
    ) -> None:
        self.definition = self.definition_type(**options)
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.num_envs = num_envs
        self._environments = Environments(self.definition, num_envs, chosen_robot(robot), threads)
        rate = round(1.0 / self.definition.interval_s)
        self.metadata = {**self.metadata, "render_fps": rate, "autoreset_mode": self.autoreset_mode}
        self.single_observation_space = observation_space(self._environments)
        self.single_action_space = spaces.Discrete(self.definition.actions)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.render_mode = render_mode
        shown = range(num_envs if render_mode == "rgb_array" else 1)
        self._renderers = [Renderer(self._environments, i, render_mode, render_size, page_path) for i in shown]
        self._begun: Flags = np.zeros(num_envs, dtype=np.bool_)
        self._ended: Flags = np.zeros(num_envs, dtype=np.bool_)
        self._episode_seeds: NDArray[np.int64] = np.zeros(num_envs, dtype=np.int64)
        # Of each environment's episodes that nobody named a seed for.
        self._randoms: list[np.random.Generator | None] = [None] * num_envs

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Begins episodes in all environments, or where ``options["reset_mask"]`` is true: with a seed s environment i begins that
        of s + i, with a sequence of seeds that of its own, without one that of a seed that its last given one draws.
        """
        mask: Flags = np.ones(self.num_envs, dtype=np.bool_)
        if options is not None and "reset_mask" in options:
            mask = np.asarray(options["reset_mask"])
            if mask.dtype != np.bool_ or mask.shape != (self.num_envs,) or not mask.any():
                raise ValueError(f"options['reset_mask']: give {self.num_envs} truth values, one true at least")
        self._begin(mask, self._seeds(seed))
        self._ended[mask] = False
        return self._environments.observations(), self._info(mask)

    def step(self, actions: NDArray[np.int64]) -> StepResult:
        """Holds a frequency in each environment for Δt.

        Raises
        ------
        gymnasium.error.ResetNeeded
            An environment has begun no episode.
        InputError
            There is no such action, or not one for each environment.
        """
        if not self._begun.all():
            raise ResetNeeded(RESET_NEEDED)
        begin = self._ended
        if self.autoreset_mode is AutoresetMode.DISABLED and begin.any():
            which = np.flatnonzero(begin).tolist()
            raise ValueError(f"environments {which} have ended: reset them with options={{'reset_mask': mask}}")
        # An environment that begins a new episode in this step goes on with the old one for nothing: lanes go together.
        observations, rewards, terminated, truncated = self._environments.step(action_indices(actions))
        if begin.any():
            self._begin(begin)
            observations[begin] = self._environments.observations()[begin]
            rewards[begin], terminated[begin], truncated[begin] = 0.0, False, False
        ended = terminated | truncated
        if ended[0]:
            self._renderers[0].end()
        final: dict[str, Any] = {}
        if self.autoreset_mode is not AutoresetMode.SAME_STEP:
            self._ended = ended
        elif ended.any():
            final = {"final_info": self._info(ended), "_final_info": ended.copy()}
            final |= {"final_obs": self._final(observations, ended), "_final_obs": ended.copy()}
            self._begin(ended)
            observations[ended] = self._environments.observations()[ended]
        return observations, rewards, terminated, truncated, final | self._info()

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """A picture of every robot (``rgb_array``), or the page of the first one's episode so far (``human``)."""
        pictures = [renderer.render() for renderer in self._renderers]
        return tuple(picture for picture in pictures if picture is not None) if self.render_mode == "rgb_array" else None

    def close_extras(self, **kwargs: Any) -> None:
        """Writes the last episode's page, in ``human`` mode."""
        self._renderers[0].leave()

    @property
    def page_path(self) -> Path | None:
        """Where ``render_mode="human"`` writes its page; None in the other modes."""
        return self._renderers[0].page_path

    def _seeds(self, seed: int | Sequence[int | None] | None) -> Sequence[int | None]:
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, (int, np.integer)):
            seeds = [seed_of(int(seed) + i) for i in range(self.num_envs)]
            super().reset(seed=seeds[0])
            return seeds
        if len(seed) != self.num_envs:
            raise InputError(f"seed: {len(seed)} for {self.num_envs} environments; give one for each")
        return [None if one is None else seed_of(one) for one in seed]

    def _begin(self, mask: Flags, seeds: Sequence[int | None] | None = None) -> None:
        for i in np.flatnonzero(mask).tolist():
            self._episode_seeds[i] = self._next_seed(i, None if seeds is None else seeds[i])
        if mask[0]:
            self._renderers[0].leave()
        self._environments.reset(mask, self._episode_seeds)
        self._begun |= mask

    def _next_seed(self, i: int, seed: int | None) -> int:
        """Of the episode that environment i begins: what one environment alone would begin."""
        random = self._randoms[i]
        if random is None or seed is not None:
            random = self._randoms[i] = seeding.np_random(seed)[0]
        return drawn_seed(random) if seed is None else seed

    @staticmethod
    def _final(observations: Observations, ended: Flags) -> NDArray[np.object_]:
        final = np.full(len(ended), None, dtype=object)
        for i in np.flatnonzero(ended):
            final[i] = observations[i].copy()
        return final

    def _info(self, mask: Flags | None = None) -> dict[str, Any]:
        """As Gymnasium puts infos together: of some environments, or of all of them, with zeros for the others."""
        here = np.ones(self.num_envs, dtype=np.bool_) if mask is None else mask
        poses = np.where(here[:, np.newaxis], self._environments.poses(), 0.0)
        info = {"pose": poses, "_pose": here.copy()}
        info |= {"episode_seed": np.where(here, self._episode_seeds, 0), "_episode_seed": here.copy()}
        faults = np.array(self._environments.faults(), dtype=object)
        faults[~here] = None
        stopped = np.array([fault is not None for fault in faults])
        if stopped.any():
            info |= {"fault": faults, "_fault": stopped}
        return info


class TurnVectorEnv(RobotVectorEnv):
    """Many of ``scram/Turn-v0``."""

    definition_type = Turn


class StraightVectorEnv(RobotVectorEnv):
    """Many of ``scram/Straight-v0``."""

    definition_type = Straight


class MazeVectorEnv(RobotVectorEnv):
    """Many of ``scram/Maze-v0``."""

    definition_type = Maze
