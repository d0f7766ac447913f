"""The name of a coefficient: axis, underscore, term, such as ``Y_v|v|``; and its unit."""

from __future__ import annotations

from collections import Counter

from hydrodamp.basis.axes import AXES
from hydrodamp.basis.term import Term
from hydrodamp.errors import ModelError, TermError

_LINEAR = ("u", "v", "w", "U", "V", "V_v", "V_w")
_ANGULAR = ("p", "q", "r")


def spell_label(axis: str, term: Term) -> str:
    """Return the name of a coefficient."""
    return f"{axis}_{term}"


def read_label(label: str) -> tuple[str, Term]:
    """Return the axis and the term of a coefficient's name."""
    axis, underscore, spelling = label.partition("_")
    if axis not in AXES or not underscore:
        raise ModelError(
            f"`{label}` is not a coefficient: it must be an axis of {' '.join(AXES)}, an "
            "underscore and a term, such as 'Y_v|v|'."
        )
    try:
        return axis, Term.parse(spelling)
    except TermError as error:
        raise ModelError(f"`{label}` is not a coefficient: {error}") from error


def latex_label(axis: str, term: Term) -> str:
    r"""Return the name of a coefficient as LaTeX mathematics."""
    return f"{axis}_{{{term.latex()}}}"


def coefficient_unit(axis: str, term: Term) -> str:
    """Return the unit of a coefficient."""
    wrench = "N" if axis in "XYZ" else "N m"
    powers = Counter(filter(None, (_factor_unit(factor) for factor in term.factors)))
    parts = [unit if power == 1 else f"{unit}^{power}" for unit, power in powers.items()]
    if not parts:
        return wrench
    return f"{wrench}/{parts[0]}" if len(parts) == 1 else f"{wrench}/({' '.join(parts)})"


def _factor_unit(factor: str) -> str:
    name = factor.strip("|")
    if name in _LINEAR:
        return "(m/s)"
    if name in _ANGULAR:
        return "(rad/s)"
    return f"[{name}]" if name in Term((factor,)).commands else ""
