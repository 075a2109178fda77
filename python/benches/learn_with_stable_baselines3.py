"""The trainings of `scram learn turn` again by Stable-Baselines3's PPO, on the same environments from the same settings.

    python python/benches/learn_with_stable_baselines3.py out/learn-0001 out/learn-0002 out/learn-0003

Each argument is the directory of a training that has ended, each with a seed of its own. Says for either learner, and either one's every
seed, at which mean return of an episode it stays (the mean over the last fifth of the training), and exits with 1 where the means of the
two are farther apart than the farthest two seeds of one of them. Run by `.ci/long`, not by pytest: the tensor library is gigabytes.
"""

import argparse
import csv
import json
import sys
import time
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import scram.envs
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnv

LAST = 0.2
"""Share of a training over which it is said to stay."""


class Engine(VecEnv):
    """`TurnVectorEnv` as Stable-Baselines3 wants it: what is seen last in an episode is in its info, and the next one has begun."""

    def __init__(self, envs: scram.envs.TurnVectorEnv, seed: int) -> None:
        self.envs = envs
        self.first_seed = seed
        self.returns: list[tuple[int, float]] = []
        self.steps = 0
        self.sums = np.zeros(envs.num_envs)
        super().__init__(envs.num_envs, envs.single_observation_space, envs.single_action_space)

    def reset(self) -> NDArray[np.float32]:
        """Begins the episodes of the seed, the same for every learner of it."""
        return self.envs.reset(seed=self.first_seed)[0]

    def step_async(self, actions: NDArray[np.int64]) -> None:
        """Keeps the actions."""
        self.actions = actions

    def step_wait(self) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        """Takes them."""
        seen, rewards, terminated, truncated, about = self.envs.step(self.actions)
        self.steps += self.num_envs
        self.sums += rewards
        done = terminated | truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for i in np.flatnonzero(done):
            infos[i] = {"terminal_observation": about["final_obs"][i], "TimeLimit.truncated": bool(truncated[i])}
            self.returns.append((self.steps, float(self.sums[i])))
            self.sums[i] = 0.0
        return seen, rewards.astype(np.float32), done, infos

    def close(self) -> None:
        """Closes them."""
        self.envs.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Of the environments, which all share it."""
        return [getattr(self.envs, attr_name, None)] * self.num_envs

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Is not needed."""
        raise NotImplementedError

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        """Is not needed."""
        raise NotImplementedError

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """None is."""
        return [False] * self.num_envs


def environments(turn: dict[str, Any], direction: str, robot: Path) -> scram.envs.TurnVectorEnv:
    """Those on which `scram learn turn` learned."""
    return scram.envs.TurnVectorEnv(
        num_envs=turn["environments"],
        robot=robot,
        autoreset_mode=gymnasium.vector.AutoresetMode.SAME_STEP,
        direction=direction,
        yaw_rate_rad_per_s=np.radians(turn["rate_deg_per_s"]),
        k_rot=turn["k_rot"],
        k_pos=turn["k_pos"],
        frequencies_hz=turn["frequencies_hz"],
        observe=turn["observe"],
        drive=turn["drive"],
        interval_s=turn["interval_s"],
        episode_s=turn["episode_s"],
        alpha_deg=turn.get("alpha_deg"),
        randomize=turn["randomize"],
    )


def learn(trained: dict[str, Any], robot: Path) -> list[tuple[int, float]]:
    """Step and return of every episode that Stable-Baselines3 played as it learned what `scram learn turn` did."""
    turn, ppo, seed = trained["settings"]["turn"], trained["settings"]["ppo"], trained["seed"]
    engine = Engine(environments(turn, trained["direction"], robot), seed)
    learner = PPO(
        "MlpPolicy",
        engine,
        seed=seed,
        device="cpu",
        learning_rate=ppo["learning_rate"],
        n_steps=ppo["steps"] // turn["environments"],
        batch_size=ppo["batch_size"],
        n_epochs=ppo["epochs"],
        gamma=ppo["discount"],
        gae_lambda=ppo["gae_lambda"],
        clip_range=ppo["clip_range"],
        vf_coef=ppo["value_coefficient"],
        ent_coef=ppo["entropy_coefficient"],
        max_grad_norm=ppo["max_gradient_norm"],
        policy_kwargs={"net_arch": [ppo["hidden_units"]] * 2},
    )
    learner.learn(ppo["steps"] * turn["updates"])
    return engine.returns


def stays(returns: list[tuple[int, float]], steps: int) -> float:
    """Mean return of the episodes that ended in the last part of a training."""
    last = [value for step, value in returns if step > (1 - LAST) * steps]
    return float(np.mean(last))


def ours(directory: Path) -> list[tuple[int, float]]:
    """From `curve.csv`: as many returns of a mean as episodes ended."""
    with (directory / "curve.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["mean_return"]]
    return [(int(row["steps"]), float(row["mean_return"])) for row in rows for _ in range(int(row["episodes"]))]


def main() -> None:
    """Prints a line for each seed, then the verdict."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", metavar="DIR", nargs="+", type=Path, help="directories of trainings that have ended")
    parser.add_argument("--robot", type=Path, default=Path("robot.toml"), help="the robot file that they learned on")
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    stay: dict[str, list[float]] = {"scram learn": [], "Stable-Baselines3": []}
    print(f"{'seed':>6}  {'scram learn':>12}  {'Stable-Baselines3':>18}")
    for directory in arguments.runs:
        trained = json.loads((directory / "policy.json").read_text())
        steps = trained["settings"]["ppo"]["steps"] * trained["updates"]
        began = time.monotonic()
        theirs = learn(trained, arguments.robot)
        both = [stays(ours(directory), steps), stays(theirs, steps)]
        for values, value in zip(stay.values(), both, strict=True):
            values.append(value)
        print(f"{trained['seed']:>6}  {both[0]:12.2f}  {both[1]:18.2f}   {time.monotonic() - began:.0f} s", flush=True)
    apart = abs(np.mean(stay["scram learn"]) - np.mean(stay["Stable-Baselines3"]))
    spread = max(max(values) - min(values) for values in stay.values())
    print(f"the means are {apart:.2f} apart, the farthest two seeds of one learner {spread:.2f}")
    sys.exit(apart > spread)


if __name__ == "__main__":
    main()
