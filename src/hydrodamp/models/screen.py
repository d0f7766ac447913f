"""How a model and a damping print themselves: readable, in one screen."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

from hydrodamp.basis.axes import AXES
from hydrodamp.basis.term import Term

if TYPE_CHECKING:
    from hydrodamp.models.damping import Damping
    from hydrodamp.models.model import DampingModel

WIDTH = 88


def group_axes(model: DampingModel) -> dict[tuple[Term, ...], list[str]]:
    """Return the axes that share the same terms, in order; the terms are the key."""
    groups: dict[tuple[Term, ...], list[str]] = {}
    for axis, row in zip(AXES, model.terms, strict=True):
        groups.setdefault(row, []).append(axis)
    return groups


def describe_model(model: DampingModel) -> str:
    """Return a model as text: its terms by axis, source and note."""
    lines = [f"{model.title} ({model.key}): {model.n_coefficients} coefficients"]
    for row, axes in group_axes(model).items():
        lines += _wrap(f"{' '.join(axes)}: {' '.join(map(str, row)) or 'no terms'}")
    return "\n".join([*lines, *_remarks(source=model.source, note=model.note)])


def describe_damping(damping: Damping) -> str:
    """Return a damping as text: its coefficients by axis, vehicle, source and note."""
    model = damping.model
    lines = [f"Damping, {model.title} ({model.key}): {model.n_coefficients} coefficients"]
    values = iter(damping.coefficients)
    for axis, row in zip(AXES, model.terms, strict=True):
        if row:
            numbers = (f"{next(values):.6g} {term}" for term in row)
            lines += _wrap(f"{axis}: " + ", ".join(numbers))
    vehicle = damping.vehicle.name if damping.vehicle else ""
    remarks = _remarks(vehicle=vehicle, source=damping.source, note=damping.note)
    return "\n".join([*lines, *remarks])


def _remarks(**remarks: str) -> list[str]:
    return [line for name, text in remarks.items() if text for line in _wrap(f"{name}: {text}")]


def _wrap(text: str) -> list[str]:
    return textwrap.wrap(
        text,
        WIDTH,
        initial_indent="  ",
        subsequent_indent="      ",
        break_long_words=False,
        break_on_hyphens=False,
    )
