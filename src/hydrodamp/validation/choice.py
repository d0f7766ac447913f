"""Which row to take, said in words, which one came second, and the front."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from hydrodamp.errors import MethodError


class Ranked(Protocol):
    """What a row must know of itself to be ranked."""

    @property
    def model(self) -> str:
        """Key of the model."""

    @property
    def method(self) -> str:
        """Key of the method."""

    @property
    def n_coefficients(self) -> int:
        """How many coefficients the model has."""

    @property
    def rms(self) -> float | None:
        """The error; None where there is none that can be trusted."""

    @property
    def settled(self) -> bool:
        """Whether there is an error, and it is that of a fit that has settled."""


Candidate = TypeVar("Candidate", bound=Ranked)
Candidate_co = TypeVar("Candidate_co", bound=Ranked, covariant=True)


@dataclass(frozen=True)
class Choice(Generic[Candidate]):
    """The row to take, and why.

    Attributes
    ----------
    row : Row
        The best one.
    runner_up : Row or None
        The second; None where no other can be ranked.
    sentence : str
        What was chosen, why, and how far the second is behind.
    reservation : str
        What was left out of the choice; empty where nothing was.
    """

    row: Candidate
    runner_up: Candidate | None
    sentence: str
    reservation: str = ""

    def __str__(self) -> str:
        """Return the sentence and the reservation."""
        return f"{self.sentence} {self.reservation}".rstrip()


def choose(rows: Iterable[Candidate], of: str = "") -> Choice[Candidate]:
    """Choose the row of the lowest error; ties go to fewer coefficients, then the earlier row.

    What the replays are of can be said in words.
    """
    asked = list(rows)
    scored = [row for row in asked if row.rms is not None]
    if not scored:
        raise MethodError("no row has an RMS error: every replay diverged or nothing was fitted")
    candidates = [row for row in scored if row.settled] or scored
    ranked = sorted(candidates, key=lambda row: (error_of(row), row.n_coefficients))
    left = len(asked) - len(candidates)
    reservation = [] if ranked[0].settled else ["No fit has settled."]
    if left:
        reservation.append(f"Left out: {_replays(left)} that diverged, failed or did not settle.")
    return Choice(
        row=ranked[0],
        runner_up=ranked[1] if len(ranked) > 1 else None,
        sentence=_sentence(ranked, len(asked), of),
        reservation=" ".join(reservation),
    )


def _sentence(ranked: Sequence[Ranked], asked: int, of: str) -> str:
    """Say which row is first, by what, and how far the second is behind."""
    named = [f"{row.model} by {row.method} ({error_of(row):.3g})" for row in ranked[:2]]
    if asked == 1:
        return f"{named[0]}, which was compared with no other."
    behind = "there is no runner-up"
    if len(ranked) > 1:
        error, other = map(error_of, ranked[:2])
        more = f", {100.0 * (other / error - 1.0):+.0f} %" if error else ""
        behind = f"runner-up {named[1]}{more}"
    return f"{named[0]}: lowest RMS error of {_replays(len(ranked))}{of}; {behind}."


class Table(Protocol[Candidate_co]):
    """Anything with rows that can be ranked: a comparison, a cross-validation."""

    @property
    def rows(self) -> tuple[Candidate_co, ...]:
        """Its rows."""


def front(table: Table[Candidate]) -> tuple[Candidate, ...]:
    """Return the rows that no other row beats in both error and complexity.

    Parameters
    ----------
    table : Comparison or CrossValidation
        Rows without an RMS error are left out: one that diverged beats nothing.

    Returns
    -------
    rows : tuple of Row
        From the fewest coefficients to the lowest error; each has more coefficients
        and a lower error than the one before. Of equal rows the first one is there.

    Examples
    --------
    >>> from hydrodamp.validation.compare import Comparison
    >>> front(Comparison(()))
    ()
    """
    scored = [row for row in table.rows if row.rms is not None]
    chosen: list[Candidate] = []
    for row in sorted(scored, key=lambda row: (row.n_coefficients, error_of(row))):
        if not chosen or error_of(row) < error_of(chosen[-1]):
            chosen.append(row)
    return tuple(chosen)


def error_of(row: Ranked) -> float:
    """Return the error of a row, infinite where it has none."""
    return float("inf") if row.rms is None else row.rms


def _replays(count: int) -> str:
    return "1 replay" if count == 1 else f"{count} replays"
