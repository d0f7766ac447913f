"""Comparison of fits by open-loop replay on test data, as in Table I of the paper."""

from __future__ import annotations

import tomllib
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from hydrodamp.data.columns import make_dataframe
from hydrodamp.data.log import Log
from hydrodamp.errors import HydrodampWarning, MethodError, repr_html
from hydrodamp.identification.adequacy import Adequacy
from hydrodamp.identification.dissipativity import velocity_ranges
from hydrodamp.identification.estimated_vehicle import with_estimated_vehicle
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.grades import Grade, count_determined
from hydrodamp.identification.methods import METHODS
from hydrodamp.identification.parameter_estimates import describe_changes
from hydrodamp.models.damping import warn_if_foreign
from hydrodamp.progress import run_parallel
from hydrodamp.simulation.block_errors import BlockErrors, block_errors
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
from hydrodamp.status import Status
from hydrodamp.validation.excitation import (
    compare_excitation,
    describe_divergences,
    find_shared_segments,
    find_untested,
)
from hydrodamp.validation.selection import Ranked, Selection, relative_errors, row_text, select_row
from hydrodamp.validation.verdict import Verdict, judge_selection
from hydrodamp.vehicle.vehicle import Vehicle

#: Key in the provenance of a comparison of the predicted errors of missions, a sentence a line.
MISSIONS = "missions"


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
    blocks : BlockErrors or None
        The errors of the replay in blocks of the test data; None where nothing was identified.
    divergences : tuple of str
        Segment, time and motion of each divergence.
    rebuilt : tuple of str
        Velocities of the test data that were rebuilt from sensors.
    """

    fit: Fit
    score: Score
    trajectory: Trajectory | None = None
    windows: HorizonScore | None = None
    blocks: BlockErrors | None = None
    divergences: tuple[str, ...] = ()
    rebuilt: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Return model, method, error and status in one line."""
        return f"{row_text(self)}, {self.n_coefficients} coefficients: {self.status.word}"

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
    def grades(self) -> Mapping[str, Grade]:
        """The grade of each coefficient by the training data; empty where not graded."""
        return self.fit.grades

    @property
    def adequacy(self) -> Adequacy | None:
        """What score tests say of the form of the model; None without tests."""
        return self.fit.adequacy

    @property
    def converged(self) -> bool:
        """Whether there is a replay, and the fit has converged."""
        return self.blocks is not None and self.fit.status is not Status.NOT_CONVERGED


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

    @property
    def overlap(self) -> str:
        """Test data that are also training data; empty for none."""
        return self.provenance.get("overlap", "")

    @property
    def missions(self) -> tuple[str, ...]:
        """Sentences on the predicted errors of standard missions by the selected row."""
        return tuple(self.provenance.get(MISSIONS, "").splitlines())

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

    @property
    def _untested(self) -> dict[str, str]:
        """The velocities that only the training or only the test data excite, with the reason."""
        for row in self.rows:
            if (run := row.trajectory) is not None:
                tested = velocity_ranges(run.log.velocity, run.axes)
                return find_untested([compare_excitation(row.fit.training_range, tested)])
        return {}

    def select(self) -> Selection[Row]:
        """Select the smallest row of those that are equal for use to the least error.

        The error of a row is the mean, over the velocities that the test excites, of the RMS error
        relative to the standard deviation of the velocity, without the noise. Errors within a
        quarter of the least, or within one standard error of the difference over blocks of the test
        data, are equal: of these, those of adequate form if there are any; of these, the rows that
        predict the most velocities significantly better than their mean; of these, that with the
        fewest coefficients, then that of least error. A velocity that only the training or only the
        test data excite does not count.
        Rows whose replay diverged are excluded unless all have, then rows that have not converged.
        Equation 24 decides nothing.

        Returns
        -------
        selection : Selection
            ``row``, ``runner_up`` and the ``sentence`` that gives the reason.

        Raises
        ------
        MethodError
            If nothing was fitted.
        """
        return select_row(self.rows, self._untested)

    def verdict(self) -> Verdict:
        """Return which row is usable, on which axes, and why.

        Returns
        -------
        verdict : Verdict
            On the row of :meth:`select`; grades count where the fits have them.

        Raises
        ------
        MethodError
            If nothing was fitted.
        """
        selection, sentences = self.select(), list[str]()
        row = selection.row
        rebuilt = dict.fromkeys(row.rebuilt, "against a velocity rebuilt from sensors")
        if row.fit.status is Status.STOPPED:
            axes = f" on {' '.join(row.fit.unconverged)}" if row.fit.unconverged else ""
            sentences.append(f"The optimiser stopped before it converged{axes}.")
        sentences.append(" ".join(describe_changes(row.fit.estimates)))
        if row.adequacy is not None:
            sentences += row.adequacy.describe(row.model)
        sentences.append(" ".join(self.missions))  # one paragraph: few lines on a screen
        return judge_selection(
            selection, self.rate_unit, sentences, rebuilt, self._untested, self.overlap
        )

    def best(self) -> Row:
        """Return the row of :meth:`select`.

        Returns
        -------
        row : Row
            The selected row.

        Raises
        ------
        MethodError
            If nothing was fitted.
        """
        return self.select().row

    def to_dataframe(self) -> Any:
        """Return the comparison as a pandas DataFrame.

        Returns
        -------
        frame : DataFrame
            A row for each fit: ``model``, ``method``, ``n_coefficients``, ``n_determined``,
            ``rank``, ``relative_error`` [%], ``rms`` (equation 24) and ``status``; by velocity
            ``rms_u`` [m/s, or ``rate_unit`` per second] and ``fit_u`` [%].

        Raises
        ------
        HydrodampError
            If pandas is not installed.
        """
        return make_dataframe(self._columns)

    @property
    def _columns(self) -> dict[str, Sequence[Any]]:
        scores, keys = (
            [row.score for row in self.rows],
            ("model", "method", "n_coefficients", "rms"),
        )
        names = dict.fromkeys(name for score in scores for name in score.rms_by_axis)
        return {
            **{key: [getattr(row, key) for row in self.rows] for key in keys},
            "n_determined": [count_determined(row.grades) for row in self.rows],
            "rank": [row.fit.rank for row in self.rows],
            "relative_error": relative_errors(self),
            "status": [row.status.word for row in self.rows],
            **{f"rms_{name}": [each.rms_by_axis.get(name) for each in scores] for name in names},
            **{f"fit_{name}": [each.fit_by_axis.get(name) for each in scores] for name in names},
        }

    def _repr_html_(self) -> str:
        is_scored = any(row.rms is not None for row in self.rows)
        return repr_html(self.verdict() if is_scored else self, self._columns)

    def __str__(self) -> str:
        """Return the table as plain text."""
        return format_rows(self.rate_unit, ((row, row.rms, row.status.word) for row in self.rows))

    __repr__ = __str__


def format_rows(unit: RateUnit, rows: Iterable[tuple[Ranked, float | None, str]]) -> str:
    """Return rows as plain text, each with an error and a remark."""
    lines = [f"{'model':<20}{'n':>5}  {'method':<11}{'RMS':>13}  m/s and {unit}/s mixed"]
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
        The vehicle of the log; a fit that estimated values of it is replayed with these.
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
    problem = prepare(vehicle, test, [fit.model for fit in requested])
    return compare_on(problem, requested, attitude, rate_unit, horizon, done)


def compare_on(
    problem: Problem,
    fits: Sequence[Fit],
    attitude: AttitudeSource = "measured",
    rate_unit: RateUnit = "deg",
    horizon: float | None = None,
    done: Callable[[Row], None] = lambda _: None,
) -> Comparison:
    """Replay fits on prepared test data and score them."""
    if horizon is not None:
        check_horizon(horizon)
    if problem.sensor_log is not None and problem.sensor_log.names:
        warnings.warn(problem.sensor_log.error_note, HydrodampWarning, stacklevel=2)
    pairs = [(with_estimated_vehicle(problem, fit), fit) for fit in fits]
    for replayed, fit in pairs:
        warn_if_foreign(fit.damping, vehicle_stamp(replayed.vehicle))
    calls = [(*pair, attitude, rate_unit, horizon) for pair in pairs]
    rows = run_parallel(_row, calls, done)
    words = comparison_provenance(fits, problem.vehicle, problem.log)
    return Comparison(rows, rate_unit, attitude, words)


def comparison_provenance(fits: Sequence[Fit], vehicle: Vehicle, test: Log) -> dict[str, str]:
    """Return logs, segments and vehicle of a comparison, and test data that are training data."""
    train = next((fit.provenance for fit in fits if fit.provenance), {})  # none where refused
    return {
        "vehicle": vehicle.name,
        "train": train.get("log", ""),
        "train_segments": train.get("segments", ""),
        "test": test.source or "in memory",
        "test_segments": " ".join(segment.name for segment in test.segments),
        **({"overlap": overlap} if (overlap := find_shared_segments(fits, test)) else {}),
    }


def _row(
    problem: Problem, fit: Fit, attitude: AttitudeSource, rate_unit: RateUnit, horizon: float | None
) -> Row:
    if not fit.status.usable:
        return Row(fit, no_score(problem.vehicle.axes, rate_unit))
    trajectory, windows = replay(problem, fit.damping, attitude), None
    if horizon is not None:
        windows = horizon_score(problem, fit.damping, horizon, attitude, rate_unit)
    row = replayed_row(fit, score(trajectory, rate_unit), trajectory, windows)
    sensor_log = problem.sensor_log
    return row if sensor_log is None else replace(row, rebuilt=sensor_log.names)


def replayed_row(
    fit: Fit, scored: Score, trajectory: Trajectory | None, windows: HorizonScore | None = None
) -> Row:
    """Return the row of a replay, with its errors in blocks and its divergences."""
    if trajectory is None:
        return Row(fit, scored, None, windows)
    blocks = block_errors(trajectory, scored.rate_unit)
    divergences = describe_divergences(trajectory, fit.training_range)
    return Row(fit, scored, trajectory, windows, blocks, divergences)


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
