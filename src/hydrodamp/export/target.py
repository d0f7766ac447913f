"""Export targets: the terms a simulator represents, and the projection of a damping onto them.

For each axis, min |Ξ x - w|² over the coefficients x, with drag coefficients x <= 0 and the linear
terms together dissipative: νᵀ (D + Dᵀ) ν <= 0 for the matrix D of linear damping.
"""

from __future__ import annotations

import subprocess
from abc import abstractmethod
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, fields, replace
from importlib.util import find_spec
from pathlib import Path
from typing import ClassVar, NamedTuple

import numpy as np
from scipy.linalg import block_diag, svd
from scipy.optimize import lsq_linear

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.basis.term import AXES, DOWN, VELOCITIES, VELOCITY_OF, Term
from hydrodamp.errors import ModelError, demand
from hydrodamp.export.plant import (
    ExportedPlant,
    States,
    check_body,
    point_transform,
    with_damping,
)
from hydrodamp.export.restoring import absorb_restoring
from hydrodamp.export.verification import Engine
from hydrodamp.files import save_all
from hydrodamp.identification.dissipative import project_dissipative
from hydrodamp.identification.dissipativity import OperatingBox, PowerRegressor
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel, read_label, spell_label

#: The files of an export by their paths in its folder.
Files = Mapping[str, str | bytes]

#: Atoms that change sign under reflection of all velocities but u, and that velocity.
SIGN_ATOMS = {**dict(zip("vwpqr", "vwpqr", strict=True)), "V_v": "v", "V_w": "w"}


class NotRun(Exception):  # noqa: N818 - an outcome, caught where the card is made
    """Why the files could not be run here, as the rest of a sentence."""


class RunError(NotRun):
    """The installed compiler or interpreter failed on the files."""


def require_package(
    package: str, name: str = "", source: str = 'pip install "hydrodamp[export]"'
) -> None:
    """Raise NotRun with its source if a package is not installed."""
    if find_spec(package) is None:
        raise NotRun(f"{name or package} is not installed ({source})")


@dataclass(frozen=True)
class Target:
    """A program that exported files are written for.

    A frozen dataclass whose fields are the settings of the target: ``dataclasses.replace`` changes
    them. A target of your own defines ``key``, ``description``, ``render_files`` and
    ``open_engine``; pass an instance to :func:`export`. If it cannot represent every term, it also
    defines ``representable_model``.

    Examples
    --------
    >>> from dataclasses import replace
    >>> from hydrodamp.export.export import find_target
    >>> replace(find_target("c"), precision="float")
    C(precision='float')
    """

    key: ClassVar[str]
    description: ClassVar[str]
    """Program and version."""
    completes_planar: ClassVar[bool] = False
    """Whether a vehicle known on X, Y and N gets assumed values on the other axes."""

    @property
    def omitted_effects(self) -> str:
        """Effects of equation 1 that no file of the target has; empty if none."""
        return ""

    def omissions_of(self, plant: ExportedPlant) -> str:
        """Return the effects that no file of a plant has: by default those of all plants."""
        return self.omitted_effects

    def representable_model(self, plant: ExportedPlant) -> DampingModel:
        """Return the damping model that the target can represent: by default all terms."""
        return plant.damping.model

    def reference_point(self, plant: ExportedPlant) -> FloatArray:
        """Return the reference point of its coefficients, from the vehicle's origin (3,) [m]."""
        return np.zeros(3)

    def unrepresented_effects(self, plant: ExportedPlant) -> tuple[str, ...]:
        """Return the labels of coefficients that the target cannot represent unchanged."""
        model, moved = self.representable_model(plant), self.reference_point(plant).any()
        return tuple(
            label
            for label in plant.damping.model.labels
            if label not in model.labels or (moved and not read_label(label)[1].commands)
        )

    def project_plant(self, plant: ExportedPlant, at: States) -> ExportedPlant:
        """Return the plant in the terms of the target, fitted at states, about its point."""
        if not self.unrepresented_effects(plant):
            return plant
        model, point = self.representable_model(plant), self.reference_point(plant)
        return project_damping(plant, model, at, point)

    @abstractmethod
    def render_files(self, plant: ExportedPlant) -> Files:
        """Return the files of a plant that :meth:`project_plant` returned."""

    @abstractmethod
    def open_engine(self, folder: Path, plant: ExportedPlant) -> AbstractContextManager[Engine]:
        """Read the files back and return the engine that runs them; raise NotRun without one."""


@dataclass(frozen=True)
class HydrodynamicTarget(Target):
    """A target with a submerged rigid body and terms of velocities; its input is a wrench."""

    other_omissions: ClassVar[str] = ""
    """Effects that it omits besides the actuators."""
    density: float = 1000.0

    def __post_init__(self) -> None:
        """Refuse settings that are not positive."""
        for setting in fields(self):
            value = getattr(self, setting.name)
            if isinstance(value, float):
                demand(0.0 < value < np.inf, setting.name, "positive", f"{value:g}.")

    @property
    def omitted_effects(self) -> str:
        """The actuators, and what else."""
        return "the actuators (its input is a wrench)" + self.other_omissions

    def allowed_terms(self, axis: str) -> Iterable[Term]:
        """Return the terms that it has on an axis."""
        return drag_terms(axis)

    def project_plant(self, plant: ExportedPlant, at: States) -> ExportedPlant:
        """Return the plant in the terms of the target, those of attitude as buoyancy."""
        return super().project_plant(absorb_restoring(plant, at.down), at)

    def representable_model(self, plant: ExportedPlant) -> DampingModel:
        """Return the terms of the plant that it has, and those that replace others."""
        check_body(plant, self.key)
        return select_terms(plant, self.key, self.allowed_terms)


def program_version(command: str) -> str:
    """Return the first line that a program prints for ``--version``."""
    call = [command, "--version"]
    process = subprocess.run(call, capture_output=True, text=True, check=True)
    return process.stdout.splitlines()[0]


def save_files(files: Files, folder: Path) -> dict[str, bytes]:
    """Write the files of an export into a folder, and return them as bytes."""
    contents = {
        path: content.encode("utf-8") if isinstance(content, str) else content
        for path, content in files.items()
    }
    save_all({folder / path: content for path, content in contents.items()})
    return contents


def select_terms(
    plant: ExportedPlant, key: str, allowed_terms: Callable[[str], Iterable[Term]]
) -> DampingModel:
    """Return the terms of a plant that a target allows on each axis.

    An unrepresented term is replaced by allowed terms of the same velocities and symmetry. Terms of
    commands remain: they are inputs, as actuators are.
    """
    model = plant.damping.model
    of_attitude = {term for term in model.basis if term.needs_attitude}
    if labels := sorted(str(term) for term in of_attitude if str(term) not in DOWN):
        raise ModelError(
            f"'{key}' has no products with the attitude such as {', '.join(labels)}: identify a "
            "model without."
        )
    rows = []
    for axis, terms in zip(AXES, model.terms, strict=True):
        row = tuple(term for term in terms if term not in of_attitude)
        candidates = (*allowed_terms(axis), *(term for term in row if term.commands))
        unrepresented = [term for term in row if term not in candidates]
        velocity = VELOCITY_OF[axis]
        velocities = {velocity, *(name for term in unrepresented for name in term.velocities)}
        symmetries = [_odd_velocities(term) for term in unrepresented]
        rows.append(
            tuple(
                term
                for term in candidates
                if term in row
                or (
                    _odd_velocities(term) in symmetries
                    and velocities.issuperset(term.velocities)
                    and term.factors != (velocity, velocity)  # injects energy in one direction
                )
            )
        )
    return replace(model, terms=tuple(rows))


def _odd_velocities(term: Term) -> set[str]:
    """Return the velocities other than u in which a term is odd."""
    names = [SIGN_ATOMS[factor] for factor in term.factors if factor in SIGN_ATOMS]
    return {name for name in names if names.count(name) % 2}


#: Directions of smaller singular values (relative to the greatest) are regularised to zero: the
#: samples do not determine them, and elsewhere they would make the motion diverge.
MIN_SINGULAR_RATIO = 1e-2

#: Labels of linear terms, (6, 6).
LINEAR = [[spell_label(axis, Term((name,))) for name in VELOCITIES] for axis in AXES]

POWER_ROUNDING = 1e-12  # of the sum of absolute powers
MAX_BISECTIONS = 40  # of the factor of linear couplings


def drag_terms(axis: str) -> tuple[Term, ...]:
    """Return linear and quadratic drag of an axis by its own velocity."""
    name = VELOCITY_OF[axis]
    return Term((name,)), Term((name, f"|{name}|"))


def project_damping(
    plant: ExportedPlant, model: DampingModel, at: States, point: FloatArray
) -> ExportedPlant:
    """Return a plant whose damping has the terms of a model, about a point of the body.

    Common terms keep their coefficients if the point is the origin. The wrench of the other terms
    is fitted at the states by axis, independently: a joint fit would couple the axes by the mass
    matrix. The linear terms inject no more power than those of the plant.
    """
    terms = tuple(tuple(term for term in row if not term.commands) for row in model.terms)
    free = replace(model, terms=terms)
    initial = plant.damping.onto(free) * (not point.any())
    transform = point_transform(point)
    regressor = free.basis.evaluate(at.velocity @ transform.T, down=at.down)
    wrench = plant.damping_wrench(at) @ np.linalg.inv(transform)
    scale = np.linalg.norm(wrench, axis=0)
    scale[scale == 0.0] = scale.max() or 1.0  # of an axis without damping
    residual = (wrench - regressor @ free.unpack(initial).T) / scale
    orthogonal, triangle = np.linalg.qr(regressor)
    targets, stops = orthogonal.T @ residual, np.cumsum([len(row) for row in free.terms])
    axes = []
    for axis, (row, stop) in enumerate(zip(free.terms, stops.tolist(), strict=True)):
        is_drag = np.array([term in drag_terms(AXES[axis]) for term in row], dtype=bool)
        drag = np.maximum(-initial[stop - len(row) : stop], 0.0)
        columns = triangle[:, [free.basis.index(term) for term in row]]
        upper = np.where(is_drag, drag, np.inf)
        axes.append(_AxisProblem.regularise(columns / scale[axis], targets[:, axis], upper))
    change = np.concatenate([axis.solve() for axis in axes])
    extent, matrix = plant.box.max_abs, _linear_matrix(plant.damping)
    power = _max_power(matrix, extent)
    limit = max(power, 0.0) + POWER_ROUNDING * float(extent @ np.abs(matrix) @ extent)
    if _max_power(_linear_matrix(Damping(free, initial + change)), extent) > limit:
        if power <= limit:
            change = _constrain_power(free, axes, initial, change, plant.box)
        change = _limit_couplings(free, initial, change, limit, extent)
    fitted = dict(zip(free.labels, (initial + change).tolist(), strict=True))
    return with_damping(plant, model, plant.damping.as_dict() | fitted)


class _AxisProblem(NamedTuple):
    """Least squares of an axis: min |matrix x - target|, x <= upper."""

    matrix: FloatArray
    target: FloatArray
    upper: FloatArray

    @classmethod
    def regularise(cls, columns: FloatArray, target: FloatArray, upper: FloatArray) -> _AxisProblem:
        """Return the problem of columns (n, m) with small singular values raised to the minimum."""
        unit = np.linalg.norm(columns, axis=0)
        unit[unit == 0.0] = 1.0
        u, singular, vh = svd(columns / unit, full_matrices=False)
        minimum = MIN_SINGULAR_RATIO * singular.max(initial=0.0) or 1.0
        is_small = singular < minimum
        weight = np.where(is_small, minimum, singular)
        projected = np.where(is_small, 0.0, u.T @ target)
        return cls(weight[:, None] * vh * unit, projected, upper)

    def solve(self, free: BoolArray | None = None, start: FloatArray | None = None) -> FloatArray:
        """Return the solution; if given, only ``free`` entries of ``start`` change."""
        x = np.zeros(len(self.upper)) if start is None else start.copy()
        free = np.ones(len(x), dtype=bool) if free is None else free
        if free.any():
            target = self.target - self.matrix[:, ~free] @ x[~free]
            matrix, unit = self.matrix[:, free], np.linalg.norm(self.matrix[:, free], axis=0)
            bounds = -np.inf, self.upper[free] * unit
            solution = lsq_linear(matrix / unit, target, bounds, method="bvls").x / unit
            x[free] = np.minimum(solution, self.upper[free])  # scaling rounds
        return x


def _constrain_power(
    model: DampingModel,
    axes: list[_AxisProblem],
    initial: FloatArray,
    change: FloatArray,
    box: OperatingBox,
) -> FloatArray:
    """Return the change nearest to the fit whose linear terms together dissipate."""
    is_linear = np.array([_is_linear(term) for _, term in _labelled_terms(model)], dtype=bool)
    rows = tuple(tuple(filter(_is_linear, row)) for row in model.terms)
    splits = np.cumsum([len(row) for row in model.terms])[:-1]
    masks, roots = np.split(is_linear, splits), []
    for axis, mask in zip(axes, masks, strict=True):
        if mask.any():  # eliminate the other terms
            ordered = np.column_stack([axis.matrix[:, ~mask], axis.matrix[:, mask]])
            n = int(mask.sum())
            roots.append(np.linalg.qr(ordered)[1][-n:, -n:])
    symmetric_box = OperatingBox(-box.max_abs, box.max_abs)
    power = PowerRegressor(replace(model, terms=rows))
    linear, _ = project_dissipative(
        power, symmetric_box, block_diag(*roots), (initial + change)[is_linear]
    )
    constrained = change.copy()
    constrained[is_linear] = linear - initial[is_linear]
    starts = zip(axes, masks, np.split(constrained, splits), strict=True)
    return np.concatenate([axis.solve(~mask, start) for axis, mask, start in starts])


def _limit_couplings(
    model: DampingModel, initial: FloatArray, change: FloatArray, limit: float, extent: FloatArray
) -> FloatArray:
    """Return a change with linear couplings scaled until they inject no more power than a limit.

    Near rest linear terms dominate: their greatest power is the greatest eigenvalue of the
    symmetric part of their matrix, in units of the box.
    """
    is_coupling = [_is_coupling(axis, term) for axis, term in _labelled_terms(model)]

    def scale_couplings(factor: float) -> FloatArray:
        return np.where(is_coupling, factor * change, change)

    def exceeds_limit(factor: float) -> bool:
        matrix = _linear_matrix(Damping(model, initial + scale_couplings(factor)))
        return _max_power(matrix, extent) > limit

    low, high = 0.0, 1.0
    if not exceeds_limit(high):
        return change
    for _ in range(MAX_BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if exceeds_limit(middle) else (middle, high)
    return scale_couplings(low)


def _labelled_terms(model: DampingModel) -> list[tuple[str, Term]]:
    return [(axis, term) for axis, row in zip(AXES, model.terms, strict=True) for term in row]


def _is_linear(term: Term) -> bool:
    return len(term.factors) == 1 and term.factors[0] in VELOCITIES


def _is_coupling(axis: str, term: Term) -> bool:
    return _is_linear(term) and term not in drag_terms(axis)


def _linear_matrix(damping: Damping) -> FloatArray:
    """Return the matrix of linear damping, shape (6, 6)."""
    values = damping.as_dict()
    return np.array([[values.get(label, 0.0) for label in row] for row in LINEAR])


def _max_power(matrix: FloatArray, extent: FloatArray) -> float:
    """Return the greatest power of linear damping at velocities of a box's size."""
    scaled = extent[:, None] * (matrix + matrix.T) * extent / 2.0
    return float(np.linalg.eigvalsh(scaled)[-1])
