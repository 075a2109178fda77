"""Measured speeds of walks, as a file or as columns."""

from collections.abc import Mapping
from os import PathLike, fspath
from typing import TYPE_CHECKING, Literal, Union

import numpy as np
import numpy.typing as npt

from scram import _scram
from scram.errors import InputError

if TYPE_CHECKING:
    import pandas

Speeds = Union[Mapping[str, npt.ArrayLike], "pandas.DataFrame", str, PathLike[str]]

#: Columns, in the order in which the engine takes them.
COLUMNS = ("f_hz", "alpha_deg", "vx_mm_per_s", "vy_mm_per_s", "yaw_deg_per_s")


def speeds(measured: Speeds) -> npt.NDArray[np.float64] | str:
    """The file's name, or a row a run."""
    if isinstance(measured, (str, PathLike)):
        return fspath(measured)
    missing = [name for name in COLUMNS if name not in measured]
    if missing:
        raise InputError(f"no column {', '.join(missing)}\n  help: the columns are {', '.join(COLUMNS)}")
    return np.column_stack([np.asarray(measured[name], dtype=np.float64) for name in COLUMNS])


def captured_speeds(
    file: str | PathLike[str],
    *,
    body: str | None = None,
    rear: str | None = None,
    ahead_deg: float = 0.0,
    window_s: tuple[float, float] = (1.0, 2.0),
    rate_hz: float | None = None,
    mm_per_unit: float | None = None,
    up: Literal["y", "z"] | None = None,
    columns: Mapping[str, str] | None = None,
) -> tuple[float, float, float]:
    """Read how fast a robot walked from a motion capture: ahead and to the left, mm/s, and yaw, °/s, in the frame of its start.

    What a row of the columns of ``identify_robot`` and ``diagnose_walk`` is made of. Files are the exports that
    ``scram identify robot`` reads.

    Parameters
    ----------
    file
        The export.
    body, rear
        The rigid body, where the file has several; or two points, the robot's front lying from ``rear`` to ``body``.
    ahead_deg
        From the body's x axis to the robot's front, counter-clockwise seen from above.
    window_s
        Between which times after the start.
    rate_hz, mm_per_unit, up, columns
        What a file does not say itself: frames a second, the size of its units, its upright axis, and names of columns, as ``{"t_s": "Time"}``.

    Raises
    ------
    MissingFileError
        There is no such file.
    InputError
        The file is no export that can be read, has no such body, or the body is not seen so long.
    """
    return _scram.captured_speeds(
        fspath(file),
        body=body,
        rear=rear,
        ahead_deg=ahead_deg,
        window_s=window_s,
        rate_hz=rate_hz,
        mm_per_unit=mm_per_unit,
        up=up,
        columns=list((columns or {}).items()),
    )
