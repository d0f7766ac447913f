"""Interpolation between samples: convert a held wrench or linear commands.

Equation 1 is integrated with a wrench w that is linear between samples and commands c that are held
from sample to sample. A held wrench has the mean w_k over step k, one that is linear between
``w'_k = (w_{k-1} + w_k)/2`` has it up to second order, without the lead of half a step. Commands
that were linear have the mean ``c'_k = (c_k + c_{k+1})/2`` over step k.
"""

from __future__ import annotations

import dataclasses
from typing import Literal

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError

Interpolation = Literal["held", "linear"]


def set_interpolation(
    log: Log, wrench: Interpolation = "linear", commands: Interpolation = "held"
) -> Log:
    """Return a log with wrench and commands for the integration of equation 1.

    Parameters
    ----------
    log : Log
        Any log.
    wrench : {"linear", "held"}, optional
        How the recorded wrench varied between samples.
    commands : {"held", "linear"}, optional
        How the commands varied between samples.

    Returns
    -------
    log : Log
        Its notes name what was converted.

    Raises
    ------
    LogError
        If a setting is neither ``held`` nor ``linear``.

    Examples
    --------
    >>> log = Log.from_arrays([0, 1, 2], {"u": [1] * 3}, commands={"rudder": [0.0, 1.0, 1.0]})
    >>> set_interpolation(log, commands="linear").command("rudder").tolist()
    [0.5, 1.0, 1.0]
    """
    for name, value in (("wrench", wrench), ("commands", commands)):
        if value not in ("held", "linear"):
            raise LogError(f"`{name}` must be held or linear; got {value}", source=log.source)
    if wrench == "held" and log.wrench is not None:
        log = dataclasses.replace(log, wrench=_average_neighbours(log, log.wrench, -1))
        log = log.with_notes("wrench held from sample to sample")
    if commands == "linear" and log.command_names:
        log = dataclasses.replace(log, commands=_average_neighbours(log, log.commands, 1))
        log = log.with_notes("commands linear between samples")
    return log


def _average_neighbours(log: Log, values: FloatArray, offset: int) -> FloatArray:
    """Return the mean of each sample and the one at an offset in its segment."""
    index = np.arange(log.n) + offset
    for start, stop in log.bounds.tolist():
        index[start:stop] = np.clip(index[start:stop], start, stop - 1)
    return np.asarray((values + values[index]) / 2.0)
