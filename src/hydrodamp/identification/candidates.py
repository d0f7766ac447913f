"""Candidate terms for a sparse model: what may be chosen, and what brakes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.basis.atoms import AXES, VELOCITIES, VELOCITY_OF
from hydrodamp.basis.term import Term
from hydrodamp.data.log import Log
from hydrodamp.identification.elimination import error, solved
from hydrodamp.identification.power import SLOWEST_UNDER_WAY, TAIL, dissipates
from hydrodamp.identification.weak import WeakEquations
from hydrodamp.models.catalog import PAPER_MODELS, catalog
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem, prepare
from hydrodamp.vehicle.vehicle import Vehicle

#: Key of the model that a selection makes.
KEY = "sparse"

#: Columns are one and the same where less than this share of the one is not in the other.
_SAME = 1e-9

#: Damping whose leftovers commands are compared with: drag, and lift of hull and fins. Without lift
#: a fin's force looks as if it did not grow with speed.
_PLAIN = tuple(catalog[key] for key in ("linear", "fossen", "prestero"))

#: Share of the leftovers that a command takes on an axis that it moves: a correlation of 0.3.
_MOVED = 0.09

#: Columns are compared on at most about this many samples.
_SAMPLES = 20_000

#: Atoms that are never negative.
_EVEN = (*(f"|{name}|" for name in VELOCITIES), "U", "V")

#: Atoms that are velocities.
_SPEEDS = (*VELOCITIES, *_EVEN, "V_v", "V_w")

#: Atoms with the sign of a velocity, where there are several.
_ALONG = {"v": ("v", "V_v"), "w": ("w", "V_w")}


def candidates(
    vehicle: Vehicle,
    log: Log,
    models: Iterable[DampingModel] = (),
) -> DampingModel:
    """Return every term that may be chosen: axis by axis those of the paper's models."""
    commands = {name: log.command(name) for name in log.command_names}
    known = log.propulsion_ratio is not None or vehicle.propulsion_speed(commands) is not None
    wanted = (2,) if under_way(log.velocity) else (1, 2)
    own = [
        [
            term
            for key in PAPER_MODELS
            for term in catalog[key].terms[axis]
            if degree(term) in wanted and (known or not term.needs_propulsion)
        ]
        for axis in range(len(AXES))
    ]
    added = [[term for model in models for term in model.terms[axis]] for axis in range(len(AXES))]
    rows = tuple(tuple(dict.fromkeys((*a, *b))) for a, b in zip(own, added, strict=True))
    return DampingModel(KEY, "Sparse", rows).restricted_to(vehicle.axes)


def degree(term: Term) -> int:
    """Return how many velocities a term is a product of; (eta-1) has no unit."""
    return sum(factor in _SPEEDS for factor in term.factors)


def under_way(velocity: FloatArray) -> bool:
    """Tell whether surge keeps its sign and never nearly vanishes."""
    low, high = np.quantile(velocity[:, 0], [TAIL, 1.0 - TAIL])
    return bool(low > SLOWEST_UNDER_WAY * high or high < SLOWEST_UNDER_WAY * low)


def distinct(problem: Problem, model: DampingModel) -> DampingModel:
    """Leave out terms that are zero throughout or copy another one."""
    known = problem.columns.n_known
    step = max(problem.n_samples // _SAMPLES, 1)
    columns = problem.regressor(step=step)[:, known:]
    size = np.linalg.norm(columns, axis=0)
    unit = columns / np.where(size > 0.0, size, 1.0)
    likeness = np.abs(unit.T @ unit)
    place = {term: number for number, term in enumerate(problem.columns.basis)}
    rows = tuple(_different(terms, place, size, likeness) for terms in model.terms)
    return replace(model, terms=rows)


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
    pairs = [(axis, term) for axis, row in enumerate(model.terms) for term in row]
    return tuple(
        np.array(
            [place for place, (of, term) in enumerate(pairs) if of == axis and brakes(axis, term)],
            dtype=np.int64,
        )
        for axis in range(len(AXES))
    )


def brakes(axis: int, term: Term) -> bool:
    """Tell whether a term has the sign of the velocity along an axis."""
    own = VELOCITY_OF[AXES[axis]]
    signed = [factor for factor in term.factors if factor not in _EVEN]
    return len(signed) == 1 and signed[0] in _ALONG.get(own, (own,))


def kept(model: DampingModel) -> BoolArray:
    """Tell which coefficients are no damping and so not for a selection to drop."""
    return np.array(
        [not dissipates(term) and not term.needs_propulsion for row in model.terms for term in row],
        dtype=np.bool_,
    )


def _different(
    terms: tuple[Term, ...], place: dict[Term, int], size: FloatArray, likeness: FloatArray
) -> tuple[Term, ...]:
    chosen: list[Term] = []
    for term in sorted(terms, key=lambda term: (dissipates(term), not _reverses(term))):
        here = place[term]
        twin = any(likeness[here, place[other]] > 1.0 - _SAME for other in chosen)
        if size[here] > 0.0 and not twin:
            chosen.append(term)
    return tuple(chosen)


def _reverses(term: Term) -> bool:
    signed = [factor for factor in term.factors if factor in (*VELOCITIES, "V_v", "V_w")]
    return len(signed) % 2 == 1


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
        columns = [triangle.basis.index(term) for term in (*known, *terms)]
        part = triangle.r[:, [*columns, len(triangle.basis) + axis]]
        places = moving(part.T @ part, len(known))
        rows.append(tuple(terms[place - len(known)] for place in places))
    return replace(everything, terms=tuple(rows))


def moving(normal: FloatArray, known: int) -> IntArray:
    """Choose columns after the known ones while each takes its share of what is left over."""
    chosen = np.arange(known)
    open_ = np.arange(known, len(normal) - 1)

    def left(places: IntArray) -> float:
        return error(normal, places, solved(normal, places))

    while len(open_):
        errors = [left(np.append(chosen, place)) for place in open_]
        best = int(np.argmin(errors))
        if errors[best] > (1.0 - _MOVED) * left(chosen):
            break
        chosen, open_ = np.append(chosen, open_[best]), np.delete(open_, best)
    return chosen[known:]
