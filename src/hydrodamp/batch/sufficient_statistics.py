"""Fold a log into a few triangles, merge folds, and solve models from them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from itertools import pairwise
from operator import itemgetter

import numpy as np
from scipy.linalg import block_diag

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.basis import Basis
from hydrodamp.batch.discovery import local_copy
from hydrodamp.batch.recordings import ResolvedMapping
from hydrodamp.data.log import Log, concatenate
from hydrodamp.errors import ProblemError, suppress_warnings
from hydrodamp.identification.fit import Fit, Method, Uncertainty, identify_or_refuse
from hydrodamp.identification.identifiability import Grade, grade_coefficients
from hydrodamp.identification.jackknife import MAX_BLOCKS, MIN_BLOCKS, jackknife
from hydrodamp.identification.least_squares import LeastSquares, WeakForm
from hydrodamp.identification.operating_range import Ranges, join_ranges, velocity_ranges
from hydrodamp.identification.qr_factor import (
    AxisSolution,
    Triangle,
    group_labels,
    merge,
    solve_axis,
    update_factor,
)
from hydrodamp.ingest.read import read_log
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import prepare, vehicle_stamp
from hydrodamp.simulation.replay import score, simulate
from hydrodamp.simulation.status import Status
from hydrodamp.vehicle.vehicle import Vehicle

#: Blocks of a log, and the shortest of them [s].
_OF_A_LOG, _SHORTEST = 8, 30.0

#: Blocks that merged statistics keep at most: more of them take memory.
_KEPT = 128

#: A direction of which one block tells more than the rest of this is taken to leave so much.
_LEAST_LEFT = 0.1


@dataclass(frozen=True, eq=False)
class LogStatistics:
    """The sufficient statistics of a log, or of many: triangles of blocks of time.

    ``order`` sorts the blocks of merged folds: start of the log [s], a number that tells logs of
    equal start apart, index of the block.
    """

    blocks: tuple[Triangle, ...]
    start: float
    duration: float
    n_samples: int
    n_logs: int
    training_range: Ranges
    order: tuple[tuple[float, float, int], ...] = ()

    def __post_init__(self) -> None:
        """Give the blocks of a single log their order."""
        if not self.order:
            content = float(np.abs(self.blocks[0].r).sum())
            order = tuple((self.start, content, k) for k in range(len(self.blocks)))
            object.__setattr__(self, "order", order)

    @cached_property
    def triangle(self) -> Triangle:
        """All blocks in one."""
        return merge(self.blocks)

    @cached_property
    def balanced(self) -> tuple[Triangle, ...]:
        """The blocks of the jackknife, of nearly equal size where there are more."""
        return tuple(merge(self.blocks[part]) for part in _divide(self.blocks, MAX_BLOCKS))

    def merge(self, other: LogStatistics) -> LogStatistics:
        """Return both as one."""
        return merge_statistics((self, other))

    def select_terms(self, basis: Basis) -> LogStatistics:
        """Return the same with the columns of some of its terms."""
        own = self.blocks[0].basis
        if basis == own:
            return self
        places = [*map(own.index, basis), *range(len(own), len(own) + 6)]
        empty = np.zeros((len(places), len(places)))
        blocks = tuple(
            Triangle(basis, update_factor(empty, one.r[:, places]), one.n_samples)
            for one in self.blocks
        )
        return replace(self, blocks=blocks)


def merge_statistics(folds: Iterable[LogStatistics]) -> LogStatistics:
    """Merge the folds of many logs.

    Coefficients and standard errors do not depend on the order of the folds. Merging in parts
    gives the same too, up to 128 blocks; a log has at most eight.

    Parameters
    ----------
    folds : iterable of Folded
        At least one, of the same vehicle, terms and method; as many at once as memory allows.

    Returns
    -------
    folded : Folded
        Of all logs. Its blocks are in the order of time; beyond 128, neighbouring blocks are
        merged into 64 or fewer of nearly equal numbers of rows.

    Raises
    ------
    ProblemError
        If there is no fold, or their terms differ.

    Examples
    --------
    >>> import hydrodamp as hd
    >>> dives, method = hd.reenact(duration=60.0), hd.WeakForm()
    >>> model = hd.catalog["linear"]
    >>> logs = dives.train, dives.test
    >>> folds = [summarise_log(log, dives.vehicle, [model], method) for log in logs]
    >>> merged = merge_statistics(folds)
    >>> merged.n_logs, len(merged.blocks)
    (2, 12)
    >>> solve_model(merged, dives.vehicle, model, method).uncertainty.n_blocks
    12
    """
    parts = tuple(folds)
    if not parts:
        raise ProblemError("merge_statistics needs at least one fold, got none")
    if any(one.blocks[0].basis != parts[0].blocks[0].basis for one in parts):
        raise ProblemError("folds of different terms cannot be merged: fold all logs for one model")
    pairs = [pair for one in parts for pair in zip(one.order, one.blocks, strict=True)]
    pairs.sort(key=itemgetter(0))
    order, blocks = [one for one, _ in pairs], [one for _, one in pairs]
    if len(blocks) > _KEPT:
        runs = _divide(blocks, _KEPT // 2)
        order, blocks = [order[run.start] for run in runs], [merge(blocks[run]) for run in runs]
    return LogStatistics(
        blocks=tuple(blocks),
        start=min(one.start for one in parts),
        duration=math.fsum(one.duration for one in parts),
        n_samples=sum(one.n_samples for one in parts),
        n_logs=sum(one.n_logs for one in parts),
        training_range=reduce(join_ranges, (one.training_range for one in parts)),
        order=tuple(order),
    )


def _divide(blocks: Sequence[Triangle], most: int) -> list[slice]:
    """Return runs of blocks: each block alone where there are few, else of nearly equal rows."""
    if len(blocks) <= most:
        return [slice(k, k + 1) for k in range(len(blocks))]
    rows = np.array([one.n_samples for one in blocks])
    middle = (np.cumsum(rows) - rows / 2.0) / rows.sum()
    firsts = np.unique((middle * most).astype(int), return_index=True)[1].tolist()
    return [slice(first, last) for first, last in pairwise([*firsts, len(blocks)])]


def _read_logs(addresses: Sequence[str], mapping: ResolvedMapping | None) -> Log:
    """Read a log or several; what is odd about single ones is left to `probe`."""
    logs = []
    with suppress_warnings():
        for address in addresses:
            with local_copy(address) as path:
                logs.append(read_log(path, mapping.mapping if mapping else None))
    return logs[0] if len(logs) == 1 else concatenate(logs)


def summarise_address(
    address: str,
    vehicle: Vehicle,
    models: Sequence[DampingModel],
    method: LeastSquares | WeakForm,
    mapping: ResolvedMapping | None = None,
) -> LogStatistics:
    """Read a log, fill equation 1 with it, and fold its rows."""
    try:
        return summarise_log(_read_logs([address], mapping), vehicle, models, method)
    except _UnusableLogError as error:
        raise ProblemError(f"{address}: {error}") from error


class _UnusableLogError(ProblemError):
    """A log gives no row, or none that is finite."""


def summarise_log(
    log: Log,
    vehicle: Vehicle,
    models: Sequence[DampingModel],
    method: LeastSquares | WeakForm,
) -> LogStatistics:
    """Fill equation 1 with a log and fold its rows."""
    with np.errstate(all="ignore"):  # what overflows is refused below
        problem = prepare(vehicle, log, models)
        rows = method.equations.rows(problem)
        if not rows.n:
            raise _UnusableLogError(f"{log.duration:.3g} s are too short to make rows of.")
        n = int(np.clip(log.duration / _SHORTEST, 1, min(_OF_A_LOG, rows.n)))
        blocks = tuple(
            rows.select(part).triangle() for part in np.array_split(np.arange(rows.n), n)
        )
        sizes = [np.square(block.r).sum() for block in blocks]  # covariances are of squares
    if not np.isfinite(sizes).all():
        raise _UnusableLogError(
            "equation 1 filled with it overflows. Its largest numbers are "
            f"{_largest_values(log)}: leave such samples out."
        )
    ranges = velocity_ranges(problem.inputs.velocity, vehicle.axes)
    return LogStatistics(blocks, float(log.time[0]), log.duration, log.n, 1, ranges)


def _largest_values(log: Log, n: int = 3) -> str:
    """Name the channels of a log with the largest numbers."""
    columns = [*zip(log.velocity_names, log.velocity.T, strict=True)]
    columns += [*zip(log.command_names, log.commands.T, strict=True)]
    sizes = {name: float(np.nanmax(np.abs(values))) for name, values in columns}
    return ", ".join(f"{k} {sizes[k]:.3g}" for k in sorted(sizes, key=lambda k: -sizes[k])[:n])


def read_start(address: str, mapping: ResolvedMapping | None = None) -> float:
    """Return when a log begins by its clock [s]."""
    return float(_read_logs([address], mapping).time[0])


def identify_logs(
    addresses: Sequence[str],
    vehicle: Vehicle,
    models: Sequence[DampingModel],
    method: Method,
    mapping: ResolvedMapping | None = None,
) -> tuple[Fit, ...]:
    """Identify models from the whole of some logs, by a method that folds nothing."""
    problem = prepare(vehicle, _read_logs(addresses, mapping), models)
    return tuple(identify_or_refuse(method, problem, model) for model in models)


def replay_log(
    address: str,
    vehicle: Vehicle,
    fits: Sequence[Fit | None],
    mapping: ResolvedMapping | None = None,
) -> tuple[float | None, ...]:
    """Return the error of equation 24 of replays of a log; None where one diverged or is absent."""
    log = _read_logs([address], mapping)
    return tuple(
        None if fit is None else score(simulate(vehicle, fit.damping, log)).rms for fit in fits
    )


def solve_model(
    folded: LogStatistics, vehicle: Vehicle, model: DampingModel, method: Method
) -> Fit:
    """Solve a model from what was folded, its standard errors by leaving out one block each."""
    free = model.restricted_to(vehicle.axes)
    if not np.isfinite(folded.triangle.r).all():
        raise ProblemError("equation 1 of the logs together is not finite.")
    with np.errstate(all="ignore"):  # what overflows is refused below
        found = [solve_axis(folded.triangle, terms, axis) for axis, terms in enumerate(free.terms)]
        known = _jackknifed(folded, free, found)
    aliased = group_labels(one.span.aliased for one in found)
    coefficients = np.concatenate([one.coefficients for one in found])
    if known is None or known.covariance is None:
        covariance = block_diag(*[one.covariance for one in found])
    else:
        covariance = known.covariance
    if not (np.isfinite(coefficients).all() and np.isfinite(covariance).all()):
        raise ProblemError(f"the estimate of model '{free.key}' is not finite.")
    return Fit(
        damping=Damping(
            free,
            coefficients,
            covariance=covariance,
            vehicle=vehicle_stamp(vehicle),
        ),
        method=method.key,
        status=Status.RANK_DEFICIENT if aliased else Status.OK,
        rank=sum(one.span.rank for one in found),
        aliased=aliased,
        n_samples=folded.n_samples,
        provenance={"logs": str(folded.n_logs), "vehicle": vehicle.name, "settings": repr(method)},
        uncertainty=known,
        training_range=dict(folded.training_range),
    )


def _jackknifed(
    folded: LogStatistics, model: DampingModel, found: Sequence[AxisSolution]
) -> Uncertainty | None:
    """Return how far estimates without one block each lie apart: whatever is alike within one.

    With orthonormal columns Q of all blocks, leaving one out moves the amounts of them by
    ``(I − QᵇᵀQᵇ)⁻¹ Qᵇᵀ e`` of its residuals e, exactly.
    """
    if len(folded.balanced) < MIN_BLOCKS:
        return None
    moves: list[FloatArray] = []
    for block in folded.balanced:
        parts = []
        for axis, (terms, one) in enumerate(zip(model.terms, found, strict=True)):
            design = block.columns(terms)
            unit = design @ one.span.coefficients
            share, turn = np.linalg.eigh(unit.T @ unit)
            left = unit.T @ (block.target(axis) - design @ one.coefficients)
            amounts = turn @ ((turn.T @ left) / np.maximum(1.0 - share, _LEAST_LEFT))
            parts.append(one.span.coefficients @ amounts)
        moves.append(np.concatenate(parts))
    leverage = np.concatenate([np.sum(one.span.coefficients**2, axis=1) for one in found])
    return jackknife(np.array(moves), folded.duration, leverage)


def grade_statistics(folded: LogStatistics | None, fit: Fit) -> tuple[Grade, ...]:
    """Grade each coefficient by its interval and what its column is worth on its axis."""
    if folded is None or fit.uncertainty is None:
        return ()
    half = fit.uncertainty.critical_value() * fit.uncertainty.standard_errors
    lost = {label for group in fit.aliased for label in group}
    found, first, root = list[Grade](), 0, np.sqrt(folded.triangle.n_samples)
    for terms in fit.model.terms:
        part = slice(first, first := first + len(terms))
        design, own = folded.triangle.columns(terms), fit.damping.coefficients[part]
        found += grade_coefficients(
            own,
            half[part],
            np.linalg.norm(design, axis=0) / root,
            np.ones(len(terms)),
            np.array([label in lost for label in fit.model.labels[part]], dtype=np.bool_),
            response=float(np.linalg.norm(design @ own) / root),
            excited=True,
        )[0]
    return tuple(found)
