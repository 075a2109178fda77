"""Sweeps over many machines, on Ray.

``python -m scram.cluster sweep --address auto`` takes the options of ``scram sweep`` and writes the same tables, byte for byte. The driver
keeps every row in the journal of ``scram sweep`` as it comes: killed, it goes on where it was when the same is run again, here or by the
command itself. What a node that dies had in work is made again by another one. ``docs/cluster.md`` says how far this goes.
"""

from __future__ import annotations

import argparse
import json
import logging
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from os.path import commonpath
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scram._scram import Sweep
from scram.errors import InputError, ScramError

if TYPE_CHECKING:
    from types import ModuleType

#: Length of a task that is aimed at, s: long beside what Ray takes for one, short beside what a dying node costs.
TASK_S = 2.0
#: Tasks in work for every core: one runs, one waits.
TASKS_A_CORE = 2

#: Ray's switch for clusters on systems with a firewall that asks; with 0 nodes stay on the loopback interface, on every system.
LOOPBACK = "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER"

Rows = list[tuple[int, list[str], list[str]]]


@dataclass(frozen=True)
class Task:
    """What a worker must know to make rows: the options, and the robot's files by their relative names, its own first."""

    arguments: tuple[str, ...]
    files: tuple[tuple[str, bytes], ...]
    about: str
    """What rows depend on, on the driver's machine."""


def task_of(sweep: Sweep, arguments: Sequence[str]) -> Task:
    """The task of a sweep, with the robot's files in it: workers need no common file system."""
    paths = [Path(path).resolve() for path in sweep.files]
    above = Path(commonpath([path.parent for path in paths]))
    files = tuple((path.relative_to(above).as_posix(), path.read_bytes()) for path in paths)
    return Task(tuple(arguments), files, sweep.about)


#: What a worker's process makes rows of: one sweep at a time.
_made: dict[Task, Sweep] = {}


def worker_of(task: Task) -> Sweep:
    """The sweep as a worker has it, made once a process."""
    if task not in _made:
        _made.clear()
        _made[task] = make_worker(task)
    return _made[task]


def make_worker(task: Task) -> Sweep:
    """The sweep from its task, if this machine makes the rows of the driver's."""
    with tempfile.TemporaryDirectory() as directory:
        for name, content in task.files:
            file = Path(directory, name)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(content)
        sweep = Sweep(list(task.arguments), Path(directory, task.files[0][0]))
    if sweep.about != task.about:
        raise ScramError(
            "this node makes other rows than the driver's machine\n"
            "  help: install the same version of scram on every node, on processors of one kind"
        )
    return sweep


def make_rows(task: Task, groups: Sequence[Sequence[int]]) -> tuple[Rows, float]:
    """Rows of groups of runs, and how long they took, s."""
    began = time.perf_counter()
    sweep = worker_of(task)
    rows = [row for group in groups for row in sweep.rows(list(group))]
    return rows, time.perf_counter() - began


def ray_module() -> ModuleType:
    """Ray, which is not needed for the rest of the package."""
    try:
        import ray
    except ImportError as error:
        raise ScramError("ray is not installed\n  help: pip install 'scram[ray]'") from error
    return ray


class Pool:
    """Tasks on a cluster, none lost: one whose node dies is made again by another.

    ``remote`` begins a task over groups and gives its reference, ``cores`` says how many tasks run at a time; a cluster that grows
    meanwhile gets more.
    """

    def __init__(
        self, groups: list[list[int]], remote: Callable[[list[list[int]]], Any], cores: Callable[[], int]
    ) -> None:
        self.ray = ray_module()
        self.remote, self.cores = remote, cores
        self.waiting = groups[::-1]
        self.running: dict[Any, list[list[int]]] = {}
        self.groups_a_task = 1
        self.seconds_a_group: float | None = None

    @classmethod
    def of(cls, task: Task, groups: list[list[int]]) -> Pool:
        """The tasks of a sweep."""
        ray = ray_module()
        # Whatever a node's death ends is tried again, however often; an error of ours ends the sweep.
        made = ray.remote(num_cpus=1, max_retries=-1, retry_exceptions=False)(make_rows)
        shared = ray.put(task)
        return cls(groups, lambda some: made.remote(shared, some), lambda: int(ray.cluster_resources().get("CPU", 1)))

    def submit(self) -> None:
        """Keeps every core in work, and the last ones with small tasks."""
        most = TASKS_A_CORE * max(1, self.cores())
        while self.waiting and len(self.running) < most:
            count = max(1, min(self.groups_a_task, -(-len(self.waiting) // most)))
            groups = [self.waiting.pop() for _ in range(min(count, len(self.waiting)))]
            self.running[self.remote(groups)] = groups

    def results(self) -> Iterator[Rows]:
        """Rows as they come."""
        errors = self.ray.exceptions
        while self.waiting or self.running:
            self.submit()
            ready, _ = self.ray.wait(list(self.running), num_returns=1, timeout=1.0)
            more, _ = self.ray.wait(list(self.running), num_returns=len(self.running), timeout=0.0)
            for reference in {*ready, *more}:
                groups = self.running.pop(reference)
                try:
                    rows, seconds = self.ray.get(reference)
                except (errors.WorkerCrashedError, errors.ObjectLostError, errors.NodeDiedError):
                    self.waiting.extend(groups)
                    continue
                except errors.RayTaskError as error:
                    raise (error.cause if isinstance(error.cause, ScramError) else error) from None
                self.learn(seconds / len(groups))
                yield rows

    def learn(self, seconds: float) -> None:
        """How many groups make a task of a good length."""
        before = self.seconds_a_group
        self.seconds_a_group = seconds if before is None else 0.8 * before + 0.2 * seconds
        self.groups_a_task = max(1, round(TASK_S / max(self.seconds_a_group, 1e-6)))


@contextmanager
def connected(address: str | None) -> Iterator[None]:
    """Ray, started on this machine where no address is named. One that runs already is left running."""
    if address is None:
        # Nobody else is to be served: on the loopback interface only. Ray reads this when it is imported.
        os.environ.setdefault(LOOPBACK, "0")
    ray = ray_module()
    own = not ray.is_initialized()
    if own:
        dashboard = False if address is None else None
        ray.init(address or "local", log_to_driver=False, logging_level=logging.ERROR, include_dashboard=dashboard)
    try:
        yield
    finally:
        if own:
            ray.shutdown()


def sweep(arguments: Sequence[str], *, address: str | None = None, quiet: bool = False) -> list[Path]:
    """Make a sweep on a cluster; ``arguments`` are the options of ``scram sweep``.

    Gives the tables that were written. ``address`` is Ray's; without one the cores of this machine do the work.

    Raises
    ------
    InputError
        An option is wrong, or the robot cannot be brought where an axis leads.
    ScramError
        The directory holds another sweep, a table cannot be written, or a node makes other rows.
    """
    driver = Sweep(list(arguments))
    task = task_of(driver, arguments)
    pending = driver.open()

    def say(words: str, end: str = "\n") -> None:
        if not quiet:
            print(words, end=end, file=sys.stderr, flush=True)

    for warning in driver.warnings:
        say(f"warning: {warning}")
    if driver.done:
        say(f"{driver.done} of {driver.total} runs were there already")
    if pending:
        with connected(address):
            shown = 0.0
            for rows in Pool.of(task, pending).results():
                driver.book(rows)
                if time.monotonic() - shown > 1.0:
                    shown = time.monotonic()
                    say(f"\r{driver.done} of {driver.total} runs", end="")
        say(f"\r{driver.total} of {driver.total} runs")
    return [Path(path) for path in driver.finish()]


def make_part(arguments: Sequence[str], number: int, count: int) -> Path:
    """Make every ``count``-th group of a sweep from number ``number`` (from 0) on, for an array of jobs, and keep it in ``--out``/parts.

    A part that is there already is not made again.
    """
    part = Sweep(list(arguments))
    file = part.out / "parts" / f"part-{number:05}-of-{count}.json"
    about = part.about
    if file.exists() and json.loads(file.read_text())["about"] == about:
        return file
    rows = [row for group in part.groups()[number::count] for row in part.rows(group)]
    file.parent.mkdir(parents=True, exist_ok=True)
    beside = file.with_suffix(f".{os.getpid()}.tmp")
    beside.write_text(json.dumps({"about": about, "rows": rows}))
    beside.replace(file)
    return file


def collect(arguments: Sequence[str]) -> list[Path]:
    """Put the parts of an array of jobs together into the tables of the sweep.

    Raises
    ------
    ScramError
        A part is of another sweep or was made by a machine that makes other rows, or rows are missing.
    """
    driver = Sweep(list(arguments))
    about = driver.about
    missing = {run + 1 for group in driver.open() for run in group}
    for file in sorted((driver.out / "parts").glob("part-*.json")):
        part = json.loads(file.read_text())
        if part["about"] != about:
            raise ScramError(f"{file} is of another sweep, or of a machine that makes other rows\n  help: delete it")
        rows = [(number, cells, path) for number, cells, path in part["rows"] if number in missing]
        driver.book(rows)
        missing -= {number for number, _, _ in rows}
    if missing:
        help = "run the array's jobs that are missing, or `sweep` with the same options, which makes the rest"
        raise ScramError(f"{len(missing)} of {driver.total} runs are in no part\n  help: {help}")
    return [Path(path) for path in driver.finish()]


def part_of(words: str) -> tuple[int, int]:
    """``3/8``: part 3, from 0, of 8."""
    number, _, count = words.partition("/")
    if not (number.isdecimal() and count.isdecimal() and int(number) < int(count)):
        raise argparse.ArgumentTypeError("NUMBER/COUNT is expected, the number from 0, as 3/8")
    return int(number), int(count)


def main(arguments: Sequence[str] | None = None) -> int:
    """The command line; exit codes are those of ``scram``."""
    parser = argparse.ArgumentParser(
        prog="python -m scram.cluster",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        add_help=False,
    )
    parser.add_argument("command", choices=["sweep", "collect"], help="make a sweep, or put an array's parts together")
    parser.add_argument("--address", help="Ray's address, `auto` for a cluster that runs here [default: this machine alone]")
    parser.add_argument("--part", type=part_of, metavar="NUMBER/COUNT", help="of an array of jobs: make this part, without Ray")
    parser.add_argument("--help", "-h", action="store_true", help="show this and the options of a sweep")
    own, rest = parser.parse_known_args(arguments)
    if own.help:
        print(parser.format_help())
        print(Sweep.help())
        return 0
    try:
        if own.part:
            files = [make_part(rest, *own.part)]
        elif own.command == "collect":
            files = collect(rest)
        else:
            files = sweep(rest, address=own.address)
    except ScramError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2 if isinstance(error, InputError) else 1
    except KeyboardInterrupt:
        print("\nstopped; what was made is kept, and the same command goes on from there", file=sys.stderr)
        return 130
    print(f"written: {', '.join(map(str, files))}")
    return 0


if __name__ == "__main__":
    # Workers look for what they are sent in the module by its name.
    from scram import cluster

    sys.exit(cluster.main())
