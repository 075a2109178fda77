"""Many robots side by side: the kernel of ``scram sweep``, without a file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import radians
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from scram import _scram
from scram._scram import Robot
from scram.errors import InputError, ScramError

if TYPE_CHECKING:
    import pandas

Floats = npt.NDArray[np.float64]

#: What is measured of a run, as the fields of a batch are called.
MEASURES = (
    "vx_mm_per_s",
    "vy_mm_per_s",
    "yaw_deg_per_s",
    "energy_j",
    "energy_j_per_m",
    "mean_f_hz",
    "front_mm_per_s",
    "rear_mm_per_s",
    "roundness",
)


@dataclass(frozen=True, slots=True, eq=False)
class Batch:
    """What a batch measured: arrays of shape (points, seeds), NaN where a run has no such number.

    Attributes
    ----------
    drive
        What the shaft does, one a point.
    parameters
        What was varied, by its name: of shape (points,), in the unit at the name's end.
    seeds
        Of shape (seeds,).
    vx_mm_per_s, vy_mm_per_s, yaw_deg_per_s
        Mean speeds over the second half of a run in the frame of its start: ahead and to the left, mm/s, and counter-clockwise, °/s.
    energy_j
        What the bridge took from its supply in that half, J; NaN where the shaft is ideal.
    energy_j_per_m
        The same over the way of the centroid, J/m.
    mean_f_hz
        Mean frequency of the shaft, Hz, positive clockwise.
    front_mm_per_s, rear_mm_per_s
        Way of the first and of the last module over time, mm/s.
    roundness
        Short over long axis of the front feet's traces seen from above: 0 a line, 1 a circle.
    path_mm
        Centroid over the ground from the start on, mm, shape (points, seeds, times, 2): ahead and to the left.
    path_s
        Times of the paths, s, shape (times,).
    notes
        What a person should know of a run, as of one that blew up; empty for an ordinary one.
    """

    drive: tuple[str, ...]
    parameters: Mapping[str, Floats]
    seeds: npt.NDArray[np.uint64]
    vx_mm_per_s: Floats
    vy_mm_per_s: Floats
    yaw_deg_per_s: Floats
    energy_j: Floats
    energy_j_per_m: Floats
    mean_f_hz: Floats
    front_mm_per_s: Floats
    rear_mm_per_s: Floats
    roundness: Floats
    path_mm: Floats
    path_s: Floats
    notes: npt.NDArray[np.str_]

    def __repr__(self) -> str:
        points, seeds, times, _ = self.path_mm.shape
        return f"<scram.Batch of {points} points with {seeds} seeds, paths of {times} times>"

    def to_pandas(self) -> pandas.DataFrame:
        """The batch as a data frame, a row for each point and seed: drive, parameters, seed, what was measured, notes; no paths.

        Raises
        ------
        ScramError
            pandas is not installed.
        """
        try:
            import pandas
        except ImportError as error:
            raise ScramError("pandas is not installed\n  help: pip install 'scram[pandas]'") from error
        points, seeds = self.notes.shape
        of_points = {"drive": np.array(self.drive), **self.parameters}
        rows: dict[str, npt.NDArray[Any]] = {name: np.repeat(values, seeds) for name, values in of_points.items()}
        rows["seed"] = np.tile(self.seeds, points)
        rows |= {name: getattr(self, name).ravel() for name in (*MEASURES, "notes")}
        return pandas.DataFrame(rows)


def simulate_batch(
    robot: Robot,
    drive: str | Sequence[str] = "freq:7",
    *,
    parameters: Mapping[str, npt.ArrayLike] | None = None,
    seeds: npt.ArrayLike = (1,),
    seconds: float = 2.0,
    turned_by: Literal["motor", "ideal"] = "motor",
    phase_noise_deg: float = 2.0,
    step_s: float = 1e-4,
    single: bool = False,
    one_robot: bool = False,
    threads: int = 0,
) -> Batch:
    """Run a robot on the ground under many conditions, each with every seed, over all cores.

    Parameters
    ----------
    robot
        A robot with a body.
    drive
        ``freq:HZ`` or ``oscillate:0..DEG``, one for all points or one a point.
    parameters
        Values of shape (points,), or one for all points, by the names of ``scram sweep --axis``: ``alpha``, ``body.modules``,
        ``backbone.roll_deg[N]`` or any quantity of the robot file.
    seeds
        Seeds of the runs that are made at every point; each draws what belongs to a robot, as its sensor's error, and what belongs to a
        run.
    seconds
        Length of a run, s.
    turned_by
        ``motor``: the firmware's controller with the simulated motor, sensor and battery. ``ideal``: a shaft at exactly the
        frequency but for a start angle and a phase error.
    phase_noise_deg
        Phase error of the ideal shaft, root mean square, degrees.
    step_s
        Integration step, s; must go into 10 ms and into the control period.
    single
        Advance the bodies in single precision: about twice as fast.
    one_robot
        What belongs to a robot is drawn from the first seed for all of them, as ``scram sweep`` does.
    threads
        Threads; 0 for one a core.

    Raises
    ------
    InputError
        A name, a shape or a value is not allowed, or the controller refuses a drive.

    Examples
    --------
    >>> import scram
    >>> robot = scram.Robot("robot.toml")
    >>> batch = scram.simulate_batch(robot, ["freq:7", "freq:-7"], seconds=0.5, turned_by="ideal", seeds=[1, 2, 3])
    >>> batch.vx_mm_per_s.shape
    (2, 3)
    """
    given = {path: np.atleast_1d(np.asarray(values, dtype=np.float64)) for path, values in (parameters or {}).items()}
    drives = [drive] if isinstance(drive, str) else list(drive)
    flat = [*given.values(), np.zeros(len(drives))]
    if any(values.ndim != 1 or values.size == 0 for values in flat):
        raise InputError("parameters and drives must be one value or of shape (points,), and not empty")
    count = max(values.size for values in flat)
    wrong = {path: values.size for path, values in given.items() if values.size not in (1, count)}
    if len(drives) not in (1, count):
        wrong["drive"] = len(drives)
    if wrong:
        lengths = ", ".join(f"{path} has {size}" for path, size in wrong.items())
        raise InputError(f"there are {count} points, but {lengths}\n  help: give one value, or one a point")
    points = np.empty((count, len(given)))
    for column, values in enumerate(given.values()):
        points[:, column] = values
    settings = {
        "seconds": float(seconds),
        "step_s": float(step_s),
        "single": bool(single),
        "one_robot": bool(one_robot),
        "phase_noise": _phase_noise(turned_by, phase_noise_deg),
        "threads": int(threads),
    }
    whole = drives * count if len(drives) == 1 else drives
    checked = _seeds(seeds)
    found = _scram.simulate_batch(robot, whole, list(given), points, checked, settings)
    notes = np.array(found.pop("notes"), dtype=np.str_).reshape(found["vx_mm_per_s"].shape)
    times = np.linspace(0.0, seconds, found["path_mm"].shape[2])
    varied = {path: points[:, column] for column, path in enumerate(given)}
    return Batch(**found, drive=tuple(whole), parameters=varied, seeds=checked, path_s=times, notes=notes)


def _phase_noise(turned_by: str, degrees: float) -> float | None:
    """Phase error of what turns the eccentric, rad; none for the motor."""
    if turned_by == "motor":
        return None
    if turned_by != "ideal":
        raise InputError(f"turned_by is `motor` or `ideal`, not `{turned_by}`")
    if not 0.0 <= degrees <= 90.0:
        raise InputError("the phase error must be a number from 0 to 90")
    return radians(degrees)


def _seeds(seeds: npt.ArrayLike) -> npt.NDArray[np.uint64]:
    """Seeds as the engine takes them."""
    array = np.atleast_1d(np.asarray(seeds))
    if array.ndim != 1 or array.size == 0 or array.dtype.kind not in "iu" or bool(np.any(array < 0)):
        raise InputError("seeds are whole numbers from 0 on, at least one")
    return array.astype(np.uint64)
