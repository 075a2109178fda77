"""The environment ``scram/Turn-v0`` with the exact drive on MuJoCo: same robot, actions, Δt, observation and reward.

The model is what ``scram export mjcf`` writes of the environment's robot. MuJoCo runs in its own loop in C (``mujoco.rollout``), one
call a step of the environment, with the setting that is its fastest on this robot (docs/mujoco.md): pyramidal cones, the projected
solver at a coarse accuracy, dense Jacobians, Euler's integrator, and what the model does not use switched off. The servo's targets
follow the same ramps from one frequency to the next.
"""

import math
import sys
from pathlib import Path
from typing import Any

import gymnasium
import mujoco
import numpy as np
from gymnasium import spaces
from mujoco import rollout

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests" / "mujoco"))
from robot import PYRAMIDAL, STATE, UNUSED, Setting  # noqa: E402

FASTEST = Setting(
    cone="pyramidal", impratio=1.0, solver="PGS", integrator="Euler", jacobian="dense", tolerance=1e-5, iterations=10
)
"""MuJoCo's setting with the most steps per second on this robot: ``tests/mujoco/timing.py single`` prints them all."""
SETTINGS = {"fastest": FASTEST, "default": PYRAMIDAL}


def model_of(text: str, setting: Setting) -> mujoco.MjModel:
    """A model with a setting and without what it does not use."""
    model = mujoco.MjModel.from_xml_string(text)
    setting.put(model)
    model.opt.disableflags |= UNUSED
    return model


class MujocoTurnEnv(gymnasium.Env):
    """Turning in place, by MuJoCo."""

    metadata = {"render_modes": []}

    def __init__(self, xml: str, definition: Any, acceleration: float, setting: str = "fastest") -> None:
        self.model = model_of(xml, SETTINGS[setting])
        self.data = mujoco.MjData(self.model)
        self.definition = definition
        self.acceleration = acceleration
        self.steps_per_action = round(definition.interval_s / self.model.opt.timestep)
        self.observation_space = spaces.Box(-np.inf, np.inf, (3,), np.float32)
        self.action_space = spaces.Discrete(len(definition.frequencies_hz))
        # Positive speed is counter-clockwise, a positive frequency clockwise.
        self.speeds = -2.0 * math.pi * np.array(definition.frequencies_hz)
        self.sites = [self.model.site(f"module{k + 1}").id for k in range(4)]
        stiffness, damping = self.model.actuator_gainprm[0, 0], -self.model.actuator_biasprm[0, 2]
        self.ahead_s = damping / stiffness
        self.desired = definition.yaw_rate_rad_per_s * (1.0 if definition.direction == "left" else -1.0)
        self.loop = rollout.Rollout(nthread=0)
        self.state = np.zeros(mujoco.mj_stateSize(self.model, STATE))

    def reset(self, *, seed=None, options=None):
        """Starts at rest."""
        super().reset(seed=seed)
        mujoco.mj_resetData(self.model, self.data)
        self.target = self.np_random.uniform(-math.pi, math.pi)
        self.data.qpos[self.model.joint("rotor").qposadr[0]] = self.target
        mujoco.mj_getState(self.model, self.data, self.state, STATE)
        self.speed, self.count = 0.0, 0
        self.start = self.pose = self.where()
        return self.observation(), {}

    def step(self, action):
        """Holds a frequency for Δt."""
        states, _ = self.loop.rollout(self.model, self.data, self.state[None], self.controls(action)[None], chunk_size=1)
        self.state = states[0, -1].copy()
        mujoco.mj_setState(self.model, self.data, self.state, STATE)
        before, self.pose = self.pose, self.where()
        turned = math.remainder(self.pose[2] - before[2], 2.0 * math.pi) / self.definition.interval_s
        x, y = self.pose[0] - self.start[0], self.pose[1] - self.start[1]
        reward = -((turned - self.desired) ** 2) * self.definition.k_rot - (x * x + y * y) * self.definition.k_pos
        self.count += 1
        late = self.count >= round(self.definition.episode_s / self.definition.interval_s)
        return self.observation(), reward, False, late, {}

    def controls(self, action):
        """Targets of the servo: a ramp to the new speed, ahead by what the servo's damping holds back."""
        step = self.model.opt.timestep
        change = self.speeds[action] - self.speed
        ramp = np.clip(np.arange(1, self.steps_per_action + 1) * self.acceleration * step, 0.0, abs(change))
        speeds = self.speed + math.copysign(1.0, change) * ramp
        angles = self.target + np.cumsum(speeds) * step
        self.speed, self.target = float(speeds[-1]), float(angles[-1])
        return (angles + self.ahead_s * speeds)[:, None]

    def where(self):
        """Mean of the modules' centres, and the direction from the last to the first."""
        mujoco.mj_kinematics(self.model, self.data)
        centres = self.data.site_xpos[self.sites]
        along = centres[0] - centres[-1]
        return np.array([*centres.mean(axis=0)[:2], math.atan2(along[1], along[0])])

    def observation(self):
        """As the thesis's, in the definition's unit of length."""
        off = (self.pose[:2] - self.start[:2]) / self.definition.length_unit_m
        return np.array([*off, self.pose[2]], dtype=np.float32)
