"""Sweeps over many machines: the rows of one."""

from __future__ import annotations

import json
import os
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from os.path import commonpath
from pathlib import Path

from scram._scram import Sweep
from scram.cluster._pool import Files, Pool, connected, say, unpacked
from scram.errors import ScramError

Rows = list[tuple[int, list[str], list[str]]]


@dataclass(frozen=True)
class Task:
    """What a worker must know to make rows: the options, and the robot's files by their relative names, its own first."""

    arguments: tuple[str, ...]
    files: Files
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
        unpacked(task.files, Path(directory))
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


def sweep(arguments: Sequence[str], *, address: str | None = None) -> list[Path]:
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

    for warning in driver.warnings:
        say(f"warning: {warning}")
    if driver.done:
        say(f"{driver.done} of {driver.total} runs were there already")
    if pending:
        with connected(address):
            shown = 0.0
            for rows in Pool.of(make_rows, task, pending).results():
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
