"""A backbone let go: module 1 clamped, module 2 on the backbone's end, every hinge of one axis turned by the same angle.

    python oscillation.py clamped.xml --axis y --angle 0.01 --step 1e-5 --seconds 1 --sample 1e-4

No gravity, no contact. Prints `angle`: the sum over that axis's hinges (rad) at even times `sample_s`, the first at the
start.
"""

import argparse

import mujoco
from robot import load, say

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model")
    parser.add_argument("--axis", choices="xyz", required=True)
    parser.add_argument("--angle", type=float, required=True, help="of each hinge, rad")
    parser.add_argument("--step", type=float, default=1e-5, help="s")
    parser.add_argument("--sample", type=float, default=1e-4, help="s")
    parser.add_argument("--seconds", type=float, default=1.0)
    given = parser.parse_args()
    model = load(given.model)
    model.opt.timestep = given.step
    model.opt.gravity[:] = 0.0
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    data = mujoco.MjData(model)
    hinges = [model.joint(i) for i in range(model.njnt) if model.joint(i).name.endswith(given.axis)]
    places = [joint.qposadr[0] for joint in hinges if joint.name.startswith("b")]
    data.qpos[places] = given.angle
    every, angles = round(given.sample / given.step), []
    for step in range(round(given.seconds / given.step) + 1):
        if step % every == 0:
            angles.append(float(data.qpos[places].sum()))
        mujoco.mj_step(model, data)
    say(sample_s=given.sample, angle=angles)
