"""Candidate terms for a sparse model, and their elimination one by one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import nnls

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.basis.atoms import AXES, VELOCITIES, VELOCITY_OF
from hydrodamp.basis.term import Term
from hydrodamp.data.log import Log
from hydrodamp.identification.power import SLOWEST_UNDER_WAY, TAIL, dissipates
from hydrodamp.identification.search import searching
from hydrodamp.models.catalog import PAPER_MODELS, catalog
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem
from hydrodamp.vehicle.vehicle import Vehicle

#: Key of the model that a selection makes.
KEY = "sparse"

#: Columns are one and the same where less than this share of the one is not in the other.
_SAME = 1e-9

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


# A log is cut into this many windows at least.
_LEAST = 16

# Share of a column's square that must be left for it to be chosen.
_FRESH = 1e-6

# Added to scaled normal matrices before they are solved.
_RIDGE = 1e-10

# Blocks are left out in this many turns.
_FOLDS = 10


def replay_blocks(
    problem: Problem, model: DampingModel, around: Damping, length: float
) -> tuple[FloatArray, int]:
    """Linearise the replay in the coefficients of a large model around a small one.

    Normal matrices of the blocks, shape (n, p + 1, p + 1), and how many blocks cannot be replayed.
    """
    search = searching(problem, model)
    windows = search.windows(min(length, problem.duration / _LEAST))
    guessed = around.onto(model)
    spread = np.sqrt(np.maximum(np.mean(windows.errors(guessed) ** 2, axis=0), search.noise**2))
    turn = np.eye(len(guessed) + 1)
    turn[:-1, -1] = guessed
    found = windows.normals(guessed, spread)
    whole = found[:, -1, -1] > 0.0
    return turn.T @ found[whole] @ turn, int(np.sum(~whole))


def forward(normal: FloatArray, most: int, first: Sequence[int] = ()) -> IntArray:
    """Choose columns one by one, each the one that explains most of what is left.

    The error-reduction ratio; the columns ``first`` are taken before all others.
    """
    n = len(normal) - 1
    scale = _scale(np.diag(normal))
    unit = normal / (scale[:, None] * scale)
    left, open_ = np.diag(unit)[:n].copy(), np.ones(n, dtype=np.bool_)
    rows = np.zeros((min(most + len(first), n), n + 1))
    order: list[int] = []
    for step in range(len(rows)):
        known = rows[: len(order)]
        if step < len(first):
            chosen = first[step]
        else:
            right = unit[:-1, -1] - known[:, :-1].T @ known[:, -1]
            fresh = open_ & (left > _FRESH)
            taken = np.where(fresh, right**2 / np.where(fresh, left, 1.0), 0.0)
            chosen = int(np.argmax(taken))
            if not taken[chosen] > 0.0:
                break
        open_[chosen] = False
        if left[chosen] > _FRESH:
            row = (unit[chosen] - known[:, chosen] @ known) / np.sqrt(left[chosen])
            rows[len(order)] = row
            left -= row[:n] ** 2
            order.append(chosen)
    return np.array(order, dtype=np.int64)


def frequencies(
    blocks: FloatArray, most: int, pairs: int, seed: int = 0, first: Sequence[int] = ()
) -> FloatArray:
    """Return the share of complementary half samples on which each column is chosen."""
    rng = np.random.default_rng(seed)
    count = np.zeros(blocks.shape[1] - 1)
    half = len(blocks) // 2
    for _ in range(pairs):
        drawn = rng.permutation(len(blocks))
        for part in (drawn[:half], drawn[half:]):
            count[forward(blocks[part].sum(axis=0), most, first)] += 1.0
    return count / (2.0 * pairs)


def nested(
    normal: FloatArray, start: IntArray, held: IntArray, groups: Sequence[IntArray] = ()
) -> tuple[IntArray, ...]:
    """Drop columns one by one, each the one whose loss costs least; the last of a group stays."""
    chosen = np.sort(start)
    sets = [chosen]
    while True:
        alone = [np.intersect1d(group, chosen) for group in groups]
        fixed = np.concatenate([held, *(group for group in alone if len(group) == 1)])
        free = ~np.isin(chosen, fixed)
        if not free.any():
            return tuple(sets)
        inverse, scale = _inverse(normal, chosen)
        coefficients = inverse @ (normal[chosen, -1] / scale)
        loss = np.where(free, coefficients**2 / np.diag(inverse), np.inf)
        chosen = np.delete(chosen, int(np.argmin(loss)))
        sets.append(chosen)


def solved(normal: FloatArray, chosen: IntArray) -> FloatArray:
    """Return the coefficients of some columns."""
    inverse, scale = _inverse(normal, chosen)
    return np.asarray(inverse @ (normal[chosen, -1] / scale) / scale)


def error(normal: FloatArray, chosen: IntArray, coefficients: FloatArray) -> float:
    """Return the sum of squares that coefficients leave of the target."""
    inner = normal[np.ix_(chosen, chosen)] @ coefficients - 2.0 * normal[chosen, -1]
    return float(normal[-1, -1] + coefficients @ inner)


def sized(blocks: FloatArray, sets: Sequence[IntArray], power: FloatArray) -> tuple[int, str]:
    """Choose the smallest set within one standard error of the best; say why."""
    total = blocks.sum(axis=0)
    rows = left_out(blocks, sets)
    prices = np.array([price(total, chosen, power[:, chosen]) for chosen in sets])
    errors = rows.sum(axis=1) + prices
    best = int(np.argmin(errors))
    allowed = rows[best].std(ddof=1) * np.sqrt(len(blocks))
    place = int(np.flatnonzero(errors <= errors[best] + allowed)[-1])
    share = 100.0 * prices[place] / max(errors[place], np.finfo(np.float64).tiny)
    return place, (
        f"{len(sets[place])} coefficients, the smallest of {len(sets)} nested models whose error "
        f"on blocks left out is within one standard error of the lowest (that of "
        f"{len(sets[best])}). {share:.2g} % of its error is the price of damping that takes power "
        "on the whole operating box."
    )


def left_out(blocks: FloatArray, sets: Sequence[IntArray]) -> FloatArray:
    """Return the error of every set on every block, its coefficients solved without it."""
    n = len(blocks)
    fold = np.arange(n) % min(_FOLDS, n)
    total = blocks.sum(axis=0)
    errors = np.zeros((len(sets), n))
    for turn in np.unique(fold):
        out = np.flatnonzero(fold == turn)
        rest = total - blocks[out].sum(axis=0)
        for number, chosen in enumerate(sets):
            coefficients = solved(rest, chosen)
            errors[number, out] = [error(blocks[place], chosen, coefficients) for place in out]
    return errors


def price(normal: FloatArray, chosen: IntArray, power: FloatArray) -> float:
    """Return by how much the least error rises where the power must not be positive."""
    part = normal[np.ix_(chosen, chosen)]
    scale = _scale(np.diag(part))
    root = np.linalg.cholesky(part / (scale[:, None] * scale) + _RIDGE * np.eye(len(chosen))).T
    normals = solve_triangular(root, (power / scale).T, trans="T")
    length = np.linalg.norm(normals, axis=0)
    normals = normals[:, length > 0.0] / length[length > 0.0]
    wished = root @ (scale * solved(normal, chosen))
    if not normals.shape[1] or np.all(wished @ normals <= 0.0):
        return 0.0
    size = float(np.linalg.norm(wished))
    kept = float(nnls(normals, wished / size)[1])
    return round(size**2 * (1.0 - kept**2), 9)


def _inverse(normal: FloatArray, chosen: IntArray) -> tuple[FloatArray, FloatArray]:
    part = normal[np.ix_(chosen, chosen)]
    scale = _scale(np.diag(part))
    scaled = part / (scale[:, None] * scale) + _RIDGE * np.eye(len(chosen))
    return np.asarray(np.linalg.inv(scaled), dtype=np.float64), scale


def _scale(square: FloatArray) -> FloatArray:
    return np.sqrt(np.where(square > 0.0, square, 1.0))
