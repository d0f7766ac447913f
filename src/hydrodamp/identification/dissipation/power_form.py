"""The power of a model as a quadratic form whose matrix is affine in speeds."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.basis.term import Term
from hydrodamp.identification.dissipation.operating_box import OperatingBox
from hydrodamp.identification.dissipation.power import dissipates
from hydrodamp.models.model import DampingModel

MOST_CORNERS = 256
"""A form with more corners is not written."""

Parameter = tuple[str, int]
"""``("signed", 0)`` is u, ``("absolute", 1)`` is abs(v), ``("one", 0)`` the constant one."""

ONE: Parameter = ("one", 0)


@dataclass(frozen=True)
class Monomial:
    """The power of one term: ``sign · Π ν_signed · Π |ν_absolute|`` per unit coefficient."""

    coefficient: int
    sign: float
    signed: tuple[int, ...]
    absolute: tuple[int, ...]

    @property
    def fits(self) -> bool:
        """Whether it is two velocities times at most one parameter."""
        return (len(self.signed), len(self.absolute)) in ((2, 0), (2, 1), (3, 0))


@dataclass(frozen=True, eq=False)
class PowerForm:
    """``νᵀ D(a) ν`` at the corners of the parameters."""

    velocities: tuple[int, ...]
    parameters: tuple[Parameter, ...]
    corners: FloatArray
    entries: FloatArray
    idle: FloatArray


def power_form(
    model: DampingModel, box: OperatingBox, others: Iterable[int] = (), *, constant: bool = False
) -> PowerForm | None:
    """Write the power of a model as a quadratic form."""
    monomials = tuple(_monomials(model, box))
    if not all(monomial.fits for monomial in monomials):
        return None
    fixed = [place for place in range(6) if box.nearest[place] > 0.0]
    absolute = {place for monomial in monomials for place in monomial.absolute}
    triples = {frozenset(each.signed) for each in monomials if len(each.signed) == 3}
    taken = _fewest_corners(triples, fixed, absolute)
    homogeneous = not constant and all(
        len(each.signed) + len(each.absolute) == 3 for each in monomials
    )
    parameters = (
        ONE,
        *(("signed", place) for place in taken),
        *(("absolute", place) for place in sorted(absolute)),
    )
    corners = _corners(parameters, box, homogeneous)
    rows = sorted({place for each in monomials for place in each.signed} | set(others))
    if len(corners) > MOST_CORNERS or not rows:
        return None
    writer = _Writer(tuple(rows), parameters, box.extent)
    return PowerForm(
        velocities=tuple(rows),
        parameters=parameters,
        corners=corners,
        entries=writer.entries(monomials, taken, model.n_coefficients),
        idle=writer.idle(taken),
    )


def packed(matrix: FloatArray) -> FloatArray:
    """Return a symmetric matrix as the vector of its upper triangle."""
    columns, rows = np.tril_indices(len(matrix))
    return np.asarray(matrix[rows, columns] * np.where(rows == columns, 1.0, np.sqrt(2.0)))


def unpacked(vectors: FloatArray, size: int) -> FloatArray:
    """Return the symmetric matrices of some vectors."""
    columns, rows = np.tril_indices(size)
    matrices = np.zeros((len(vectors), size, size))
    matrices[:, rows, columns] = vectors / np.where(rows == columns, 1.0, np.sqrt(2.0))
    matrices[:, columns, rows] = matrices[:, rows, columns]
    return matrices


def _monomials(model: DampingModel, box: OperatingBox) -> Iterator[Monomial]:
    labelled = ((axis, term) for axis, row in enumerate(model.terms) for term in row)
    for place, (axis, term) in enumerate(labelled):
        moving = all(box.extent[VELOCITIES.index(name)] > 0.0 for name in term.velocities)
        if dissipates(term) and moving and box.extent[axis] > 0.0:
            yield _monomial(place, axis, term, box)


def _monomial(place: int, axis: int, term: Term, box: OperatingBox) -> Monomial:
    """Read a term; the absolute value of a velocity that keeps its sign is a signed one."""
    sign, signed, absolute = 1.0, [axis], []
    for factor in term.factors:
        name = factor.strip("|")
        if name not in VELOCITIES:
            return Monomial(place, sign, (), ())
        velocity = VELOCITIES.index(name)
        if factor == name:
            signed.append(velocity)
        elif box.nearest[velocity] > 0.0:
            signed.append(velocity)
            sign *= float(np.sign(box.low[velocity]))
        else:
            absolute.append(velocity)
    return Monomial(place, sign, tuple(signed), tuple(absolute))


def _fewest_corners(
    triples: set[frozenset[int]], fixed: list[int], absolute: set[int]
) -> tuple[int, ...]:
    """Choose signed parameters, one in each triple: those that keep their sign first."""
    first = [place for place in fixed if any(place in triple for triple in triples)]
    open_triples = [triple for triple in triples if not triple & set(first)]
    rest = [place for place in range(6) if place not in fixed]
    sets = (chosen for count in range(7) for chosen in combinations(rest, count))
    hitting = [chosen for chosen in sets if all(each & set(chosen) for each in open_triples)]

    def corners(chosen: tuple[int, ...]) -> float:
        return float(np.prod([1.5 if place in absolute else 2.0 for place in chosen]))

    return (*first, *min(hitting, key=corners))


def _corners(parameters: tuple[Parameter, ...], box: OperatingBox, homogeneous: bool) -> FloatArray:
    """Return corners of a set that holds all values of the parameters on the box."""
    used = sorted({place for kind, place in parameters if kind != "one"})
    keeping = [place for place in used if box.nearest[place] > 0.0]
    along_edges = homogeneous and not keeping
    values: list[tuple[float, ...]] = []
    for place in used:
        low, high = float(box.low[place]), float(box.high[place])
        if place in keeping:
            near = low if abs(low) < abs(high) else high
            values.append((near,) if homogeneous and len(keeping) == 1 else (low, high))
        elif ("signed", place) not in parameters:
            values.append((0.0, float(box.extent[place])))
        elif along_edges or ("absolute", place) in parameters:
            values.append((low, 0.0, high))
        else:
            values.append((low, high))
    rows = []
    for corner in product(*values):
        if not along_edges or np.count_nonzero(corner) == 1:
            at = dict(zip(used, corner, strict=True))
            rows.append([_value(parameter, at) for parameter in parameters])
    return np.unique(np.array(rows), axis=0)


def _value(parameter: Parameter, at: dict[int, float]) -> float:
    kind, place = parameter
    if kind == "one":
        return 1.0
    return abs(at[place]) if kind == "absolute" else at[place]


@dataclass(frozen=True, eq=False)
class _Writer:
    """Writes products of velocities into packed matrices."""

    rows: tuple[int, ...]
    parameters: tuple[Parameter, ...]
    extent: FloatArray

    def _blank(self, columns: int) -> FloatArray:
        size = len(self.rows)
        return np.zeros((len(self.parameters), size * (size + 1) // 2, columns))

    def _product(self, one: int, other: int) -> FloatArray:
        """Return the packed matrix of ``ν_one ν_other``."""
        matrix = np.zeros((6, 6))
        matrix[one, other] += 0.5 * self.extent[one] * self.extent[other]
        matrix[other, one] += 0.5 * self.extent[one] * self.extent[other]
        return packed(matrix[np.ix_(self.rows, self.rows)])

    def entries(
        self, monomials: tuple[Monomial, ...], taken: tuple[int, ...], columns: int
    ) -> FloatArray:
        blank = self._blank(columns)
        for each in monomials:
            left, parameter = list(each.signed), ONE
            if each.absolute:
                parameter = ("absolute", each.absolute[0])
            elif len(left) == 3:
                chosen = next(place for place in taken if place in left)
                left.remove(chosen)
                parameter = ("signed", chosen)
            place = self.parameters.index(parameter)
            blank[place, :, each.coefficient] += each.sign * self._product(*left)
        return blank

    def idle(self, taken: tuple[int, ...]) -> FloatArray:
        pairs = [
            (one, other, third)
            for one, other in combinations([each for each in taken if each in self.rows], 2)
            for third in self.rows
            if not (third in taken and taken.index(third) > taken.index(other))
        ]
        blank = self._blank(len(pairs))
        for column, (one, other, third) in enumerate(pairs):
            blank[self.parameters.index(("signed", one)), :, column] += self._product(other, third)
            blank[self.parameters.index(("signed", other)), :, column] -= self._product(one, third)
        return blank
