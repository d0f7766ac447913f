"""What tells rows apart in every picture: the colour of a method, the dashes of a model."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from typing import Literal, NamedTuple

Linestyle = Literal["-"] | tuple[float, tuple[float, ...]]
"""How matplotlib takes the dashes of a line."""

SAMPLE = 4.0
"""Length of a line in a legend where dashes are to be seen [letters]."""

_DASHES: tuple[tuple[float, ...], ...] = (
    (),
    (5.0, 2.0),
    (1.2, 1.6),
    (6.0, 1.6, 1.2, 1.6),
    (11.0, 2.5),
    (6.0, 1.6, 1.2, 1.6, 1.2, 1.6),
    (10.0, 2.0, 3.0, 2.0),
    (2.6, 1.2, 2.6, 4.5),
    (1.2, 4.0),
    (1.2, 1.4, 1.2, 5.0),
)
"""Lengths on and off of each model, in widths of the line; solid for the first."""

_METHODS = {
    "recommended": ("#D55E00", "o"),
    "ls": ("#0072B2", "s"),
    "ai": ("#E69F00", "^"),
    "ai-scaled": ("#CC79A7", "v"),
    "oe": ("#009E73", "D"),
    "weak": ("#56B4E9", "P"),
    "ridge": ("#999933", "<"),
    "dissipative": ("#882255", ">"),
    "rls": ("#8C510A", "8"),
}
"""Colour and marker of each method of the command line."""

_OTHERS = (("#CC6677", "*"), ("#5E4FA2", "1"), ("#B8860B", "2"), ("#4D4D4D", "3"))
"""Of methods under any other key."""


class Look(NamedTuple):
    """How a row is drawn."""

    colour: str
    marker: str
    dashes: tuple[float, ...]

    @property
    def linestyle(self) -> Linestyle:
        """The dashes as matplotlib takes them, which scales them by the width of the line."""
        return (0.0, self.dashes) if self.dashes else "-"


def looks_of(rows: Sequence[tuple[str, str]], models: Sequence[str] = ()) -> list[Look]:
    """Return how the rows of a picture are drawn."""
    order = list(dict.fromkeys((*models, *(model for model, _ in rows))))
    dashes = {model: _DASHES[place % len(_DASHES)] for place, model in enumerate(order)}
    return [Look(*_method_look(method), dashes[model]) for model, method in rows]


def colour_of(method: str) -> str:
    """Return the colour of a method, the same in every figure and in the report.

    Parameters
    ----------
    method : str
        Its key; any other word has a colour too, always the same.

    Returns
    -------
    colour : str
        As ``#rrggbb``, to stand on white.

    Examples
    --------
    >>> colour_of("ls"), colour_of("mine") == colour_of("mine")
    ('#0072B2', True)
    """
    return _method_look(method)[0]


def mark_of(method: str) -> str:
    """Return the marker of a method, as matplotlib spells it."""
    return _method_look(method)[1]


def _method_look(method: str) -> tuple[str, str]:
    """Return colour and marker; the check sum of an unknown key chooses among the others."""
    if method in _METHODS:
        return _METHODS[method]
    return _OTHERS[zlib.crc32(method.encode()) % len(_OTHERS)]
