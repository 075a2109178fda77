"""Tasks on a Ray cluster, none lost."""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from scram.errors import InputError, ScramError

if TYPE_CHECKING:
    from types import ModuleType

#: Length of a task that is aimed at, s: long beside what Ray takes for one, short beside what a dying node costs.
TASK_S = 2.0
#: Tasks in work for every core: one runs, one waits.
TASKS_A_CORE = 2

#: Ray's switch for clusters on systems with a firewall that asks; with 0 nodes stay on the loopback interface, on every system.
LOOPBACK = "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER"

#: Files that travel with a task, by their relative names.
Files = tuple[tuple[str, bytes], ...]


def ray_module() -> ModuleType:
    """Ray, which is not needed for the rest of the package."""
    try:
        import ray
    except ImportError as error:
        raise ScramError("ray is not installed\n  help: pip install 'scram[ray]'") from error
    return ray


Item = TypeVar("Item")
Result = TypeVar("Result")


class Pool(Generic[Item, Result]):
    """Tasks on a cluster, none lost: one whose node dies is made again by another.

    ``remote`` begins a task over some items and gives its reference, ``cores`` says how many tasks run at a time; a cluster that grows
    meanwhile gets more.
    """

    def __init__(self, items: Sequence[Item], remote: Callable[[list[Item]], Any], cores: Callable[[], int]) -> None:
        self.ray = ray_module()
        self.remote, self.cores = remote, cores
        self.waiting = list(items)[::-1]
        self.running: dict[Any, list[Item]] = {}
        self.items_a_task = 1
        self.seconds_an_item: float | None = None

    @classmethod
    def of(
        cls, make: Callable[[Any, list[Item]], tuple[Result, float]], shared: object, items: Sequence[Item], cores: int = 1
    ) -> Pool[Item, Result]:
        """Tasks of so many cores that ``make`` results of what they share and of their items, and say how long that took, s.

        Raises
        ------
        InputError
            No node has so many cores: Ray would wait for one that has.
        """
        ray = ray_module()
        largest = largest_node(ray)
        if cores > largest:
            raise InputError(
                f"a command needs {cores} cores, and the largest node has {largest}\n"
                f"  help: give --cores {max(1, largest)} or less, or add a node with {cores} cores to the cluster"
            )
        # Whatever a node's death ends is tried again, however often; an error of ours ends the whole.
        made = ray.remote(num_cpus=cores, max_retries=-1, retry_exceptions=False)(make)
        there = ray.put(shared)
        return cls(items, lambda some: made.remote(there, some), lambda: int(ray.cluster_resources().get("CPU", 1)) // cores)

    def submit(self) -> None:
        """Keeps every core in work, and the last ones with small tasks."""
        most = TASKS_A_CORE * max(1, self.cores())
        while self.waiting and len(self.running) < most:
            count = max(1, min(self.items_a_task, -(-len(self.waiting) // most)))
            items = [self.waiting.pop() for _ in range(min(count, len(self.waiting)))]
            self.running[self.remote(items)] = items

    def results(self) -> Iterator[Result]:
        """Results as they come, one a task."""
        errors = self.ray.exceptions
        while self.waiting or self.running:
            self.submit()
            ready, _ = self.ray.wait(list(self.running), num_returns=1, timeout=1.0)
            more, _ = self.ray.wait(list(self.running), num_returns=len(self.running), timeout=0.0)
            for reference in {*ready, *more}:
                items = self.running.pop(reference)
                try:
                    result, seconds = self.ray.get(reference)
                except (errors.WorkerCrashedError, errors.ObjectLostError, errors.NodeDiedError):
                    self.waiting.extend(items)
                    continue
                except errors.RayTaskError as error:
                    raise (error.cause if isinstance(error.cause, ScramError) else error) from None
                self.learn(seconds / len(items))
                yield result

    def learn(self, seconds: float) -> None:
        """How many items make a task of a good length."""
        before = self.seconds_an_item
        self.seconds_an_item = seconds if before is None else 0.8 * before + 0.2 * seconds
        self.items_a_task = max(1, round(TASK_S / max(self.seconds_an_item, 1e-6)))


def largest_node(ray: ModuleType) -> int:
    """Cores of the node that has most of them."""
    return max((int(node["Resources"].get("CPU", 0)) for node in ray.nodes() if node["Alive"]), default=0)


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
        try:
            ray.init(address or "local", log_to_driver=False, logging_level=logging.ERROR, include_dashboard=dashboard)
        except (ConnectionError, RuntimeError, ValueError) as error:
            help = "start one with `ray start --head`, or leave the address out for this machine alone"
            raise ScramError(f"no Ray at `{address or 'local'}`: {error}\n  help: {help}") from error
    try:
        yield
    finally:
        if own:
            ray.shutdown()


def unpacked(files: Files, directory: Path) -> None:
    """Files that travelled, in a directory."""
    for name, content in files:
        file = directory / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(content)


def say(words: str, end: str = "\n") -> None:
    """Tell the person who waits."""
    print(words, end=end, file=sys.stderr, flush=True)
