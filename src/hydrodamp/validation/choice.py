"""Which row to take, by a rule that is said in words, and which one came second."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from hydrodamp.errors import MethodError, did_you_mean

#: Ratio from which an error is so many times as large, not so many percent worse.
_LARGE = 3.0


class Ranked(Protocol):
    """What a row must know of itself to be ranked."""

    @property
    def model(self) -> str:
        """Key of the model."""
        ...

    @property
    def method(self) -> str:
        """Key of the method."""
        ...

    @property
    def n_coefficients(self) -> int:
        """How many coefficients the model has."""
        ...

    @property
    def rms(self) -> float | None:
        """The error; None where there is none that can be trusted."""
        ...

    @property
    def settled(self) -> bool:
        """Whether there is an error, and it is that of a fit that has settled."""
        ...


Candidate = TypeVar("Candidate", bound=Ranked)


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
        The rule, what it chose and how far the second is behind.
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


class Rule(Protocol):
    """A way to order rows that have an error."""

    def ranked(self, rows: Sequence[Candidate]) -> list[Candidate]:
        """Return the rows, best first."""
        ...

    def described(self, row: Ranked) -> str:
        """Return what counts of a row."""
        ...

    def reason(self, rows: Sequence[Ranked]) -> str:
        """Say why the first of the ranked rows is first."""
        ...


@dataclass(frozen=True)
class LowestError:
    """The lowest RMS error; ties go to fewer coefficients, then to the earlier row.

    Examples
    --------
    >>> LowestError()
    LowestError()
    """

    def ranked(self, rows: Sequence[Candidate]) -> list[Candidate]:
        """Return the rows, lowest error first."""
        return sorted(rows, key=lambda row: (error_of(row), row.n_coefficients))

    def described(self, row: Ranked) -> str:
        """Return the error."""
        return _size(error_of(row))

    def reason(self, rows: Sequence[Ranked]) -> str:
        """Say why the first of the ranked rows is first."""
        return f"lowest RMS error of {_replays(len(rows))}"


@dataclass(frozen=True)
class Parsimony:
    """The fewest coefficients among the rows whose error is near the lowest.

    Ties go to the lower error, then to the earlier row.

    Parameters
    ----------
    within : float
        How far above the lowest error a row may be, as a share of it.

    Raises
    ------
    MethodError
        If it is negative or not finite.

    Examples
    --------
    >>> Parsimony(within=0.2)
    Parsimony(within=0.2)
    """

    within: float = 0.10

    def __post_init__(self) -> None:
        """Check the share."""
        if not 0.0 <= self.within < float("inf"):
            raise MethodError(f"`within` must be zero or more, such as 0.1; got {self.within}")

    def ranked(self, rows: Sequence[Candidate]) -> list[Candidate]:
        """Return the rows near the lowest error by size, then the others by error."""
        near = self._near(rows)
        by_size = sorted(near, key=lambda row: (row.n_coefficients, error_of(row)))
        return by_size + LowestError().ranked([row for row in rows if row not in near])

    def described(self, row: Ranked) -> str:
        """Return the number of coefficients and the error."""
        return f"{row.n_coefficients} coefficients, {_size(error_of(row))}"

    def reason(self, rows: Sequence[Ranked]) -> str:
        """Say why the first of the ranked rows is first."""
        near, lowest = len(self._near(rows)), _size(min(map(error_of, rows)))
        which = "the only replay" if near == 1 else f"fewest coefficients of {near} replays"
        return f"{which} within {100.0 * self.within:g} % of the lowest RMS error, {lowest}"

    def _near(self, rows: Sequence[Candidate]) -> list[Candidate]:
        limit = (1.0 + self.within) * min(map(error_of, rows))
        return [row for row in rows if error_of(row) <= limit]


#: The rules by the words that :meth:`Comparison.choice` takes.
RULES: dict[str, Rule] = {"rms": LowestError(), "parsimony": Parsimony()}


def choose(rows: Iterable[Candidate], rule: str | Rule = "rms") -> Choice[Candidate]:
    """Choose a row by a rule."""
    how, asked = _found(rule), list(rows)
    scored = [row for row in asked if row.rms is not None]
    if not scored:
        raise MethodError("no row has an RMS error: every replay diverged or nothing was fitted")
    candidates = [row for row in scored if row.settled] or scored
    ranked = how.ranked(candidates)
    best, second = ranked[0], ranked[1] if len(ranked) > 1 else None
    return Choice(
        row=best,
        runner_up=second,
        sentence=_sentence(how, ranked, len(asked)),
        reservation=_reservation(best.settled, len(asked) - len(candidates)),
    )


def _sentence(rule: Rule, ranked: Sequence[Ranked], asked: int) -> str:
    """Say which row is first, and by what; of one alone only what it is."""
    best, second = ranked[0], ranked[1] if len(ranked) > 1 else None
    if asked == 1:
        return f"{_named(rule, best)}, which was compared with no other."
    return f"{_named(rule, best)}: {rule.reason(ranked)}; {_behind(rule, best, second)}."


def error_of(row: Ranked) -> float:
    """Return the error of a row, infinite where it has none."""
    return float("inf") if row.rms is None else row.rms


def _found(rule: str | Rule) -> Rule:
    if not isinstance(rule, str):
        return rule
    if rule not in RULES:
        raise MethodError(
            f"unknown rule '{rule}'.{did_you_mean(rule, RULES)} Known: {', '.join(RULES)}."
        )
    return RULES[rule]


def _named(rule: Rule, row: Ranked) -> str:
    return f"{row.model} by {row.method} ({rule.described(row)})"


def _behind(rule: Rule, best: Ranked, second: Ranked | None) -> str:
    if second is None:
        return "there is no runner-up"
    return f"runner-up {_named(rule, second)}, {_compared(error_of(best), error_of(second))}"


def _compared(error: float, other: float) -> str:
    if other == error:
        return "equal in error"
    word = "worse" if other > error else "better"
    if error == 0.0:
        return word
    ratio = other / error
    if ratio >= _LARGE:
        return f"{ratio:.2g} times as large"
    share = 100.0 * abs(ratio - 1.0)
    return f"{share:.0f} % {word}" if share >= 1.0 else f"less than 1 % {word}"


def _reservation(settled: bool, left: int) -> str:
    words = [] if settled else ["No fit has settled."]
    if left:
        words.append(f"Left out: {_replays(left)} that diverged, failed or did not settle.")
    return " ".join(words)


def _replays(count: int) -> str:
    return "1 replay" if count == 1 else f"{count} replays"


def _size(error: float) -> str:
    return f"{error:.3g}"
