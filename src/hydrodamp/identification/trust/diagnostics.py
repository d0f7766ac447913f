"""What the residuals of a regression say: white or not, far out, tied to the regressors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES
from hydrodamp.errors import MethodError
from hydrodamp.identification.rows.equations import Rows
from hydrodamp.identification.rows.rank import spanned
from hydrodamp.identification.rows.support import chosen_support
from hydrodamp.identification.rows.weak_equations import WeakEquations
from hydrodamp.identification.trust.residuals import FAR, Whiteness, outlier_share, whiteness
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

#: Probability below which a test on six axes is worth a sentence.
REJECTED = 0.01

#: Share of outliers worth a sentence: more than 100 times that of normal residuals.
MANY = 0.01


@dataclass(frozen=True)
class AxisDiagnostics:
    """What the residuals of one axis say."""

    axis: str
    rms: float
    whiteness: Whiteness
    outliers: float

    @property
    def coloured(self) -> bool:
        """Whether the residuals are correlated in time."""
        return self.whiteness.p is not None and self.whiteness.p < REJECTED

    @property
    def spiked(self) -> bool:
        """Whether there are more outliers than normal residuals have."""
        return self.outliers > MANY

    def __str__(self) -> str:
        """Return a line for the table."""
        white = self.whiteness
        return (
            f"{self.axis:<5}{self.rms:>10.3g}{_cell(white.p):>9}{white.neighbours:>8.2f}"
            f"{white.time:>8.2g} s{100.0 * self.outliers:>9.2f} %"
        )


@dataclass(frozen=True)
class Diagnostics:
    """What the residuals of a model say, axis by axis.

    Attributes
    ----------
    model : str
        Key of the model.
    axes : tuple of AxisDiagnostics
        Those on which the model has terms.
    spacing : float
        Length of the test functions, which follow each other without overlap [s].
    """

    model: str
    axes: tuple[AxisDiagnostics, ...]
    spacing: float

    @property
    def remarks(self) -> tuple[str, ...]:
        """What to know and to do, a sentence a kind of trouble."""
        said = (_colour(self.axes), _spikes(self.axes))
        return tuple(sentence for sentence in said if sentence)

    def as_dict(self) -> dict[str, Any]:
        """Return everything as numbers, words and lists, ready for strict JSON."""
        return {**asdict(self), "remarks": list(self.remarks)}

    def __str__(self) -> str:
        """Return a table of the axes, then the sentences."""
        head = f"{'axis':<5}{'rms':>10}{'white p':>9}{'lag 1':>8}{'time':>10}"
        head += f"{'outliers':>11}"
        title = f"{self.model}: residuals under test functions of {self.spacing:.3g} s"
        return "\n".join([title, head, *map(str, self.axes), *self.remarks])


def diagnose(
    problem: Problem,
    model: DampingModel,
    damping: Damping | None = None,
    *,
    support: float | None = None,
) -> Diagnostics:
    """Examine what a model leaves of a log.

    Residuals are those of the weak form under test functions that follow each other and
    share no sample, so that no correlation is of their making.

    Parameters
    ----------
    problem : Problem
        Vehicle and log.
    model : DampingModel
        Which terms.
    damping : Damping, optional
        Whose residuals to examine; by default those of least squares on the same rows.
    support : float, optional
        Length of the test functions [s]; by default as :class:`WeakEquations` chooses it.

    Returns
    -------
    diagnostics : Diagnostics
        Axis by axis, with sentences.

    Raises
    ------
    MethodError
        If the damping lacks a coefficient.

    Examples
    --------
    >>> from hydrodamp.models.catalog import catalog
    >>> from hydrodamp.simulation.campaign.reenact import reenact
    >>> from hydrodamp.simulation.problem import prepare
    >>> campaign, fossen = reenact(duration=60.0), catalog["fossen"]
    >>> found = diagnose(prepare(campaign.vehicle, campaign.train, fossen), fossen)
    >>> [one.axis for one in found.axes]
    ['X', 'Y', 'Z', 'K', 'M', 'N']
    """
    free = model.restricted_to(problem.vehicle.axes)
    length = chosen_support(problem).length if support is None else support
    rows = WeakEquations(length, overlap=1, windows=()).rows(problem)
    axes = tuple(
        _axis(rows, free, axis, _known(damping, free), length)
        for axis in range(6)
        if free.terms[axis]
    )
    return Diagnostics(free.key, axes, length)


def _known(damping: Damping | None, model: DampingModel) -> dict[str, float] | None:
    if damping is None:
        return None
    values = damping.as_dict()
    if missing := [label for label in model.labels if label not in values]:
        raise MethodError(f"the damping has no coefficient {', '.join(missing)} of '{model.key}'")
    return values


def _axis(
    rows: Rows,
    model: DampingModel,
    axis: int,
    values: dict[str, float] | None,
    length: float,
) -> AxisDiagnostics:
    own = model.terms[axis]
    design = rows.design[:, [rows.basis.index(term) for term in own]]
    left = rows.target[:, axis] - _explained(design, rows.target[:, axis], values, axis, own)
    return AxisDiagnostics(
        axis=AXES[axis],
        rms=float(np.sqrt(np.mean(left**2))),
        whiteness=whiteness(left, rows.segment, length),
        outliers=outlier_share(left),
    )


def _explained(
    design: FloatArray,
    target: FloatArray,
    values: dict[str, float] | None,
    axis: int,
    terms: tuple[object, ...],
) -> FloatArray:
    if values is not None:
        found: FloatArray = design @ [values[f"{AXES[axis]}_{term}"] for term in terms]
        return found
    directions = spanned(design, terms).directions
    explained: FloatArray = directions @ (directions.T @ target)
    return explained


def _colour(axes: Sequence[AxisDiagnostics]) -> str:
    where = [
        f"{one.axis} (over {one.whiteness.time:.2g} s, neighbours {one.whiteness.neighbours:.2f})"
        for one in axes
        if one.coloured
    ]
    if not where:
        return ""
    return (
        f"Residuals are correlated in time on {', '.join(where)} (Ljung-Box, p < {REJECTED:g}): "
        "intervals for white residuals would be wrong."
    )


def _spikes(axes: Sequence[AxisDiagnostics]) -> str:
    where = [f"{one.axis} ({100.0 * one.outliers:.1f} %)" for one in axes if one.spiked]
    if not where:
        return ""
    return (
        f"Many residuals are beyond {FAR:g} robust standard deviations on {', '.join(where)}: look "
        "at the log there and remove its spikes."
    )


def _cell(p: float | None) -> str:
    return "–" if p is None else f"{p:.3f}"
