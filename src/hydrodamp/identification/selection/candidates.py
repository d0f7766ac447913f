"""The terms a selection may choose from, on a given log.

Under way ``u^2`` and ``u|u|`` are one column, and no data tell them apart. Of such terms
the one that reverses with the motion is the candidate: damping does.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import replace

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.basis.axes import AXES, VELOCITIES, VELOCITY_OF
from hydrodamp.basis.term import Term
from hydrodamp.data.log import Log
from hydrodamp.identification.dissipation.operating_box import SLOWEST_UNDER_WAY, TAIL
from hydrodamp.identification.dissipation.power import dissipates
from hydrodamp.models.catalog import PAPER_MODELS, catalog
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem
from hydrodamp.vehicle.vehicle import Vehicle

KEY = "sparse"
"""Key of the model that a selection makes."""

_SAME = 1e-9
"""Columns are one and the same where less than this share of the one is not in the other."""

_SAMPLES = 20_000
"""Columns are compared on at most about this many samples."""

_EVEN = (*(f"|{name}|" for name in VELOCITIES), "U", "V")
"""Atoms that are never negative."""

_SPEEDS = (*VELOCITIES, *_EVEN, "V_v", "V_w")
"""Atoms that are velocities."""

_ALONG = {"v": ("v", "V_v"), "w": ("w", "V_w")}
"""Atoms with the sign of a velocity, where there are several."""


def candidates(
    vehicle: Vehicle,
    log: Log,
    models: Iterable[DampingModel] = (),
    degrees: Collection[int] | None = None,
) -> DampingModel:
    """Return every term that may be chosen: axis by axis those of the paper's models.

    Parameters
    ----------
    vehicle : Vehicle
        Says which axes are free, and with the log whether the propulsion ratio is known.
    log : Log
        What was measured.
    models : iterable of DampingModel
        Their terms are candidates beside the paper's, whatever their degree.
    degrees : collection of int, optional
        How many velocities a term of the paper's is a product of. By default two for a
        vehicle that is under way throughout, one and two for one that hovers: at the
        Reynolds numbers of a vehicle under way forces grow with the square of speed, and
        runs at one speed cannot tell ``w`` from ``w|u|``, which another speed does.

    Returns
    -------
    model : DampingModel
        Terms with (eta-1) only where the propulsion ratio is known.
    """
    commands = {name: log.command(name) for name in log.command_names}
    known = log.propulsion_ratio is not None or vehicle.propulsion_speed(commands) is not None
    wanted = degrees if degrees is not None else (2,) if under_way(log.velocity) else (1, 2)
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
    """Return how many velocities a term is a product of; (eta-1) has no unit.

    Examples
    --------
    >>> degree(Term.parse("v|r|")), degree(Term.parse("uv(eta-1)")), degree(Term.parse("w"))
    (2, 2, 1)
    """
    return sum(factor in _SPEEDS for factor in term.factors)


def under_way(velocity: FloatArray) -> bool:
    """Tell whether surge keeps its sign and never nearly vanishes.

    Parameters
    ----------
    velocity : ndarray, shape (n, 6)
        u v w [m/s] p q r [rad/s].

    Returns
    -------
    under_way : bool
        As for the operating box.
    """
    low, high = np.quantile(velocity[:, 0], [TAIL, 1.0 - TAIL])
    return bool(low > SLOWEST_UNDER_WAY * high or high < SLOWEST_UNDER_WAY * low)


def distinct(problem: Problem, model: DampingModel) -> DampingModel:
    """Leave out terms that are zero throughout or copy another one.

    Parameters
    ----------
    problem : Problem
        Prepared for the model.
    model : DampingModel
        Restricted to the free axes.

    Returns
    -------
    model : DampingModel
        Of equal terms the one that reverses with the motion, then the first in canonical
        order. Terms that are no damping stay unless they are zero.
    """
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
    """Return the model of some coefficients of another.

    Parameters
    ----------
    offered : DampingModel
        The larger one.
    places : ndarray of int
        Places in its labels, rising.

    Returns
    -------
    model : DampingModel
        With the same key.

    Examples
    --------
    >>> picked(DampingModel.from_table({"X Y": "u v"}, key="mine"), np.array([0, 3])).labels
    ('X_u', 'Y_v')
    """
    ends = np.cumsum([0, *map(len, offered.terms)])
    rows = tuple(
        tuple(terms[place - start] for place in places[(places >= start) & (places < stop)])
        for terms, start, stop in zip(offered.terms, ends[:-1], ends[1:], strict=True)
    )
    return replace(offered, terms=rows)


def drag(model: DampingModel) -> tuple[IntArray, ...]:
    """Return the coefficients that brake an axis, axis by axis.

    A term brakes where its sign is that of the axis's own velocity, whatever the others
    are: with a negative coefficient it takes power at every velocity.

    Parameters
    ----------
    model : DampingModel
        Any model.

    Returns
    -------
    places : tuple of ndarray of int
        Places in the model's labels, one array for each of the six axes.

    Examples
    --------
    >>> model = DampingModel.from_table({"X": "u^2 u|u|", "Y": "v|r| uv |r|V_v"}, key="mine")
    >>> [places.tolist() for places in drag(model)[:2]]
    [[1], [2, 4]]
    """
    pairs = [(axis, term) for axis, row in enumerate(model.terms) for term in row]
    return tuple(
        np.array(
            [place for place, (of, term) in enumerate(pairs) if of == axis and brakes(axis, term)],
            dtype=np.int64,
        )
        for axis in range(len(AXES))
    )


def brakes(axis: int, term: Term) -> bool:
    """Tell whether a term has the sign of the velocity along an axis.

    Parameters
    ----------
    axis : int
        0 (X) to 5 (N).
    term : Term
        Any term.

    Returns
    -------
    brakes : bool
        True for ``v``, ``v|r|``, ``vV`` and ``|r|V_v`` on Y. The sign of (eta-1) is open.
    """
    own = VELOCITY_OF[AXES[axis]]
    signed = [factor for factor in term.factors if factor not in _EVEN]
    return len(signed) == 1 and signed[0] in _ALONG.get(own, (own,))


def kept(model: DampingModel) -> BoolArray:
    """Tell which coefficients are no damping and so not for a selection to drop.

    Parameters
    ----------
    model : DampingModel
        Any model.

    Returns
    -------
    kept : ndarray of bool, shape (n_coefficients,)
        True for terms with commands, weight and constants.
    """
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
