"""The robot in Gymnasium: ``scram/Turn-v0``, ``scram/Straight-v0`` and ``scram/Maze-v0``.

Importing this module registers them; ``gymnasium.make("scram.envs:scram/Turn-v0")`` imports it, too.

>>> import gymnasium
>>> import scram.envs
>>> env = gymnasium.make("scram/Turn-v0", direction="right")
>>> observation, info = env.reset(seed=1)
>>> observation, reward, terminated, truncated, info = env.step(7)
>>> envs = gymnasium.make_vec("scram/Turn-v0", num_envs=8)
>>> observations, infos = envs.reset(seed=1)
>>> observations.shape
(8, 3)
"""

try:
    import gymnasium
except ImportError as _error:
    raise ImportError("scram.envs needs Gymnasium: pip install 'scram[rl]'") from _error

from scram.envs.definitions import Definition, Maze, Straight, Turn
from scram.envs.single import MazeEnv, RobotEnv, StraightEnv, TurnEnv
from scram.envs.vector import MazeVectorEnv, RobotVectorEnv, StraightVectorEnv, TurnVectorEnv

__all__ = [
    "Definition",
    "Maze",
    "MazeEnv",
    "MazeVectorEnv",
    "RobotEnv",
    "RobotVectorEnv",
    "Straight",
    "StraightEnv",
    "StraightVectorEnv",
    "Turn",
    "TurnEnv",
    "TurnVectorEnv",
]

for _name in ("Turn", "Straight", "Maze"):
    gymnasium.register(
        id=f"scram/{_name}-v0",
        entry_point=f"scram.envs:{_name}Env",
        vector_entry_point=f"scram.envs:{_name}VectorEnv",
    )
