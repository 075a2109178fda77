"""What the environments can be told: one dataclass a task, its fields the keyword arguments of ``gymnasium.make``.

Defaults are the engine's (``host/tasks``): the thesis's where it gives a number, chosen ones elsewhere. docs/gymnasium.md has
the reasons. A task whose default differs from the turn's says so again; a test compares every field of every task with the engine.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

from scram._scram import environment_defaults

_TURN: dict[str, Any] = environment_defaults("turn")
_STRAIGHT: dict[str, Any] = environment_defaults("straight")
_MAZE: dict[str, Any] = environment_defaults("maze")


@dataclass(frozen=True, kw_only=True)
class Definition:
    """What every environment has."""

    task: ClassVar[str]

    frequencies_hz: Sequence[float] = tuple(_TURN["frequencies_hz"])
    """What an action chooses among, Hz, clockwise positive."""
    oscillations_deg: Sequence[tuple[float, float]] = tuple(_TURN["oscillations_deg"])
    """What it chooses among beyond them with ``drive="motor"``: the controller's swings from one angle to the other and back, degrees."""
    interval_s: float = _TURN["interval_s"]
    """Δt: time from an action to the next, s."""
    episode_s: float = _TURN["episode_s"]
    """Length of an episode, s; it is truncated then."""
    drive: Literal["exact", "motor"] = _TURN["drive"]
    """A shaft that follows its frequency exactly, or the firmware's controller with motor, sensor and battery."""
    step_s: float = _TURN["step_s"]
    """Integration step, s."""
    precision: Literal["single", "double"] = _TURN["precision"]
    """Digits of the bodies' arithmetic."""
    observe: Sequence[str] = tuple(_TURN["observe"])
    """Parts of the observation, in this order: ``pose``, ``velocity``, ``shaft``, and in a maze ``walls``."""
    length_unit_m: float = _TURN["length_unit_m"]
    """Unit of the lengths that are observed, m."""
    start_position_m: float = _TURN["start_position_m"]
    """The robot starts up to so far off its place along x and along y, m."""
    start_heading_rad: float = _TURN["start_heading_rad"]
    """The robot starts turned by up to so much to either side, rad."""
    alpha_deg: float | None = _TURN["alpha_deg"]
    """α of the backbones, degrees; None for the robot file's own."""
    randomize: float = _TURN["randomize"]
    """Share of the robot file's spreads from which every episode draws its robot: 0 none, 1 all from low to high."""
    randomized: Sequence[str] = tuple(_TURN["randomized"])
    """Quantities of the robot file that are drawn, or tables of them, by their dotted paths."""

    @property
    def actions(self) -> int:
        """How many actions there are."""
        return len(self.frequencies_hz) + len(self.oscillations_deg)


@dataclass(frozen=True, kw_only=True)
class Turn(Definition):
    """Turning in place; the reward is the thesis's equation (5.5)."""

    task: ClassVar[str] = "turn"

    direction: Literal["left", "right"] = _TURN["direction"]
    """Counter-clockwise or clockwise seen from above."""
    yaw_rate_rad_per_s: float = _TURN["yaw_rate_rad_per_s"]
    """ω desired in that direction, rad/s."""
    k_rot: float = _TURN["k_rot"]
    """Weight of the angular velocity's squared error, s²."""
    k_pos: float = _TURN["k_pos"]
    """Weight of the squared distance from the start, 1/m²."""


@dataclass(frozen=True, kw_only=True)
class Straight(Definition):
    """Walking along the line on which the robot starts."""

    task: ClassVar[str] = "straight"

    interval_s: float = _STRAIGHT["interval_s"]
    k_ahead: float = _STRAIGHT["k_ahead"]
    """Weight of the speed along the line, s/m."""
    k_side: float = _STRAIGHT["k_side"]
    """Weight of the squared distance from the line, 1/m²."""
    k_heading: float = _STRAIGHT["k_heading"]
    """Weight of the squared heading against the line, 1/rad²."""


@dataclass(frozen=True, kw_only=True)
class Maze(Definition):
    """Finding the way through a maze of corridors with right-angle turns."""

    task: ClassVar[str] = "maze"

    interval_s: float = _MAZE["interval_s"]
    episode_s: float = _MAZE["episode_s"]
    observe: Sequence[str] = tuple(_MAZE["observe"])
    maze: Literal["figure-5.5", "random"] = _MAZE["maze"]
    """The maze of the thesis's figure, or one drawn at random."""
    cell_m: float = _MAZE["cell_m"]
    """Width of the corridors, m."""
    columns: int = _MAZE["columns"]
    """Cells of a random maze along x."""
    rows: int = _MAZE["rows"]
    """Cells of a random maze along y."""
    maze_seed: int = _MAZE["maze_seed"]
    """What draws a random maze."""
    k_progress: float = _MAZE["k_progress"]
    """Weight of the way gained, 1/m."""
    k_step: float = _MAZE["k_step"]
    """Cost of a step."""
    k_exit: float = _MAZE["k_exit"]
    """For reaching the exit."""
