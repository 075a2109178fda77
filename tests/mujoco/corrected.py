"""Mean speeds over t = 1 … 2 s, with what MuJoCo's contacts leave out put back.

    python corrected.py --velocity-term --coulomb --frequencies=6,7,8 alpha0.xml alpha60.xml

A contact of MuJoCo asks for an acceleration `aref` of the point that touches, which follows from depth and velocity.
Both corrections change `aref` between mj_step1, which makes it, and mj_step2, which solves for it; elliptic cones only.

--velocity-term: MuJoCo holds J·dv/dt to `aref`. The point's acceleration is J·dv/dt + dJ/dt·v: the second term is taken
    off `aref`. Without it a foot that is stuck creeps, and the more so the farther it is from the free joint.
--coulomb: MuJoCo's friction is the solution of a convex problem, in which a foot that slides is also lifted, by μ times
    the speed of sliding. Coulomb's law has that lift taken off again (de Saxcé and Feng 1998). Which slip that is, is known
    when the step is solved: it is solved three times, from the slip of the step before on.

Prints `speeds` as speeds.py does.
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial

import mujoco
import numpy as np
from robot import ELLIPTIC, QPOS, STATE, conditions, controls, frequencies, load, say, speeds, start

# Solutions of a step before the one that counts. Five change the speeds by 2 % of the largest.
AHEAD = 2


def cross(a, b):
    """Row by row; np.cross takes ten times as long on a few rows."""
    return a[:, [1, 2, 0]] * b[:, [2, 0, 1]] - a[:, [2, 0, 1]] * b[:, [1, 2, 0]]


class Touching:
    """The contacts of a step that have rows: their geoms, bodies and first rows."""

    def __init__(self, model, data):
        held = data.contact.efc_address >= 0
        geoms = data.contact.geom[held]
        self.bodies = model.geom_bodyid[geoms].max(axis=1)
        # The ground is the world's, body 0.
        self.feet = np.where(model.geom_bodyid[geoms[:, 0]] > 0, geoms[:, 0], geoms[:, 1])
        self.rows = data.contact.efc_address[held]
        self.points = data.contact.pos[held]
        self.frames = data.contact.frame[held].reshape(-1, 3, 3)
        self.friction = data.contact.friction[held, 0]


def velocity_term(model, data, touching):
    """dJ/dt·v (m/s²) of the points that touch, in the contacts' frames, n × 3. The point stays below the foot's centre
    however the foot turns: it is not fixed to the foot."""
    linear, angular = np.empty((3, model.nv)), np.empty((3, model.nv))
    found = {}
    for body in set(touching.bodies.tolist()):
        mujoco.mj_jacDot(model, data, linear, angular, data.xpos[body], body)
        found[body] = np.array([linear @ data.qvel, angular @ data.qvel, data.cvel[body, :3]])
    a, turning, spin = np.array([found[body] for body in touching.bodies.tolist()]).swapaxes(0, 1)
    origins = data.xpos[touching.bodies]
    centres = data.geom_xpos[touching.feet] - origins
    world = a + cross(turning, touching.points - origins) + cross(spin, cross(spin, centres))
    return np.einsum("nij,nj->ni", touching.frames, world)


def slip(model, data, touching):
    """How far each contact is from holding along the ground, m/s²: MuJoCo's measure of sliding."""
    left = np.empty(data.nefc)
    mujoco.mj_mulJacVec(model, data, left, data.qacc)
    left += data.efc_R * data.efc_force - data.efc_aref
    return np.hypot(left[touching.rows + 1], left[touching.rows + 2])


def without_lift(model, data, touching, sliding):
    """Takes the lift off `aref`. `sliding`: the slip of every geom, of the step before and then of this one."""
    base = data.efc_aref[touching.rows]
    for _ in range(AHEAD):
        data.efc_aref[touching.rows] = base - touching.friction * sliding[touching.feet]
        mujoco.mj_fwdActuation(model, data)
        mujoco.mj_fwdAcceleration(model, data)
        mujoco.mj_fwdConstraint(model, data)
        data.qacc_warmstart[:] = data.qacc
        now = slip(model, data, touching)
        sliding[:] = 0.0
        sliding[touching.feet] = now
    data.efc_aref[touching.rows] = base - touching.friction * sliding[touching.feet]


def run(model, frequency_hz, seconds, given):
    """States after every step."""
    data = mujoco.MjData(model)
    mujoco.mj_setState(model, data, start(model, frequency_hz), STATE)
    count = round(seconds / model.opt.timestep)
    states, sliding = np.empty((count, QPOS + model.nq)), np.zeros(model.ngeom)
    for step, control in enumerate(controls(model, frequency_hz, 0, count)):
        mujoco.mj_step1(model, data)
        data.ctrl[:] = control
        if data.nefc:
            touching = Touching(model, data)
            if given.velocity_term:
                data.efc_aref[touching.rows[:, None] + np.arange(3)] -= velocity_term(model, data, touching)
            if given.coulomb:
                without_lift(model, data, touching, sliding)
        mujoco.mj_step2(model, data)
        states[step, QPOS:] = data.qpos
    return states


def one(given, condition):
    """The speeds of a condition."""
    path, frequency_hz = condition
    model = load(path, replace(ELLIPTIC, step_s=given.step))
    if given.time_constant:
        model.geom_solref[:, 0] = given.time_constant
    return speeds(model, run(model, frequency_hz, 2.0, given))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="+")
    parser.add_argument("--frequencies", type=frequencies, required=True, help="Hz, counter-clockwise positive")
    parser.add_argument("--velocity-term", action="store_true")
    parser.add_argument("--coulomb", action="store_true")
    parser.add_argument("--time-constant", type=float, help="of the contacts instead of the model's, s")
    parser.add_argument("--step", type=float, default=1e-4, help="s")
    parser.add_argument("--threads", type=int, default=2)
    given = parser.parse_args()
    todo = conditions(given.models, given.frequencies)
    with ProcessPoolExecutor(given.threads) as pool:
        table = list(pool.map(partial(one, given), todo))
    say(step_s=given.step, conditions=todo, speeds=table)
