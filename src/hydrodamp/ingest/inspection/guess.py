"""A guessed role of a column, with its confidence and evidence."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Guess:
    """A guessed role of a column."""

    column: str
    role: str
    confidence: int
    unit: str | None = None
    sign: int = 1
    evidence: tuple[str, ...] = ()
    is_best: bool = True
    topic: str = ""
    is_pulse: bool = False  # a pulse width in microseconds
    offset: float = 0.0  # added before the sign
