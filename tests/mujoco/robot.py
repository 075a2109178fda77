"""What the scripts share: a model written by `scram export mjcf`, driven and judged as in hal-sim.

SI units and radians. Frequencies are counter-clockwise positive seen from above, as MuJoCo's rotor; the thesis's sign is
the other one. Every script prints one JSON object on stdout.
"""

import json
import math
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from mujoco import rollout

# What the model does not use. Off, a step costs less and gives the same.
UNUSED = sum(
    int(getattr(mujoco.mjtDisableBit, "mjDSBL_" + name))
    for name in ("EQUALITY", "FRICTIONLOSS", "LIMIT", "CLAMPCTRL", "ISLAND", "MIDPHASE", "SENSOR")
)
STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS
# Where in a state the positions begin: after the time.
QPOS = 1
# Samples of the heading between two times, so that it is unwrapped without doubt.
HEADINGS = 41


@dataclass(frozen=True)
class Setting:
    """How MuJoCo steps."""

    step_s: float = 1e-4
    integrator: str = "implicitfast"
    cone: str = "elliptic"
    solver: str = "Newton"
    # Above 1 makes elliptic cones slip less; it costs pyramidal ones accuracy.
    impratio: float = 10.0
    # MuJoCo's defaults.
    jacobian: str = "auto"
    tolerance: float = 1e-8
    iterations: int = 100

    def text(self):
        words = [self.integrator, self.cone, self.solver]
        if self.jacobian != "auto":
            words.append(self.jacobian)
        if (self.tolerance, self.iterations) != (1e-8, 100):
            words.append(f"tolerance {self.tolerance:g}, {self.iterations} iterations")
        return ", ".join(words + [f"{self.step_s:g} s"])

    def with_step(self, step_s):
        return replace(self, step_s=step_s)

    def put(self, model):
        """Into a model."""
        model.opt.timestep = self.step_s
        model.opt.integrator = getattr(mujoco.mjtIntegrator, "mjINT_" + self.integrator.upper())
        model.opt.cone = getattr(mujoco.mjtCone, "mjCONE_" + self.cone.upper())
        model.opt.solver = getattr(mujoco.mjtSolver, "mjSOL_" + self.solver.upper())
        model.opt.impratio = self.impratio
        model.opt.jacobian = getattr(mujoco.mjtJacobian, "mjJAC_" + self.jacobian.upper())
        model.opt.tolerance = self.tolerance
        model.opt.iterations = self.iterations


ELLIPTIC = Setting()
PYRAMIDAL = Setting(cone="pyramidal", impratio=1.0)


def load(path, setting=None):
    """A model as it was written, or with another setting and without what it does not use."""
    model = mujoco.MjModel.from_xml_path(str(path))
    if setting is not None:
        setting.put(model)
        model.opt.disableflags |= UNUSED
    return model


def controls(model, frequency_hz, first, count):
    """The servo's targets for so many steps: it aims ahead of the phase by what its damping holds back, so that the
    torque is kp·(ωt − angle) + kv·(ω − speed)."""
    stiffness, damping = model.actuator_gainprm[0, 0], -model.actuator_biasprm[0, 2]
    time = (first + np.arange(count)) * model.opt.timestep
    return (2.0 * math.pi * frequency_hz * (time + damping / stiffness))[:, None]


def start(model, frequency_hz):
    """At rest in the nominal pose, the rotor at its speed, as a state."""
    data = mujoco.MjData(model)
    data.qvel[model.joint("rotor").dofadr[0]] = 2.0 * math.pi * frequency_hz
    state = np.zeros(mujoco.mj_stateSize(model, STATE))
    mujoco.mj_getState(model, data, state, STATE)
    return state


def runs(models, frequencies_hz, seconds, threads):
    """States after every step, one run for each model and frequency. MuJoCo's own loop in C."""
    count = round(seconds / models[0].opt.timestep)
    pairs = list(zip(models, frequencies_hz))
    starts = np.array([start(model, f) for model, f in pairs])
    control = np.array([controls(model, f, 0, count) for model, f in pairs])
    data = [mujoco.MjData(models[0]) for _ in range(max(1, threads))]
    with rollout.Rollout(nthread=threads if threads > 1 else 0) as loop:
        states, _ = loop.rollout(models, data, starts, control, chunk_size=1)
    return states


def speeds(model, states, from_s=1.0, to_s=2.0):
    """Longitudinal and lateral speed (m/s, in the frame of the start) and yaw rate (rad/s, counter-clockwise): the mean
    of the modules' centres, and the direction from the last module to the first."""
    data = mujoco.MjData(model)
    sites = [i for i in range(model.nsite) if model.site(i).name.startswith("module")]
    sites.sort(key=lambda i: int(model.site(i).name.removeprefix("module")))
    step = model.opt.timestep
    # The first state is the one after the first step.
    ends = [min(len(states) - 1, max(0, round(t / step) - 1)) for t in (from_s, to_s)]
    centres, headings = [], []
    for index in np.linspace(*ends, HEADINGS).astype(int):
        data.qpos[:] = states[index, QPOS : QPOS + model.nq]
        mujoco.mj_kinematics(model, data)
        x = data.site_xpos[sites]
        along = x[0] - x[-1]
        centres.append(x.mean(axis=0))
        headings.append(math.atan2(along[1], along[0]))
    time = (ends[1] - ends[0]) * step
    moved = (centres[-1] - centres[0]) / time
    turned = np.unwrap(headings)
    return [float(moved[0]), float(moved[1]), float((turned[-1] - turned[0]) / time)]


def conditions(paths, frequencies_hz):
    """Every model at every frequency, the frequencies of a model together."""
    return [(path, f) for path in paths for f in frequencies_hz]


def all_speeds(paths, frequencies_hz, setting, threads, seconds=2.0):
    """The speeds of every model at every frequency. As many runs at a time as threads: fine steps make long runs."""
    models = {path: load(path, setting) for path in paths}
    todo, table = conditions(paths, frequencies_hz), []
    for k in range(0, len(todo), threads):
        some = todo[k : k + threads]
        states = runs([models[path] for path, _ in some], [f for _, f in some], seconds, threads)
        table += [speeds(models[path], states[i]) for i, (path, _) in enumerate(some)]
    return table


def frequencies(text):
    """`-8,-7,6` as numbers, for argparse."""
    return [float(word) for word in text.split(",")]


def say(**figures):
    """Prints the result."""
    print(json.dumps({"mujoco": mujoco.__version__, **figures}))
