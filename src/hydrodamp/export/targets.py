"""The table of targets."""

from __future__ import annotations

from hydrodamp.errors import MethodError, no_such
from hydrodamp.export.forms import FORMS
from hydrodamp.export.randomisation import Randomisation
from hydrodamp.export.target import Target

TARGETS: dict[str, Target] = {**FORMS, Randomisation.key: Randomisation()}
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
        raise MethodError(no_such("target", key, TARGETS))
    return TARGETS[key]
