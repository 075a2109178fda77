"""How fast MuJoCo is on a model, and how exact.

    python timing.py single alpha60.xml --frequency=7           steps per second of one robot, one thread
    python timing.py sweep --frequencies=-8,-7,-6,6,7,8 alpha0.xml alpha60.xml …
                                                                 all conditions on `--threads`: wall time and error

`single` times, at the model's own time step and in MuJoCo's own loop in C, every solver with either kind of Jacobian, at its
default accuracy and at a coarse one, with both cheap integrators (pyramidal cones, which cost less), and both cones' Newton.
All of them once for a part of the run; the fastest of those and the named ones for 2 s, the median of `--repeats`. A setting
whose robot flies away does not count.
`sweep` times each candidate setting and tells its error against the same cone's run at `--converged` s: RMS over the
conditions over the largest, for vx, vy and yaw. The converged runs take minutes; `--cache` keeps them.
"""

import argparse
import hashlib
import json
import statistics
import time
from dataclasses import asdict, replace
from pathlib import Path

import mujoco
import numpy as np
from robot import ELLIPTIC, PYRAMIDAL, QPOS, all_speeds, conditions, frequencies, load, runs, say, speeds

PROJECTED = replace(PYRAMIDAL, solver="PGS")


def coarse(setting):
    """The same at an accuracy that costs less: the solver ends earlier, and its Jacobian is not stored sparsely."""
    return replace(setting, jacobian="dense", tolerance=1e-5, iterations=10)


# What `single` looks through for the fastest.
SCREENED = [
    replace(PYRAMIDAL, solver=solver, integrator=integrator, jacobian=jacobian, tolerance=tolerance, iterations=iterations)
    for solver in ("PGS", "Newton", "CG")
    for integrator in ("implicitfast", "Euler")
    for jacobian in ("dense", "sparse")
    for tolerance, iterations in ((1e-8, 100), (1e-5, 10))
]
# What `single` times in any case.
NAMED = [PROJECTED, coarse(PROJECTED), PYRAMIDAL, ELLIPTIC, replace(ELLIPTIC, integrator="Euler")]
# Of those screened, how many are timed in full, and after which part of a run they are chosen, s.
FINALISTS, PART_S = 4, 0.5
# Chosen by hand: both cones' Newton and the projected solver, at either accuracy, at steps up to the longest that walks.
# `--all` tries a finer grid with every solver and integrator.
CANDIDATES = [
    replace(setting, step_s=step)
    for exact in (PROJECTED, PYRAMIDAL, ELLIPTIC)
    for setting in (exact, coarse(exact), replace(coarse(exact), integrator="Euler"))
    for step in (1e-4, 2e-4, 2.5e-4, 5e-4, 1e-3)
]
EVERYTHING = [
    replace(cone, integrator=integrator, solver=solver, step_s=step)
    for cone in (PYRAMIDAL, ELLIPTIC)
    for integrator in ("implicitfast", "Euler", "implicit")
    for solver in ("Newton", "PGS", "CG")
    for step in (1e-4, 2e-4, 3e-4, 5e-4, 7e-4, 1e-3)
]


def timed(models, frequencies_hz, threads, repeats, seconds=2.0):
    """States of the last of some runs, and the median of their times: wall, or of the processor for one thread, so that
    what else the machine does does not count."""
    clock, times = time.thread_time if threads == 1 else time.perf_counter, []
    for _ in range(repeats):
        begin = clock()
        states = runs(models, frequencies_hz, seconds, threads)
        times.append(clock() - begin)
    return states, statistics.median(times)


def rate(given, setting, repeats, seconds):
    """Steps per second of one robot on one thread; 0 where it flies away."""
    setting = setting.with_step(given.step)
    model = load(given.models[0], setting)
    states, busy = timed([model], [given.frequency], 1, repeats, seconds)
    stays = bool(np.isfinite(states).all()) and np.abs(states[0, -1, QPOS : QPOS + 3]).max() < 1.0
    return round(seconds / given.step) / busy if stays else 0.0


def single(given):
    """Steps per second of one robot on one thread, of the fastest settings and of those that are named."""
    screened = sorted(SCREENED, key=lambda setting: rate(given, setting, 1, PART_S), reverse=True)
    chosen = NAMED + [setting for setting in screened[:FINALISTS] if setting not in NAMED]
    table = [
        {"setting": setting.with_step(given.step).text(), "steps_per_s": rate(given, setting, given.repeats, 2.0)}
        for setting in chosen
    ]
    say(single=table)


def converged(given, cone):
    """The speeds in the limit of small steps, kept in a file named by what they follow from."""
    setting = replace(ELLIPTIC if cone == "elliptic" else PYRAMIDAL, step_s=given.converged)
    texts = [Path(path).read_text() for path in given.models]
    key = json.dumps([mujoco.__version__, asdict(setting), given.frequencies, texts])
    kept = given.cache and Path(given.cache) / f"mujoco-{hashlib.sha256(key.encode()).hexdigest()[:16]}.json"
    if kept and kept.exists():
        return np.array(json.loads(kept.read_text()))
    table = all_speeds(given.models, given.frequencies, setting, given.threads)
    if kept:
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_text(json.dumps(table))
    return np.array(table)


def sweep(given):
    """Wall time and error of every candidate."""
    todo, limits, table = conditions(given.models, given.frequencies), {}, []
    for setting in EVERYTHING if given.all else CANDIDATES:
        if setting.cone not in limits:
            limits[setting.cone] = converged(given, setting.cone)
        models = {path: load(path, setting) for path in given.models}
        states, wall = timed([models[path] for path, _ in todo], [f for _, f in todo], given.threads, given.repeats)
        reached = np.array([speeds(models[path], states[i]) for i, (path, _) in enumerate(todo)])
        del states
        limit = limits[setting.cone]
        error = np.sqrt(((reached - limit) ** 2).mean(axis=0)) / np.abs(limit).max(axis=0)
        # A run that has blown up has no speed: it is infinitely wrong.
        error = [float(share) if np.isfinite(share) else 1e9 for share in error]
        table.append({"setting": setting.text(), "step_s": setting.step_s, "wall_s": wall, "error": error})
    say(sweep=table)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("single", "sweep"))
    parser.add_argument("models", nargs="+")
    parser.add_argument("--frequency", type=float, default=7.0, help="Hz, counter-clockwise positive")
    parser.add_argument("--frequencies", type=frequencies, default=[7.0], help="the same, several with commas")
    parser.add_argument("--step", type=float, default=1e-4, help="s, of `single`")
    parser.add_argument("--converged", type=float, default=2.5e-5, help="s, of `sweep`")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--cache", help="directory that keeps converged runs")
    parser.add_argument("--all", action="store_true", help="every setting, not only the good ones")
    given = parser.parse_args()
    (single if given.what == "single" else sweep)(given)
