"""What the simulation of a recorded or measured robot gets wrong: ``scram diagnose``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from typing import Any, Literal

from scram import _scram
from scram._paths import Runs, loaded
from scram._scram import Robot
from scram._speeds import Speeds, speeds

Interval = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Cause:
    """An effect that the model lacks.

    Attributes
    ----------
    effect
        Name as in the robot file's ``[effects.NAME]``.
    also
        Effects that these runs cannot tell from it.
    parameters
        By key: value, low and high of the interval, 95 % of a shaft and 90 % of a walk, in the unit at the key's end.
    """

    effect: str
    also: tuple[str, ...]
    parameters: Mapping[str, Interval]


@dataclass(frozen=True, slots=True, eq=False)
class Diagnosis:
    """What a diagnosis says; in a notebook it shows its report.

    Attributes
    ----------
    verdict
        ``nothing``: the model lacks nothing that these runs show; ``explained``: it lacks the ``causes``; ``ambiguous``: it lacks one of
        several that these runs cannot tell apart; ``unexplained``: it lacks something that is no known effect.
    causes
        What it lacks, each a :class:`Cause`; empty where nothing is named.
    noise_floor_rad
        Noise of the angle reading, rad, root mean square.
    before_rad
        Error of free rollouts on the held-out runs, of the file's model with refitted numbers, rad, root mean square.
    after_rad
        The same of the extended model.
    percent_removed
        Share of the error above the noise that the causes remove, %: value, low and high of the 95 % interval.
    next_experiment
        The experiment that would decide where these runs cannot; None where nothing is left to decide.
    summary
        Sentences for people.
    robot
        The extended model.
    rivals
        Other models that these runs cannot tell from it.
    html
        The report: a page that needs nothing else.
    data
        Everything that ``scram diagnose --json`` prints.
    """

    verdict: Literal["nothing", "explained", "ambiguous", "unexplained"]
    causes: tuple[Cause, ...]
    noise_floor_rad: float
    before_rad: float
    after_rad: float
    percent_removed: Interval
    next_experiment: str | None
    summary: tuple[str, ...]
    robot: Robot
    rivals: tuple[Robot, ...] = field(repr=False)
    html: str = field(repr=False)
    data: Mapping[str, Any] = field(repr=False)

    def _repr_html_(self) -> str:
        return _framed(self.html)


def diagnose(
    robot: Robot,
    fit: Runs,
    holdout: Runs,
    *,
    seed: int = 1,
    also_try: Sequence[str] = (),
    threads: int = 0,
) -> Diagnosis:
    """Compare a robot file with recordings, and name the cause of what it gets wrong.

    All recordings are of one robot in one state. Of simulated ones this means one seed and different drives: another seed of
    ``simulate`` is another specimen of the robot, with another angle sensor.

    Parameters
    ----------
    robot
        The robot as its file describes it.
    fit
        Recordings, or their files, that numbers are fitted on; or one of them.
    holdout
        The same that are judged on and never fitted.
    seed
        Seed of the bootstrap.
    also_try
        Effects to try that a diagnosis does not try by itself.
    threads
        Threads; 0 for one a core.

    Raises
    ------
    InputError
        A recording is of another rig or too short or is there twice, or the model follows none of them.
    """
    found = _scram.diagnose(robot, loaded(fit), loaded(holdout), seed=seed, also_try=list(also_try), threads=threads)
    said = found["said"]
    gain = said["gain"]
    robot, *rivals = found["models"]
    return Diagnosis(
        verdict=said["verdict"],
        causes=_causes(said),
        noise_floor_rad=said["noise_floor"],
        before_rad=said["before"],
        after_rad=said["after"],
        percent_removed=(gain["percent_of_excess_removed"], gain["low"], gain["high"]),
        next_experiment=said["next_experiment"],
        summary=tuple(found["summary"]),
        robot=robot,
        rivals=tuple(rivals),
        html=found["html"],
        data=said,
    )


@dataclass(frozen=True, slots=True, eq=False)
class WalkDiagnosis:
    """What the diagnosis of a walk says; in a notebook it shows its report.

    Errors are of the held-out conditions, ahead, to the left and in heading: root mean square as a share of the largest speed, ``None``
    where that was not measured.

    Attributes
    ----------
    verdict
        ``nothing``, ``explained``, ``ambiguous`` or ``unexplained``, as of a :class:`Diagnosis`.
    causes
        What the model lacks, each a :class:`Cause`; empty where nothing is named.
    log10_evidence_against_nothing
        Logarithm of the factor by which the effects raise the evidence. Chance passes 2 in at most one table of a hundred.
    before
        Errors of the file's model with refitted numbers.
    after
        Errors of the extended model.
    scatter
        What repeats alone make of a mean.
    summary
        Sentences for people.
    robot
        The extended model.
    html
        The report: a page that needs nothing else.
    data
        Everything that ``scram diagnose --measured … --json`` prints.
    """

    verdict: Literal["nothing", "explained", "ambiguous", "unexplained"]
    causes: tuple[Cause, ...]
    log10_evidence_against_nothing: float
    before: tuple[float | None, float | None, float | None]
    after: tuple[float | None, float | None, float | None]
    scatter: tuple[float | None, float | None, float | None]
    summary: tuple[str, ...]
    robot: Robot
    html: str = field(repr=False)
    data: Mapping[str, Any] = field(repr=False)

    def _repr_html_(self) -> str:
        return _framed(self.html)


def diagnose_walk(
    robot: Robot,
    measured: Speeds,
    *,
    holdout: Sequence[tuple[float, float]] = (),
    window_s: tuple[float, float] = (1.0, 2.0),
    draws: int = 24,
    seed: int = 1,
    threads: int = 0,
) -> WalkDiagnosis:
    """Compare the simulated walk of a robot with its measured speeds, and name the cause of what it gets wrong.

    The shaft is taken to turn evenly, unless the robot file has ``eccentric.servo_nm_per_rad`` and ``servo_nm_s_per_rad``. Speeds of
    ``simulate_batch`` that are to stand for measured ones are therefore made with ``turned_by="ideal"``: what a motor's shaft does within
    a turn would be blamed on something else. It takes two and a half to five minutes on two cores, and
    more than nine where no effect explains the speeds.

    Parameters
    ----------
    robot
        The robot as its file describes it.
    measured
        A table's file, or columns as `identify_robot` takes them, a row a run; repeats say how far a mean scatters.
    holdout
        Conditions (f in Hz, α in degrees) to judge by, in place of one in four.
    window_s
        Speeds are those between these times of a run, s: two from 0 on, at least 0.05 s apart.
    draws
        Sets of numbers that are drawn to find where the refit starts.
    seed
        Of these draws.
    threads
        Threads; 0 for one a core.

    Raises
    ------
    InputError
        The table has too few conditions, a held-out one is not in it, or the robot file cannot be varied.
    """
    found = _scram.diagnose_walk(
        robot,
        speeds(measured),
        holdout=list(holdout),
        window_s=window_s,
        draws=draws,
        seed=seed,
        threads=threads,
    )
    said = found["said"]
    return WalkDiagnosis(
        verdict=said["verdict"],
        causes=_causes(said),
        log10_evidence_against_nothing=said["log10_evidence_against_nothing"],
        before=_three(said["before"]),
        after=_three(said["after"]),
        scatter=_three(said["scatter"]),
        summary=tuple(found["summary"]),
        robot=found["robot"],
        html=found["html"],
        data=said,
    )


def _framed(html: str) -> str:
    return f'<iframe srcdoc="{escape(html)}" style="width:100%;height:44em;border:1px solid #ccc"></iframe>'


def _three(shares: Sequence[float | None]) -> tuple[float | None, float | None, float | None]:
    ahead, left, heading = shares
    return ahead, left, heading


def _causes(said: Mapping[str, Any]) -> tuple[Cause, ...]:
    return tuple(Cause(one["effect"], tuple(one["also"]), _intervals(one["parameters"])) for one in said["causes"])


def _intervals(parameters: Mapping[str, Sequence[float]]) -> dict[str, Interval]:
    return {key: (value, low, high) for key, (value, low, high) in parameters.items()}
