"""Mean speeds over t = 1 … 2 s of robots on the ground.

    python speeds.py --frequencies=-8,-7,-6,6,7,8 alpha0.xml alpha60.xml

Prints `speeds`: for each model and each frequency vx, vy (m/s, frame of the start) and the yaw rate (rad/s,
counter-clockwise). Models carry their settings; `--step` changes the time step.
"""

import argparse
from dataclasses import replace

from robot import ELLIPTIC, PYRAMIDAL, all_speeds, conditions, frequencies, say

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="+")
    parser.add_argument("--frequencies", type=frequencies, required=True, help="Hz, counter-clockwise positive")
    parser.add_argument("--step", type=float, default=1e-4, help="s")
    parser.add_argument("--cone", choices=("elliptic", "pyramidal"), default="elliptic")
    parser.add_argument("--integrator", default="implicitfast")
    parser.add_argument("--threads", type=int, default=2)
    given = parser.parse_args()
    setting = replace(ELLIPTIC if given.cone == "elliptic" else PYRAMIDAL, step_s=given.step, integrator=given.integrator)
    table = all_speeds(given.models, given.frequencies, setting, given.threads)
    say(setting=setting.text(), conditions=conditions(given.models, given.frequencies), speeds=table)
