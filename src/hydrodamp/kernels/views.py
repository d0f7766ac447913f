"""The compiled core's views of Python's arrays, and how its kernels get their docstrings."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from hydrodamp.kernels import _core
from hydrodamp.kernels.entries import Entries
from hydrodamp.kernels.inputs import Inputs
from hydrodamp.kernels.plant import Plant
from hydrodamp.kernels.robustness import Robustness

F = TypeVar("F", bound=Callable[..., object])

NO_ATTITUDE = np.empty((0, 4))
"""How the core is told to use the recorded down vectors."""


def documented_by(twin: Callable[..., object]) -> Callable[[F], F]:
    """Return a decorator that lends a kernel the docstring of its NumPy twin.

    Parameters
    ----------
    twin : callable
        The kernel of the reference.

    Returns
    -------
    decorator : callable
        Sets ``__doc__``.
    """

    def lend(function: F) -> F:
        function.__doc__ = twin.__doc__
        return function

    return lend


@functools.lru_cache(maxsize=32)
def core_plant(plant: Plant) -> _core.Plant:
    """Return the core's view of a plant, kept for the next call.

    Parameters
    ----------
    plant : Plant
        Its arrays never change, so a view stays right.

    Returns
    -------
    view : _core.Plant
        Pointers into the same arrays.
    """
    return _core.Plant(plant.factors, plant.mass_columns, plant.free, plant.n_channels)


def core_record(inputs: Inputs) -> _core.Record:
    """Return the core's view of a record.

    Parameters
    ----------
    inputs : Inputs
        The record.

    Returns
    -------
    view : _core.Record
        Pointers into the same arrays.
    """
    return _core.Record(
        inputs.time,
        inputs.velocity,
        inputs.down,
        inputs.wrench,
        inputs.channels,
        inputs.propulsion,
    )


@functools.lru_cache(maxsize=32)
def core_entries(entries: Entries) -> _core.Entries:
    """Return the core's view of entries, kept for the next call.

    Parameters
    ----------
    entries : Entries
        Its arrays never change, so a view stays right.

    Returns
    -------
    view : _core.Entries
        Pointers into the same arrays.
    """
    return _core.Entries(entries.starts, entries.rows, entries.known)


@functools.lru_cache(maxsize=32)
def core_robust(robustness: Robustness) -> _core.Robust:
    """Return the core's view of the robust identifier's settings, kept for the next call.

    Parameters
    ----------
    robustness : Robustness
        Its arrays never change, so a view stays right.

    Returns
    -------
    view : _core.Robust
        Pointers into the same arrays.
    """
    lower, upper = robustness.bounds
    return _core.Robust(
        core_entries(robustness.entries),
        robustness.a,
        robustness.gains,
        robustness.led_to,
        lower,
        upper,
        robustness.leakage,
        robustness.dead_zone,
    )
