"""The workflow from logs to a verdict: check, prepare, identify, grade, replay, predict."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

from hydrodamp.data.log import Log
from hydrodamp.errors import HydrodampWarning
from hydrodamp.experiment_design.standard_missions import describe_missions
from hydrodamp.identification.command_response import CommandResponse, estimate_command_response
from hydrodamp.identification.estimated_vehicle import estimated_vehicle
from hydrodamp.identification.fit import Fit, Method, digest
from hydrodamp.identification.fit_files import Key
from hydrodamp.identification.identifiability import GradedFit, Identifiability
from hydrodamp.identification.methods import identify_and_grade
from hydrodamp.identification.model_request import SPARSE, ModelRequest
from hydrodamp.identification.stepwise import StepwiseSelection
from hydrodamp.identification.wrench_gains import check_gains
from hydrodamp.models.model import DampingModel
from hydrodamp.progress import count_items, progress
from hydrodamp.simulation.checks import with_gains
from hydrodamp.simulation.log_issues import log_issues, training_issues, warn_issues
from hydrodamp.simulation.problem import Problem, prepare
from hydrodamp.simulation.replay import (
    AttitudeSource,
    HorizonScore,
    RateUnit,
    horizon_scores,
)
from hydrodamp.validation.compare import (
    MISSIONS,
    Comparison,
    Row,
    compare_on,
    comparison_provenance,
)
from hydrodamp.validation.cross_validation import CrossValidation, cross_validate
from hydrodamp.validation.diagnostics import find_selected_row
from hydrodamp.validation.excitation import compare_logs, foreign_motion
from hydrodamp.vehicle.vehicle import Vehicle

#: Key in the provenance of an incomplete comparison; its value says how many rows there are.
UNFINISHED = "unfinished"

#: Key in the provenance of a comparison that reuses fits of an earlier run; how many.
RESUMED = "resumed"


@dataclass(frozen=True)
class Study:
    """Training data with models and methods, checked and prepared, and the test data.

    `selection` repeats the selection of terms; `origin` is of each fit, `provenance` of the rows.
    """

    problem: Problem
    train: Log
    test: Log
    models: tuple[DampingModel, ...]
    methods: tuple[Method, ...]
    response: CommandResponse | None = None
    selection: StepwiseSelection | None = None
    origin: dict[str, str] = field(default_factory=dict)
    attitude: AttitudeSource = "measured"
    rate_unit: RateUnit = "deg"
    horizon: float | None = None
    provenance: dict[str, str] = field(default_factory=dict)

    @property
    def settings(self) -> dict[str, Any]:
        """The settings of replays."""
        return {key: getattr(self, key) for key in ("attitude", "rate_unit", "horizon")}

    @property
    def requests(self) -> dict[Key, tuple[DampingModel, Method]]:
        """Model and method of each row."""
        pairs = product(self.methods, self.models)
        return {(model.key, method.key): (model, method) for method, model in pairs}

    @property
    def digests(self) -> dict[Key, str]:
        """The digest of all that determines each fit, by which an earlier one is reused."""
        return {key: digest(self.problem, *pair) for key, pair in self.requests.items()}

    @property
    def selected_model(self) -> DampingModel | None:
        """The model whose terms were selected, if any."""
        return next((each for each in self.models if each.key.split("+")[0] == SPARSE), None)


@dataclass(frozen=True)
class Assessment:
    """A comparison, and by row the identifiability of coefficients or why it is not known."""

    comparison: Comparison
    graded: Mapping[Key, Identifiability | str]


def prepare_study(
    vehicle: Vehicle,
    train: Log,
    test: Log,
    request: ModelRequest,
    methods: Sequence[Method],
    *,
    response: Sequence[str] = (),
    gains: bool = False,
) -> Study:
    """Check the logs, warn of their issues, complete the models and prepare the training data.

    `response` names parameters of the response of commands to estimate; with `gains` each model
    has the gains of the actuators.
    """
    models = request.unselected(vehicle, train)
    warn_issues(train, training_issues(vehicle, train, request.candidates(vehicle, train, models)))
    if message := foreign_motion(vehicle, train):
        warn_issues(train, [message])
    if test is not train:
        candidates = request.candidates(vehicle, test, models)
        warn_issues(test, log_issues(vehicle, test, candidates, reference=train))
        for sentence in compare_logs(train, test, vehicle.axes).sentences:
            warnings.warn(sentence, HydrodampWarning, stacklevel=2)
    if gains:
        models = tuple(with_gains(vehicle, train, model) for model in models)
    selection = request.selection(vehicle, train, gains)
    if selection is not None:
        with progress("selecting terms", len(selection.windows)) as step:
            models += (selection.select(vehicle, train, (), lambda *_: step()),)
    estimated = estimate_response(vehicle, train, models, response)
    if estimated is not None:
        is_same, train = test is train, estimated.apply(train)
        test = train if is_same else estimated.apply(test)
    problem = prepare(vehicle, train, models)
    warn_issues(train, check_gains(problem, models))
    return Study(problem, train, test, models, tuple(methods), estimated, selection)


def estimate_response(
    vehicle: Vehicle, log: Log, models: Sequence[DampingModel], parameters: Sequence[str]
) -> CommandResponse | None:
    """Return the estimated response of the commands, None without parameters to estimate."""
    if not parameters:
        return None
    with warnings.catch_warnings():  # the problem of the shifted log gives them again
        warnings.simplefilter("ignore", HydrodampWarning)
        problem = prepare(vehicle, log, models)
    return estimate_command_response(problem, models[0], parameters)


def identify_study(
    study: Study, fits: dict[Key, GradedFit], save: Callable[[Fit], None] = lambda _: None
) -> None:
    """Add the graded fits that are missing, each saved when it is complete."""
    for number, method in enumerate(study.methods, start=1):
        missing = [model for model in study.models if (model.key, method.key) not in fits]
        counter = f" ({number} of {len(study.methods)})" if len(study.methods) > 1 else ""
        with progress(f"identifying by {method.key}{counter}", len(missing)) as step:

            def record_fit(graded: GradedFit, step: Callable[..., None] = step) -> None:
                fit = replace(graded[0], provenance=graded[0].provenance | study.origin)
                fits[fit.model.key, fit.method] = fit, graded[1]
                save(fit)
                step()

            if missing:
                identify_and_grade(study.problem, missing, method, record_fit)


def assess_study(
    study: Study,
    finished: Mapping[Key, Fit] | None = None,
    save: Callable[[Fit], None] = lambda _: None,
) -> Assessment:
    """Identify, grade and replay all rows, and predict the errors of missions by the selected one.

    Finished fits are reused, and `save` gets each new one. After Ctrl-C the assessment has the
    rows that are finished.
    """
    fits: dict[Key, GradedFit] = {key: (fit, None) for key, fit in (finished or {}).items()}
    rows, label, vehicle = dict[Key, Row](), "replaying", study.problem.vehicle
    try:
        identify_study(study, fits, save)
    except KeyboardInterrupt:
        label = "interrupted: replaying the finished fits"
    graded = {key: grades for key, (_, grades) in fits.items() if grades is not None}
    ordered = [fits[key][0] for key in study.requests if key in fits]
    with suppress(KeyboardInterrupt), progress(label, len(ordered)) as step:

        def record_row(row: Row) -> None:
            rows[row.model, row.method] = row
            step()

        if ordered:
            tested = study.problem
            if study.test is not study.train:
                tested = prepare(vehicle, study.test, [fit.model for fit in ordered])
            compare_on(tested, ordered, **study.settings, done=record_row)
    words = comparison_provenance(ordered, vehicle, study.test) | study.provenance
    if finished is not None:
        words[RESUMED] = f"{len(finished)} of {len(study.requests)} fits from an earlier run"
    if len(rows) < len(study.requests):
        words[UNFINISHED] = f"{len(rows)} of {len(study.requests)} rows: interrupted"
    finished_rows = tuple(rows[key] for key in study.requests if key in rows)
    comparison = Comparison(finished_rows, study.rate_unit, study.attitude, words)
    if (row := find_selected_row(comparison)) is not None:
        text = "\n".join(describe_missions(row.fit))
        comparison = replace(comparison, provenance=words | ({MISSIONS: text} if text else {}))
    return Assessment(comparison, graded)


@dataclass(frozen=True)
class Validation:
    """A cross-validation; errors by horizon of fits to the entire log, where computed."""

    table: CrossValidation
    fits: tuple[Fit, ...] = ()
    scores: tuple[tuple[HorizonScore, ...] | None, ...] = ()
    is_complete: bool = True


def validate_study(study: Study, folds: int, by_horizon: bool) -> Validation:
    """Cross-validate all rows, and compute the errors by horizon of fits to the entire log.

    After Ctrl-C the table has the folds that are finished.
    """
    tables, identified = list[CrossValidation](), dict[Key, GradedFit]()
    vehicle, log, selected = study.problem.vehicle, study.train, study.selected_model
    models = [study.selection if model is selected else model for model in study.models]
    windows: dict[str, Any] = {"attitude": study.attitude, "rate_unit": study.rate_unit}
    try:
        with progress("cross-validating", folds * len(study.requests)) as step:
            cross_validate(
                vehicle, log, filter(None, models), study.methods, folds=folds,
                **study.settings, done=lambda _: step(), keep=tables.append,
            )  # fmt: skip
        if not by_horizon:
            return Validation(tables[-1])
        identify_study(study, identified)
        fits = tuple(identified[key][0] for key in study.requests)
        scores = tuple(
            horizon_scores(estimated_vehicle(vehicle, fit), fit.damping, log, **windows)
            if fit.status.usable
            else None
            for fit in count_items(fits, "replaying windows", len(fits))
        )
    except KeyboardInterrupt:
        if not tables:
            raise
        return Validation(tables[-1], is_complete=False)
    return Validation(tables[-1], fits, scores)
