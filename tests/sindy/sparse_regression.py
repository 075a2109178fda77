"""Sparse regression beside the diagnosis: what pysindy finds hidden in the data sets that `cargo blind --keep` has written.

    cargo blind --seed 7 … --keep out/sets --journal out/sets.jsonl
    python tests/sindy/sparse_regression.py out/sets out/sets.jsonl

For every data set the acceleration of the shaft is regressed on a library of terms, sparsely (sequentially thresholded least
squares: Brunton, Proctor and Kutz, PNAS 113, 2016, as pysindy has it). The fit runs are differentiated by pysindy's smoothed finite
differences; the threshold is the largest whose model predicts the acceleration of the held-out runs nearly as well as the best. The
effects of the terms that are left, beside those of a linear motor, are what sparse regression names. It gets what the diagnosis
gets, and the same rule judges it, but for one: a term that stands for several effects is right for each of them.
"""

import csv
import json
import sys
import tomllib
from collections import Counter
from pathlib import Path

import numpy as np
import pysindy

# A linear motor, which is in every model: u is the drive as the speed (rad/s) at which no current flows, 0 while the bridge is open, w the
# speed, e whether the bridge drives.
LINEAR = {"u": lambda th, w, u, e, t: u, "e w": lambda th, w, u, e, t: e * w, "w": lambda th, w, u, e, t: w}

# Scale of the speed over which friction weakens, rad/s: one of a few, as a library has to be linear.
SLOW = 10.0

# Below this drive, rad/s, its sign is in doubt.
WEAK = 4.0


def smooth_sign(x, width):
    """A sign that numerical noise about zero does not flip."""
    return np.tanh(x / width)


def at_drive(u, e):
    return e * smooth_sign(u, WEAK)


# Terms by the effects that they stand for; what no function of the present state and drive expresses has none.
TERMS = {
    "sign w": (["coulomb_friction"], lambda th, w, u, e, t: smooth_sign(w, 1.0)),
    "sign w, slow": (["stribeck_friction"], lambda th, w, u, e, t: smooth_sign(w, 1.0) * np.exp(-((w / SLOW) ** 2))),
    "|u| sign w": (["load_friction"], lambda th, w, u, e, t: np.abs(u) * smooth_sign(w, 1.0)),
    "1": (["bias_torque", "directional_friction"], lambda th, w, u, e, t: np.ones_like(w)),
    "|w| w": (["quadratic_drag"], lambda th, w, u, e, t: np.abs(w) * w),
    "w^3": (["cubic_drag"], lambda th, w, u, e, t: w**3),
    "sin th": (["gravity_tilt"], lambda th, w, u, e, t: np.sin(th)),
    "cos th": (["gravity_tilt"], lambda th, w, u, e, t: np.cos(th)),
    "sign u": (["driver_drop_by_command", "driver_deadband"], lambda th, w, u, e, t: at_drive(u, e)),
    "sign i": (
        ["driver_drop", "driver_dead_time"],
        lambda th, w, u, e, t: e * smooth_sign(u - w, WEAK),
    ),
    "u |u|": (["battery_sag"], lambda th, w, u, e, t: u * np.abs(u)),
    "u t": (["battery_discharge", "winding_heating"], lambda th, w, u, e, t: u * t),
    "w t": (["grease_warming"], lambda th, w, u, e, t: w * t),
} | {
    f"{name} {order} th": (["torque_ripple"], lambda th, w, u, e, t, f=f, k=order: f(k * th))
    for order in range(2, 13)
    for name, f in (("sin", np.sin), ("cos", np.cos))
}

THRESHOLDS = np.geomspace(1e-3, 0.3, 12)

# A sparser model may predict held-out acceleration worse than the best by this share.
NEARLY = 1.01

# Rows that are kept of a run: its differentiated angle does not change faster.
ROWS_PER_S = 200


def free_speed(directory):
    """Of the motor at the whole duty by a data set's robot file, rad/s."""
    robot = tomllib.loads((directory / "robot.toml").read_text())
    return robot["supply"]["rail_v"]["value"] / robot["motor"]["torque_constant_nm_per_a"]["value"]


def read(path):
    """Time, angle (unwrapped), drive (0 while the bridge is open) and whether it drives, of one run."""
    with open(path, newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["angle_rad"]]
    column = lambda name: np.array([float(row[name]) for row in rows])
    enable = column("enable")
    drive = enable * column("duty") * free_speed(path.parent)
    return column("t_s"), np.unwrap(column("angle_rad")), drive, enable


def differentiate(run):
    """Angle, speed and acceleration by smoothed finite differences over windows of some 20 ms."""
    time, angle, drive, enable = run
    window = max(7, 2 * int(0.01 / np.median(np.diff(time))) + 1)
    window = min(window, len(time) // 4 * 2 - 1)
    smooth = pysindy.SmoothedFiniteDifference(smoother_kws={"window_length": window, "polyorder": 3})
    speed = smooth(angle[:, None], time)
    acceleration = smooth(speed, time)[:, 0]
    kept = slice(window, -window, max(1, round(1 / (ROWS_PER_S * np.median(np.diff(time))))))
    return tuple(column[kept] for column in (angle, speed[:, 0], drive, enable, time)), acceleration[kept]


def features(state):
    columns = [term(*state) for term in LINEAR.values()] + [term(*state) for _, term in TERMS.values()]
    return np.column_stack(columns)


def stlsq(threshold, features, target):
    """Coefficients of normalised terms by pysindy's sequentially thresholded least squares."""
    optimizer = pysindy.STLSQ(threshold=threshold, alpha=1e-6, max_iter=30)
    optimizer.fit(features, target[:, None])
    return optimizer.coef_[0]


def names(directory):
    """The effects that sparse regression names for the data set in a directory."""
    fit = [differentiate(read(path)) for path in sorted(directory.glob("fit-*.csv"))]
    held = [differentiate(read(path)) for path in sorted(directory.glob("held-*.csv"))]
    stacked = lambda runs: (np.vstack([features(run[0]) for run in runs]), np.concatenate([run[1] for run in runs]))
    (x, y), (x_held, y_held) = stacked(fit), stacked(held)
    scale, unit = np.linalg.norm(x, axis=0) / np.sqrt(len(x)), np.std(y)
    scale[scale == 0.0] = 1.0
    x, x_held, y, y_held = x / scale, x_held / scale, y / unit, y_held / unit

    def error(coefficients):
        return np.mean((x_held @ coefficients - y_held) ** 2)

    models = [stlsq(threshold, x, y) for threshold in THRESHOLDS]
    least = min(map(error, models))
    sparsest = [model for model in models if error(model) <= NEARLY * least][-1]
    active = np.flatnonzero(sparsest[len(LINEAR) :])
    terms = list(TERMS)
    return {effect for place in active for effect in TERMS[terms[place]][0]}


def judge(truth, named, category):
    """As the campaign judges the diagnosis: the truth and nothing else; of two effects also one alone."""
    groups = [set(effects) for effects, _ in TERMS.values()]
    # A term that stands for several effects names each of them; it is right for any of them.
    stands_for = lambda effect: set().union(*(group for group in groups if effect in group))
    foreign = named - set().union(*(stands_for(effect) for effect in truth)) if truth else named
    if category == "nothing":
        return "right" if not named else "false name"
    if foreign:
        return "false name"
    found = sum(bool(stands_for(effect) & named) for effect in truth)
    return ["nothing", "one of two" if len(truth) == 2 else "right", "right"][found]


def main():
    sets, journal = Path(sys.argv[1]), Path(sys.argv[2])
    marks = {}
    for line in journal.read_text().splitlines():
        outcome = json.loads(line)
        category, truth = outcome["category"], set(outcome["truth"])
        named = names(sets / f"{category}-{outcome['seed']}")
        mark = judge(truth, named, category)
        marks.setdefault(category, Counter())[mark] += 1
        print(f"{category} {outcome['seed']} {' + '.join(sorted(truth)) or 'nothing'}: {mark} ({', '.join(sorted(named)) or 'nothing'})")
    for category, counts in marks.items():
        print(f"{category}: {sum(counts.values())} sets, " + ", ".join(f"{count} {mark}" for mark, count in counts.most_common()))


if __name__ == "__main__":
    main()
