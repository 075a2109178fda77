"""Paths of the feet of a robot that touches nothing, its rotor at a prescribed phase.

    python foot_path.py --frequencies=-7,7 --foot foot1L --from 1.5 --seconds 2 clamped0.xml clamped60.xml

The rotor is kept to its speed by an armature that nothing can slow down: that adds inertia about the joint alone and
leaves every other force as it is. Prints `paths`: for each model and each frequency the foot's centre (m) at even times
`sample_s` from `--from` on.
"""

import argparse
import math

import mujoco
from robot import conditions, frequencies, load, say

# kg·m²: the eccentric has 3e-7.
ENDLESS = 1e3


def path(model, frequency_hz, foot, given):
    rotor = model.joint("rotor").dofadr[0]
    model.opt.timestep = given.step
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    model.dof_armature[rotor] = ENDLESS
    mujoco.mj_setConst(model, mujoco.MjData(model))
    data = mujoco.MjData(model)
    data.qvel[rotor] = 2.0 * math.pi * frequency_hz
    every, points = round(given.sample / given.step), []
    site = model.site(foot).id
    for step in range(round(given.seconds / given.step) + 1):
        if step % every == 0 and step * given.step > given.begin - 0.5 * given.step:
            mujoco.mj_kinematics(model, data)
            points.append([float(x) for x in data.site_xpos[site]])
        mujoco.mj_step(model, data)
    return points


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="+")
    parser.add_argument("--frequencies", type=frequencies, required=True, help="Hz, counter-clockwise positive")
    parser.add_argument("--foot", default="foot1L")
    parser.add_argument("--from", type=float, default=1.5, dest="begin", help="s")
    parser.add_argument("--seconds", type=float, default=2.0, help="until")
    parser.add_argument("--step", type=float, default=5e-5, help="s")
    parser.add_argument("--sample", type=float, default=1e-3, help="s")
    given = parser.parse_args()
    paths = [path(load(model), f, given.foot, given) for model, f in conditions(given.models, given.frequencies)]
    say(sample_s=given.sample, conditions=conditions(given.models, given.frequencies), paths=paths)
