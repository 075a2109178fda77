"""What calling from Python costs: the same work called from Rust and from Python in turn, in one process.

    python python/benches/overhead.py [--repeats 15]

Prints medians and their ratio; the first call of each is not counted.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median

import numpy as np

import scram
from scram import _scram

WALK_S = 2.0
SEEDS = 32


def timed(call: Callable[[], object]) -> float:
    """How long a call takes, s."""
    began = time.perf_counter()
    call()
    return time.perf_counter() - began


def compare(rust: Callable[[], float], python: Callable[[], object], repeats: int) -> tuple[float, float, float]:
    """Medians of both, s, and the median of the ratios of neighbours, in turn so that what else the machine does falls on both."""
    rust()
    python()
    pairs = []
    for repeat in range(repeats):
        if repeat % 2:
            other = timed(python)
            pairs.append((rust(), other))
        else:
            pairs.append((rust(), timed(python)))
    return median(a for a, _ in pairs), median(b for _, b in pairs), median(b / a for a, b in pairs)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=15)
    repeats = parser.parse_args().repeats
    robot = scram.Robot(Path(__file__).resolve().parents[2] / "robot.toml")

    rust, python, ratio = compare(
        lambda: _scram.peer_walk(robot, WALK_S, 1), lambda: scram.simulate(robot, "freq:7", WALK_S, 1), repeats
    )
    print(f"a walk of {WALK_S:g} s: Rust {1e3 * rust:.2f} ms, Python {1e3 * python:.2f} ms, {100 * (ratio - 1):+.1f} %")

    seeds = np.arange(1, SEEDS + 1)
    rust, python, ratio = compare(
        lambda: _scram.peer_batch(robot, WALK_S, SEEDS),
        lambda: scram.simulate_batch(robot, "freq:7", seeds=seeds, seconds=WALK_S),
        max(3, repeats // 3),
    )
    print(
        f"{SEEDS} walks of {WALK_S:g} s: Rust {SEEDS / rust:.1f} a second, Python {SEEDS / python:.1f} a second, "
        f"{100 / ratio:.1f} % of Rust's"
    )


if __name__ == "__main__":
    main()
