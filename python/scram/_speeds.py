"""Measured speeds of walks, as a file or as columns."""

from collections.abc import Mapping
from os import PathLike, fspath
from typing import TYPE_CHECKING, Union

import numpy as np
import numpy.typing as npt

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
