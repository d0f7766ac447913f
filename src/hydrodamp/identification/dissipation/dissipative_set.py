"""The coefficients whose damping takes power everywhere on a box, and the way there."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.errors import MethodError
from hydrodamp.identification.dissipation.certificate import Corners, corners_of
from hydrodamp.identification.dissipation.cutting_planes import ROUNDS, Planes
from hydrodamp.identification.dissipation.operating_box import OperatingBox
from hydrodamp.identification.dissipation.power import PowerRows
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel

_SIZE = 100.0
"""Size of the greatest scaled coefficient in a program; the solver's tolerances suit it."""


@dataclass(frozen=True, eq=False)
class Dissipating:
    """Coefficients that dissipate, and how that is known."""

    coefficients: FloatArray
    n_corners: int = 0
    bound: float = np.inf
    rounds: int = 0
    done: bool = True

    @property
    def certified(self) -> bool:
        """Whether it is proven."""
        return self.n_corners > 0


@dataclass(frozen=True, eq=False)
class DissipativeSet:
    """All coefficients of a model with ``ν·τ(ν) ≤ −νᵀ reserve ν`` on a box."""

    model: DampingModel
    box: OperatingBox
    reserve: FloatArray = field(default_factory=lambda: np.zeros((6, 6)))
    certify: bool = True

    @cached_property
    def power(self) -> PowerRows:
        """The power of the damping terms."""
        return PowerRows(self.model)

    @cached_property
    def searched(self) -> OperatingBox:
        """The box, with zero for velocities that no power and no reserve depends on."""
        needed = self.reserve.any(axis=0) | self.power.velocities
        return OperatingBox(self.box.low * needed, self.box.high * needed)

    @cached_property
    def corners(self) -> Corners | None:
        """The matrix inequalities of a proof; None where there can be none."""
        return corners_of(self.model, self.box, self.reserve) if self.certify else None

    def nearest(
        self, coefficients: npt.ArrayLike, root: npt.ArrayLike, rounds: int = ROUNDS
    ) -> Dissipating:
        """Return the coefficients of the set that are nearest to some."""
        wished = np.asarray(coefficients, dtype=np.float64)
        if not self.power.counted.any():
            return Dissipating(wished)
        measure = np.linalg.qr(np.asarray(root, dtype=np.float64), mode="r")
        scale = np.linalg.norm(measure, axis=0)
        unit = float(np.abs(scale * wished).max()) / _SIZE or 1.0
        measure, point, scale = measure / scale, scale * wished / unit, scale / unit
        if self.corners is not None:
            proven = self.corners.nearest(measure, point, scale)
            if proven is not None:
                return Dissipating(proven.coefficients, proven.n_corners, proven.bound)
        cut = Planes(self.power, self.searched, self.reserve).nearest(measure, point, scale, rounds)
        return Dissipating(cut.coefficients, rounds=cut.rounds, done=cut.done)


def project_dissipative(
    damping: Damping,
    box: OperatingBox,
    metric: npt.ArrayLike | None = None,
    reserve: npt.ArrayLike | None = None,
) -> Damping:
    """Return the nearest damping that takes power everywhere on a box.

    Parameters
    ----------
    damping : Damping
        Coefficients, however they were found.
    box : OperatingBox
        Velocities at which it is to take power.
    metric : array_like, shape (n_coefficients, n_coefficients), optional
        Symmetric and positive definite: squared distance is ``δᵀ metric δ``. Such as the
        inverse of a covariance. By default each coefficient counts by the power of its
        term at the rim of the box.
    reserve : array_like, shape (6, 6), optional
        The power is to be at most ``−νᵀ reserve ν`` [W]; zero by default.

    Returns
    -------
    damping : Damping
        The same model and vehicle, no covariance.

    Raises
    ------
    MethodError
        If the metric is not positive definite, no coefficients dissipate so much, or
        the solver fails.

    Examples
    --------
    >>> damping = Damping.from_dict(None, {"X_u": -2.0, "Y_v": 1.0})
    >>> box = OperatingBox([-1, -1, 0, 0, 0, 0], [1, 1, 0, 0, 0, 0])
    >>> project_dissipative(damping, box).coefficients.round(6) + 0.0
    array([-2.,  0.])
    """
    held = np.zeros((6, 6)) if reserve is None else np.asarray(reserve, dtype=np.float64)
    wanted = DissipativeSet(damping.model, box, held)
    root = _by_power(wanted) if metric is None else _root(metric, damping.model)
    found = wanted.nearest(damping.coefficients, root)
    if not np.all(np.isfinite(found.coefficients)):
        raise MethodError(
            f"the solver found no dissipative coefficients of model '{damping.model.key}': the "
            "metric, the box and the coefficients must be of sane and similar sizes."
        )
    return replace(damping, coefficients=frozen(found.coefficients), covariance=None)


def _by_power(wanted: DissipativeSet) -> FloatArray:
    """Measure each coefficient by its power where the box is widest."""
    power = np.abs(wanted.power.rows(wanted.box.extent[None, :]))[0]
    return np.diag(np.where(power > 0.0, power, 1.0))


def _root(metric: npt.ArrayLike, model: DampingModel) -> FloatArray:
    shape = (model.n_coefficients, model.n_coefficients)
    try:
        root = np.linalg.cholesky(frozen(metric, shape, "metric")).T
        if not np.all(np.isfinite(root)):
            raise ValueError("it holds numbers that are not finite")
    except (ValueError, np.linalg.LinAlgError) as error:
        raise MethodError(
            f"`metric` must be a positive definite matrix of shape {shape}, one row a "
            f"coefficient: {error}."
        ) from error
    return np.asarray(root)
