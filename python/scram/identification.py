"""Parameters from measurements: ``scram identify``."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from os import PathLike, fspath
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from scram import _scram
from scram._paths import loaded
from scram._scram import Recording, Robot
from scram._speeds import Speeds, speeds
from scram.errors import InputError


@dataclass(frozen=True, slots=True)
class Number:
    """A number that was looked for, in the unit at the end of its path."""

    path: str
    value: float
    low: float
    high: float
    """Ends of the interval: 95 % of a motor, 90 % of a backbone and of a walk."""
    file: float | None
    """What the robot file says."""
    told: bool
    """Whether the measurements tell it, or it hangs on what is believed."""


def _number(path: str, said: Mapping[str, Any]) -> Number:
    """A number of a path, as the extension says it."""
    return Number(path, said["value"], said["low"], said["high"], said["file"], said["told"])


@dataclass(frozen=True, eq=False)
class _Fit:
    """What every fit has; in a notebook it shows a table and a plot."""

    robot: Robot
    """The robot with what was found."""
    svg: str = field(repr=False)
    """A plot; empty where there is none."""
    data: Mapping[str, Any] = field(repr=False)
    """Everything that the command prints with ``--json``."""

    def _rows(self) -> list[tuple[str, ...]]:
        return []

    def _repr_html_(self) -> str:
        rows = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in self._rows())
        return f"<table>{rows}</table>{self.svg}"


@dataclass(frozen=True, eq=False)
class PotentiometerFit(_Fit):
    """Correction and blind arc of an angle sensor. Angles in degrees."""

    before_rms_deg: float
    after_rms_deg: float
    """Error of the reading without and with the correction."""
    noise_deg: float
    """Scatter of one reading."""
    blind_arc_deg: tuple[float, float]

    def _rows(self) -> list[tuple[str, ...]]:
        low, high = self.blind_arc_deg
        return [
            ("error before, RMS", f"{self.before_rms_deg:.3f}°"),
            ("error left, RMS", f"{self.after_rms_deg:.3f}°"),
            ("noise of one reading", f"{self.noise_deg:.3f}°"),
            ("blind arc", f"{low:.1f}° … {high:.1f}°"),
        ]


@dataclass(frozen=True, eq=False)
class _NumbersFit(_Fit):
    numbers: tuple[Number, ...]

    def _rows(self) -> list[tuple[str, ...]]:
        def cells(one: Number) -> tuple[str, ...]:
            file = "–" if one.file is None else f"{one.file:.4g}"
            return (one.path, f"{one.value:.4g}", f"{one.low:.4g} … {one.high:.4g}", file, "yes" if one.told else "no")

        return [("number", "found", "interval", "file", "told"), *map(cells, self.numbers)]


@dataclass(frozen=True, eq=False)
class MotorFit(_NumbersFit):
    """A motor's numbers and its friction. Errors are of free rollouts on the held-out runs, rad."""

    friction: tuple[str, ...]
    """Effects of friction in the model."""
    noise_rad: float
    before_rad: float
    after_rad: float


@dataclass(frozen=True, eq=False)
class BackboneFit(_NumbersFit):
    """Stiffness and damping of a backbone. Errors by thesis (3.1), rad."""

    error_rad: float
    floor_rad: float
    """What the noise alone makes of the error."""


@dataclass(frozen=True, eq=False)
class RobotFit(_NumbersFit):
    """What decides how a robot walks."""

    misfit: float
    """Deviation of the fitted means over what repeats explain; above 1 something is missing."""
    thesis_loss: tuple[float, float]
    """Thesis (3.2) with the file's numbers and with those found."""


Run = Recording | str | PathLike[str]


def identify_potentiometer(robot: Robot, run: Run, *, second: bool = False) -> PotentiometerFit:
    """Find the angle sensor's correction and blind arc from one run at constant voltage.

    Parameters
    ----------
    robot
        A robot with a potentiometer.
    run
        A recording of several turns at constant voltage, or its file.
    second
        For the second of two sensors, and where it stands against the first.

    Raises
    ------
    MissingFileError
        There is no such file.
    InputError
        The recording is of another rig, too short, or the shaft does not turn evenly enough; the robot has no such sensor.

    Examples
    --------
    >>> import scram
    >>> robot = scram.Robot("robot.toml")
    >>> run = scram.simulate(robot, "duty:1", seconds=2.5, bench=True)
    >>> fit = scram.identify_potentiometer(robot, run)
    >>> fit.after_rms_deg < 0.2 < fit.before_rms_deg
    True
    """
    found = _scram.identify_potentiometer(robot, loaded([run])[0], second=second)
    said = found["said"]
    own = said["own"] if second else said
    correction = own["correction"]
    return PotentiometerFit(
        robot=found["robot"],
        svg=found["svg"],
        data=said,
        before_rms_deg=own["before_rms_deg"],
        after_rms_deg=own["after_rms_deg"],
        noise_deg=own["noise_deg"],
        blind_arc_deg=(correction["blind_from_deg"], correction["blind_to_deg"]),
    )


def identify_motor(
    robot: Robot,
    fit: Iterable[Run],
    holdout: Iterable[Run],
    *,
    resistance_ohm: float | None = None,
    inertia_kg_m2: float | None = None,
    seed: int = 1,
    threads: int = 0,
) -> MotorFit:
    """Find a motor's numbers and its friction from bench runs.

    Parameters
    ----------
    robot
        The robot as its file describes it.
    fit
        Recordings, or their files, that numbers are fitted on.
    holdout
        Recordings that are judged on and never fitted.
    resistance_ohm, inertia_kg_m2
        Of the winding, and of rotor and load, positive, where they are known to 2 %: without a measured current the scale of torques
        hangs on one of them.
    seed
        Seed of the bootstrap.
    threads
        Threads; 0 for one a core.

    Raises
    ------
    MissingFileError
        There is no such file.
    InputError
        A recording is of another rig or too short or is there twice, the model follows none of them, or a number is not allowed.
    """
    found = _scram.identify_motor(
        robot,
        loaded(fit),
        loaded(holdout),
        resistance_ohm=resistance_ohm,
        inertia_kg_m2=inertia_kg_m2,
        seed=seed,
        threads=threads,
    )
    said = found["said"]
    return MotorFit(
        robot=found["robot"],
        svg=found["svg"],
        data=said,
        numbers=tuple(Number(**one) for one in said["numbers"]),
        friction=tuple(said["friction"]),
        noise_rad=said["noise_rad"],
        before_rad=said["before_rad"],
        after_rad=said["after_rad"],
    )


@dataclass(frozen=True, eq=False)
class Release:
    """How a backbone's end turns after it is let go."""

    name: str
    t_s: npt.ArrayLike
    """Increasing times of shape (n,)."""
    angles_rad: npt.ArrayLike
    """Rotation about x (torsion), y (stiff) and z (soft) against the pose at rest, shape (n, 3); NaN where missing."""


def identify_backbone(
    robot: Robot,
    fit: Iterable[Release | str | PathLike[str]],
    holdout: Iterable[Release | str | PathLike[str]] = (),
    *,
    body: str | None = None,
    base: str | None = None,
    module: int | None = None,
    gravity: Literal["level", "hanging", "none"] = "level",
) -> BackboneFit:
    """Find a backbone's stiffness and damping from its free oscillations (thesis section 3.1).

    Parameters
    ----------
    robot
        A robot with a body.
    fit
        Oscillations to fit: each a :class:`Release`, or a motion capture's file.
    holdout
        Oscillations that are judged on and never fitted.
    body
        The rigid body that swings, where a file has several.
    base
        The one that holds the fast end, where that moves, too.
    module
        Which of the robot's modules is at the end, from 1; the last where nothing is said.
    gravity
        How the backbone stands in the room: it lies ``level``, is ``hanging`` from its fast end, or ``none`` where gravity is left out.

    Raises
    ------
    MissingFileError
        There is no such file.
    InputError
        A run cannot be used, the robot has no such module, or no stiffness near the file's swings like these runs.
    """

    def release(run: Release | str | PathLike[str]) -> str | tuple[str, npt.NDArray[Any], npt.NDArray[Any]]:
        if isinstance(run, Release):
            return (run.name, np.asarray(run.t_s, dtype=np.float64), np.asarray(run.angles_rad, dtype=np.float64))
        return fspath(run)

    found = _scram.identify_backbone(
        robot,
        [release(run) for run in fit],
        [release(run) for run in holdout],
        body=body,
        base=base,
        module=module,
        gravity=gravity,
    )
    said = found["said"]
    numbers = [
        _number(f"backbone.{one['field']}", one) for one in said["hinges"]
    ]
    return BackboneFit(
        robot=found["robot"],
        svg=found["svg"],
        data=said,
        numbers=tuple(numbers),
        error_rad=said["error_rad"],
        floor_rad=said["floor_rad"],
    )


def identify_robot(
    robot: Robot,
    measured: Speeds,
    *,
    holdout: Sequence[tuple[float, float]] = (),
    uneven: bool = False,
    window_s: tuple[float, float] = (1.0, 2.0),
    draws: int = 200,
    seed: int = 1,
    threads: int = 0,
) -> RobotFit:
    """Find what of a robot decides how it walks, from its measured speeds (thesis section 3.3).

    Parameters
    ----------
    robot
        A robot with a body.
    measured
        A table's file, or columns (for example a data frame) ``f_hz`` (positive clockwise), ``alpha_deg``, ``vx_mm_per_s``,
        ``vy_mm_per_s`` (to the left) and ``yaw_deg_per_s``, a row a run, NaN where nothing was measured.
    holdout
        Conditions (f in Hz, α in degrees) to judge by, in place of one in four.
    uneven
        Look for an off-centre weight and for each foot's own friction, too.
    window_s
        Speeds are those between these times of a run, s: two from 0 on, at least 0.05 s apart.
    draws
        Sets of numbers that are drawn to find where the fit starts.
    seed
        Of these draws.
    threads
        Threads; 0 for one a core.

    Raises
    ------
    MissingFileError
        There is no such file.
    InputError
        The table has too few conditions, a held-out one is not in it, a number is not allowed, or the robot cannot be simulated.
    """
    found = _scram.identify_robot(
        robot,
        speeds(measured),
        holdout=list(holdout),
        uneven=uneven,
        window_s=window_s,
        draws=draws,
        seed=seed,
        threads=threads,
    )
    said = found["said"]
    numbers = [
        _number(one["path"], one) for one in said["parameters"]
    ]
    before, after = said["thesis_loss"]
    return RobotFit(
        robot=found["robot"],
        svg=found["svg"],
        data=said,
        numbers=tuple(numbers),
        misfit=said["misfit"],
        thesis_loss=(before, after),
    )
