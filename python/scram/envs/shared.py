"""What one environment and many have in common."""

from pathlib import Path
from typing import cast

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from scram._scram import Environments, Robot


def observation_space(environments: Environments) -> spaces.Space[NDArray[np.float32]]:
    """The space of one environment's observations."""
    low, high = environments.observation_bounds
    return cast("spaces.Space[NDArray[np.float32]]", spaces.Box(low, high, dtype=np.float32))


def chosen_robot(robot: Robot | str | Path | None) -> Robot | None:
    """A robot file by its path."""
    return Robot(robot) if isinstance(robot, (str, Path)) else robot


def seed_of(seed: int) -> int:
    """As the engine takes it: 64 bits without a sign."""
    if seed < 0:
        raise ValueError(f"seed: {seed} is negative")
    return seed % 2**64
