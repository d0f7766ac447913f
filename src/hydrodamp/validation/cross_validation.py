"""Cross-validation: hold out one fold in turn, identify on the others, replay the held-out fold."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import BoolArray
from hydrodamp.basis.basis import Basis
from hydrodamp.data.log import Log, Segment, extract_segments
from hydrodamp.data.time_scale import motion_time_scale
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import Fit, Method
from hydrodamp.identification.methods import identify_all
from hydrodamp.identification.regression import Folds, Rows, folds
from hydrodamp.identification.stepwise import StepwiseSelection
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import prepare
from hydrodamp.simulation.replay import AttitudeSource, RateUnit
from hydrodamp.validation.compare import Row, Selection, compare, format_rows, select_row
from hydrodamp.vehicle.vehicle import Vehicle

# Default gap between blocks over the correlation time of the velocities.
_RELATIVE_GAP = 2.0


@dataclass(frozen=True)
class ValidatedRow:
    """One model by one method, identified and replayed once per fold."""

    folds: tuple[Row, ...]

    @property
    def model(self) -> str:
        """Key of the model."""
        return self.folds[0].model

    @property
    def method(self) -> str:
        """Key of the method."""
        return self.folds[0].method

    @property
    def n_coefficients(self) -> int:
        """Number of coefficients; the maximum over folds where terms are selected."""
        return max(row.n_coefficients for row in self.folds)

    @property
    def rms_by_fold(self) -> tuple[float | None, ...]:
        """Equation 24 on each fold; None where the replay diverged or there is none."""
        return tuple(row.rms for row in self.folds)

    @property
    def rms(self) -> float | None:
        """Mean of equation 24 over all folds; None where any fold has no error."""
        return self.rms_of_completed if None not in self.rms_by_fold else None

    @property
    def rms_of_completed(self) -> float | None:
        """Mean over the folds that have an error; see :attr:`n_failed_folds`."""
        errors = self._errors
        return statistics.fmean(errors) if errors else None

    @property
    def standard_deviation(self) -> float | None:
        """Standard deviation over the folds that have an error; None for fewer than two."""
        errors = self._errors
        return statistics.stdev(errors) if len(errors) > 1 else None

    @property
    def failed_folds(self) -> tuple[str, ...]:
        """The folds without an error, numbered from 1, with status and place of divergence."""
        causes = (
            (number, filter(None, (row.status.word, row.score.divergence_text)))
            for number, row in enumerate(self.folds, start=1)
            if row.rms is None
        )
        return tuple(f"fold {number} ({' in '.join(cause)})" for number, cause in causes)

    @property
    def n_failed_folds(self) -> int:
        """Number of folds without an error."""
        return len(self.failed_folds)

    @property
    def converged(self) -> bool:
        """Whether every fold has an error and its fit has converged."""
        return all(row.converged for row in self.folds)

    @property
    def _errors(self) -> list[float]:
        return [rms for rms in self.rms_by_fold if rms is not None]


@dataclass(frozen=True)
class CrossValidation:
    """Models by methods over all folds.

    Attributes
    ----------
    rows : tuple of ValidatedRow
        Models within methods.
    held_out : tuple of tuple of str
        The segments that each fold held out.
    rate_unit : {"deg", "rad"}
        Unit of angular rates in every error.
    """

    rows: tuple[ValidatedRow, ...]
    held_out: tuple[tuple[str, ...], ...]
    rate_unit: RateUnit = "deg"

    def select(self) -> Selection[ValidatedRow]:
        """Select a row by the one-standard-error rule over the folds.

        Returns
        -------
        selection : Selection
            Among the rows with an error on every fold. The caveat names rows with failed folds
            that have a lower error on their remaining folds.

        Raises
        ------
        MethodError
            If there is no such row.
        """
        selection = select_row(self.rows, f" of all {len(self.held_out)} folds")
        better = (_better_on_completed(row, selection.row) for row in self.rows)
        caveat = " ".join(filter(None, (selection.caveat, *better)))
        return replace(selection, caveat=caveat)

    def __str__(self) -> str:
        """Return the table as plain text."""
        failed = [f"failed {', '.join(row.failed_folds) or 'no fold'}" for row in self.rows]
        errors = [row.rms_of_completed for row in self.rows]
        return format_rows(self.rate_unit, zip(self.rows, errors, failed, strict=True))


def _better_on_completed(row: ValidatedRow, selected: ValidatedRow) -> str:
    """Report a row with failed folds that is better than the selected one on the others."""
    errors, reference = np.array([row.rms_by_fold, selected.rms_by_fold], dtype=float)
    completed = np.isfinite(errors)
    if completed.all() or not errors[completed].sum() < reference[completed].sum():
        return ""
    return (
        f"{row.model} by {row.method} has a lower error on the folds that it completed "
        f"({errors[completed].mean():.3g} against {reference[completed].mean():.3g}), but failed "
        f"on {row.n_failed_folds} of {len(row.folds)}: inspect these folds."
    )


def cross_validate(
    vehicle: Vehicle,
    log: Log,
    models: Iterable[DampingModel | StepwiseSelection] | DampingModel | StepwiseSelection,
    methods: Iterable[Method] | Method,
    *,
    folds: int | None = None,
    gap: float | None = None,
    attitude: AttitudeSource = "measured",
    rate_unit: RateUnit = "deg",
    done: Callable[[Fit], None] = lambda _: None,
    keep: Callable[[CrossValidation], None] = lambda _: None,
) -> CrossValidation:
    """Cross-validate every model by every method.

    Parameters
    ----------
    vehicle : Vehicle
        Mass matrix, restoring wrench and actuators.
    log : Log
        The measurements.
    models : DampingModel, StepwiseSelection or iterable of them
        The terms. A ``StepwiseSelection`` selects terms on the training data of each
        fold, with the terms of the other models as further candidates.
    methods : Method or iterable of Method
        The methods with their settings.
    folds : int, optional
        Number of folds. By default one per segment, at most ten; a log of one segment
        is cut into five blocks. With more folds than segments the longest segments
        are cut.
    gap : float, optional
        Time excluded around the cut between two blocks [s]. By default two correlation times of
        the velocities.
    attitude : {"measured", "simulated"}
        Which attitude gravity and buoyancy act along.
    rate_unit : {"deg", "rad"}
        Unit of angular rates in equation 24.
    done : callable, optional
        Called with each fit when it is complete: folds times models times methods.
    keep : callable, optional
        Called after each fold with the table of the folds so far.

    Returns
    -------
    table : CrossValidation
        One row per model and method.

    Raises
    ------
    MethodError
        If there are too few samples for the folds.
    ProblemError
        If the log lacks what the vehicle or a term needs.

    Examples
    --------
    >>> from hydrodamp.identification.least_squares import LeastSquares
    >>> from hydrodamp.models.catalog import catalog
    >>> from hydrodamp.simulation.campaign.reenact import reenact
    >>> campaign = reenact(duration=20.0)
    >>> models = [catalog[key] for key in ("linear", "fossen")]
    >>> table = cross_validate(campaign.vehicle, campaign.train, models, LeastSquares())
    >>> [(row.model, len(row.rms_by_fold)) for row in table.rows]
    [('linear', 4), ('fossen', 4)]
    """
    requested = tuple(models) if isinstance(models, Iterable) else (models,)
    fixed = [model for model in requested if isinstance(model, DampingModel)]
    all_methods = tuple(methods) if isinstance(methods, Iterable) else (methods,)
    rows: list[list[Row]] = []
    held_out: list[tuple[str, ...]] = []
    result = CrossValidation((), (), rate_unit)
    for train, test in split_holdout(log, folds, gap):
        selected = [
            model.select(vehicle, train, fixed) if isinstance(model, StepwiseSelection) else model
            for model in requested
        ]
        problem = prepare(vehicle, train, selected)
        fits = [
            fit for method in all_methods for fit in identify_all(problem, selected, method, done)
        ]
        table = compare(fits, vehicle, test, attitude=attitude, rate_unit=rate_unit)
        # Trajectories are dropped: they are as long as the log.
        rows.append([replace(row, trajectory=None) for row in table.rows])
        held_out.append(tuple(segment.name for segment in test.segments))
        validated = tuple(map(ValidatedRow, zip(*rows, strict=True)))
        result = CrossValidation(validated, tuple(held_out), rate_unit)
        keep(result)
    return result


def split_holdout(
    log: Log, n: int | None = None, gap: float | None = None
) -> tuple[tuple[Log, Log], ...]:
    """Divide a log into folds of whole segments, or of blocks with a gap between them.

    Return pairs of training and test data.
    """
    lengths = [len(segment) for segment in log.segments]
    number = np.repeat(np.arange(len(lengths)), lengths)
    samples = Rows(Basis(()), np.empty((log.n, 0)), np.zeros((log.n, 6)), number, log.time)
    if gap is None:
        gap = _RELATIVE_GAP * motion_time_scale(log.time, log.velocity, log.bounds)
    divided = folds(samples, n, gap)
    return tuple(_holdout(log, divided, fold) for fold in range(divided.n))


def _holdout(log: Log, divided: Folds, fold: int) -> tuple[Log, Log]:
    held_out = divided.fold == fold
    train, test = _segments(log, ~held_out & (divided.fold >= 0)), _segments(log, held_out)
    if not train or not test:
        raise MethodError(
            f"{divided.description}: fold {fold + 1} leaves no two neighbouring samples to "
            f"{'replay' if train else 'identify from'}. Use a longer log, fewer folds "
            "or a smaller gap."
        )
    return extract_segments(log, train), extract_segments(log, test)


def _segments(log: Log, mask: BoolArray) -> list[Segment]:
    """Return the runs of a mask in each segment; a part of one has its start [s] in its name."""
    segments = []
    for segment in log.segments:
        padded = np.concatenate([[False], mask[segment.start : segment.stop], [False]])
        edges = segment.start + np.flatnonzero(padded[1:] != padded[:-1]).reshape(-1, 2)
        for start, stop in edges[np.diff(edges, axis=1).ravel() >= 2].tolist():
            is_complete = stop - start == len(segment)
            since = log.time[start] - log.time[segment.start]
            name = segment.name if is_complete else f"{segment.name}+{since:.6g}s"
            segments.append(Segment(name, start, stop))
    return segments
