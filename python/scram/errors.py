"""Exceptions of the package. Their text is what the command line says, with its help."""


class ScramError(Exception):
    """Something could not be done. Base of every exception of this package."""


class InputError(ScramError, ValueError):
    """What a call was given is wrong: an argument, a robot file, a recording."""


class MissingFileError(ScramError, FileNotFoundError):
    """There is no such file."""
