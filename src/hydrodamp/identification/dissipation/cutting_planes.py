"""Dissipation by search: forbid the worst velocity found, solve again, repeat."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.basis.axes import AXES, VELOCITIES
from hydrodamp.errors import MethodError
from hydrodamp.identification.dissipation.cone_program import Inequalities, Nearest, nearest
from hydrodamp.identification.dissipation.operating_box import OperatingBox
from hydrodamp.identification.dissipation.power import PowerRows, size, spread, worst_places
from hydrodamp.models.model import DampingModel

ROUNDS = 40
"""Rounds at the most."""

_TOLERANCE = 1e-4
"""Share of the greatest power below which a violation only tightens the planes."""

_WORTH = 2.0
"""Tightening may lengthen the distance by this factor: sets without interior would have
it grow without bound."""

_PRESSING = 1e-9
"""Planes that press less than this share of the hardest are not held by it."""

_SLACK = 1e-3
"""Planes further away than this share of the greatest power are dropped."""


@dataclass(frozen=True, eq=False)
class Cut:
    """Coefficients that dissipate as far as a search tells."""

    coefficients: FloatArray
    rounds: int
    done: bool


@dataclass(frozen=True, eq=False)
class Planes:
    """The planes of a model on a box."""

    power: PowerRows
    box: OperatingBox
    reserve: FloatArray

    def nearest(
        self, root: FloatArray, point: FloatArray, scale: FloatArray, rounds: int = ROUNDS
    ) -> Cut:
        """Return the nearest coefficients that no search can object to."""
        x, tighter = point, 0.0
        nothing = Inequalities(np.zeros((0, len(point))), np.zeros(0))
        planes = nothing
        for done in range(rounds):
            worst, greatest = self._search(x / scale)
            new = self._planes(worst, scale)
            over = new.rows @ x - new.bound
            if over.max() <= 0.0:
                return Cut(x / scale, done, True)
            if over.max() < _TOLERANCE * greatest:
                tighter += 2.0 * float(over.max())
            planes = _joined(planes, new, over > -tighter)
            solved = nearest(root, point, replace(planes, bound=planes.bound - tighter))
            if tighter > 0.0 and (solved.infeasible or not _near(root, point, x, solved.point)):
                return Cut(x / scale, done, True)
            _check(solved, self.power.model)
            if not solved.solved:
                return Cut(np.full(len(point), np.nan), done + 1, False)
            x = solved.point
            slack = planes.bound - planes.rows @ x
            pressing = solved.pressing > _PRESSING * solved.pressing.max()
            planes = _joined(nothing, planes, pressing | (slack < _SLACK * greatest))
        return Cut(x / scale, rounds, False)

    def _search(self, coefficients: FloatArray) -> tuple[FloatArray, float]:
        """Return velocities of locally greatest excess, and the greatest power anywhere."""

        def excess(velocity: FloatArray) -> FloatArray:
            return self.power.power(coefficients, velocity) + self._reserved(velocity)

        def relative(velocity: FloatArray) -> FloatArray:
            return excess(velocity) / size(velocity, self.box)

        found = np.vstack([worst_places(measure, self.box) for measure in (excess, relative)])
        coarse = np.round(found / np.where(self.box.extent > 0.0, self.box.extent, 1.0), 3)
        _, apart = np.unique(coarse, axis=0, return_index=True)
        return found[apart], float(np.abs(relative(spread(self.box))).max())

    def _planes(self, velocity: FloatArray, scale: FloatArray) -> Inequalities:
        length = size(velocity, self.box)
        rows = self.power.rows(velocity) / scale / length[:, None]
        return Inequalities(rows, -self._reserved(velocity) / length)

    def _reserved(self, velocity: FloatArray) -> FloatArray:
        return np.asarray(np.sum((velocity @ self.reserve) * velocity, axis=1))


def _joined(planes: Inequalities, new: Inequalities, chosen: BoolArray) -> Inequalities:
    return Inequalities(
        np.vstack([planes.rows, new.rows[chosen]]), np.append(planes.bound, new.bound[chosen])
    )


def _near(root: FloatArray, point: FloatArray, before: FloatArray, after: FloatArray) -> bool:
    """Tell whether a step is worth a violation that hardly shows."""
    distance = float(np.linalg.norm(root @ (before - point)))
    least = _TOLERANCE * float(np.linalg.norm(root @ point))
    moved = float(np.linalg.norm(root @ (after - point)))
    return moved <= max(_WORTH * distance, least)


def _check(solved: Nearest, model: DampingModel) -> None:
    if solved.infeasible:
        raise MethodError(
            f"no coefficients of model '{model.key}' take as much power as `margin` asks for at "
            "every velocity of the operating box: lower `margin`, give a `box` that keeps "
            "further away from rest, or add a term of its own velocity (such as "
            f"{_own(model)}) to each axis."
        )


def _own(model: DampingModel) -> str:
    """Name a linear term that an axis lacks, else any."""
    own = [f"{axis}_{velocity}" for axis, velocity in zip(AXES, VELOCITIES, strict=True)]
    return next((label for label in own if label not in model.labels), own[0])
