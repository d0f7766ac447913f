"""Cross-validation: identify on all folds but one, replay that one, in turn."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import BoolArray
from hydrodamp.basis.basis import Basis
from hydrodamp.data.log import Log, Segment, extract_segments
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import Fit, Method
from hydrodamp.identification.methods import identify_all
from hydrodamp.identification.regression_rows import Folds, Rows, folds
from hydrodamp.identification.stepwise import StepwiseSelection
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import prepare
from hydrodamp.simulation.replay import AttitudeSource, RateUnit
from hydrodamp.validation.compare import Row, compare, format_rows
from hydrodamp.validation.selection import Selection, select_row
from hydrodamp.vehicle.vehicle import Vehicle


@dataclass(frozen=True)
class ValidatedRow:
    """One model by one method, identified and replayed once a fold."""

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
        """How many coefficients the model has, at most where each fold selects its own."""
        return max(row.n_coefficients for row in self.folds)

    @property
    def rms_by_fold(self) -> tuple[float | None, ...]:
        """Equation 24 on each fold; None where there is no usable replay."""
        return tuple(row.rms for row in self.folds)

    @property
    def rms(self) -> float | None:
        """Mean of equation 24 over all folds; None where one has no error."""
        return self.rms_of_completed if None not in self.rms_by_fold else None

    @property
    def rms_of_completed(self) -> float | None:
        """Mean over the folds that have an error, to be read beside how many have none."""
        finished = self._finished
        return statistics.fmean(finished) if finished else None

    @property
    def standard_deviation(self) -> float | None:
        """Standard deviation over the folds that have an error; None for fewer than two."""
        finished = self._finished
        return statistics.stdev(finished) if len(finished) > 1 else None

    @property
    def failed_folds(self) -> tuple[str, ...]:
        """The folds that have no error, from 1, each with where its replay left, or its status."""
        causes = (
            (number, filter(None, (row.status.word, row.score.divergence_text)))
            for number, row in enumerate(self.folds, start=1)
            if row.rms is None
        )
        return tuple(f"fold {number} ({' in '.join(cause)})" for number, cause in causes)

    @property
    def n_failed_folds(self) -> int:
        """How many folds have no error."""
        return len(self.failed_folds)

    @property
    def converged(self) -> bool:
        """Whether every fold has an error, and that of a fit that has settled."""
        return all(row.converged for row in self.folds)

    @property
    def _finished(self) -> list[float]:
        return [rms for rms in self.rms_by_fold if rms is not None]


@dataclass(frozen=True)
class CrossValidation:
    """Models by methods over all folds.

    Attributes
    ----------
    rows : tuple of ValidatedRow
        Models within methods.
    held_out : tuple of tuple of str
        The segments each fold held out.
    rate_unit : {"deg", "rad"}
        Unit of angular rates in every number.
    """

    rows: tuple[ValidatedRow, ...]
    held_out: tuple[tuple[str, ...], ...]
    rate_unit: RateUnit = "deg"

    def select(self) -> Selection[ValidatedRow]:
        """Choose the row of the fewest coefficients among those as good as the lowest mean error.

        Returns
        -------
        choice : Choice
            Among the rows that have an error on every fold, with the sentence that says why;
            those that are nearer on the folds they have are named, with both errors there.

        Raises
        ------
        MethodError
            If there is no such row.
        """
        chosen = select_row(self.rows, f" of all {len(self.held_out)} folds")
        nearer = (_nearer(row, chosen.row) for row in self.rows)
        said = " ".join(filter(None, (chosen.caveat, *nearer)))
        return replace(chosen, caveat=said)

    def __str__(self) -> str:
        """Return the table as plain text."""
        lost = [f"lost {', '.join(row.failed_folds) or 'no fold'}" for row in self.rows]
        errors = [row.rms_of_completed for row in self.rows]
        return format_rows(self.rate_unit, zip(self.rows, errors, lost, strict=True))


def _nearer(row: ValidatedRow, chosen: ValidatedRow) -> str:
    """Say of a row that lost folds that it is nearer than the chosen one on the others."""
    own, other = np.array([row.rms_by_fold, chosen.rms_by_fold], dtype=float)
    kept = np.isfinite(own)
    if kept.all() or not own[kept].sum() < other[kept].sum():
        return ""
    return (
        f"{row.model} by {row.method} is nearer on the folds that it ended ({own[kept].mean():.3g} "
        f"against {other[kept].mean():.3g}), but lost {row.n_failed_folds} of "
        f"{len(row.folds)}: look what is special there."
    )


def cross_validate(
    vehicle: Vehicle,
    log: Log,
    models: Iterable[DampingModel | StepwiseSelection] | DampingModel | StepwiseSelection,
    methods: Iterable[Method] | Method,
    *,
    folds: int | None = None,
    gap: float = 5.0,
    attitude: AttitudeSource = "measured",
    rate_unit: RateUnit = "deg",
    done: Callable[[Fit], None] = lambda _: None,
    keep: Callable[[CrossValidation], None] = lambda _: None,
) -> CrossValidation:
    """Identify every model by every method on all folds but one, and replay that one.

    Parameters
    ----------
    vehicle : Vehicle
        Everything known.
    log : Log
        What was measured.
    models : DampingModel, Sparse or iterable of them
        Which terms. A ``StepwiseSelection`` selects its own on each fold, from what the fold is
        identified from, with the other models' terms as further candidates.
    methods : Method or iterable of Method
        How.
    folds : int, optional
        How many folds. By default each segment is held out once, in ten folds at
        most. A log of one segment is cut into five blocks; and so are the longest
        segments where more folds than segments are asked for.
    gap : float
        What is left out around the cut between two blocks [s].
    attitude : {"measured", "simulated"}
        Which attitude gravity and buoyancy act along.
    rate_unit : {"deg", "rad"}
        Unit of angular rates in equation 24.
    done : callable, optional
        Called with each fit as it comes, for a progress bar: folds times models times methods.
    keep : callable, optional
        Called after each fold with the table of the folds so far.

    Returns
    -------
    table : CrossValidation
        A row a model and method.

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
    asked = tuple(models) if isinstance(models, Iterable) else (models,)
    given = [model for model in asked if isinstance(model, DampingModel)]
    ways = tuple(methods) if isinstance(methods, Iterable) else (methods,)
    rows: list[list[Row]] = []
    held_out: list[tuple[str, ...]] = []
    found = CrossValidation((), (), rate_unit)
    for train, test in split_holdout(log, folds, gap):
        chosen = [
            model.select(vehicle, train, given) if isinstance(model, StepwiseSelection) else model
            for model in asked
        ]
        problem = prepare(vehicle, train, chosen)
        fits = [fit for method in ways for fit in identify_all(problem, chosen, method, done)]
        table = compare(fits, vehicle, test, attitude=attitude, rate_unit=rate_unit)
        # Without its replays, which are as long as the log.
        rows.append([replace(row, trajectory=None) for row in table.rows])
        held_out.append(tuple(part.name for part in test.segments))
        each = tuple(map(ValidatedRow, zip(*rows, strict=True)))
        found = CrossValidation(each, tuple(held_out), rate_unit)
        keep(found)
    return found


def split_holdout(log: Log, n: int | None = None, gap: float = 5.0) -> tuple[tuple[Log, Log], ...]:
    """Divide a log into folds of whole segments, or of blocks with a gap between them.

    Each is what to identify from, and what to replay.
    """
    lengths = [len(part) for part in log.segments]
    segment = np.repeat(np.arange(len(lengths)), lengths)
    samples = Rows(Basis(()), np.empty((log.n, 0)), np.zeros((log.n, 6)), segment, log.time)
    divided = folds(samples, n, gap)
    return tuple(_holdout(log, divided, fold) for fold in range(divided.n))


def _holdout(log: Log, divided: Folds, fold: int) -> tuple[Log, Log]:
    here = divided.fold == fold
    train, test = _stretches(log, ~here & (divided.fold >= 0)), _stretches(log, here)
    if not train or not test:
        raise MethodError(
            f"{divided.description}: fold {fold + 1} leaves no two neighbouring samples to "
            f"{'replay' if train else 'identify from'}. Give a longer log, fewer folds "
            "or a smaller gap."
        )
    return extract_segments(log, train), extract_segments(log, test)


def _stretches(log: Log, chosen: BoolArray) -> list[Segment]:
    """Return what is chosen of each segment; a piece of one has its start [s] in its name."""
    found = []
    for part in log.segments:
        kept = np.concatenate([[False], chosen[part.start : part.stop], [False]])
        edges = part.start + np.flatnonzero(kept[1:] != kept[:-1]).reshape(-1, 2)
        for start, stop in edges[np.diff(edges, axis=1).ravel() >= 2].tolist():
            whole = stop - start == len(part)
            since = log.time[start] - log.time[part.start]
            name = part.name if whole else f"{part.name}+{since:.6g}s"
            found.append(Segment(name, start, stop))
    return found
