"""What the driver of a cluster bears: 1000 workers that only sleep, with rows of a sweep's size.

    python python/benches/thousand_workers.py [--workers 1000] [--rows 240000] [--seconds 0.4]

The workers are coroutines in four processes of Ray, so that a small machine holds them: a task is a call of an actor, which asks for no core,
where a sweep's is scheduled on a node. The driver, the size of what goes to and fro, and the journal are those of a sweep. Prints rows a second beside what the sleep alone would let through, and the driver's own processor time.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import tempfile
import time
from importlib import import_module
from itertools import cycle
from pathlib import Path
from typing import Any

from scram._scram import Sweep
from scram.cluster import LOOPBACK, Pool, Rows

os.environ.setdefault(LOOPBACK, "0")
# Ray reads the variable when it is imported; its types do not know actors of coroutines.
ray: Any = import_module("ray")

#: Groups of a sweep have eight runs, the lanes of the kernel.
RUNS_A_GROUP = 8
#: Runs of a condition.
REPEATS = 10_000


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--workers", type=int, default=1000)
    parser.add_argument("--rows", type=int, default=240_000)
    parser.add_argument("--seconds", type=float, default=0.4, help="of a group of eight rows")
    given = parser.parse_args()
    robot = Path(__file__).resolve().parents[2] / "robot.toml"
    conditions = max(1, given.rows // REPEATS)

    class Sleepers:
        async def make(self, groups: list[list[int]], row: tuple[list[str], list[str]]) -> tuple[Rows, float]:
            took = given.seconds * len(groups)
            await asyncio.sleep(took)
            return [(run + 1, row[0], row[1]) for group in groups for run in group], took

    with tempfile.TemporaryDirectory() as out:
        options = ["--axis", f"ground.friction=0.5:1.0:{conditions}", "--repeats", str(REPEATS), "--seconds", "0.1"]
        driver = Sweep([*options, "--robot", str(robot), "--out", out])
        groups = driver.open()
        (_, cells, path), *_ = driver.rows(groups[0][:1])
        ray.init(address="local", include_dashboard=False, log_to_driver=False)
        homes = cycle([ray.remote(num_cpus=0, max_concurrency=given.workers)(Sleepers).remote() for _ in range(4)])

        def remote(some: list[list[int]]) -> Any:
            return next(homes).make.remote(some, (cells, path))

        pool: Pool[list[int], Rows] = Pool(groups, remote, lambda: given.workers // 2)
        began, busy = time.perf_counter(), time.process_time()
        tasks = 0
        for rows in pool.results():
            driver.book(rows)
            tasks += 1
        took, used = time.perf_counter() - began, time.process_time() - busy
        total = driver.done
        driver.finish()
        ray.shutdown()
    ideal = given.workers * RUNS_A_GROUP / given.seconds
    print(f"{given.workers} workers, {total} rows in {tasks} tasks and {took:.1f} s")
    print(f"{total / took:.0f} rows a second, {100 * total / took / ideal:.0f} % of what the sleep lets through without begin and end")
    print(f"driver: {1e3 * used / tasks:.2f} ms of its processor a task, {100 * used / took:.0f} % of a core")


if __name__ == "__main__":
    main()
