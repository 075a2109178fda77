"""What one environment and many have in common."""

from pathlib import Path
from typing import cast

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from scram._scram import Environments, Robot
from scram.errors import InputError

#: Seeds are below this: what an array of numbers with a sign holds.
SEEDS = 2**63

#: What is said to who makes a step without an episode.
RESET_NEEDED = "no episode has begun: call reset() before step()"


def observation_space(environments: Environments) -> spaces.Space[NDArray[np.float32]]:
    """The space of one environment's observations."""
    low, high = environments.observation_bounds
    return cast("spaces.Space[NDArray[np.float32]]", spaces.Box(low, high, dtype=np.float32))


def chosen_robot(robot: Robot | str | Path | None) -> Robot | None:
    """A robot file by its path."""
    return Robot(robot) if isinstance(robot, (str, Path)) else robot


def seed_of(seed: int) -> int:
    """As the engine takes it."""
    if not 0 <= seed < SEEDS:
        raise InputError(f"seed: {seed} is not a whole number from 0 to {SEEDS - 1}")
    return int(seed)


def drawn_seed(random: np.random.Generator) -> int:
    """A seed for an episode that nobody named one for."""
    return int(random.integers(SEEDS))


def action_indices(actions: ArrayLike) -> NDArray[np.int64]:
    """Actions as the engine takes them: a number that is not whole names none."""
    array = np.atleast_1d(np.asarray(actions))
    if array.dtype.kind not in "iu":
        raise InputError(f"action: {array.dtype} is no type of whole numbers\n  help: give the index of an action for each robot")
    return array.astype(np.int64)
