"""The table of targets."""

from __future__ import annotations

from hydrodamp.errors import MethodError, did_you_mean
from hydrodamp.export.c99 import C
from hydrodamp.export.casadi import CasADi
from hydrodamp.export.fmu import FMU
from hydrodamp.export.octave import Octave
from hydrodamp.export.python import Python
from hydrodamp.export.target import Target

TARGETS: dict[str, Target] = {form.key: form for form in (Python(), C(), Octave(), CasADi(), FMU())}
"""The targets by their keys, with their usual settings."""


def find_target(key: str) -> Target:
    """Return the target of a key.

    Parameters
    ----------
    key : str
        Such as ``"python"``.

    Returns
    -------
    target : Target
        With its usual settings.

    Raises
    ------
    MethodError
        If there is none, with the nearest that there is.

    Examples
    --------
    >>> find_target("python").key
    'python'
    """
    if key not in TARGETS:
        raise MethodError(
            f"there is no target '{key}'; the targets are {', '.join(TARGETS)}."
            f"{did_you_mean(key, TARGETS)}"
        )
    return TARGETS[key]
