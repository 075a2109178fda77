"""The picture of docs/gymnasium.md: Turn-v0 after ten seconds at −7 Hz beside Maze-v0 half a minute on.

    python python/benches/pictures.py docs/gymnasium.png
"""

import sys

import gymnasium
import numpy as np
import scram.envs  # noqa: F401
from PIL import Image


def after(name: str, actions: list[int], **options: object) -> np.ndarray:
    """What an environment shows after these actions, the last of them repeated to the end."""
    env = gymnasium.make(name, render_mode="rgb_array", render_size=(800, 600), **options)
    env.reset(seed=1)
    for action in actions:
        env.step(action)
    return env.render()


if __name__ == "__main__":
    turned = after("scram/Turn-v0", [2] * 250)
    walked = after("scram/Maze-v0", [7, 7, 7, 7, 2, 2, 2, 2] * 94)
    Image.fromarray(np.concatenate([turned, walked], axis=1)).save(sys.argv[1], optimize=True)
