"""What the draws of the study of coverage come to: averages and tables."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from hydrodamp import AXES, find_model
from hydrodamp.arrays import BoolArray, FloatArray

Key = tuple[str, str]
"""A method and a model."""


@dataclass(frozen=True)
class Draws:
    """What one method said of one model, draw by draw; all of shape (n_draws, n_coefficients).

    Attributes
    ----------
    estimate, target : ndarray
        On the draw, and on the same trajectory without noise; NaN where the fit failed.
    low, high, error : ndarray
        Ends of the interval, and the standard error.
    determined : ndarray of bool
        Whether the fit graded the coefficient as determined.
    """

    estimate: FloatArray
    target: FloatArray
    low: FloatArray
    high: FloatArray
    error: FloatArray
    determined: BoolArray

    @classmethod
    def joined(cls, parts: list[Draws]) -> Draws:
        """Return the draws of several parts as one."""
        names = [part.name for part in fields(cls)]
        return cls(
            **{name: np.concatenate([getattr(one, name) for one in parts]) for name in names}
        )

    @property
    def whole(self) -> Draws:
        """Only the draws in which nothing failed."""
        kept = np.isfinite(self.estimate + self.target + self.error).all(axis=1)
        return Draws(*(getattr(self, part.name)[kept] for part in fields(self)))


def verdicts(method: str, model: str, draws: Draws) -> list[dict[str, Any]]:
    """Return what came out for each coefficient, as one record each."""
    kept = draws.whole
    if len(kept.estimate) < 2:
        return []
    miss = kept.estimate - kept.target
    bias, spread = miss.mean(axis=0), miss.std(axis=0, ddof=1)
    covered = (kept.low <= kept.target) & (kept.target <= kept.high)
    centred = (kept.low - bias <= kept.target) & (kept.target <= kept.high - bias)
    columns = {
        "target": kept.target.mean(axis=0),
        "bias": bias,
        "spread": spread,
        "reported_error": np.median(kept.error, axis=0),
        "target_moves": _ratio(kept.target.std(axis=0), kept.estimate.std(axis=0)),
        "determined_share": kept.determined.mean(axis=0),
        "coverage": covered.mean(axis=0),
        "centred_coverage": centred.mean(axis=0),
    }
    labels = find_model(model).labels
    rows = zip(labels, *(column.tolist() for column in columns.values()), strict=True)
    return [
        {"method": method, "model": model, **dict(zip(("label", *columns), row, strict=True))}
        for row in rows
    ]


def _ratio(part: FloatArray, whole: FloatArray) -> FloatArray:
    return np.divide(part, whole, out=np.zeros_like(part), where=whole > 0.0)


def counted(records: list[dict[str, Any]], axis: str) -> list[int]:
    """Return the places of an axis's coefficients that most draws grade as determined."""
    return [
        place
        for place, record in enumerate(records)
        if record["label"].startswith(f"{axis}_") and record["determined_share"] > 0.5
    ]


def by_axis(records: list[dict[str, Any]], draws: Draws, axis: str) -> dict[str, Any] | None:
    """Return the coverage averaged over an axis, or None where no coefficient counts."""
    places = counted(records, axis)
    if not places:
        return None
    kept = draws.whole
    inside = (kept.low <= kept.target) & (kept.target <= kept.high)
    a_draw = inside[:, places].mean(axis=1)
    some = [records[place] for place in places]
    return {
        "axis": axis,
        "counted": len(places),
        "of": sum(record["label"].startswith(f"{axis}_") for record in records),
        "coverage": float(a_draw.mean()),
        "monte_carlo_error": float(a_draw.std(ddof=1) / math.sqrt(len(a_draw))),
        "centred_coverage": float(np.mean([one["centred_coverage"] for one in some])),
        "error_ratio": float(np.mean([one["reported_error"] / one["spread"] for one in some])),
        "target_moves": float(np.mean([one["target_moves"] for one in some])),
    }


def biases(records: dict[Key, list[dict[str, Any]]], axis: str) -> Iterator[dict[str, Any]]:
    """Yield the bias of each method on the coefficients that count for the first one."""
    leading = next(iter(records), ("", ""))[0]
    for (method, model), some in records.items():
        places = counted(records[leading, model], axis)
        if places and some:
            misses = [(abs(some[place]["bias"]), some[place]) for place in places]
            yield {
                "method": method,
                "model": model,
                "axis": axis,
                "counted": len(places),
                "spreads": float(np.median([bias / one["spread"] for bias, one in misses])),
                "percent": float(
                    np.median([100 * bias / abs(one["target"]) for bias, one in misses])
                ),
            }


def summary(draws: dict[Key, Draws]) -> dict[str, Any]:
    """Return everything that came out: by axis, by coefficient, and what failed."""
    records = {key: verdicts(*key, some) for key, some in draws.items()}
    axes = [
        {"method": key[0], "model": key[1], **row}
        for key, some in draws.items()
        for axis in AXES
        if (row := by_axis(records[key], some, axis))
    ]
    failed = [
        {"method": key[0], "model": key[1], "draws": len(some.error) - len(some.whole.error)}
        for key, some in draws.items()
    ]
    return {
        "coverage": axes,
        "bias": [row for axis in AXES for row in biases(records, axis)],
        "failed": [row for row in failed if row["draws"]],
        "coefficients": [record for some in records.values() for record in some],
    }


Rows = tuple[tuple[str, ...], list[tuple[str, ...]]]
"""The head of a table and its lines."""


def coverage_table(result: dict[str, Any]) -> Rows:
    """Return the table of coverage, a line for each method, model and axis."""
    head = ("method", "model", "axis", "counted", "coverage [%]", "without bias [%]")
    return (*head, "reported / actual error", "target moves"), [
        (
            *(row["method"], row["model"], row["axis"], f"{row['counted']} of {row['of']}"),
            f"{100 * row['coverage']:.1f} ± {100 * row['monte_carlo_error']:.1f}",
            f"{100 * row['centred_coverage']:.1f}",
            *(f"{row['error_ratio']:.2f}", f"{row['target_moves']:.2f}"),
        )
        for row in result["coverage"]
    ]


def bias_table(result: dict[str, Any]) -> Rows:
    """Return the table of bias, a line for each model and axis, the methods side by side."""
    cells = {(row["model"], row["axis"], row["method"]): row for row in result["bias"]}
    methods = list(dict.fromkeys(row["method"] for row in result["bias"]))
    places = sorted({key[:2] for key in cells}, key=[key[:2] for key in cells].index)
    lines = []
    for place in places:
        some = [cells.get((*place, method)) for method in methods]
        told_in = [f"{one['spreads']:.2f} ({one['percent']:.1f} %)" if one else "" for one in some]
        lines.append((*place, str(next(one["counted"] for one in some if one)), *told_in))
    return ("model", "axis", "counted", *methods), lines


def markdown(table: Rows) -> str:
    """Return a table in Markdown."""
    head, rows = table
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def show(title: str, table: Rows) -> None:
    """Print a table whose lines fit the screen."""
    head, rows = table
    printed = Table(title=title)
    for place, name in enumerate(head):
        printed.add_column(name, min_width=max((len(row[place]) for row in rows), default=0))
    for row in rows:
        printed.add_row(*row)
    Console().print(printed)
