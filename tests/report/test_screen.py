from __future__ import annotations

import io

from rich.console import Console

from hydrodamp.report.comparison_grids import comparison_grids
from hydrodamp.report.grid import Grid
from hydrodamp.report.screen import rich_table, show
from hydrodamp.validation.comparison import Comparison


def test_a_terminal_shows_every_word_in_80_columns(comparison: Comparison) -> None:
    stream = io.StringIO()
    show(Console(file=stream, width=80), *comparison_grids(comparison))
    lines = stream.getvalue().splitlines()
    assert max(map(len, lines)) <= 80
    text = stream.getvalue()
    for grid in comparison_grids(comparison):
        assert grid.title in text
        for row in grid.rows:
            assert all(word in text for word in row)


def test_a_time_between_colons_is_no_emoji() -> None:
    stream = io.StringIO()
    show(Console(file=stream), Grid("50:100:", ("a",), (), "l", notes=("They share 50:100: all.",)))
    assert stream.getvalue().count("50:100:") == 2


def test_outcomes_have_colours() -> None:
    rows = (("a", "diverged"), ("b", "~1.0"), ("c", "0.5"))
    table = rich_table(Grid("", ("model", "ls"), rows, "lr", best=frozenset({(2, 1)})))
    styles = [str(cell.style) for cell in table.columns[1].cells]
    assert styles == ["red", "yellow", "bold green"]


def test_numbers_never_wrap_on_a_narrow_terminal(comparison: Comparison) -> None:
    stream = io.StringIO()
    (grid, *_) = comparison_grids(comparison)
    show(Console(file=stream, width=20), grid)
    text = stream.getvalue()
    assert all(word in text for row in grid.rows for word in row)
