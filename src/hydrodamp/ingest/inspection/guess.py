"""A guessed role of a column, with its confidence and evidence."""

from __future__ import annotations

from dataclasses import dataclass, replace

#: Confidence [%] if neither file nor motion states a unit.
UNCONFIRMED = 55


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

    def with_evidence(self, message: str) -> Guess:
        """Return a guess with one more piece of evidence."""
        return replace(self, evidence=(*self.evidence, message))

    def with_unit(self, unit: str | None, reason: str) -> Guess:
        """Return a guess with a unit that neither file nor name states."""
        if self.unit is not None or unit is None:
            return self
        return replace(self.with_evidence(f"{unit} {reason}"), unit=unit)

    def with_unconfirmed_unit(self, unit: str, reason: str) -> Guess:
        """Return a guess with a unit that nothing confirms."""
        return replace(self.with_unit(unit, reason), confidence=min(self.confidence, UNCONFIRMED))
