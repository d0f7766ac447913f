"""Comparison of fits by open-loop replay on test data, as in Table I of the paper.

A row is selected by the one-standard-error rule (Breiman et al., 1984); rows that no other one
dominates in error and size form the Pareto front.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Generic, Protocol, TypeVar

import numpy as np

from hydrodamp.data.log import Log
from hydrodamp.errors import MethodError, Status
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.methods import METHODS
from hydrodamp.models.damping import warn_if_foreign
from hydrodamp.progress import run_parallel
from hydrodamp.simulation.problem import Problem, prepare, vehicle_stamp
from hydrodamp.simulation.replay import (
    AttitudeSource,
    HorizonScore,
    RateUnit,
    Score,
    Trajectory,
    check_horizon,
    horizon_score,
    no_score,
    replay,
    score,
)
from hydrodamp.vehicle.vehicle import Vehicle


class Ranked(Protocol):
    """Protocol of rows that can be ranked."""

    @property
    def model(self) -> str:
        """Key of the model."""

    @property
    def method(self) -> str:
        """Key of the method."""

    @property
    def n_coefficients(self) -> int:
        """Number of coefficients of the model."""

    @property
    def rms(self) -> float | None:
        """The RMS error; None where there is none."""

    @property
    def rms_by_fold(self) -> tuple[float | None, ...]:
        """The RMS error of each held-out segment or fold."""

    @property
    def converged(self) -> bool:
        """Whether there is an RMS error, and the fit has converged."""


Candidate = TypeVar("Candidate", bound=Ranked)
Candidate_co = TypeVar("Candidate_co", bound=Ranked, covariant=True)


@dataclass(frozen=True)
class Selection(Generic[Candidate]):
    """The selected row, with the reason.

    Attributes
    ----------
    row : Row
        That of fewest coefficients among those within one standard error of the lowest error.
    runner_up : Row or None
        The lowest error, or the second where the lowest is selected; None for a single row.
    sentence : str
        The selected row, the reason, and the margin to the runner-up.
    caveat : str
        Rows that were excluded; empty for none.
    """

    row: Candidate
    runner_up: Candidate | None
    sentence: str
    caveat: str = ""

    def __str__(self) -> str:
        """Return the sentence and the caveat."""
        return f"{self.sentence} {self.caveat}".rstrip()


def select_row(rows: Iterable[Candidate], of: str = "") -> Selection[Candidate]:
    """Select the row of fewest coefficients within one standard error of the lowest error.

    Ties go to the lower error, then to the earlier row. ``of`` describes the replays in the
    sentence.
    """
    requested = list(rows)
    scored = [row for row in requested if row.rms is not None]
    if not scored:
        raise MethodError("no row has an RMS error: every replay diverged or nothing was fitted")
    candidates = [row for row in scored if row.converged] or scored
    ranked = sorted(candidates, key=lambda row: (rms_or_infinity(row), row.n_coefficients))
    equivalent = [row for row in ranked if _is_equivalent(row, ranked[0])]
    row = min(equivalent, key=lambda row: row.n_coefficients)
    n_excluded = len(requested) - len(candidates)
    caveats = [] if row.converged else ["No fit has converged."]
    if n_excluded:
        caveats.append(
            f"Excluded: {_replays(n_excluded)} that diverged, failed or did not converge."
        )
    runner_up = next((each for each in ranked if each is not row), None)
    sentence = _simpler(row, ranked[0]) or _sentence(ranked, len(requested), of)
    return Selection(row, runner_up, sentence, " ".join(caveats))


def _is_equivalent(row: Ranked, lowest: Ranked) -> bool:
    """Whether the mean log ratio of the errors is within its standard error, paired by segment.

    Segments differ in length and amplitude far more than models do, so errors are paired and taken
    as ratios: else the largest amplitude would decide. The rule is that of Breiman et al.,
    Classification and Regression Trees, 1984, section 3.4.3.
    """
    errors = np.array([row.rms_by_fold, lowest.rms_by_fold], dtype=float)
    if errors.shape[1] < 2 or not np.all(errors > 0.0):
        return rms_or_infinity(row) == rms_or_infinity(lowest)
    ratio = np.log(errors[0] / errors[1])
    return bool(ratio.mean() <= ratio.std(ddof=1) / np.sqrt(ratio.size))


def _simpler(row: Ranked, lowest: Ranked) -> str:
    """Give the reason for a row other than the lowest error, else an empty string."""
    if row is lowest:
        return ""
    return (
        f"{_row_text(row)}: {row.n_coefficients} coefficients; on the {len(row.rms_by_fold)} "
        "held-out parts it is within one standard error of the lowest RMS error, "
        f"{_row_text(lowest)} with {lowest.n_coefficients}."
    )


def _sentence(ranked: Sequence[Ranked], n_rows: int, of: str) -> str:
    """Name the row of lowest error, and the runner-up with its margin."""
    texts = [*map(_row_text, ranked[:2])]
    if n_rows == 1:
        return f"{texts[0]}, the only row."
    runner_up = "there is no runner-up"
    if len(ranked) > 1:
        lowest, second = map(rms_or_infinity, ranked[:2])
        margin = f", {100.0 * (second / lowest - 1.0):+.0f} %" if lowest else ""
        runner_up = f"runner-up {texts[1]}{margin}"
    return f"{texts[0]}: lowest RMS error of {_replays(len(ranked))}{of}; {runner_up}."


class Table(Protocol[Candidate_co]):
    """A comparison or cross-validation: rows that can be ranked."""

    @property
    def rows(self) -> tuple[Candidate_co, ...]:
        """Its rows."""


def pareto_front(table: Table[Candidate]) -> tuple[Candidate, ...]:
    """Return the Pareto front of RMS error and number of coefficients.

    Parameters
    ----------
    table : Comparison or CrossValidation
        Rows without an RMS error are excluded.

    Returns
    -------
    rows : tuple of Row
        From the fewest coefficients to the lowest error; each has more coefficients
        and a lower error than the one before. Of equal rows the first is included.

    Examples
    --------
    >>> from hydrodamp.validation.compare import Comparison
    >>> pareto_front(Comparison(()))
    ()
    """
    scored = [row for row in table.rows if row.rms is not None]
    front: list[Candidate] = []
    for row in sorted(scored, key=lambda row: (row.n_coefficients, rms_or_infinity(row))):
        if not front or rms_or_infinity(row) < rms_or_infinity(front[-1]):
            front.append(row)
    return tuple(front)


def rms_or_infinity(row: Ranked) -> float:
    """Return the RMS error of a row, infinite where there is none."""
    return float("inf") if row.rms is None else row.rms


def _row_text(row: Ranked) -> str:
    return f"{row.model} by {row.method} ({rms_or_infinity(row):.3g})"


def _replays(count: int) -> str:
    return "1 replay" if count == 1 else f"{count} replays"


@dataclass(frozen=True)
class Row:
    """One fit and the score of its replay on test data.

    Attributes
    ----------
    fit : Fit
        The fit.
    score : Score
        RMS errors of its replay.
    trajectory : Trajectory or None
        The replay; None where nothing was identified.
    windows : HorizonScore or None
        Errors of replays restarted after every horizon, where one was requested.
    """

    fit: Fit
    score: Score
    trajectory: Trajectory | None = None
    windows: HorizonScore | None = None

    @property
    def model(self) -> str:
        """Key of the model."""
        return self.fit.model.key

    @property
    def method(self) -> str:
        """Key of the method."""
        return self.fit.method

    @property
    def n_coefficients(self) -> int:
        """Number of coefficients of the model."""
        return self.fit.model.n_coefficients

    @property
    def rms(self) -> float | None:
        """Equation 24; None where the replay diverged or there is none."""
        return self.score.rms

    @property
    def rms_by_fold(self) -> tuple[float | None, ...]:
        """Equation 24 on each segment; None where it diverged."""
        return tuple(self.score.rms_by_segment.values())

    @property
    def status(self) -> Status:
        """That of the replay where it diverged, else that of the fit."""
        diverged = self.fit.status.usable and self.score.diverged
        return self.score.status if diverged else self.fit.status

    @property
    def converged(self) -> bool:
        """Whether there is an RMS error, and the fit has converged."""
        return self.rms is not None and self.status is not Status.NOT_CONVERGED


@dataclass(frozen=True)
class Comparison:
    """Rows of one comparison, in the order of the fits.

    Attributes
    ----------
    rows : tuple of Row
        Models within methods.
    rate_unit : {"deg", "rad"}
        Unit of angular rates in every error.
    attitude : str
        Whether replays used the measured or a simulated attitude.
    provenance : dict of str to str
        Logs, segments and vehicle.
    """

    rows: tuple[Row, ...]
    rate_unit: RateUnit = "deg"
    attitude: str = "measured"
    provenance: dict[str, str] = field(default_factory=dict)

    @property
    def models(self) -> tuple[str, ...]:
        """Keys of the models, in order."""
        return tuple(dict.fromkeys(row.model for row in self.rows))

    @property
    def methods(self) -> tuple[str, ...]:
        """Keys of the methods, in order."""
        return tuple(dict.fromkeys(row.method for row in self.rows))

    def row(self, model: str, method: str) -> Row:
        """Return the row of a model and a method.

        Parameters
        ----------
        model, method : str
            Their keys.

        Returns
        -------
        row : Row
            The first one with both.

        Raises
        ------
        MethodError
            If there is none.
        """
        for row in self.rows:
            if (row.model, row.method) == (model, method):
                return row
        raise MethodError(
            f"no row of model '{model}' by method '{method}'; models are "
            f"{', '.join(self.models)}, methods {', '.join(self.methods)}."
        )

    def select(self) -> Selection[Row]:
        """Select a row by the one-standard-error rule.

        The row of fewest coefficients among those whose errors, segment by segment, are within one
        standard error of the lowest RMS error; with a single segment, the lowest. Rows that have
        not converged are excluded unless none has.

        Returns
        -------
        selection : Selection
            ``row``, ``runner_up`` and the ``sentence`` that gives the reason.

        Raises
        ------
        MethodError
            If no row has an RMS error.
        """
        return select_row(self.rows)

    def best(self) -> Row:
        """Return the row of :meth:`select`.

        Returns
        -------
        row : Row
            The selected row.

        Raises
        ------
        MethodError
            If no row has an RMS error.
        """
        return self.select().row

    def __str__(self) -> str:
        """Return the table as plain text."""
        return format_rows(self.rate_unit, ((row, row.rms, row.status.word) for row in self.rows))


def format_rows(unit: RateUnit, rows: Iterable[tuple[Ranked, float | None, str]]) -> str:
    """Return rows as plain text, each with an error and a remark."""
    lines = [f"{'model':<20}{'n':>5}  {'method':<11}{f'RMS ({unit}/s)':>13}"]
    for row, rms, remark in rows:
        error = "–" if rms is None else f"{rms:.3f}"
        lines.append(
            f"{row.model:<20}{row.n_coefficients:>5}  {row.method:<11}{error:>13}  {remark}"
        )
    return "\n".join(lines)


def compare(
    fits: Iterable[Fit],
    vehicle: Vehicle,
    test: Log,
    *,
    attitude: AttitudeSource = "measured",
    rate_unit: RateUnit = "deg",
    horizon: float | None = None,
    done: Callable[[Row], None] = lambda _: None,
) -> Comparison:
    """Replay fits open loop on test data and score them.

    Parameters
    ----------
    fits : iterable of Fit
        The fits.
    vehicle : Vehicle
        The vehicle of the log.
    test : Log
        Test data; each segment restarts from its first sample.
    attitude : {"measured", "simulated"}
        Which attitude gravity and buoyancy act along.
    rate_unit : {"deg", "rad"}
        Unit of angular rates in equation 24.
    horizon : float, optional
        Also replay windows of this length [s], each from the measured state.
    done : callable, optional
        Called with each row after its replay.

    Returns
    -------
    comparison : Comparison
        One row per fit, in order; a diverged replay has a status.

    Raises
    ------
    ProblemError
        If the log lacks what the vehicle or a term needs.
    MethodError
        If the horizon is not positive.

    Warns
    -----
    ForeignVehicleWarning
        If coefficients belong to a vehicle of another mass matrix, weight or buoyancy.
    """
    requested = tuple(fits)
    if horizon is not None:
        check_horizon(horizon)
    problem = prepare(vehicle, test, [fit.model for fit in requested])
    for fit in requested:
        warn_if_foreign(fit.damping, vehicle_stamp(vehicle))
    calls = [(problem, fit, attitude, rate_unit, horizon) for fit in requested]
    rows = run_parallel(_row, calls, done)
    return Comparison(rows, rate_unit, attitude, comparison_provenance(requested, vehicle, test))


def comparison_provenance(fits: Sequence[Fit], vehicle: Vehicle, test: Log) -> dict[str, str]:
    """Return logs, segments and vehicle of a comparison."""
    train = next((fit.provenance for fit in fits if fit.provenance), {})  # none where refused
    return {
        "vehicle": vehicle.name,
        "train": train.get("log", ""),
        "train_segments": train.get("segments", ""),
        "test": test.source or "in memory",
        "test_segments": " ".join(segment.name for segment in test.segments),
    }


def _row(
    problem: Problem, fit: Fit, attitude: AttitudeSource, rate_unit: RateUnit, horizon: float | None
) -> Row:
    if not fit.status.usable:
        return Row(fit, no_score(problem.vehicle.axes, rate_unit))
    trajectory, windows = replay(problem, fit.damping, attitude), None
    if horizon is not None:
        windows = horizon_score(problem, fit.damping, horizon, attitude, rate_unit)
    return Row(fit, score(trajectory, rate_unit), trajectory, windows)


@dataclass(frozen=True)
class PaperRow:
    """One line of the paper's Table I."""

    n_coefficients: int
    ls: float
    ai: float


#: Root mean square velocity error values for different models.
_TABLE = tomllib.loads(Path(__file__).with_name("paper_table_1.toml").read_text("utf-8"))
PAPER_TABLE_I = {model: PaperRow(*values) for model, values in _TABLE.items()}

#: Column of Table I for each method that the paper has.
PAPER_COLUMN = {key: entry.paper_column for key, entry in METHODS.items() if entry.paper_column}


def is_paper_campaign(comparison: Comparison) -> bool:
    """Whether Table I applies to a comparison: the re-enacted campaign with models of the paper."""
    has_paper_model = not PAPER_TABLE_I.keys().isdisjoint(comparison.models)
    return "truth" in comparison.provenance and has_paper_model
