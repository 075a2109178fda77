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
from scram._paths import Run, Runs, loaded
from scram._scram import Robot
from scram._speeds import Speeds, speeds
from scram.errors import InputError


@dataclass(frozen=True, slots=True)
class Number:
    """A number that was looked for, in the unit at the end of its path.

    Attributes
    ----------
    path
        Dotted path in the robot file.
    value
        What was found.
    low, high
        Ends of the interval: 95 % of a motor, 90 % of a backbone and of a walk.
    file
        What the robot file says; None where it says nothing.
    told
        Whether the measurements tell it: of a motor, the interval's ends are at most a factor of 1.3 apart; of a backbone, its axis
        swings; of a walk, at most half of the width of what the file believes is left. Otherwise it hangs on what is believed.
    """

    path: str
    value: float
    low: float
    high: float
    file: float | None
    told: bool


def _number(path: str, said: Mapping[str, Any]) -> Number:
    """A number of a path, as the extension says it."""
    return Number(path, said["value"], said["low"], said["high"], said["file"], said["told"])


#: Of every fit, behind what its own documentation says.
_OF_EVERY_FIT = """robot
        The robot with what was found.
    svg
        A plot; empty where there is none.
    data
        Everything that the command prints with ``--json``.
    """


@dataclass(frozen=True, eq=False)
class _Fit:
    """What every fit has; in a notebook it shows a table and a plot."""

    robot: Robot
    svg: str = field(repr=False)
    data: Mapping[str, Any] = field(repr=False)

    def __init_subclass__(cls) -> None:
        cls.__doc__ = f"{cls.__doc__ or ''}{_OF_EVERY_FIT}"

    def _rows(self) -> list[tuple[str, ...]]:
        return []

    def _repr_html_(self) -> str:
        rows = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in self._rows())
        return f"<table>{rows}</table>{self.svg}"


@dataclass(frozen=True, eq=False)
class PotentiometerFit(_Fit):
    """Correction and blind arc of an angle sensor.

    Attributes
    ----------
    before_rms_deg, after_rms_deg
        Error of the reading without and with the correction, degrees, root mean square.
    noise_deg
        Scatter of one reading, degrees, root mean square.
    blind_arc_deg
        Where the blind arc begins and ends, degrees counter-clockwise from the middle of the gap.
    """

    before_rms_deg: float
    after_rms_deg: float
    noise_deg: float
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
    """A motor's numbers and its friction.

    Attributes
    ----------
    numbers
        Each a :class:`Number`: resistance, torque constant, inertias, and those of the friction.
    friction
        Effects of friction in the model; empty where these runs show none.
    noise_rad
        Noise of the angle reading, rad, root mean square.
    before_rad, after_rad
        Error of free rollouts on the held-out runs with the file's numbers and with those found, rad, root mean square.
    """

    friction: tuple[str, ...]
    noise_rad: float
    before_rad: float
    after_rad: float


@dataclass(frozen=True, eq=False)
class BackboneFit(_NumbersFit):
    """Stiffness and damping of a backbone.

    Attributes
    ----------
    numbers
        Each a :class:`Number`: stiffness and damping of every hinge.
    error_rad
        Error of the fitted runs by thesis (3.1), rad.
    floor_rad
        What the noise alone makes of the error, rad.
    """

    error_rad: float
    floor_rad: float


@dataclass(frozen=True, eq=False)
class RobotFit(_NumbersFit):
    """What decides how a robot walks.

    Attributes
    ----------
    numbers
        Each a :class:`Number`, what the speeds tell best first.
    misfit
        Deviation of the fitted means over what repeats explain, without a unit; above 1 something is missing, and above 1.5 the intervals
        are no promise.
    thesis_loss
        Thesis (3.2) over all conditions with the file's numbers and with those found; mm/s and °/s are added up as in the thesis.
    """

    misfit: float
    thesis_loss: tuple[float, float]


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
    fit: Runs,
    holdout: Runs,
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
        Recordings, or their files, that numbers are fitted on; or one of them. Simulated ones are of one seed.
    holdout
        The same that are judged on and never fitted.
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
    """How a backbone's end turns after it is let go.

    Attributes
    ----------
    name
        What messages call it.
    t_s
        Increasing times, s, shape (n,).
    angles_rad
        Rotation about x (torsion), y (stiff) and z (soft) against the pose at rest, rad, shape (n, 3); NaN where missing.
    """

    name: str
    t_s: npt.ArrayLike
    angles_rad: npt.ArrayLike


Releases = Release | str | PathLike[str] | Iterable[Release | str | PathLike[str]]


def identify_backbone(
    robot: Robot,
    fit: Releases,
    holdout: Releases = (),
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
        Oscillations to fit: each a :class:`Release`, or a motion capture's file; or one of them.
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

    def releases(runs: Releases) -> list[str | tuple[str, npt.NDArray[Any], npt.NDArray[Any]]]:
        return [release(run) for run in ([runs] if isinstance(runs, (Release, str, PathLike)) else runs)]

    found = _scram.identify_backbone(
        robot,
        releases(fit),
        releases(holdout),
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

    The shaft is taken to turn evenly, unless the robot file has ``eccentric.servo_nm_per_rad`` and ``servo_nm_s_per_rad``. Speeds of
    ``simulate_batch`` that are to stand for measured ones are therefore made with ``turned_by="ideal"``: what a motor's shaft does within
    a turn would be blamed on something else. It takes two to four minutes on two cores with the usual
    draws.

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
