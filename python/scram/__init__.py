"""Simulator, recordings and diagnosis of a miniature robot that walks with one motor.

Quantities are in the unit at the end of their name. Angles are counter-clockwise seen from above with 0 in the middle of the
sensor's gap; a drive's frequency is positive clockwise, as in the thesis.
"""

from scram._scram import Robot
from scram.errors import InputError, MissingFileError, ScramError

__all__ = ["InputError", "MissingFileError", "Robot", "ScramError"]
