"""What the simulation of a recorded robot gets wrong: ``scram diagnose``."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from os import PathLike
from typing import Any, Literal

from scram import _scram
from scram._paths import loaded
from scram._scram import Recording, Robot

Interval = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Cause:
    """An effect that the model lacks."""

    effect: str
    """Name as in the robot file's ``[effects.NAME]``."""
    also: tuple[str, ...]
    """Effects that these runs cannot tell from it."""
    parameters: Mapping[str, Interval]
    """By key: value, low and high of the 95 % interval, in the unit at the key's end."""


@dataclass(frozen=True, slots=True, eq=False)
class Diagnosis:
    """What a diagnosis says; in a notebook it shows its report. Errors are in rad, root mean square."""

    verdict: Literal["nothing", "explained", "ambiguous", "unexplained"]
    causes: tuple[Cause, ...]
    noise_floor_rad: float
    """Noise of the angle reading."""
    before_rad: float
    """Error of free rollouts on the held-out runs, of the file's model with refitted numbers."""
    after_rad: float
    """The same of the extended model."""
    percent_removed: Interval
    """Share of the error above the noise that the causes remove, %: value, low and high of the 95 % interval."""
    next_experiment: str | None
    """The experiment that would decide where these runs cannot."""
    summary: tuple[str, ...]
    """Sentences for people."""
    robot: Robot
    """The extended model."""
    rivals: tuple[Robot, ...] = field(repr=False)
    """Other models that these runs cannot tell from it."""
    html: str = field(repr=False)
    """The report: a page that needs nothing else."""
    data: Mapping[str, Any] = field(repr=False)
    """Everything that ``scram diagnose --json`` prints."""

    def _repr_html_(self) -> str:
        style = "width:100%;height:44em;border:1px solid #ccc"
        return f'<iframe srcdoc="{escape(self.html)}" style="{style}"></iframe>'


def diagnose(
    robot: Robot,
    fit: Iterable[Recording | str | PathLike[str]],
    holdout: Iterable[Recording | str | PathLike[str]],
    *,
    seed: int = 1,
    also_try: Sequence[str] = (),
    threads: int = 0,
) -> Diagnosis:
    """Compare a robot file with recordings, and name the cause of what it gets wrong.

    Parameters
    ----------
    robot
        The robot as its file describes it.
    fit
        Recordings, or their files, that numbers are fitted on.
    holdout
        Recordings that are judged on and never fitted.
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
    causes = [Cause(one["effect"], tuple(one["also"]), _intervals(one["parameters"])) for one in said["causes"]]
    gain = said["gain"]
    robot, *rivals = found["models"]
    return Diagnosis(
        verdict=said["verdict"],
        causes=tuple(causes),
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


def _intervals(parameters: Mapping[str, Sequence[float]]) -> dict[str, Interval]:
    return {key: (value, low, high) for key, (value, low, high) in parameters.items()}
