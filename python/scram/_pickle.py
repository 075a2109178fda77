"""Recordings in pickles: for other processes, as those of ``multiprocessing`` and Ray."""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from scram._scram import Recording

#: zlib's fastest level: a recording's numbers are text in its file.
LEVEL = 1


def file_of(recording: Recording) -> bytes:
    """All of a recording that its file holds."""
    with TemporaryDirectory(prefix="scram-") as directory:
        file = Path(directory, "run.mcap")
        recording.write(file)
        return zlib.compress(file.read_bytes(), LEVEL)


def recording_of(packed: bytes, name: str | PathLike[str], metrics: Mapping[str, Any], notes: Sequence[str]) -> Recording:
    """The recording of such a file, with what the file does not hold."""
    with TemporaryDirectory(prefix="scram-") as directory:
        file = Path(directory, "run.mcap")
        file.write_bytes(zlib.decompress(packed))
        return Recording._of_file(file, name, metrics, notes)
