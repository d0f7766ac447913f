"""The ninth model: a few terms, chosen for what they do to the replay."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.basis.atoms import AXES, VELOCITIES
from hydrodamp.basis.term import Term
from hydrodamp.data.log import Log
from hydrodamp.errors import MethodError, demand
from hydrodamp.identification.elimination import (
    forward,
    frequencies,
    nested,
    sized,
    solved,
)
from hydrodamp.identification.power import box_of, dissipates
from hydrodamp.identification.search import begun, ladder, searching, starts, within
from hydrodamp.identification.weak import WeakEquations
from hydrodamp.models.catalog import PAPER_MODELS, catalog
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.progress import counted
from hydrodamp.simulation.problem import Problem, prepare
from hydrodamp.simulation.replay import replay, score
from hydrodamp.vehicle.vehicle import Vehicle

#: Key of the model that a selection makes.
KEY = "sparse"

#: Damping whose leftovers commands are compared with: drag, and lift of hull and fins. Without lift
#: a fin's force looks as if it did not grow with speed.
_PLAIN = tuple(catalog[key] for key in ("linear", "fossen", "prestero"))

#: Atoms that are never negative.
_EVEN = (*(f"|{name}|" for name in VELOCITIES), "U", "V")

#: Atoms with the sign of a velocity.
_SIGNED = (*VELOCITIES, "V_v", "V_w")

# Terms an axis has in the first model, and the windows that it is fitted on [s].
_FIRST, _SHORT = 4, 5.0

# Blocks below which nothing can be left out, and blocks at most.
_FEWEST, _PARTS = 4, 32

# A log is cut into this many windows at least.
_LEAST = 16

# Terms that forward selection takes before elimination, and the share of the half samples on which
# one must be chosen.
_MOST, _OFTEN = 60, 0.5

# Share of the leftovers that a command takes that moves an axis: a correlation of 0.3.
_MOVED = 0.09


@dataclass(frozen=True)
class Sparse:
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
    >>> Sparse().windows
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
        offered = candidates(vehicle, log, given)
        problem = prepare(vehicle, log, offered)
        damping, _ = refit(problem, _first(problem, offered), (), (_SHORT,))
        rounds = []
        for window in counted(self.windows, "selecting terms", len(self.windows)):
            damping, rms, words = select_around(problem, offered, damping, window)
            rounds.append((np.inf if rms is None else rms, damping.model, words))
        _, model, words = min(rounds, key=lambda each: each[0])
        source = f"selected by hydrodamp from {log.source or 'a log in memory'}"
        idle = set(log.command_names) - {*vehicle.commands, *model.commands}
        if idle and log.wrench is None:
            words += f" No axis follows the command {' '.join(sorted(idle))}."
        return replace(model, source=source, note=words)


def select_around(
    problem: Problem, offered: DampingModel, around: Damping, window: float
) -> tuple[Damping, float | None, str]:
    """Select around a small model, and fit what was selected: that, its error, and how."""
    blocks, lost = replay_blocks(problem, offered, around, window)
    if len(blocks) < _FEWEST:
        raise MethodError(
            f"only {len(blocks)} of {len(blocks) + lost} blocks of the log can be replayed, "
            f"and a selection needs {_FEWEST}: give a longer log, or check its signs and the "
            "vehicle's mass and actuators."
        )
    held, total = np.flatnonzero(kept(offered)), blocks.sum(axis=0)
    order = forward(total, _MOST, held.tolist())
    stable = order[frequencies(blocks, held.tolist())[order] >= _OFTEN]
    braked = brakes(offered)
    ranked = np.array([*order, *range(len(braked))])
    brake = ranked[np.unique(braked[ranked], return_index=True)[1]]
    pool = np.union1d(stable, held)
    missing = ~np.isin(braked[brake], [-1, *braked[pool]])
    sets = nested(total, np.append(pool, brake[missing]), held, braked)
    place, words = sized(blocks, sets)
    first = [solved(total, sets[place])]
    return *refit(problem, picked(offered, sets[place]), first, (_SHORT, window)), words


def replay_blocks(
    problem: Problem, model: DampingModel, around: Damping, length: float
) -> tuple[FloatArray, int]:
    """Linearise the replay in the coefficients of a large model around a small one.

    Normal matrices of the blocks, shape (n, p + 1, p + 1), and how many blocks cannot be replayed.
    """
    search = searching(problem, model)
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
    triangle = WeakEquations().rows(problem).triangle()
    fixed, braked, start = kept(offered), brakes(offered), 0
    chosen: list[int] = []
    for axis, terms in enumerate(offered.terms):
        part = np.column_stack([triangle.columns(terms), triangle.target(axis)])
        first = np.flatnonzero(fixed[start : start + len(terms)])
        order = forward(part.T @ part, len(terms), first.tolist()) + start
        chosen += [*(first + start), *order[: len(first) + _FIRST]]
        chosen += order[braked[order] == axis][:1].tolist()
        start += len(terms)
    return picked(offered, np.unique(np.array(chosen, dtype=np.int64)))


def refit(
    problem: Problem, model: DampingModel, first: Sequence[FloatArray], lengths: Sequence[float]
) -> tuple[Damping, float | None]:
    """Fit the replay on windows of some lengths, and score that of the whole log."""
    search = searching(problem, model)
    tried, lengths = [*first, *starts(search, model)], within(problem, lengths)
    place = ladder(search, begun(search, tried, lengths[0]), lengths)
    damping = Damping(model, place.coefficients)
    return damping, score(replay(problem, damping)).rms


def candidates(vehicle: Vehicle, log: Log, models: Iterable[DampingModel] = ()) -> DampingModel:
    """Return every term that may be chosen: axis by axis those of the paper's models."""
    commands = {name: log.command(name) for name in log.command_names}
    known = log.propulsion_ratio is not None or vehicle.propulsion_speed(commands) is not None
    ahead = under_way(log.velocity)
    wanted = (2,) if ahead else (1, 2)
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
    # Of terms that are one and the same the last stays: one that reverses with the motion.
    terms = tuple(
        tuple({_form(one, ahead): one for one in sorted(row, key=_reverses)}.values())
        for row in rows
    )
    return DampingModel(KEY, "Sparse", terms).restricted_to(vehicle.axes)


def degree(term: Term) -> int:
    """Return how many velocities a term is a product of; (eta-1) has no unit."""
    return sum(factor in (*_SIGNED, *_EVEN) for factor in term.factors)


def under_way(velocity: FloatArray) -> bool:
    """Tell whether surge keeps its sign and never nearly vanishes."""
    return bool(box_of(velocity).nearest[0] > 0.0)


def _form(term: Term, ahead: bool) -> tuple[str, ...]:
    """Return what terms share that surge of one sign makes equal, such as uv and v|u|."""
    same = ahead and not term.commands
    return tuple(sorted("u" if same and one == "|u|" else one for one in term.factors))


def picked(offered: DampingModel, places: IntArray) -> DampingModel:
    """Return the model of some coefficients of another."""
    ends = np.cumsum([0, *map(len, offered.terms)])
    rows = tuple(
        tuple(terms[place - start] for place in places[(places >= start) & (places < stop)])
        for terms, start, stop in zip(offered.terms, ends[:-1], ends[1:], strict=True)
    )
    return replace(offered, terms=rows)


def brakes(model: DampingModel) -> IntArray:
    """Return the axis that each coefficient brakes at any velocity, or -1."""
    places = []
    for axis, (own, row) in enumerate(zip(VELOCITIES, model.terms, strict=True)):
        for term in row:
            signed = [factor for factor in term.factors if factor not in _EVEN]
            places.append(axis if signed in ([own], [f"V_{own}"]) else -1)
    return np.array(places)


def _reverses(term: Term) -> bool:
    return sum(factor in _SIGNED for factor in term.factors) % 2 == 1


def kept(model: DampingModel) -> BoolArray:
    """Tell which coefficients are no damping and so not for a selection to drop."""
    return np.array(
        [not dissipates(term) and not term.needs_propulsion for row in model.terms for term in row],
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
        {axes: " ".join(form.format(name) for name in idle for form in forms)}, key=KEY
    )
    problem = prepare(vehicle, log, [everything, *_PLAIN, *given])
    triangle = WeakEquations().rows(problem).triangle()
    rows = []
    for axis, terms in enumerate(everything.terms):
        known = {term for model in problem.models[1:] for term in model.terms[axis]}
        part = np.column_stack([triangle.columns([*known, *terms]), triangle.target(axis)])
        normal = part.T @ part
        places = forward(normal, len(terms), range(len(known)), _MOVED)
        rows.append(tuple(terms[place - len(known)] for place in places if place >= len(known)))
    return replace(everything, terms=tuple(rows))
