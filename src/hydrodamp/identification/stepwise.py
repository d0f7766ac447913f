"""Stepwise selection of damping terms by simulation error.

Each round linearises the simulation of windows of the log in the coefficients of all candidate
terms around the present model, gives normal matrices of blocks, and selects terms from them:
forward selection with stability selection, backward elimination, and the one-standard-error rule
of a cross-validation. The selected model is fitted by output error, and the rounds are compared
by dissipation, error of the replay relative to the motion of each velocity, and size. After
Piroddi and Spinelli (2003).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.basis.term import AXES, VELOCITY_OF, Term
from hydrodamp.data.log import Log
from hydrodamp.errors import MethodError, demand
from hydrodamp.identification.backward_elimination import (
    backward_elimination,
    forward_selection,
    select_significant,
    select_size,
    selection_frequencies,
    solve_subset,
)
from hydrodamp.identification.continuation import fit_windows, make_objective
from hydrodamp.identification.dissipativity import (
    axis_terms,
    is_damping_term,
    max_damping_power,
    operating_box,
)
from hydrodamp.identification.fit import MAX_BLOCKS, MIN_BLOCKS
from hydrodamp.identification.general_model import (
    NONNEGATIVE_ATOMS,
    SIGNED_ATOMS,
    is_under_way,
    remove_duplicates,
)
from hydrodamp.identification.weak_form import WeakRegression
from hydrodamp.models.catalog import PAPER_MODELS, catalog
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.block_errors import block_errors
from hydrodamp.simulation.problem import Problem, prepare
from hydrodamp.simulation.replay import replay
from hydrodamp.vehicle.vehicle import Vehicle

#: Key of the selected model.
SPARSE_KEY = "sparse"

#: Models whose residuals commands are tested against: drag, and lift of hull and fins. Without
#: lift, the force of a fin appears not to grow with speed.
_BASELINE_MODELS = tuple(catalog[key] for key in ("linear", "fossen", "prestero"))

#: Terms of each axis in the initial model, and the windows that it is fitted on [time scales].
_N_INITIAL_TERMS, _INITIAL_WINDOW = 4, 2.0

#: Relative error of a round over the lowest one [1] that fewer coefficients justify.
_MAX_ERROR_RATIO = 1.1

#: Windows of a log at least.
_MIN_WINDOWS = 16

#: Terms of forward selection, and share of the half samples [1] that must select a term.
_MAX_FORWARD_TERMS, _MIN_SELECTION_FREQUENCY = 60, 0.5


class Round(NamedTuple):
    """One round: the model, how its size was chosen, its relative error, largest power [W]."""

    model: DampingModel
    summary: str
    error: float | None
    max_power: float


@dataclass(frozen=True)
class StepwiseSelection:
    """Select a model with few terms from a log.

    Parameters
    ----------
    windows : tuple of float
        Window length of each round, over the correlation time of the velocities [1].

    Raises
    ------
    MethodError
        If a length is not positive.

    Examples
    --------
    >>> StepwiseSelection().windows
    (4.0, 12.0, 12.0)
    """

    windows: tuple[float, ...] = (4.0, 12.0, 12.0)

    def __post_init__(self) -> None:
        """Check the lengths."""
        fits = len(self.windows) > 0 and all(0.0 < window < np.inf for window in self.windows)
        demand(fits, "windows", "positive lengths [1]", self.windows)

    def select(
        self,
        vehicle: Vehicle,
        log: Log,
        models: Iterable[DampingModel] = (),
        done: Callable[[Round], None] | None = None,
    ) -> DampingModel:
        """Return the selected model.

        Parameters
        ----------
        vehicle : Vehicle
            Mass matrix, restoring wrench, actuators and free axes.
        log : Log
            Training data; never the test data.
        models : iterable of DampingModel
            Their damping terms are further candidates. Their terms with commands,
            weight and constants are not damping and are always retained.
            Commands that neither they nor the vehicle's actuators use are added on
            the axes where they explain the residuals of common damping models.
        done : callable, optional
            Called with each round when it ends, once for each of the windows.

        Returns
        -------
        model : DampingModel
            Key ``sparse``; its note says how it was selected.

        Raises
        ------
        MethodError
            If the log is too short to select from.
        """
        models = [*models]
        if command_terms := select_command_terms(vehicle, log, models):
            models.append(command_terms)
        candidates = candidate_model(vehicle, log, models)
        candidates = remove_duplicates(prepare(vehicle, log, candidates), candidates)
        problem = prepare(vehicle, log, candidates)
        initial = _initial_model(problem, candidates)
        damping, _ = _fit_simulation(problem, initial, (), (_INITIAL_WINDOW,))
        rounds: list[Round] = []
        for window in self.windows:
            result, damping = select_round(problem, candidates, damping, window)
            rounds.append(result)
            if done is not None:
                done(result)
        best, reason = best_round(rounds)
        source = f"selected by hydrodamp from {log.source or 'a log in memory'}"
        note = f"{reason} {best.summary}"
        idle = set(log.command_names) - {*vehicle.commands, *best.model.commands}
        if idle and log.wrench is None:
            note += f" No axis depends on the command {' '.join(sorted(idle))}."
        return replace(best.model, source=source, note=note)


def select_round(
    problem: Problem, candidates: DampingModel, present: Damping, window: float
) -> tuple[Round, Damping]:
    """Select a model around the present one, and fit it."""
    blocks, n_diverged = block_normal_matrices(problem, candidates, present, window)
    if len(blocks) < MIN_BLOCKS:
        raise MethodError(
            f"only {len(blocks)} of {len(blocks) + n_diverged} blocks of the log can be replayed, "
            f"and a selection needs {MIN_BLOCKS}: give a longer log, or check its signs and the "
            "vehicle's mass and actuators."
        )
    retained, drag = np.flatnonzero(is_retained(candidates)), drag_indices(candidates)
    total = blocks.sum(axis=0)
    order = forward_selection(total, _MAX_FORWARD_TERMS, retained.tolist())
    frequencies = selection_frequencies(blocks, retained.tolist())[order]
    stable = order[frequencies >= _MIN_SELECTION_FREQUENCY]
    pool = [*stable.tolist(), *retained.tolist()]
    for group in drag:  # each axis needs a drag term
        if len(group) and not np.isin(group, pool).any():
            pool.append(int([*order[np.isin(order, group)], *group][0]))
    start = np.unique(np.array(pool, dtype=np.int64))
    subset, summary = select_size(blocks, backward_elimination(total, start, retained, drag))
    model, initial = submodel(candidates, subset), [solve_subset(total, subset)]
    damping, error = _fit_simulation(problem, model, initial, (_INITIAL_WINDOW, window))
    power = max_damping_power(damping, operating_box(problem)).power
    return Round(model, summary, error, power), damping


def block_normal_matrices(
    problem: Problem, model: DampingModel, present: Damping, length: float
) -> tuple[FloatArray, int]:
    """Linearise the simulation in a model's coefficients around the present damping.

    Returns normal matrices of the blocks (n, p + 1, p + 1) and the number of diverged blocks.
    """
    objective = make_objective(problem, model)
    seconds = length * objective.time_scale
    windows = objective.windows(min(seconds, problem.duration / _MIN_WINDOWS))
    coefficients = present.onto(model)
    residual_std = objective.residual_std(coefficients, windows)
    n = len(windows.bounds)
    block_of_window = np.arange(n) * min(MAX_BLOCKS, n) // n
    normals = windows.block_normal_matrices(coefficients, residual_std, block_of_window)
    total_from_change = np.eye(len(coefficients) + 1)
    total_from_change[:-1, -1] = coefficients
    finite = normals[:, -1, -1] > 0.0
    return total_from_change.T @ normals[finite] @ total_from_change, int(np.sum(~finite))


def _initial_model(problem: Problem, candidates: DampingModel) -> DampingModel:
    """Select a few terms of each axis by forward selection on the weak form."""
    triangle = WeakRegression().rows(problem).triangle()
    retained, drag, start = is_retained(candidates), drag_indices(candidates), 0
    indices: list[int] = []
    for axis, terms in enumerate(candidates.terms):
        rows = np.column_stack([triangle.columns(terms), triangle.target(axis)])
        first = np.flatnonzero(retained[start : start + len(terms)])
        order = forward_selection(rows.T @ rows, len(terms), first.tolist()) + start
        drag_order = [*order[np.isin(order, drag[axis])], *drag[axis]]
        indices += [*(first + start), *order[: len(first) + _N_INITIAL_TERMS], *drag_order[:1]]
        start += len(terms)
    return submodel(candidates, np.unique(np.array(indices, dtype=np.int64)))


def _fit_simulation(
    problem: Problem, model: DampingModel, initial: Sequence[FloatArray], lengths: Sequence[float]
) -> tuple[Damping, float | None]:
    """Fit a model by output error on windows of some lengths; return the error of a replay."""
    objective = make_objective(problem, model)
    seconds = [length * objective.time_scale for length in lengths]
    _, result = fit_windows(objective, model, seconds, initial)
    damping = Damping(model, result.coefficients)
    errors = block_errors(replay(problem, damping))
    if errors.diverged.any():
        return damping, None
    return damping, errors.relative_error(errors.excited)


def best_round(rounds: Sequence[Round]) -> tuple[Round, str]:
    """Return the best round, by dissipation, then relative error, then size, and the reason."""
    finite = [(each.error, each) for each in rounds if each.error is not None]
    if not finite:
        return rounds[-1], "The replay of every selected model diverges; this is the last one."
    dissipative = [(error, each) for error, each in finite if each.max_power <= 0.0]
    eligible = dissipative or finite
    lowest = min(error for error, _ in eligible)
    close = [(error, each) for error, each in eligible if error <= _MAX_ERROR_RATIO * lowest]
    _, best = min(close, key=lambda pair: (pair[1].model.n_coefficients, pair[0]))
    criterion = "is dissipative over the operating range" if dissipative else "can be replayed"
    return best, (
        f"{len(eligible)} of {len(rounds)} rounds gave a model that {criterion}; this one has the "
        f"fewest coefficients within {100.0 * (_MAX_ERROR_RATIO - 1.0):.0f} % of the lowest "
        f"error on the training data, {100.0 * lowest:.3g} % of the motion."
    )


def candidate_model(
    vehicle: Vehicle, log: Log, models: Iterable[DampingModel] = ()
) -> DampingModel:
    """Return the candidate terms of every axis: those of the paper's models and of ``models``."""
    commands = {name: log.command(name) for name in log.command_names}
    known = log.propulsion_ratio is not None or vehicle.propulsion_speed(commands) is not None
    degrees = (2,) if is_under_way(log.velocity) else (1, 2)

    def is_candidate(term: Term) -> bool:
        return velocity_degree(term) in degrees and (known or not term.needs_propulsion)

    published, models, rows = [catalog[key] for key in PAPER_MODELS], [*models], []
    for axis in range(len(AXES)):
        row = filter(is_candidate, (term for model in published for term in model.terms[axis]))
        rows.append([*row, *(term for model in models for term in model.terms[axis])])
    terms = tuple(tuple(dict.fromkeys(row)) for row in rows)
    return DampingModel(SPARSE_KEY, "Sparse", terms).restricted_to(vehicle.axes)


def velocity_degree(term: Term) -> int:
    """Return the degree of a term in the velocities; (eta-1) is dimensionless."""
    return sum(factor in (*SIGNED_ATOMS, *NONNEGATIVE_ATOMS) for factor in term.factors)


def submodel(model: DampingModel, indices: IntArray) -> DampingModel:
    """Return the model of some coefficients of another."""
    pairs = axis_terms(model)
    rows: list[list[Term]] = [[] for _ in AXES]
    for axis, term in (pairs[index] for index in indices):
        rows[axis].append(term)
    return replace(model, terms=tuple(map(tuple, rows)))


def drag_indices(model: DampingModel) -> tuple[IntArray, ...]:
    """Return the indices of the drag coefficients of each axis."""
    drag = np.array([axis if is_drag(axis, term) else -1 for axis, term in axis_terms(model)])
    return tuple(np.flatnonzero(drag == axis) for axis in range(len(AXES)))


def is_drag(axis: int, term: Term) -> bool:
    """Return whether a term always has the sign of the velocity of an axis."""
    velocity = VELOCITY_OF[AXES[axis]]
    signed = [factor for factor in term.factors if factor not in NONNEGATIVE_ATOMS]
    return len(signed) == 1 and signed[0] in (velocity, f"V_{velocity}")


def is_retained(model: DampingModel) -> BoolArray:
    """Return which coefficients are not damping and so not subject to selection."""
    retained = [
        not is_damping_term(term) and not term.needs_propulsion for _, term in axis_terms(model)
    ]
    return np.array(retained, dtype=np.bool_)


def select_command_terms(
    vehicle: Vehicle, log: Log, models: Iterable[DampingModel]
) -> DampingModel | None:
    """Return terms of commands that nothing else uses, on the axes that they affect."""
    models = [model.restricted_to(vehicle.axes) for model in models]
    used = {*vehicle.commands, *(name for model in models for name in model.commands)}
    idle = [name for name in log.command_names if name not in used]
    if log.wrench is not None or not idle:
        return None
    forms = ("{}", "u|u|*{}") if is_under_way(log.velocity) else ("{}",)
    axes = " ".join(vehicle.axes)
    candidates = DampingModel.from_table(
        {axes: " ".join(form.format(name) for name in idle for form in forms)}, key=SPARSE_KEY
    )
    problem = prepare(vehicle, log, [candidates, *_BASELINE_MODELS, *models])
    triangle = WeakRegression().rows(problem).triangle()
    rows = []
    for axis, terms in enumerate(candidates.terms):
        known = {term for model in problem.models[1:] for term in model.terms[axis]}
        columns = np.column_stack([triangle.columns([*known, *terms]), triangle.target(axis)])
        indices = select_significant(columns.T @ columns, len(known))
        rows.append(tuple(terms[index - len(known)] for index in indices))
    return replace(candidates, terms=tuple(rows))
