"""Searches for a robot that turns in place at one constant frequency: how `robots/three-modules.toml` was found.

    pip install scipy
    python python/benches/search_for_turning_in_place.py

Differential evolution (SciPy's, one population at a time in `simulate_batch`) over α and masses of a robot of three modules, the stiffness of
its silicone and the mass of its eccentric. What is made small is how far the robot goes while it turns by a radian, mm, at the best frequency
at which it turns by 10 °/s or more. The best robot is then run anew from other starts. Twenty minutes on a core.
"""

import tempfile
from pathlib import Path

import numpy as np
import scram
from numpy.typing import NDArray
from scipy.optimize import differential_evolution

ROBOT = Path(__file__).parents[2] / "robot.toml"
MODULES = '[body]\nmodules = ["actuator", "courier", "passive"]\n'
FREQUENCIES_HZ = np.array([-8, -7.5, -7, -6.5, -6, 6, 6.5, 7, 7.5, 8])
SECONDS = 6.0
LEAST_DEG_PER_S = 10.0
BOUNDS = {
    "alpha": (20.0, 170.0),
    "body.courier.mass_kg": (0.010, 0.020),
    "body.actuator.mass_kg": (0.006, 0.010),
    "body.passive.mass_kg": (0.0045, 0.0075),
    "eccentric.mass_kg": (0.002, 0.0036),
    "stiffness": (0.6, 1.5),
}
"""Of every unknown; the stiffness of the silicone as a factor of the file's, which its damping follows."""


def short_robot() -> scram.Robot:
    """The file's robot without its rear module."""
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "robot.toml"
        path.write_text(f'base = "{ROBOT}"\nname = "short"\nsummary = "Three modules."\n\n{MODULES}')
        return scram.Robot(path)


def per_radian(robot: scram.Robot, designs: NDArray[np.float64], seeds: list[int]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """How far (mm) each design goes a radian of turning at each frequency, and how fast it turns (°/s); shape (designs, frequencies)."""
    count = len(FREQUENCIES_HZ)
    unknown = dict(zip(BOUNDS, np.repeat(designs, count, axis=0).T, strict=True))
    factor = unknown.pop("stiffness")
    silicone = [path for path in robot.quantities if path.startswith("backbone.") and path.endswith("_per_rad")]
    for path in silicone:
        unknown[path] = factor * robot.quantities[path].value
    drives = [f"freq:{hz}" for hz in FREQUENCIES_HZ] * len(designs)
    batch = scram.simulate_batch(
        robot, drives, parameters=unknown, seeds=seeds, seconds=SECONDS, turned_by="ideal", single=True, threads=0
    )
    shape = (len(designs), count, len(seeds))
    # Speeds are the mean over the second half of a run in the frame of its start: into the robot's own, whose heading is at the middle of
    # that half what it is in the mean. An arc's chord is shorter than the arc.
    rate = np.deg2rad(batch.yaw_deg_per_s).reshape(shape)
    velocity = (batch.vx_mm_per_s + 1j * batch.vy_mm_per_s).reshape(shape) * np.exp(-0.75j * SECONDS * rate)
    chord = np.maximum(np.abs(np.sinc(0.25 * SECONDS * rate / np.pi)), 0.1)
    speed, rate = np.abs((velocity / chord).mean(axis=2)), rate.mean(axis=2)
    return speed / np.maximum(np.abs(rate), 1e-3), np.rad2deg(rate)


def cost(robot: scram.Robot, designs: NDArray[np.float64], seeds: list[int]) -> NDArray[np.float64]:
    """Of each design, at its best frequency; what turns too slowly pays for it."""
    distance, rate = per_radian(robot, designs, seeds)
    slow = np.maximum(LEAST_DEG_PER_S - np.abs(rate), 0.0)
    return np.asarray((distance + 20.0 * slow).min(axis=1))


def main() -> None:
    """Searches, and says what it found."""
    robot = short_robot()
    found = differential_evolution(
        lambda columns: cost(robot, np.atleast_2d(columns.T), [1, 2]),
        list(BOUNDS.values()),
        popsize=6,
        maxiter=40,
        tol=0.0,
        polish=False,
        vectorized=True,
        updating="deferred",
        rng=1,
        callback=lambda intermediate_result: print(f"{intermediate_result.fun:.1f} mm a radian", flush=True),
    )
    for path, value in zip(BOUNDS, found.x, strict=True):
        print(f"{path:<24} {value:.4g}")
    distance, rate = per_radian(robot, found.x[np.newaxis], [11, 12, 13, 14])
    for place in np.argsort(distance[0])[:3]:
        print(f"{FREQUENCIES_HZ[place]:+} Hz: {distance[0, place]:.1f} mm a radian at {rate[0, place]:+.1f} °/s")


if __name__ == "__main__":
    main()
