"""Stable-Baselines3's own check of every environment, and an update of its PPO with the thesis's Table 5.1 on one of them.

    python python/benches/check_stable_baselines3.py

Run by `.ci/long`, not by pytest: its tensor library is gigabytes.
"""

import warnings

import gymnasium
import scram.envs  # noqa: F401
from stable_baselines3 import PPO
from stable_baselines3.common.env_checker import check_env

TABLE_5_1 = {
    "learning_rate": 3e-4,
    "n_steps": 2048,
    "batch_size": 64,
    "n_epochs": 10,
    "gamma": 0.99,
    "gae_lambda": 0.95,
    "clip_range": 0.2,
    "vf_coef": 0.5,
    "ent_coef": 0.2,
}


def main() -> None:
    """Prints a line for each check; an exception where one fails."""
    for name in ("Turn", "Straight", "Maze"):
        for drive in ("exact", "motor"):
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                check_env(gymnasium.make(f"scram/{name}-v0", drive=drive, render_mode="rgb_array").unwrapped)
            print(f"scram/{name}-v0, {drive}: passed")
    PPO("MlpPolicy", gymnasium.make("scram/Turn-v0"), seed=1, device="cpu", **TABLE_5_1).learn(2048)
    print("scram/Turn-v0: an update of PPO passed")


if __name__ == "__main__":
    main()
