"""Recordings that are given as files."""

from __future__ import annotations

from collections.abc import Iterable
from os import PathLike

from scram._scram import Recording, read

Run = Recording | str | PathLike[str]
Runs = Run | Iterable[Run]

#: Samples of a run that are worth their time in a fit: a minute at 1 kHz. A longer file is thinned by whole blocks.
MOST_SAMPLES = 60_000


def loaded(runs: Runs) -> list[Recording]:
    """The recordings, those that are files read; one by itself is one of several."""
    several = [runs] if isinstance(runs, (Recording, str, PathLike)) else runs
    return [run if isinstance(run, Recording) else read(run, most_samples=MOST_SAMPLES) for run in several]
