"""A backbone pulled aside by a force and a torque at its end, and let go: what a motion capture system would see.

    python release.py --wrench 0,0,0.05,0.002,0,0 --seconds 1.2 clamped.xml

Module 1 is held fast, module 2 is on the backbone's end; gravity acts, nothing touches. The end stands still under the
wrench (force in N, torque in N m, world frame, at its centre of mass) before it is let go. For every wrench prints how the end turns
against its pose at rest, as rotation vectors (rad) in the world's frame at even times `sample_s`, the first at the release.
"""

import argparse

import mujoco
import numpy as np
from robot import load, say

# While it is pulled aside, the hinges' damping times this, and for so long, s: it comes to rest soon.
CALMED = 6.0
CALM_S = 0.6


def turned(data, site, rest):
    """Rotation vector from a rest orientation to the present one."""
    now = data.site_xmat[site].reshape(3, 3)
    quat, vector = np.zeros(4), np.zeros(3)
    mujoco.mju_mat2Quat(quat, (now @ rest.T).flatten())
    mujoco.mju_quat2Vel(vector, quat, 1.0)
    return [float(x) for x in vector]


def settle(model, data, wrench):
    """Lets the end come to rest under a wrench."""
    damping = model.dof_damping.copy()
    model.dof_damping[:] = CALMED * damping
    end = model.body("m2").id
    data.xfrc_applied[end] = wrench
    for _ in range(round(CALM_S / model.opt.timestep)):
        mujoco.mj_step(model, data)
    data.xfrc_applied[end] = 0.0
    data.qvel[:] = 0.0
    model.dof_damping[:] = damping
    mujoco.mj_forward(model, data)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model")
    parser.add_argument("--wrench", action="append", required=True, help="fx,fy,fz,tx,ty,tz; once a run")
    parser.add_argument("--step", type=float, default=5e-5, help="s")
    parser.add_argument("--sample", type=float, default=1e-3, help="s")
    parser.add_argument("--seconds", type=float, default=1.2)
    given = parser.parse_args()
    model = load(given.model)
    model.opt.timestep = given.step
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    site = model.site("module2").id
    data = mujoco.MjData(model)
    settle(model, data, np.zeros(6))
    rest = data.site_xmat[site].reshape(3, 3).copy()
    every, runs = round(given.sample / given.step), []
    for wrench in given.wrench:
        mujoco.mj_resetData(model, data)
        settle(model, data, np.array([float(word) for word in wrench.split(",")]))
        angles = []
        for step in range(round(given.seconds / given.step) + 1):
            if step % every == 0:
                mujoco.mj_kinematics(model, data)
                angles.append(turned(data, site, rest))
            mujoco.mj_step(model, data)
        runs.append(angles)
    say(sample_s=given.sample, runs=runs)
