"""Cross-validation: hold out one fold in turn, identify on the others, replay the held-out fold."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import compress, repeat

import numpy as np

from hydrodamp.arrays import BoolArray
from hydrodamp.basis.basis import Basis
from hydrodamp.data.log import Log, Segment, extract_segments
from hydrodamp.errors import HydrodampWarning, MethodError
from hydrodamp.identification.adequacy import Adequacy, Form
from hydrodamp.identification.fit import Fit, Method
from hydrodamp.identification.grades import Grade
from hydrodamp.identification.methods import identify_all
from hydrodamp.identification.regression import Folds, Rows, folds
from hydrodamp.identification.stepwise import StepwiseSelection
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.block_errors import BlockErrors, pool
from hydrodamp.simulation.problem import prepare
from hydrodamp.simulation.replay import AttitudeSource, RateUnit
from hydrodamp.validation.compare import Row, compare, format_rows
from hydrodamp.validation.excitation import (
    Imbalance,
    compare_logs,
    describe_folds,
    find_untested,
    select_folds,
)
from hydrodamp.validation.selection import Selection, row_text, select_row
from hydrodamp.validation.verdict import Verdict, judge_selection
from hydrodamp.vehicle.vehicle import Vehicle

# Default gap between blocks over the correlation time of the velocities.
_RELATIVE_GAP = 2.0


@dataclass(frozen=True)
class ValidatedRow:
    """One model by one method, identified and replayed once per fold.

    Attributes
    ----------
    folds : tuple of Row
        The fit and the replay of each fold.
    counted : tuple of bool
        Whether each fold counts in :attr:`rms` and in the selection; by default all do.
    """

    folds: tuple[Row, ...]
    counted: tuple[bool, ...] = ()

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
        """Equation 24 over the folds that count; None where any of them has no error."""
        has_errors = all(row.rms is not None for _, row in self._counted)
        return self.blocks.rms if self.blocks is not None and has_errors else None

    @cached_property
    def blocks(self) -> BlockErrors | None:
        """The errors of the folds that count, in blocks; None where one has no replay."""
        blocks = [row.blocks for _, row in self._counted if row.blocks is not None]
        return pool(blocks) if 0 < len(blocks) == len(self._counted) else None

    @property
    def _counted(self) -> tuple[tuple[int, Row], ...]:
        """The folds that count, with their numbers."""
        return tuple(compress(enumerate(self.folds, start=1), self.counted or repeat(True)))

    @property
    def standard_error(self) -> float | None:
        """Standard error of :attr:`rms` over blocks of the held-out data."""
        return None if self.blocks is None or self.rms is None else self.blocks.standard_error

    @property
    def grades(self) -> Mapping[str, Grade]:
        """The worst grade of each coefficient by the training data of the folds."""
        order, worst = [*Grade], dict[str, Grade]()
        for row in self.folds:
            for label, grade in row.grades.items():
                worst[label] = max(worst.get(label, grade), grade, key=order.index)
        return worst

    @property
    def adequacy(self) -> Adequacy | None:
        """What score tests say of the form in the fold in which it is worst; None without tests."""
        known = [row.fit.adequacy for _, row in self._counted if row.fit.adequacy is not None]
        return max(known, key=lambda each: [*Form].index(each.form), default=None)

    @property
    def divergences(self) -> tuple[str, ...]:
        """Fold, segment, time and motion of each divergence in a fold that counts."""
        return tuple(
            f"fold {number}, {text}" for number, row in self._counted for text in row.divergences
        )

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

    def __repr__(self) -> str:
        """Return model, method and error in one line."""
        return f"{row_text(self)} over {len(self.folds)} folds"

    @property
    def converged(self) -> bool:
        """Whether every fold has a replay and its fit has converged."""
        return all(row.converged for row in self.folds)


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
    imbalances : tuple of Imbalance
        Velocities that only the held-out or only the other segments of each fold excite.
    """

    rows: tuple[ValidatedRow, ...]
    held_out: tuple[tuple[str, ...], ...]
    rate_unit: RateUnit = "deg"
    imbalances: tuple[Imbalance, ...] = ()

    def select(self) -> Selection[ValidatedRow]:
        """Select a row by the rule of :meth:`Comparison.select`.

        Returns
        -------
        selection : Selection
            Over blocks of all folds.

        Raises
        ------
        MethodError
            If nothing was fitted.
        """
        return select_row(self.rows, find_untested(self.imbalances))

    def verdict(self) -> Verdict:
        """Return which row is usable, on which axes, and why, as :meth:`Comparison.verdict`.

        Returns
        -------
        verdict : Verdict
            On the row of :meth:`select`.

        Raises
        ------
        MethodError
            If nothing was fitted.
        """
        selection = self.select()
        sentences = list(describe_folds(self.imbalances, self.held_out))
        if (adequacy := selection.row.adequacy) is not None:
            sentences += adequacy.describe(selection.row.model)
        untested = find_untested(self.imbalances)
        return judge_selection(selection, self.rate_unit, sentences, untested=untested)

    def __str__(self) -> str:
        """Return the table as plain text."""
        failed = [f"failed {', '.join(row.failed_folds) or 'no fold'}" for row in self.rows]
        errors = [row.rms for row in self.rows]
        return format_rows(self.rate_unit, zip(self.rows, errors, failed, strict=True))

    __repr__ = __str__


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
    horizon: float | None = None,
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
    horizon : float, optional
        Also replay windows of this length [s] in each fold, each from the measured state.
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
    >>> log = campaign.train.select("yaw-1800", "yaw-2133", "yaw-2600")
    >>> table = cross_validate(campaign.vehicle, log, models, LeastSquares())
    >>> [(row.model, len(row.rms_by_fold)) for row in table.rows]
    [('linear', 3), ('fossen', 3)]
    """
    requested = tuple(models) if isinstance(models, Iterable) else (models,)
    fixed = [model for model in requested if isinstance(model, DampingModel)]
    all_methods = tuple(methods) if isinstance(methods, Iterable) else (methods,)
    rows: list[list[Row]] = []
    splits = split_holdout(log, folds, gap)
    imbalances = tuple(compare_logs(train, test, vehicle.axes) for train, test in splits)
    names = [tuple(segment.name for segment in test.segments) for _, test in splits]
    for sentence in describe_folds(imbalances, names):
        warnings.warn(sentence, HydrodampWarning, stacklevel=2)
    counted = select_folds(imbalances)
    for train, test in splits:
        selected = [
            model.select(vehicle, train, fixed) if isinstance(model, StepwiseSelection) else model
            for model in requested
        ]
        problem = prepare(vehicle, train, selected)
        fits = [
            fit for method in all_methods for fit in identify_all(problem, selected, method, done)
        ]
        table = compare(
            fits, vehicle, test,
            attitude=attitude, rate_unit=rate_unit, horizon=horizon,
        )  # fmt: skip
        # Trajectories are dropped: they are as long as the log.
        rows.append([replace(row, trajectory=None) for row in table.rows])
        validated = tuple(
            ValidatedRow(row, counted[: len(rows)]) for row in zip(*rows, strict=True)
        )
        result = CrossValidation(tuple(validated), tuple(names[: len(rows)]), rate_unit, imbalances)
        keep(result)
    return result


def split_holdout(
    log: Log, n: int | None = None, gap: float | None = None
) -> tuple[tuple[Log, Log], ...]:
    """Divide a log into folds of whole segments, or of blocks with a gap between them.

    Return pairs of training and test data.
    """
    number = log.segment_numbers
    samples = Rows(Basis(()), np.empty((log.n, 0)), np.zeros((log.n, 6)), number, log.time)
    if gap is None:
        gap = _RELATIVE_GAP * log.time_scale
    divided = folds(samples, n, gap)
    return tuple(_holdout(log, divided, fold) for fold in range(divided.n))


def count_folds(log: Log, n: int) -> int:
    """Return the largest number of folds, at most n, into which a log can be divided."""
    blocks = len(log.segments) + int(log.duration / (_RELATIVE_GAP * log.time_scale))
    for count in range(min(n, max(blocks, 2)), 2, -1):
        with suppress(MethodError):
            return len(split_holdout(log, count))
    return len(split_holdout(log, 2))


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
