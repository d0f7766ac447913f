"""The table form of a model: axes to terms, as it is typed in code and in files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from hydrodamp.basis.axes import AXES
from hydrodamp.basis.term import Term
from hydrodamp.errors import TermError

Table = Mapping[str, str | Iterable[str | Term]]
"""Axes, separated by blanks, to terms: one text separated by blanks, or a list."""

Rows = tuple[tuple[Term, ...], ...]
"""The terms of each of the six axes."""


def read_table(table: Table) -> tuple[Rows, list[str]]:
    """Return the six rows of a table and every fault found in it."""
    rows: dict[str, dict[Term, None]] = {axis: {} for axis in AXES}
    faults: list[str] = []
    for axes, spellings in table.items():
        terms = _read_terms(axes, spellings, faults)
        for axis in axes.split():
            if axis in rows:
                rows[axis].update(dict.fromkeys(terms))
            else:
                faults.append(f"`{axis}` is not an axis; the axes are {' '.join(AXES)}.")
    return tuple(tuple(row) for row in rows.values()), faults


def _read_terms(axes: str, spellings: str | Iterable[str | Term], faults: list[str]) -> list[Term]:
    found: list[Term] = []
    for spelling in spellings.split() if isinstance(spellings, str) else spellings:
        try:
            found.append(spelling if isinstance(spelling, Term) else Term.parse(spelling))
        except TermError as error:
            faults.append(f"At {axes}: {error}")
    return found
