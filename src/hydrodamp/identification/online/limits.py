"""Bounds that an online method keeps its coefficients in, element by element."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES, VELOCITY_OF
from hydrodamp.errors import MethodError
from hydrodamp.models.model import DampingModel


class Limits(Protocol):
    """Bounds of a model's coefficients: a value with one verb."""

    def of(self, model: DampingModel) -> tuple[FloatArray, FloatArray]:
        """Return lower and upper bounds in the order of the model's labels."""
        ...


@dataclass(frozen=True)
class OwnDrag:
    """No coefficient of an axis's own drag, linear or quadratic, drives it.

    That is ``X_u ≤ 0``, ``X_u|u| ≤ 0`` and so on: a part of what dissipation asks for
    that costs nothing to keep at every step.

    Examples
    --------
    >>> model = DampingModel.from_table({"Y": "v v|v| r"}, key="mine")
    >>> dict(zip(model.labels, OwnDrag().of(model)[1].tolist(), strict=True))
    {'Y_v': 0.0, 'Y_r': inf, 'Y_v|v|': 0.0}
    """

    def of(self, model: DampingModel) -> tuple[FloatArray, FloatArray]:
        """Return lower and upper bounds.

        Parameters
        ----------
        model : DampingModel
            Which terms.

        Returns
        -------
        lower, upper : ndarray, shape (n_coefficients,)
            Infinite where there is no bound.
        """
        upper = np.array([0.0 if _drags(label) else np.inf for label in model.labels])
        return np.full(len(upper), -np.inf), upper


@dataclass(frozen=True)
class Within:
    """Bounds by label.

    Parameters
    ----------
    bounds : tuple of (str, float, float)
        Label, lower and upper bound.

    Raises
    ------
    MethodError
        If a lower bound exceeds its upper one.

    Examples
    --------
    >>> model = DampingModel.from_table({"Y": "v r"}, key="mine")
    >>> Within((("Y_v", -200.0, 0.0),)).of(model)[0]
    array([-200.,  -inf])
    """

    bounds: tuple[tuple[str, float, float], ...]

    def __post_init__(self) -> None:
        """Refuse bounds that exclude each other."""
        for label, low, high in self.bounds:
            if not low <= high:
                raise MethodError(
                    f"bounds of {label} must not exclude each other; got {low}, {high}"
                )

    def of(self, model: DampingModel) -> tuple[FloatArray, FloatArray]:
        """Return lower and upper bounds.

        Parameters
        ----------
        model : DampingModel
            Which terms; labels it has not are left aside.

        Returns
        -------
        lower, upper : ndarray, shape (n_coefficients,)
            Infinite where there is no bound.
        """
        low = {label: bound for label, bound, _ in self.bounds}
        high = {label: bound for label, _, bound in self.bounds}
        return _listed(model, low, -np.inf), _listed(model, high, np.inf)


def _listed(model: DampingModel, bounds: dict[str, float], default: float) -> FloatArray:
    return np.array([bounds.get(label, default) for label in model.labels])


def _drags(label: str) -> bool:
    return label in set(_own_drag())


def _own_drag() -> Iterable[str]:
    for axis in AXES:
        name = VELOCITY_OF[axis]
        yield from (f"{axis}_{name}", f"{axis}_{name}|{name}|")
