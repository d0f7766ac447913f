"""The ninth model: a few terms, chosen for what they do to the replay."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.basis.atoms import AXES, VELOCITIES, VELOCITY_OF
from hydrodamp.basis.term import Term
from hydrodamp.data.log import Log
from hydrodamp.errors import MethodError, demand
from hydrodamp.identification.backward_elimination import (
    forward,
    frequencies,
    moving,
    nested,
    sized,
    solved,
)
from hydrodamp.identification.dissipativity import (
    is_damping_term,
    max_damping_power,
    operating_box,
    velocity_box,
)
from hydrodamp.identification.gauss_newton import (
    admissible_lengths,
    best_initial_iterate,
    continue_over_lengths,
    initial_candidates,
    make_objective,
)
from hydrodamp.identification.weak_form import WeakRegression
from hydrodamp.models.catalog import PAPER_MODELS, catalog
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem, prepare
from hydrodamp.simulation.replay import replay, score
from hydrodamp.vehicle.vehicle import Vehicle

#: Key of the model that a selection makes.
SPARSE_KEY = "sparse"

#: Columns are one and the same where less than this share of the one is not in the other.
_SAME = 1e-9

#: Damping whose leftovers commands are compared with: drag, and lift of hull and fins. Without lift
#: a fin's force looks as if it did not grow with speed.
_PLAIN = tuple(catalog[key] for key in ("linear", "fossen", "prestero"))

#: Columns are compared on at most about this many samples.
_SAMPLES = 20_000

#: Atoms that are never negative.
_EVEN = (*(f"|{name}|" for name in VELOCITIES), "U", "V")

#: Atoms with the sign of a velocity.
_SIGNED = (*VELOCITIES, "V_v", "V_w")

# Terms an axis has in the first model, and the windows that it is fitted on [s].
_FIRST, _SHORT = 4, 5.0

# A round with fewer coefficients may be this much worse on the training data.
_NEAR = 1.1

# Blocks below which nothing can be left out, and blocks at most.
_FEWEST, _PARTS = 4, 32

# A log is cut into this many windows at least.
_LEAST = 16

# Terms that forward selection takes before elimination, and the share of the half samples on which
# one must be chosen.
_MOST, _OFTEN = 60, 0.5


class Round(NamedTuple):
    """One round: selection around a model, and the replay of what was selected."""

    model: DampingModel
    summary: str
    rms: float | None
    max_power: float


@dataclass(frozen=True)
class StepwiseSelection:
    """Select a model with few terms from a log.

    Parameters
    ----------
    windows : tuple of float
        Length of the windows that are replayed, round by round [s].

    Raises
    ------
    MethodError
        If a length is not positive.

    Examples
    --------
    >>> StepwiseSelection().windows
    (10.0, 30.0, 30.0)
    """

    windows: tuple[float, ...] = (10.0, 30.0, 30.0)

    def __post_init__(self) -> None:
        """Check the lengths."""
        fits = len(self.windows) > 0 and all(0.0 < window < np.inf for window in self.windows)
        demand(fits, "windows", "positive lengths [s]", self.windows)

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
            Everything known.
        log : Log
            What the model is to be identified from; never what it is tested on.
        models : iterable of DampingModel
            Their damping terms are further candidates. Their terms with commands,
            weight and constants are no damping: they are kept, whatever is selected.
            Commands that neither they nor the vehicle's actuators take are offered on
            the axes where they explain what a plain damping leaves over, and kept there.
        done : callable, optional
            Called with each round as it comes, one for each of the windows.

        Returns
        -------
        model : DampingModel
            Key ``sparse``; its note says how it was selected.

        Raises
        ------
        MethodError
            If the log is too short to select from.
        """
        given = tuple(models)
        driven = moved(vehicle, log, given)
        given = given if driven is None else (*given, driven)
        everything = candidates(vehicle, log, given)
        offered = distinct(prepare(vehicle, log, everything), everything)
        problem = prepare(vehicle, log, offered)
        first = _first(problem, offered)
        damping, _ = refit(problem, first, (), (_SHORT,))
        rounds: list[Round] = []
        for window in self.windows:
            made, damping = select_around(problem, offered, damping, window)
            rounds.append(made)
            if done is not None:
                done(made)
        best, why = best_round(rounds)
        source = f"selected by hydrodamp from {log.source or 'a log in memory'}"
        note = f"{why} {best.summary}"
        idle = set(log.command_names) - {*vehicle.commands, *best.model.commands}
        if idle and log.wrench is None:
            note += f" No axis follows the command {' '.join(sorted(idle))}."
        return replace(best.model, source=source, note=note)


def select_around(
    problem: Problem, offered: DampingModel, around: Damping, window: float
) -> tuple[Round, Damping]:
    """Select around a small model, and fit what was selected."""
    blocks, lost = replay_blocks(problem, offered, around, window)
    if len(blocks) < _FEWEST:
        raise MethodError(
            f"only {len(blocks)} of {len(blocks) + lost} blocks of the log can be replayed, "
            f"and a selection needs {_FEWEST}: give a longer log, or check its signs and the "
            "vehicle's mass and actuators."
        )
    held, groups = np.flatnonzero(kept(offered)), drag(offered)
    total = blocks.sum(axis=0)
    order = forward(total, _MOST, held.tolist())
    stable = order[frequencies(blocks, held.tolist())[order] >= _OFTEN]
    pool = [*stable.tolist(), *held.tolist()]
    for group in groups:  # a term that brakes each axis
        if len(group) and not np.isin(group, pool).any():
            pool.append(int([*order[np.isin(order, group)], *group][0]))
    sets = nested(total, np.unique(np.array(pool, dtype=np.int64)), held, groups)
    place, words = sized(blocks, sets)
    model = picked(offered, sets[place])
    damping, rms = refit(problem, model, [solved(total, sets[place])], (_SHORT, window))
    return Round(
        model, words, rms, max_damping_power(damping, operating_box(problem)).power
    ), damping


def replay_blocks(
    problem: Problem, model: DampingModel, around: Damping, length: float
) -> tuple[FloatArray, int]:
    """Linearise the replay in the coefficients of a large model around a small one.

    Normal matrices of the blocks, shape (n, p + 1, p + 1), and how many blocks cannot be replayed.
    """
    search = make_objective(problem, model)
    windows = search.windows(min(length, problem.duration / _LEAST))
    guessed = around.onto(model)
    spread = search.spread(guessed, windows)
    turn = np.eye(len(guessed) + 1)
    turn[:-1, -1] = guessed
    found = windows.normals(guessed, spread, min(_PARTS, len(windows.bounds)))
    whole = found[:, -1, -1] > 0.0
    return turn.T @ found[whole] @ turn, int(np.sum(~whole))


def _first(problem: Problem, offered: DampingModel) -> DampingModel:
    """Choose a few terms of each axis from the rows of the regression."""
    triangle = WeakRegression().rows(problem).triangle()
    fixed, brakes, start = kept(offered), drag(offered), 0
    chosen: list[int] = []
    for axis, terms in enumerate(offered.terms):
        part = np.column_stack([triangle.columns(terms), triangle.target(axis)])
        first = np.flatnonzero(fixed[start : start + len(terms)])
        order = forward(part.T @ part, len(terms), first.tolist()) + start
        braking = [*order[np.isin(order, brakes[axis])], *brakes[axis]]
        chosen += [*(first + start), *order[: len(first) + _FIRST], *braking[:1]]
        start += len(terms)
    return picked(offered, np.unique(np.array(chosen, dtype=np.int64)))


def refit(
    problem: Problem, model: DampingModel, first: Sequence[FloatArray], lengths: Sequence[float]
) -> tuple[Damping, float | None]:
    """Fit the replay on windows of some lengths, and score that of the whole log."""
    search = make_objective(problem, model)
    tried, lengths = (
        [*first, *initial_candidates(search, model)],
        admissible_lengths(problem, lengths),
    )
    place = continue_over_lengths(search, best_initial_iterate(search, tried, lengths[0]), lengths)
    damping = Damping(model, place.coefficients)
    return damping, score(replay(problem, damping)).rms


def best_round(rounds: Sequence[Round]) -> tuple[Round, str]:
    """Choose among rounds: dissipation first, then the replay, then the size."""
    finished = [(one.rms, one) for one in rounds if one.rms is not None]
    if not finished:
        return rounds[-1], "No selected model replays the training data; this is the last."
    braking = [(rms, one) for rms, one in finished if one.max_power <= 0.0]
    ranked = braking or finished
    least = min(rms for rms, _ in ranked)
    near = [(one.model.n_coefficients, rms, one) for rms, one in ranked if rms <= _NEAR * least]
    brakes = "whose damping brakes at all velocities of the log"
    what = brakes if braking else "that replays the training data"
    return min(near, key=lambda each: each[:2])[-1], (
        f"{len(ranked)} of {len(rounds)} rounds gave a model {what}; this one has the fewest "
        f"coefficients within {100.0 * (_NEAR - 1.0):.0f} % of their lowest RMS on the training "
        f"data, {least:.3g}."
    )


def candidates(vehicle: Vehicle, log: Log, models: Iterable[DampingModel] = ()) -> DampingModel:
    """Return every term that may be chosen: axis by axis those of the paper's models."""
    commands = {name: log.command(name) for name in log.command_names}
    known = log.propulsion_ratio is not None or vehicle.propulsion_speed(commands) is not None
    wanted = (2,) if under_way(log.velocity) else (1, 2)
    paper = [catalog[key] for key in PAPER_MODELS]
    rows = [
        [
            *(
                term
                for model in paper
                for term in model.terms[axis]
                if degree(term) in wanted and (known or not term.needs_propulsion)
            ),
            *(term for model in models for term in model.terms[axis]),
        ]
        for axis in range(len(AXES))
    ]
    terms = tuple(tuple(dict.fromkeys(row)) for row in rows)
    return DampingModel(SPARSE_KEY, "Sparse", terms).restricted_to(vehicle.axes)


def degree(term: Term) -> int:
    """Return how many velocities a term is a product of; (eta-1) has no unit."""
    return sum(factor in (*_SIGNED, *_EVEN) for factor in term.factors)


def under_way(velocity: FloatArray) -> bool:
    """Tell whether surge keeps its sign and never nearly vanishes."""
    return bool(velocity_box(velocity).min_abs[0] > 0.0)


def distinct(problem: Problem, model: DampingModel) -> DampingModel:
    """Leave out terms that are zero throughout or copy another one."""
    step = max(problem.n_samples // _SAMPLES, 1)
    columns = problem.regressor(step=step)[:, problem.equations.n_known :]
    size = np.linalg.norm(columns, axis=0)
    unit = columns / np.where(size > 0.0, size, 1.0)
    same = np.abs(unit.T @ unit) > 1.0 - _SAME
    place = {term: number for number, term in enumerate(problem.equations.basis)}
    rows = []
    for terms in model.terms:
        chosen: list[Term] = []
        for term in sorted(terms, key=lambda one: (is_damping_term(one), not _reverses(one))):
            here = place[term]
            if size[here] > 0.0 and not same[here, [place[other] for other in chosen]].any():
                chosen.append(term)
        rows.append(tuple(chosen))
    return replace(model, terms=tuple(rows))


def picked(offered: DampingModel, places: IntArray) -> DampingModel:
    """Return the model of some coefficients of another."""
    ends = np.cumsum([0, *map(len, offered.terms)])
    rows = tuple(
        tuple(terms[place - start] for place in places[(places >= start) & (places < stop)])
        for terms, start, stop in zip(offered.terms, ends[:-1], ends[1:], strict=True)
    )
    return replace(offered, terms=rows)


def drag(model: DampingModel) -> tuple[IntArray, ...]:
    """Return the coefficients that brake an axis, axis by axis."""
    braking = [brakes(axis, term) for axis, row in enumerate(model.terms) for term in row]
    ends = np.cumsum([0, *map(len, model.terms)])
    places = np.flatnonzero(braking)
    return tuple(places[(places >= a) & (places < b)] for a, b in pairwise(ends))


def brakes(axis: int, term: Term) -> bool:
    """Tell whether a term has the sign of the velocity along an axis."""
    own = VELOCITY_OF[AXES[axis]]
    signed = [factor for factor in term.factors if factor not in _EVEN]
    return len(signed) == 1 and signed[0] in (own, f"V_{own}")


def _reverses(term: Term) -> bool:
    return sum(factor in _SIGNED for factor in term.factors) % 2 == 1


def kept(model: DampingModel) -> BoolArray:
    """Tell which coefficients are no damping and so not for a selection to drop."""
    return np.array(
        [
            not is_damping_term(term) and not term.needs_propulsion
            for row in model.terms
            for term in row
        ],
        dtype=np.bool_,
    )


def moved(vehicle: Vehicle, log: Log, models: Iterable[DampingModel]) -> DampingModel | None:
    """Return terms of commands that nothing else takes, on the axes that they move."""
    given = [model.restricted_to(vehicle.axes) for model in models]
    taken = {*vehicle.commands, *(name for model in given for name in model.commands)}
    idle = [name for name in log.command_names if name not in taken]
    if log.wrench is not None or not idle:
        return None
    forms = ("{}", "u|u|*{}") if under_way(log.velocity) else ("{}",)
    axes = " ".join(vehicle.axes)
    everything = DampingModel.from_table(
        {axes: " ".join(form.format(name) for name in idle for form in forms)}, key=SPARSE_KEY
    )
    problem = prepare(vehicle, log, [everything, *_PLAIN, *given])
    triangle = WeakRegression().rows(problem).triangle()
    rows = []
    for axis, terms in enumerate(everything.terms):
        known = {term for model in problem.models[1:] for term in model.terms[axis]}
        part = np.column_stack([triangle.columns([*known, *terms]), triangle.target(axis)])
        places = moving(part.T @ part, len(known))
        rows.append(tuple(terms[place - len(known)] for place in places))
    return replace(everything, terms=tuple(rows))
