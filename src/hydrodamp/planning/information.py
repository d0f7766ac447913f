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
    def of(cls, noise: FloatArray, motion: FloatArray, share: float) -> Seen:
        """Return the errors of sensors, and a share of the motion that no model of it has."""
        spread = np.sqrt(noise**2 + (share * motion) ** 2)
        return cls(np.maximum(spread, 1e-6), np.maximum(_DOUBT * noise, 1e-6))


def informed(fleet: Fleet, voyage: Voyage, seen: Seen, window: float = WINDOW) -> FloatArray:
    """Return what each vehicle's record tells of the model's coefficients, shape (n, p, p).

    With A the slopes of a replay on the coefficients, over the spread of its errors, and B those
    on the first velocity, a window tells A'A - A'B (B'B + D)^-1 B'A, where D is what is known of
    the first velocity: Cramer and Rao's bound of output error (Farina and Piroddi 2010).
    """
    n_waters, n = len(fleet.matrices), voyage.states.shape[1]
    model, p = fleet.waters.model, fleet.waters.model.n_coefficients
    found = np.zeros((n, p, p))
    free = np.flatnonzero(fleet.vehicle.free)
    for water in range(min(n_waters, n)):
        own = np.arange(water, n, n_waters)
        log = voyage.part(own).log(fleet.vehicle, fleet.helm.names, exact=True)
        problem = prepare(fleet.vehicle, log, fleet.waters.wide)
        samples = len(voyage.states)
        length = max(min(round(window / voyage.period), samples - 1), 2)
        starts = np.arange(0, samples - length, length)
        bounds = (np.arange(len(own))[:, None] * samples + starts).ravel()
        spans = np.column_stack([bounds, bounds + length])
        block = max(length // _MEANS, 1)
        _, _, slopes = core.replay(
            problem.columns.plant,
            fleet.matrices[water],
            problem.inputs,
            spans,
            problem.columns.entries(model),
            max_step=MAX_STEP,
            block=block,
        )
        slopes = slopes[:, free] / seen.spread[free, None]
        slopes = np.nan_to_num(slopes).reshape(len(spans), -1, p + 6)
        a, b = slopes[:, :, :p], slopes[:, :, p + free]
        inner = b.transpose(0, 2, 1) @ b + np.diag(seen.doubt[free] ** -2.0)
        shared = b.transpose(0, 2, 1) @ a
        told = a.transpose(0, 2, 1) @ a - shared.transpose(0, 2, 1) @ np.linalg.solve(inner, shared)
        found[own] = told.reshape(len(own), len(starts), p, p).sum(axis=1)
    return found
