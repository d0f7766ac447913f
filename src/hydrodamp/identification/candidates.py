"""Candidate terms for a sparse model: what may be chosen, and what brakes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.basis.atoms import AXES, VELOCITIES, VELOCITY_OF
from hydrodamp.basis.term import Term
from hydrodamp.data.log import Log
from hydrodamp.identification.elimination import moving
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

#: Columns are compared on at most about this many samples.
_SAMPLES = 20_000

#: Atoms that are never negative.
_EVEN = (*(f"|{name}|" for name in VELOCITIES), "U", "V")

#: Atoms with the sign of a velocity.
_SIGNED = (*VELOCITIES, "V_v", "V_w")


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
    return DampingModel(KEY, "Sparse", terms).restricted_to(vehicle.axes)


def degree(term: Term) -> int:
    """Return how many velocities a term is a product of; (eta-1) has no unit."""
    return sum(factor in (*_SIGNED, *_EVEN) for factor in term.factors)


def under_way(velocity: FloatArray) -> bool:
    """Tell whether surge keeps its sign and never nearly vanishes."""
    low, high = np.quantile(velocity[:, 0], [TAIL, 1.0 - TAIL])
    return bool(low > SLOWEST_UNDER_WAY * high or high < SLOWEST_UNDER_WAY * low)


def distinct(problem: Problem, model: DampingModel) -> DampingModel:
    """Leave out terms that are zero throughout or copy another one."""
    step = max(problem.n_samples // _SAMPLES, 1)
    columns = problem.regressor(step=step)[:, problem.columns.n_known :]
    size = np.linalg.norm(columns, axis=0)
    unit = columns / np.where(size > 0.0, size, 1.0)
    same = np.abs(unit.T @ unit) > 1.0 - _SAME
    place = {term: number for number, term in enumerate(problem.columns.basis)}
    rows = []
    for terms in model.terms:
        chosen: list[Term] = []
        for term in sorted(terms, key=lambda one: (dissipates(one), not _reverses(one))):
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
        places = moving(part.T @ part, len(known))
        rows.append(tuple(terms[place - len(known)] for place in places))
    return replace(everything, terms=tuple(rows))
