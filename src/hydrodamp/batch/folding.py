"""One log folded, and folds merged: a few triangles are all that is left of a log."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.basis import Basis
from hydrodamp.batch.addresses import here
from hydrodamp.data.log import Log, concatenate
from hydrodamp.errors import HydrodampWarning, ProblemError
from hydrodamp.identification.extrapolation import Ranges, joined, sailed
from hydrodamp.identification.fit import Fit, Method, Uncertainty, attempted
from hydrodamp.identification.grades import Grade, rated
from hydrodamp.identification.linear import LeastSquares, WeakForm
from hydrodamp.identification.triangle import (
    AxisSolution,
    Triangle,
    folded_rows,
    group_labels,
    merge,
    solve_axis,
)
from hydrodamp.ingest.read import read_log
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import prepare, stamp
from hydrodamp.simulation.replay import score, simulate
from hydrodamp.simulation.status import Status
from hydrodamp.vehicle.vehicle import Vehicle

#: Blocks of a log, of at least so many seconds each, and of many logs merged.
_OF_A_LOG, _SHORTEST, _MOST = 8, 30.0, 32

#: Blocks from which standard errors can be told.
_FEWEST = 4

#: A direction of which one block tells more than the rest of this is taken to leave so much.
_LEAST_LEFT = 0.1


@dataclass(frozen=True, eq=False)
class Folded:
    """What is left of a log, or of many: triangles of blocks of time, in their order."""

    blocks: tuple[Triangle, ...]
    start: float
    duration: float
    n_samples: int
    n_logs: int
    sailed: Ranges

    @cached_property
    def triangle(self) -> Triangle:
        """All blocks in one."""
        return merge(self.blocks)

    def merged(self, other: Folded) -> Folded:
        """Return both; neighbouring blocks are merged where there are many."""
        blocks = (*self.blocks, *other.blocks)
        while len(blocks) > _MOST:
            blocks = tuple(merge(blocks[k : k + 2]) for k in range(0, len(blocks), 2))
        return Folded(
            blocks,
            min(self.start, other.start),
            self.duration + other.duration,
            self.n_samples + other.n_samples,
            self.n_logs + other.n_logs,
            joined(self.sailed, other.sailed),
        )

    def only(self, basis: Basis) -> Folded:
        """Return the same with the columns of some of its terms."""
        own = self.blocks[0].basis
        if basis == own:
            return self
        places = [*map(own.index, basis), *range(len(own), len(own) + 6)]
        empty = np.zeros((len(places), len(places)))
        blocks = (
            Triangle(basis, folded_rows(empty, one.r[:, places]), one.n_samples)
            for one in self.blocks
        )
        return Folded(
            tuple(blocks), self.start, self.duration, self.n_samples, self.n_logs, self.sailed
        )


def _read(addresses: Sequence[str], mapping: str | None) -> Log:
    """Read a log or several; what is odd about single ones is left to `probe`."""
    logs = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", HydrodampWarning)
        for address in addresses:
            with here(address) as path:
                logs.append(read_log(path, mapping))
    return logs[0] if len(logs) == 1 else concatenate(logs)


def fold(
    address: str,
    vehicle: Vehicle,
    models: Sequence[DampingModel],
    method: LeastSquares | WeakForm,
    mapping: str | None = None,
) -> Folded:
    """Read a log, fill equation 1 with it, and fold its rows."""
    log = _read([address], mapping)
    problem = prepare(vehicle, log, models)
    rows = method.equations.rows(problem)
    if not rows.n:
        raise ProblemError(f"{address}: {log.duration:.3g} s are too short to make rows of.")
    n = int(np.clip(log.duration / _SHORTEST, 1, min(_OF_A_LOG, rows.n)))
    blocks = tuple(rows.taken(part).triangle() for part in np.array_split(np.arange(rows.n), n))
    ranges = sailed(problem.inputs.velocity, vehicle.axes)
    return Folded(blocks, float(log.time[0]), log.duration, log.n, 1, ranges)


def begins(address: str, mapping: str | None = None) -> float:
    """Return when a log begins by its clock [s]."""
    return float(_read([address], mapping).time[0])


def identified(
    addresses: Sequence[str],
    vehicle: Vehicle,
    models: Sequence[DampingModel],
    method: Method,
    mapping: str | None = None,
) -> tuple[Fit, ...]:
    """Identify models from the whole of some logs, by a method that folds nothing."""
    problem = prepare(vehicle, _read(addresses, mapping), models)
    return tuple(attempted(method, problem, model) for model in models)


def replayed(
    address: str, vehicle: Vehicle, fits: Sequence[Fit], mapping: str | None = None
) -> tuple[float | None, ...]:
    """Return the error of equation 24 of replays of a log; None where one diverged."""
    log = _read([address], mapping)
    return tuple(score(simulate(vehicle, fit.damping, log)).rms for fit in fits)


def solved(folded: Folded, vehicle: Vehicle, model: DampingModel, method: Method) -> Fit:
    """Solve a model from what was folded, its standard errors by leaving out one block each."""
    free = model.restricted_to(vehicle.axes)
    found = [solve_axis(folded.triangle, terms, axis) for axis, terms in enumerate(free.terms)]
    aliased = group_labels(one.span.aliased for one in found)
    known = _jackknifed(folded, free, found)
    covariance = block_diag(*[one.covariance for one in found]) if known is None else None
    coefficients = np.concatenate([one.coefficients for one in found])
    return Fit(
        damping=Damping(
            free,
            coefficients,
            covariance=covariance if known is None else known.covariance,
            vehicle=stamp(vehicle),
        ),
        method=method.key,
        status=Status.RANK_DEFICIENT if aliased else Status.OK,
        rank=sum(one.span.rank for one in found),
        aliased=aliased,
        n_samples=folded.n_samples,
        provenance={"logs": str(folded.n_logs), "vehicle": vehicle.name, "settings": repr(method)},
        uncertainty=known,
        sailed=dict(folded.sailed),
    )


def _jackknifed(
    folded: Folded, model: DampingModel, found: Sequence[AxisSolution]
) -> Uncertainty | None:
    """Return how far estimates without one block each lie apart: whatever is alike within one.

    With orthonormal columns Q of all blocks, leaving one out moves the amounts of them by
    ``(I − QᵇᵀQᵇ)⁻¹ Qᵇᵀ e`` of its residuals e, exactly.
    """
    n = len(folded.blocks)
    if n < _FEWEST:
        return None
    moves: list[FloatArray] = []
    for block in folded.blocks:
        parts = []
        for axis, (terms, one) in enumerate(zip(model.terms, found, strict=True)):
            design = block.columns(terms)
            unit = design @ one.span.coefficients
            share, turn = np.linalg.eigh(unit.T @ unit)
            left = unit.T @ (block.target(axis) - design @ one.coefficients)
            amounts = turn @ ((turn.T @ left) / np.maximum(1.0 - share, _LEAST_LEFT))
            parts.append(one.span.coefficients @ amounts)
        moves.append(np.concatenate(parts))
    away = np.array(moves) - np.mean(moves, axis=0)
    return Uncertainty(
        covariance=(n - 1) / n * (away.T @ away),
        degrees_of_freedom=n - 1,
        method="one block of the logs after another left out (jackknife)",
        block=folded.duration / n,
        n_blocks=n,
    )


def graded(folded: Folded | None, fit: Fit) -> tuple[Grade, ...]:
    """Grade each coefficient by its interval and what its column is worth on its axis."""
    if folded is None or fit.uncertainty is None:
        return ()
    half = fit.uncertainty.reach() * fit.uncertainty.standard_errors
    lost = {label for group in fit.aliased for label in group}
    found, first, root = list[Grade](), 0, np.sqrt(folded.triangle.n_samples)
    for terms in fit.model.terms:
        part = slice(first, first := first + len(terms))
        design, own = folded.triangle.columns(terms), fit.damping.coefficients[part]
        found += rated(
            own,
            half[part],
            np.linalg.norm(design, axis=0) / root,
            np.ones(len(terms)),
            np.array([label in lost for label in fit.model.labels[part]], dtype=np.bool_),
            response=float(np.linalg.norm(design @ own) / root),
            excited=True,
        )[0]
    return tuple(found)
