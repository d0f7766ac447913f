"""Tables on a terminal, by rich: made from the same grids as every other rendering."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hydrodamp.report.grid import Grid

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

_ALARMS = {"diverged": "red", "failed": "red", "too few": "red"}


def show(console: Console, *grids: Grid) -> None:
    """Print tables with their remarks."""
    from hydrodamp.report.renderings import wrapped

    for place, grid in enumerate(grids):
        if place:
            console.print()
        console.print(grid.title, style="bold", markup=False, emoji=False)
        _print_whole(console, rich_table(grid))
        if grid.notes:
            console.print()
        for note in grid.notes:
            for line in wrapped(note, min(console.width, 100)):
                console.print(line, markup=False, highlight=False, emoji=False, soft_wrap=True)


def rich_table(grid: Grid) -> Table:
    """Return a table for a rich console."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table
    from rich.text import Text

    table = Table(
        box=SIMPLE_HEAD,
        show_edge=False,
        pad_edge=False,
        padding=(0, grid.gap - 1, 0, 0),
    )
    for place, (name, side) in enumerate(zip(grid.header, grid.align, strict=True)):
        table.add_column(
            Text(name),
            justify="right" if side == "r" else "left",
            style="dim" if place in grid.dim else "",
            overflow="fold",
            no_wrap=side == "r",
        )
    for i, row in enumerate(grid.rows):
        table.add_row(*(Text(word, style=_style(grid, i, j)) for j, word in enumerate(row)))
    return table


def _print_whole(console: Console, table: Table) -> None:
    """Print a table no narrower than its words: rather past the edge than in pieces."""
    least = console.measure(table, options=console.options.update(width=10_000)).minimum
    if least > console.width:
        table.width = least
    console.print(table, crop=False)


def _style(grid: Grid, i: int, j: int) -> str:
    word = grid.rows[i][j]
    if (i, j) in grid.best:
        return "bold green"
    return "yellow" if word.startswith("~") else _ALARMS.get(word, "")
