"""Which row to take, said in words, which one came second, and the front."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np

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
    def rms_by_fold(self) -> tuple[float | None, ...]:
        """The error of each run or fold that was held out."""

    @property
    def converged(self) -> bool:
        """Whether there is an error, and it is that of a fit that has settled."""


Candidate = TypeVar("Candidate", bound=Ranked)
Candidate_co = TypeVar("Candidate_co", bound=Ranked, covariant=True)


@dataclass(frozen=True)
class Selection(Generic[Candidate]):
    """The row to take, and why.

    Attributes
    ----------
    row : Row
        The one of the fewest coefficients among those that are as good as the lowest error.
    runner_up : Row or None
        The lowest error, or the second where that is chosen; None where no other can be ranked.
    sentence : str
        What was chosen, why, and how far the second is behind.
    reservation : str
        What was left out of the choice; empty where nothing was.
    """

    row: Candidate
    runner_up: Candidate | None
    sentence: str
    caveat: str = ""

    def __str__(self) -> str:
        """Return the sentence and the reservation."""
        return f"{self.sentence} {self.caveat}".rstrip()


def select_row(rows: Iterable[Candidate], of: str = "") -> Selection[Candidate]:
    """Choose the row of the fewest coefficients among those as good as the lowest error.

    A row is as good where the runs or folds that were held out do not tell it from the lowest; the
    lower error, then the earlier row, goes first. What the replays are of can be said in words.
    """
    asked = list(rows)
    scored = [row for row in asked if row.rms is not None]
    if not scored:
        raise MethodError("no row has an RMS error: every replay diverged or nothing was fitted")
    candidates = [row for row in scored if row.converged] or scored
    ranked = sorted(candidates, key=lambda row: (rms_or_infinity(row), row.n_coefficients))
    equal = [row for row in ranked if _as_good(row, ranked[0])]
    row = min(equal, key=lambda row: row.n_coefficients)
    left = len(asked) - len(candidates)
    reservation = [] if row.converged else ["No fit has settled."]
    if left:
        reservation.append(f"Left out: {_replays(left)} that diverged, failed or did not settle.")
    return Selection(
        row=row,
        runner_up=next((other for other in ranked if other is not row), None),
        sentence=_simpler(row, ranked[0]) or _sentence(ranked, len(asked), of),
        caveat=" ".join(reservation),
    )


def _as_good(row: Ranked, lowest: Ranked) -> bool:
    """Compare the errors of two rows run by run: one standard error of the mean of log ratios.

    Runs differ in length and roughness far more than models do, so errors are paired, and taken as
    ratios: else the roughest run alone would decide. The rule of one standard error is that of
    Breiman et al., Classification and Regression Trees, 1984, section 3.4.3.
    """
    parts = np.array([row.rms_by_fold, lowest.rms_by_fold], dtype=float)
    if parts.shape[1] < 2 or not np.all(parts > 0.0):
        return rms_or_infinity(row) == rms_or_infinity(lowest)
    ratio = np.log(parts[0] / parts[1])
    return bool(ratio.mean() <= ratio.std(ddof=1) / np.sqrt(ratio.size))


def _simpler(row: Ranked, lowest: Ranked) -> str:
    """Say why a row of fewer coefficients is taken, empty where the lowest error is."""
    if row is lowest:
        return ""
    return (
        f"{_named(row)}: {row.n_coefficients} coefficients, and the {len(row.rms_by_fold)} parts "
        f"held out do not tell it from the lowest RMS error, that of {_named(lowest)} with "
        f"{lowest.n_coefficients}."
    )


def _sentence(ranked: Sequence[Ranked], asked: int, of: str) -> str:
    """Say which row is first, by what, and how far the second is behind."""
    named = [*map(_named, ranked[:2])]
    if asked == 1:
        return f"{named[0]}, which was compared with no other."
    behind = "there is no runner-up"
    if len(ranked) > 1:
        error, other = map(rms_or_infinity, ranked[:2])
        more = f", {100.0 * (other / error - 1.0):+.0f} %" if error else ""
        behind = f"runner-up {named[1]}{more}"
    return f"{named[0]}: lowest RMS error of {_replays(len(ranked))}{of}; {behind}."


class Table(Protocol[Candidate_co]):
    """Anything with rows that can be ranked: a comparison, a cross-validation."""

    @property
    def rows(self) -> tuple[Candidate_co, ...]:
        """Its rows."""


def pareto_front(table: Table[Candidate]) -> tuple[Candidate, ...]:
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
    >>> pareto_front(Comparison(()))
    ()
    """
    scored = [row for row in table.rows if row.rms is not None]
    chosen: list[Candidate] = []
    for row in sorted(scored, key=lambda row: (row.n_coefficients, rms_or_infinity(row))):
        if not chosen or rms_or_infinity(row) < rms_or_infinity(chosen[-1]):
            chosen.append(row)
    return tuple(chosen)


def rms_or_infinity(row: Ranked) -> float:
    """Return the error of a row, infinite where it has none."""
    return float("inf") if row.rms is None else row.rms


def _named(row: Ranked) -> str:
    return f"{row.model} by {row.method} ({rms_or_infinity(row):.3g})"


def _replays(count: int) -> str:
    return "1 replay" if count == 1 else f"{count} replays"
