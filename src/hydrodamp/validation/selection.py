"""Model selection by the one-standard-error rule (Breiman et al., 1984), and the Pareto front."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np

from hydrodamp.errors import MethodError


class Ranked(Protocol):
    """Protocol of rows that can be ranked."""

    @property
    def model(self) -> str:
        """Key of the model."""

    @property
    def method(self) -> str:
        """Key of the method."""

    @property
    def n_coefficients(self) -> int:
        """Number of coefficients of the model."""

    @property
    def rms(self) -> float | None:
        """The RMS error; None where there is none."""

    @property
    def rms_by_fold(self) -> tuple[float | None, ...]:
        """The RMS error of each held-out segment or fold."""

    @property
    def converged(self) -> bool:
        """Whether there is an RMS error, and the fit has converged."""


Candidate = TypeVar("Candidate", bound=Ranked)
Candidate_co = TypeVar("Candidate_co", bound=Ranked, covariant=True)


@dataclass(frozen=True)
class Selection(Generic[Candidate]):
    """The selected row, with the reason.

    Attributes
    ----------
    row : Row
        That of fewest coefficients among those within one standard error of the lowest error.
    runner_up : Row or None
        The lowest error, or the second where the lowest is selected; None for a single row.
    sentence : str
        The selected row, the reason, and the margin to the runner-up.
    caveat : str
        Rows that were excluded; empty for none.
    """

    row: Candidate
    runner_up: Candidate | None
    sentence: str
    caveat: str = ""

    def __str__(self) -> str:
        """Return the sentence and the caveat."""
        return f"{self.sentence} {self.caveat}".rstrip()


def select_row(rows: Iterable[Candidate], of: str = "") -> Selection[Candidate]:
    """Select the row of fewest coefficients within one standard error of the lowest error.

    Ties go to the lower error, then to the earlier row. ``of`` describes the replays in the
    sentence.
    """
    requested = list(rows)
    scored = [row for row in requested if row.rms is not None]
    if not scored:
        raise MethodError("no row has an RMS error: every replay diverged or nothing was fitted")
    candidates = [row for row in scored if row.converged] or scored
    ranked = sorted(candidates, key=lambda row: (rms_or_infinity(row), row.n_coefficients))
    equivalent = [row for row in ranked if _is_equivalent(row, ranked[0])]
    row = min(equivalent, key=lambda row: row.n_coefficients)
    n_excluded = len(requested) - len(candidates)
    caveats = [] if row.converged else ["No fit has converged."]
    if n_excluded:
        caveats.append(
            f"Excluded: {_replays(n_excluded)} that diverged, failed or did not converge."
        )
    return Selection(
        row=row,
        runner_up=next((each for each in ranked if each is not row), None),
        sentence=_simpler(row, ranked[0]) or _sentence(ranked, len(requested), of),
        caveat=" ".join(caveats),
    )


def _is_equivalent(row: Ranked, lowest: Ranked) -> bool:
    """Whether the mean log ratio of the errors is within its standard error, paired by segment.

    Segments differ in length and amplitude far more than models do, so errors are paired and taken
    as ratios: else the largest amplitude would decide. The rule is that of Breiman et al.,
    Classification and Regression Trees, 1984, section 3.4.3.
    """
    errors = np.array([row.rms_by_fold, lowest.rms_by_fold], dtype=float)
    if errors.shape[1] < 2 or not np.all(errors > 0.0):
        return rms_or_infinity(row) == rms_or_infinity(lowest)
    ratio = np.log(errors[0] / errors[1])
    return bool(ratio.mean() <= ratio.std(ddof=1) / np.sqrt(ratio.size))


def _simpler(row: Ranked, lowest: Ranked) -> str:
    """Give the reason for a row other than the lowest error, else an empty string."""
    if row is lowest:
        return ""
    return (
        f"{_row_text(row)}: {row.n_coefficients} coefficients; on the {len(row.rms_by_fold)} "
        "held-out parts it is within one standard error of the lowest RMS error, "
        f"{_row_text(lowest)} with {lowest.n_coefficients}."
    )


def _sentence(ranked: Sequence[Ranked], n_rows: int, of: str) -> str:
    """Name the row of lowest error, and the runner-up with its margin."""
    texts = [*map(_row_text, ranked[:2])]
    if n_rows == 1:
        return f"{texts[0]}, the only row."
    runner_up = "there is no runner-up"
    if len(ranked) > 1:
        lowest, second = map(rms_or_infinity, ranked[:2])
        margin = f", {100.0 * (second / lowest - 1.0):+.0f} %" if lowest else ""
        runner_up = f"runner-up {texts[1]}{margin}"
    return f"{texts[0]}: lowest RMS error of {_replays(len(ranked))}{of}; {runner_up}."


class Table(Protocol[Candidate_co]):
    """A comparison or cross-validation: rows that can be ranked."""

    @property
    def rows(self) -> tuple[Candidate_co, ...]:
        """Its rows."""


def pareto_front(table: Table[Candidate]) -> tuple[Candidate, ...]:
    """Return the Pareto front of RMS error and number of coefficients.

    Parameters
    ----------
    table : Comparison or CrossValidation
        Rows without an RMS error are excluded.

    Returns
    -------
    rows : tuple of Row
        From the fewest coefficients to the lowest error; each has more coefficients
        and a lower error than the one before. Of equal rows the first is included.

    Examples
    --------
    >>> from hydrodamp.validation.compare import Comparison
    >>> pareto_front(Comparison(()))
    ()
    """
    scored = [row for row in table.rows if row.rms is not None]
    front: list[Candidate] = []
    for row in sorted(scored, key=lambda row: (row.n_coefficients, rms_or_infinity(row))):
        if not front or rms_or_infinity(row) < rms_or_infinity(front[-1]):
            front.append(row)
    return tuple(front)


def rms_or_infinity(row: Ranked) -> float:
    """Return the RMS error of a row, infinite where there is none."""
    return float("inf") if row.rms is None else row.rms


def _row_text(row: Ranked) -> str:
    return f"{row.model} by {row.method} ({rms_or_infinity(row):.3g})"


def _replays(count: int) -> str:
    return "1 replay" if count == 1 else f"{count} replays"
