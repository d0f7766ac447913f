"""The estimate of a live run as a table on a terminal, refreshed in place."""

from __future__ import annotations

import sys
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import groupby
from typing import TYPE_CHECKING, Any

from hydrodamp.live.estimator import CRITICAL_VALUE, diagnostic_status
from hydrodamp.live.sample_validator import REJECTED, RESTARTS
from hydrodamp.report.table import NOTHING, coefficient

if TYPE_CHECKING:
    from rich.console import RenderableType


@contextmanager
def live_table() -> Iterator[Callable[[dict[str, Any]], None]]:
    """Yield a function that shows an estimate line in place of the one before."""
    from rich.console import Console
    from rich.live import Live

    lines: deque[dict[str, Any]] = deque(maxlen=1)
    console = Console(highlight=False, emoji=False, markup=False)

    def render() -> RenderableType:
        return _render(lines[0]) if lines else "no estimate yet"

    messages = sys.stderr.isatty()  # they appear above the table
    with Live(get_renderable=render, console=console, redirect_stderr=messages):
        yield lines.append


def _render(line: dict[str, Any]) -> RenderableType:
    from rich.columns import Columns
    from rich.console import Group
    from rich.table import Table

    values = diagnostic_status(line)[2]
    summary = Table.grid(padding=(0, 2))
    summary.add_row(line["method"], line["verdict"])
    time = line["time"]
    summary.add_row("time", NOTHING if time is None else f"{time:.1f} s")
    for name, value in values.items():
        if name.startswith("alarm") or name == "changes":
            summary.add_row(name, value or NOTHING)
    meanings = REJECTED | {kind: f"after {event}" for kind, event in RESTARTS.items()}
    for kind, n in line["counts"].items():
        summary.add_row(kind, f"{n} {meanings.get(kind, '')}")
    tables = []
    for axis, entries in groupby(line["coefficients"].items(), lambda item: item[0][0]):
        table = Table(axis, "value", "± 95 %", "grade", box=None)
        for label, entry in entries:
            error = entry["standard_error"]
            half_width = None if error is None else CRITICAL_VALUE * error
            grade = ", ".join(filter(None, (entry["grade"], entry["cause"])))
            table.add_row(label, coefficient(entry["value"]), coefficient(half_width), grade)
        tables.append(table)
    return Group(summary, Columns(tables))
