"""All cleaning steps, one after the other."""

from __future__ import annotations

from collections.abc import Sequence

from hydrodamp.advance import counted
from hydrodamp.conditioning.attitude_jumps import steady_attitude
from hydrodamp.conditioning.bottom_lock import mask_bottom_lock
from hydrodamp.conditioning.frozen import mask_frozen
from hydrodamp.conditioning.spikes import remove_spikes
from hydrodamp.conditioning.suspicions import note_suspicions
from hydrodamp.conditioning.touched import Cleaned, Step, Touched
from hydrodamp.data.log import Log

CLEANING_STEPS: tuple[Step, ...] = (
    mask_bottom_lock,
    mask_frozen,
    steady_attitude,
    remove_spikes,
    note_suspicions,
)
"""Numbers that stand for none first: they would look like spikes to the others."""


def clean(log: Log, steps: Sequence[Step] = CLEANING_STEPS) -> Cleaned:
    """Clean a log, step by step, and count what every step touched.

    Parameters
    ----------
    log : Log
        Any log.
    steps : sequence of function, optional
        Each takes a log and returns a :class:`Cleaned`; :func:`functools.partial` gives one
        other settings.

    Returns
    -------
    cleaned : Cleaned
        The log, whose notes tell each step that found something, and the counts.

    Raises
    ------
    LogError
        If a step leaves nothing.

    Examples
    --------
    >>> import numpy as np
    >>> time = np.arange(0.0, 20.0, 0.1)
    >>> surge, rate = 1 + 0.1 * np.sin(time), 0.2 * np.cos(time)
    >>> surge[50] = 9.0
    >>> print(clean(Log.from_arrays(time, {"u": surge, "r": rate})))
    spikes: 1 of 200 samples of `u` (0.5 %) interpolated
    """
    touched: list[Touched] = []
    for step in counted(steps, len(steps)):
        done = step(log)
        log = done.log
        touched += done.touched
    return Cleaned(log, tuple(touched))
