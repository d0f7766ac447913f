"""Rows of the benchmark, their regret, and the tables of both."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from statistics import median

import numpy as np

from hydrodamp.simulation.replay import Horizon

HORIZONS: dict[str, Horizon] = {"1 s": 1.0, "10 s": 10.0, "run": "run"}
"""How long each replay lasts: from one measured state to the next, or a whole run."""

RESOLUTION = 0.01
"""An error below this counts as this: a fourth of what published sensor noise alone gives."""

BAR = {"median": 1.05, "95 %": 1.3, "worst": 2.0}
"""What the regret of a method that is recommended must not exceed."""


@dataclass(frozen=True)
class Row:
    """One fit, and how far its replays are from the test log.

    Attributes
    ----------
    campaign, model, method : str
        Their names.
    group : str
        Of the campaign.
    rms : dict of str to float or None
        Equation 24 by horizon, m/s and deg/s; None where a replay diverged or there is no fit.
    status : str
        Of the fit, in a word; ``"raised"`` where the method raised.
    diverged : bool
        Whether a fit was made whose replay of whole runs diverged.
    seconds : float
        Of one processor, for the fit alone.
    why : str
        What the method raised.
    fit : dict of str to float or None
        100 (1 - rmse/std) by velocity over whole runs [%].
    """

    campaign: str
    model: str
    method: str
    group: str
    rms: dict[str, float | None]
    status: str
    diverged: bool
    seconds: float
    why: str = ""
    fit: dict[str, float | None] = field(default_factory=dict)

    @property
    def job(self) -> tuple[str, str, str]:
        """What tells it from other rows."""
        return self.campaign, self.model, self.method


def regrets(rows: Iterable[Row], horizon: str = "run") -> dict[tuple[str, str, str], float]:
    """Return each row's error over the least one on its model and campaign.

    Infinite where the row has no error and another method has one; where no method has one
    there is no regret.
    """
    places: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        places.setdefault((row.campaign, row.model), []).append(row)
    found = {}
    for some in places.values():
        errors = [_error(row.rms[horizon]) for row in some]
        least = min(errors)
        if math.isfinite(least):
            found.update({row.job: e / least for row, e in zip(some, errors, strict=True)})
    return found


def _error(rms: float | None) -> float:
    return math.inf if rms is None else max(rms, RESOLUTION)


@dataclass(frozen=True)
class Summary:
    """The regrets of one method, in a few numbers."""

    n: int
    median: float
    most: float
    worst: float
    lost: int

    @classmethod
    def of(cls, regrets: Sequence[float]) -> Summary:
        """Return the median, the regret that 95 % keep to, the worst finite one, and the lost."""
        ranked = sorted(regrets)
        finite = [one for one in ranked if math.isfinite(one)]
        return cls(
            n=len(ranked),
            median=median(ranked),
            most=ranked[math.ceil(0.95 * len(ranked)) - 1],
            worst=max(finite, default=math.inf),
            lost=len(ranked) - len(finite),
        )

    @property
    def passes(self) -> bool:
        """Whether the method is good enough to be recommended."""
        numbers = (self.median, self.most, self.worst)
        return not self.lost and all(np.less_equal(numbers, [*BAR.values()]))


def by_method(rows: Sequence[Row], horizon: str) -> dict[str, Summary]:
    """Return the summary of each method, in the order of the rows."""
    found: dict[str, list[float]] = {}
    for (_, _, method), regret in regrets(rows, horizon).items():
        found.setdefault(method, []).append(regret)
    return {method: Summary.of(some) for method, some in found.items()}


def markdown(rows: Sequence[Row]) -> str:
    """Return all tables as Markdown."""
    if not rows:
        return "There is no row.\n"
    parts = [
        regret_table([row for row in rows if row.group == group], horizon, group)
        for group in dict.fromkeys(row.group for row in rows)
        for horizon in reversed(HORIZONS)
    ]
    parts.append(median_table(rows, "model", lambda row: row.model))
    parts.append(median_table(rows, "vehicle", lambda row: row.campaign.partition("/")[0]))
    parts.append(median_table(rows, "campaign", lambda row: row.campaign))
    if any(row.why for row in rows):
        parts.append(reasons(rows))
    return "\n\n".join(parts) + "\n"


def reasons(rows: Sequence[Row]) -> str:
    """Return the table of what methods raised."""
    said = Counter((f"`{row.method}`", row.why) for row in rows if row.why)
    lines = [(method, why, str(n)) for (method, why), n in said.most_common()]
    return _titled("Raised", ("method", "what", "rows"), lines)


def regret_table(rows: Sequence[Row], horizon: str, group: str) -> str:
    """Return the table of methods: how far each is from the best one at a horizon."""
    took = {
        method: median(row.seconds for row in rows if row.method == method)
        for method in dict.fromkeys(row.method for row in rows)
    }
    lines = [
        (
            *(f"`{method}`", str(one.n), number(one.median), number(one.most)),
            *(number(one.worst), str(one.lost), f"{took[method]:.2g}"),
            "yes" if one.passes else "no",
        )
        for method, one in by_method(rows, horizon).items()
    ]
    criterion = ("criterion", "", *(f"{one:g}" for one in BAR.values()), "0", "", "")
    head = ("method", "rows", "median", "95 % within", "worst", "failed", "CPU [s]", "passes")
    title = "whole runs" if horizon == "run" else f"restarts every {horizon}"
    return _titled(f"Regret, {title}, campaigns {group}", head, [criterion, *lines])


def median_table(rows: Sequence[Row], what: str, place: Callable[[Row], str]) -> str:
    """Return the table of median regrets of whole runs, a line a place, and the least error."""
    found: dict[tuple[str, str], list[float]] = {}
    least: dict[str, float] = {}
    regret = regrets(rows)
    for row in rows:
        least[place(row)] = min(least.get(place(row), math.inf), _error(row.rms["run"]))
        if row.job in regret:
            found.setdefault((place(row), row.method), []).append(regret[row.job])
    methods = list(dict.fromkeys(row.method for row in rows))
    lines = [
        (where, number(error), *(cell(found.get((where, method), [])) for method in methods))
        for where, error in least.items()
    ]
    title = f"Median regret by {what}, whole runs (number of failed rows), and lowest error"
    return _titled(title, (what, "lowest", *(f"`{method}`" for method in methods)), lines)


def cell(regrets: Sequence[float]) -> str:
    """Return the median of some regrets and how many are infinite."""
    if not regrets:
        return ""
    one = Summary.of(regrets)
    return number(one.median) + (f" ({one.lost})" if one.lost else "")


def number(value: float) -> str:
    """Return a regret in a few digits; a dash where it is infinite."""
    if math.isinf(value):
        return "-"
    return f"{value:.2f}" if value < 10.0 else f"{value:.3g}"


def _titled(title: str, head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    return f"**{title}**\n\n{table(head, rows)}"


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
