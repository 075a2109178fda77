"""Steps per second of ``scram/Turn-v0`` beside the same environment on MuJoCo, in one run.

    pip install -r tests/mujoco/requirements.txt
    python python/benches/envs.py [--seconds 2] [--repeats 5]

What is measured: one environment (``gymnasium.make``), and ``make_vec`` with the number of environments that is best; MuJoCo in one
process, and in Gymnasium's AsyncVectorEnv over all cores. Both advance the same robot by the same 0.1 ms, choose the same actions and
reset alike. Every variant is timed in turn, as often as ``--repeats`` says, and the medians stand in the table: what else the machine does
meets all of them. MuJoCo is measured with the setting that is fastest here of those in ``tests/mujoco/timing.py``.
"""

import argparse
import os
import statistics
import time
from collections.abc import Callable

import gymnasium
import numpy as np
import scram.envs  # noqa: F401
from gymnasium.vector import AsyncVectorEnv, VectorEnv
from mujoco_env import MujocoTurnEnv

Timed = Callable[[float], float]


def rate(step: Callable[[], int], seconds: float) -> float:
    """Environment steps per second over a time."""
    count, begin = 0, time.perf_counter()
    while time.perf_counter() - begin < seconds:
        count += step()
    return count / (time.perf_counter() - begin)


def of_one(env: gymnasium.Env) -> Timed:
    """Random actions in one environment."""
    random = np.random.default_rng(0)
    env.reset(seed=0)

    def step() -> int:
        _, _, terminated, truncated, _ = env.step(random.integers(10))
        if terminated or truncated:
            env.reset()
        return 1

    return lambda seconds: rate(step, seconds)


def of_many(envs: VectorEnv) -> Timed:
    """The same in many."""
    random = np.random.default_rng(0)
    envs.reset(seed=0)

    def step() -> int:
        envs.step(random.integers(10, size=envs.num_envs))
        return envs.num_envs

    return lambda seconds: rate(step, seconds)


def variants(counts: list[int]) -> dict[str, Timed]:
    """What is timed, by name."""
    plain = gymnasium.make("scram/Turn-v0").unwrapped
    plain.reset(seed=0)
    given = (plain.mjcf(), plain.definition, plain.shaft_acceleration_rad_per_s2)
    timed: dict[str, Timed] = {}
    for precision in ("single", "double"):
        timed[f"scram, 1 environment, {precision}"] = of_one(gymnasium.make("scram/Turn-v0", precision=precision))
        for count in counts:
            many = gymnasium.make_vec("scram/Turn-v0", num_envs=count, precision=precision)
            timed[f"scram, make_vec({count}), {precision}"] = of_many(many)
    cores = os.cpu_count() or 1
    timed["MuJoCo, one process"] = of_one(MujocoTurnEnv(*given))
    timed[f"MuJoCo, AsyncVectorEnv({cores})"] = of_many(AsyncVectorEnv([lambda: MujocoTurnEnv(*given)] * cores))
    return timed


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=2.0, help="of one measurement")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--counts", type=int, nargs="+", default=[8, 16, 32, 64], help="environments of make_vec")
    given = parser.parse_args()
    timed = variants(given.counts)
    for measure in timed.values():
        measure(0.2)
    rates: dict[str, list[float]] = {name: [] for name in timed}
    for _ in range(given.repeats):
        for name, measure in timed.items():
            rates[name].append(measure(given.seconds))
    medians = {name: statistics.median(values) for name, values in rates.items()}
    peers = [name for name in medians if name.startswith("MuJoCo")]
    print("| environment | steps/s |" + "".join(f" × {name} |" for name in peers))
    print("|---|---|" + "---|" * len(peers))
    for name, median in medians.items():
        ratios = "".join(f" {median / medians[peer]:.1f} |" for peer in peers)
        print(f"| {name} | {median:.0f} |{ratios}")
    best = max((name for name in medians if name.startswith("scram")), key=medians.__getitem__)
    peer = max(peers, key=medians.__getitem__)
    pairs = [mine / theirs for mine, theirs in zip(rates[best], rates[peer], strict=True)]
    print(f"{best} / {peer}: {statistics.median(pairs):.1f} times, {min(pairs):.1f} to {max(pairs):.1f}")


if __name__ == "__main__":
    main()
