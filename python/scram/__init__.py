"""Simulator, recordings and diagnosis of a miniature robot that walks with one motor.

Quantities are in the unit at the end of their name. Angles are counter-clockwise seen from above with 0 in the middle of the
sensor's gap; a drive's frequency is positive clockwise, as in the thesis.

>>> import scram
>>> robot = scram.Robot("robot.toml", **{"motor.resistance_ohm": 17})
>>> run = scram.simulate(robot, "freq:7", seconds=1, seed=1)
>>> len(run), run["duty"].dtype
(1000, dtype('float64'))
"""

from scram._scram import Actuation, Controller, Quantity, Recording, Robot, read, simulate
from scram._speeds import captured_speeds
from scram.batch import Batch, simulate_batch
from scram.diagnosis import Cause, Diagnosis, WalkDiagnosis, diagnose, diagnose_walk
from scram.errors import InputError, MissingFileError, ScramError
from scram.identification import (
    BackboneFit,
    MotorFit,
    Number,
    PotentiometerFit,
    Release,
    RobotFit,
    identify_backbone,
    identify_motor,
    identify_potentiometer,
    identify_robot,
)

__all__ = [
    "Actuation",
    "BackboneFit",
    "Batch",
    "Cause",
    "Controller",
    "Diagnosis",
    "InputError",
    "MissingFileError",
    "MotorFit",
    "Number",
    "PotentiometerFit",
    "Quantity",
    "Recording",
    "Release",
    "Robot",
    "RobotFit",
    "ScramError",
    "WalkDiagnosis",
    "captured_speeds",
    "diagnose",
    "diagnose_walk",
    "identify_backbone",
    "identify_motor",
    "identify_potentiometer",
    "identify_robot",
    "read",
    "simulate",
    "simulate_batch",
]
