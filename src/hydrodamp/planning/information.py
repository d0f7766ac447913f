"""What a dive will tell: normal matrices of its replay, window by window, added up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.identification.windows import MAX_STEP
from hydrodamp.kernels import core
from hydrodamp.planning.sailing import Fleet, Voyage
from hydrodamp.simulation.problem import prepare

#: Length of a window [s], means of errors in it, and how well its first velocity is known, in
#: standard deviations of what is measured: as the search of output error has them.
WINDOW, _MEANS, _DOUBT = 8.0, 10, 0.4


@dataclass(frozen=True, eq=False)
class Seen:
    """By what errors replays are judged: their standard deviation, and that of first velocities."""

    spread: FloatArray
    doubt: FloatArray

    @classmethod
    def of(cls, noise: FloatArray) -> Seen:
        """Return the errors of sensors."""
        return cls(np.maximum(noise, 1e-6), np.maximum(_DOUBT * noise, 1e-6))


def informed(fleet: Fleet, voyage: Voyage, seen: Seen, window: float = WINDOW) -> FloatArray:
    """Return what each vehicle's record tells of the model's coefficients, shape (n, p, p).

    With A the slopes of a replay on the coefficients, over the spread of its errors, and B those
    on the first velocity, a window tells A'A - A'B (B'B + D)^-1 B'A, where D is what is known of
    the first velocity: Cramer and Rao's bound of output error (Farina and Piroddi 2010).
    """
    n_waters, n = len(fleet.matrices), voyage.states.shape[1]
    p = fleet.waters.model.n_coefficients
    found = np.zeros((n, p, p))
    for water in range(min(n_waters, n)):
        own = np.arange(water, n, n_waters)
        found[own] = _in_one_water(fleet, voyage.part(own), water, seen, window)
    return found


def _in_one_water(
    fleet: Fleet, voyage: Voyage, water: int, seen: Seen, window: float
) -> FloatArray:
    """Return what the windows of each vehicle tell, all in one water."""
    model = fleet.waters.model
    log = voyage.log(fleet.vehicle, fleet.helm.names, exact=True)
    problem = prepare(fleet.vehicle, log, fleet.waters.wide)
    samples, n = voyage.states.shape[:2]
    free, p = np.flatnonzero(fleet.vehicle.free), model.n_coefficients
    length = max(min(round(window / voyage.period), samples - 1), 2)
    starts = np.arange(0, samples - length, length)
    first = (np.arange(n)[:, None] * samples + starts).ravel()
    _, _, slopes = core.replay(
        problem.columns.plant,
        fleet.matrices[water],
        problem.inputs,
        np.column_stack([first, first + length]),
        problem.columns.entries(model),
        max_step=MAX_STEP,
        block=max(length // _MEANS, 1),
    )
    slopes = np.nan_to_num(slopes[:, free] / seen.spread[free, None])
    slopes = slopes.reshape(len(first), -1, p + 6)
    a, b = slopes[:, :, :p], slopes[:, :, p + free]
    inner = b.transpose(0, 2, 1) @ b + np.diag(seen.doubt[free] ** -2.0)
    shared = b.transpose(0, 2, 1) @ a
    told = a.transpose(0, 2, 1) @ a - shared.transpose(0, 2, 1) @ np.linalg.solve(inner, shared)
    return np.asarray(told.reshape(n, len(starts), p, p).sum(axis=1))
