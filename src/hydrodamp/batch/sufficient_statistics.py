"""Sufficient statistics of linear regressions: R factors and Qᵀy of blocks of time of a log.

With A = QR of the rows of a block, (R, Qᵀy) determines the least-squares estimate. Statistics of
several logs are merged by a QR factorisation of the stacked R, and solved for any model whose terms
they contain; standard errors come from the delete-one-block jackknife.
"""

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
from hydrodamp.batch.discovery import ResolvedMapping
from hydrodamp.batch.reading import outlier_messages, read_logs
from hydrodamp.data.log import Log
from hydrodamp.errors import ProblemError, suppress_warnings
from hydrodamp.identification.dissipativity import Ranges, join_ranges, velocity_ranges
from hydrodamp.identification.estimated_vehicle import estimated_vehicle
from hydrodamp.identification.fit import (
    MAX_BLOCKS,
    MIN_BLOCKS,
    Fit,
    Method,
    Uncertainty,
    jackknife,
)
from hydrodamp.identification.grades import Grade, grade_coefficients
from hydrodamp.identification.least_squares import LeastSquares, WeakForm
from hydrodamp.identification.methods import identify_all
from hydrodamp.identification.regression import (
    AxisSolution,
    Triangle,
    group_labels,
    merge,
    solve_axis,
    update_factor,
)
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import prepare, vehicle_stamp
from hydrodamp.simulation.replay import score, simulate
from hydrodamp.status import Status
from hydrodamp.vehicle.vehicle import Vehicle

MAX_BLOCKS_PER_LOG, MIN_BLOCK = 8, 10.0  # [1], correlation times of the velocities; by choice
MAX_STORED_BLOCKS = 128  # of merged statistics; limits their memory
MIN_REMAINING_SHARE = 0.1  # floor of 1 − leverage of a block, against division by zero


@dataclass(frozen=True, eq=False)
class LogStatistics:
    """Sufficient statistics of one or several logs: (R, Qᵀy) of blocks of time.

    ``order`` sorts the blocks of merged statistics: start of the log [s], a number that
    distinguishes logs of equal start, index of the block. ``outliers`` are the implausible samples
    that are left out of a single log, without its name.
    """

    blocks: tuple[Triangle, ...]
    start: float
    duration: float
    n_samples: int
    n_logs: int
    training_range: Ranges
    order: tuple[tuple[float, float, int], ...] = ()
    outliers: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Set the order of the blocks of a single log."""
        if not self.order:
            content = float(np.abs(self.blocks[0].r).sum())
            order = tuple((self.start, content, k) for k in range(len(self.blocks)))
            object.__setattr__(self, "order", order)

    @cached_property
    def triangle(self) -> Triangle:
        """All blocks merged."""
        return merge(self.blocks)

    @cached_property
    def balanced(self) -> tuple[Triangle, ...]:
        """The blocks of the jackknife; merged to nearly equal numbers of rows if there are more."""
        return tuple(merge(self.blocks[run]) for run in _group_blocks(self.blocks, MAX_BLOCKS))

    def merge(self, other: LogStatistics) -> LogStatistics:
        """Return the statistics of both."""
        return merge_statistics((self, other))

    def select_terms(self, basis: Basis) -> LogStatistics:
        """Return the statistics for a subset of the terms."""
        current = self.blocks[0].basis
        if basis == current:
            return self
        columns = [*map(current.index, basis), *range(len(current), len(current) + 6)]
        empty = np.zeros((len(columns), len(columns)))
        blocks = tuple(
            Triangle(basis, update_factor(empty, block.r[:, columns]), block.n_samples)
            for block in self.blocks
        )
        return replace(self, blocks=blocks)


def merge_statistics(statistics: Iterable[LogStatistics]) -> LogStatistics:
    """Merge the sufficient statistics of several logs.

    Coefficients and standard errors do not depend on the order. Merging in several steps gives
    the same result up to 128 blocks; a log has at most eight.

    Parameters
    ----------
    statistics : iterable of LogStatistics
        At least one, of the same vehicle, terms and method.

    Returns
    -------
    merged : LogStatistics
        Of all logs, blocks in the order of time. More than 128 blocks are merged with their
        adjacent blocks into 64 or fewer of nearly equal numbers of rows.

    Raises
    ------
    ProblemError
        If there are none, or their terms differ.

    Examples
    --------
    >>> import hydrodamp as hd
    >>> dives, method = hd.reenact(duration=60.0), hd.WeakForm()
    >>> model = hd.catalog["linear"]
    >>> logs = dives.train, dives.test
    >>> statistics = [summarise_log(log, dives.vehicle, [model], method) for log in logs]
    >>> merged = merge_statistics(statistics)
    >>> merged.n_logs, len(merged.blocks)
    (2, 10)
    >>> solve_model(merged, dives.vehicle, model, method).uncertainty.n_blocks
    10
    """
    logs = tuple(statistics)
    if not logs:
        raise ProblemError("merge_statistics needs the statistics of at least one log, got none")
    if any(log.blocks[0].basis != logs[0].blocks[0].basis for log in logs):
        raise ProblemError("statistics of different terms cannot be merged: use one model")
    pairs = [pair for log in logs for pair in zip(log.order, log.blocks, strict=True)]
    pairs.sort(key=itemgetter(0))
    order, blocks = [key for key, _ in pairs], [block for _, block in pairs]
    if len(blocks) > MAX_STORED_BLOCKS:
        runs = _group_blocks(blocks, MAX_STORED_BLOCKS // 2)
        order, blocks = [order[run.start] for run in runs], [merge(blocks[run]) for run in runs]
    return LogStatistics(
        blocks=tuple(blocks),
        start=min(log.start for log in logs),
        duration=math.fsum(log.duration for log in logs),
        n_samples=sum(log.n_samples for log in logs),
        n_logs=sum(log.n_logs for log in logs),
        training_range=reduce(join_ranges, (log.training_range for log in logs)),
        order=tuple(order),
    )


def _group_blocks(blocks: Sequence[Triangle], n_max: int) -> list[slice]:
    """Return at most ``n_max`` runs of neighbouring blocks with nearly equal numbers of rows."""
    if len(blocks) <= n_max:
        return [slice(k, k + 1) for k in range(len(blocks))]
    rows = np.array([block.n_samples for block in blocks])
    middle = (np.cumsum(rows) - rows / 2.0) / rows.sum()
    firsts = np.unique((middle * n_max).astype(int), return_index=True)[1].tolist()
    return [slice(first, last) for first, last in pairwise([*firsts, len(blocks)])]


def summarise_address(
    address: str,
    vehicle: Vehicle,
    models: Sequence[DampingModel],
    method: LeastSquares | WeakForm,
    mapping: ResolvedMapping | None = None,
) -> LogStatistics:
    """Read a log and return its sufficient statistics."""
    try:
        with suppress_warnings() as collected:
            log = read_logs([address], mapping)
            statistics = summarise_log(log, vehicle, models, method)
        return replace(statistics, outliers=outlier_messages(collected, log.source))
    except _UnusableLogError as error:
        raise ProblemError(f"{address}: {error}") from error


class _UnusableLogError(ProblemError):
    """A log without a finite regression row."""


def summarise_log(
    log: Log, vehicle: Vehicle, models: Sequence[DampingModel], method: LeastSquares | WeakForm
) -> LogStatistics:
    """Return the sufficient statistics of the regression rows of a log."""
    with np.errstate(all="ignore"):  # overflow is refused below
        problem = prepare(vehicle, log, models)
        log = problem.log
        rows = method.equations.rows(problem)
        if not rows.n:
            raise _UnusableLogError(f"{log.duration:.3g} s are too short for a regression row.")
        n_blocks = log.duration / (MIN_BLOCK * rows.time_scale)
        n = int(np.clip(n_blocks, 1, min(MAX_BLOCKS_PER_LOG, rows.n)))
        blocks = tuple(
            rows.select(block).triangle() for block in np.array_split(np.arange(rows.n), n)
        )
        sizes = [np.square(block.r).sum() for block in blocks]  # covariances need squares
    if not np.isfinite(sizes).all():
        raise _UnusableLogError(
            "equation 1 overflows. The largest values of the log are "
            f"{_largest_values(log)}: remove such samples."
        )
    ranges = velocity_ranges(problem.inputs.velocity, vehicle.axes)
    return LogStatistics(blocks, float(log.time[0]), log.duration, log.n, 1, ranges)


def _largest_values(log: Log, n: int = 3) -> str:
    """Return the channels with the largest values, as text."""
    columns = [*zip(log.velocity_names, log.velocity.T, strict=True)]
    columns += [*zip(log.command_names, log.commands.T, strict=True)]
    sizes = {name: float(np.nanmax(np.abs(values))) for name, values in columns}
    return ", ".join(f"{k} {sizes[k]:.3g}" for k in sorted(sizes, key=lambda k: -sizes[k])[:n])


def identify_logs(
    addresses: Sequence[str],
    vehicle: Vehicle,
    models: Sequence[DampingModel],
    method: Method,
    mapping: ResolvedMapping | None = None,
) -> tuple[tuple[Fit, ...], tuple[str, ...]]:
    """Identify models from concatenated logs, without statistics; return fits and outliers."""
    with suppress_warnings() as collected:
        problem = prepare(vehicle, read_logs(addresses, mapping), models)
    return identify_all(problem, models, method), outlier_messages(collected)


def replay_log(
    address: str,
    vehicle: Vehicle,
    fits: Sequence[Fit | None],
    mapping: ResolvedMapping | None = None,
) -> tuple[float | None, ...]:
    """Return the RMS error (eq. 24) of replays of a log; None for divergence or an absent fit."""
    with suppress_warnings():
        log = read_logs([address], mapping)
        return tuple(
            None
            if fit is None
            else score(simulate(estimated_vehicle(vehicle, fit), fit.damping, log)).rms
            for fit in fits
        )


def solve_model(
    statistics: LogStatistics, vehicle: Vehicle, model: DampingModel, method: Method
) -> Fit:
    """Solve a model from sufficient statistics, with jackknife standard errors."""
    free = model.restricted_to(vehicle.axes)
    if not np.isfinite(statistics.triangle.r).all():
        raise ProblemError("equation 1 of the logs together is not finite.")
    with np.errstate(all="ignore"):  # overflow is refused below
        solutions = [
            solve_axis(statistics.triangle, terms, axis) for axis, terms in enumerate(free.terms)
        ]
        uncertainty = _jackknife(statistics, free, solutions)
    aliased = group_labels(solution.span.aliased for solution in solutions)
    coefficients = np.concatenate([solution.coefficients for solution in solutions])
    covariance = None if uncertainty is None else uncertainty.covariance
    if covariance is None:
        covariance = block_diag(*(solution.covariance for solution in solutions))
    if not (np.isfinite(coefficients).all() and np.isfinite(covariance).all()):
        raise ProblemError(f"the estimate of model '{free.key}' is not finite.")
    return Fit(
        damping=Damping(free, coefficients, covariance=covariance, vehicle=vehicle_stamp(vehicle)),
        method=method.key,
        status=Status.RANK_DEFICIENT if aliased else Status.OK,
        rank=sum(solution.span.rank for solution in solutions),
        aliased=aliased,
        n_samples=statistics.n_samples,
        provenance={
            "logs": str(statistics.n_logs),
            "vehicle": vehicle.name,
            "settings": repr(method),
        },
        uncertainty=uncertainty,
        training_range=dict(statistics.training_range),
    )


def _jackknife(
    statistics: LogStatistics, model: DampingModel, solutions: Sequence[AxisSolution]
) -> Uncertainty | None:
    """Return the delete-one-block jackknife covariance; it is robust to correlation in a block.

    With orthonormal columns Q of all blocks, deleting block b changes their coefficients by
    exactly ``(I − QᵇᵀQᵇ)⁻¹ Qᵇᵀ e``, with its residuals e.
    """
    if len(statistics.balanced) < MIN_BLOCKS:
        return None
    changes: list[FloatArray] = []
    for block in statistics.balanced:
        steps = []
        for axis, (terms, solution) in enumerate(zip(model.terms, solutions, strict=True)):
            design = block.columns(terms)
            orthonormal = design @ solution.span.coefficients
            leverage, vectors = np.linalg.eigh(orthonormal.T @ orthonormal)
            projection = orthonormal.T @ (block.target(axis) - design @ solution.coefficients)
            remaining = np.maximum(1.0 - leverage, MIN_REMAINING_SHARE)
            change = vectors @ ((vectors.T @ projection) / remaining)
            steps.append(solution.span.coefficients @ change)
        changes.append(np.concatenate(steps))
    coefficients = [solution.span.coefficients for solution in solutions]
    leverage = np.concatenate([np.sum(axis**2, axis=1) for axis in coefficients])
    return jackknife(np.array(changes), statistics.duration, leverage)


def grade_statistics(statistics: LogStatistics | None, fit: Fit) -> tuple[Grade, ...]:
    """Grade each coefficient by its interval and its contribution to the axis force."""
    if statistics is None or fit.uncertainty is None:
        return tuple(fit.grades.values())
    half = fit.uncertainty.critical_value() * fit.uncertainty.standard_errors
    aliased = {label for group in fit.aliased for label in group}
    grades, first, root = list[Grade](), 0, np.sqrt(statistics.triangle.n_samples)
    for terms in fit.model.terms:
        columns = slice(first, first := first + len(terms))
        design, coefficients = statistics.triangle.columns(terms), fit.damping.coefficients[columns]
        grades += grade_coefficients(
            coefficients,
            half[columns],
            np.linalg.norm(design, axis=0) / root,
            np.ones(len(terms)),
            np.array([label in aliased for label in fit.model.labels[columns]], dtype=np.bool_),
            response=float(np.linalg.norm(design @ coefficients) / root),
            excited=True,
        )[0]
    return tuple(grades)
