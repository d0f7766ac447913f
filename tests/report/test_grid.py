import pytest

from hydrodamp.report.comparison_tables import detail_tables, summary_tables
from hydrodamp.report.table import (
    Column,
    Table,
    coefficient,
    error_size,
    percent,
    to_csv,
    to_latex,
    to_markdown,
    to_text,
)
from table_rows import rows

GRID = Table(
    "Errors & more",
    (Column("model_a", number=False), Column("rms", form="{:.1f}".format, key="rms_deg")),
    (("u|u|", "~1"), ("v^2", 0.25), ("<w>", None)),
    ("first note", "second <note>"),
    best=frozenset({(1, 0)}),
)


@pytest.mark.parametrize("write", [to_text, to_markdown, to_latex, to_csv])
def test_a_table_in_each_form(write, snapshot):
    """Markdown and LaTeX escape their marks; CSV has names for programs and full precision."""
    assert write(GRID) == snapshot


@pytest.mark.parametrize("width", [80, 20])
def test_a_terminal_shows_every_word_whole(comparison, width):
    grids = (*detail_tables(comparison), *summary_tables(comparison))
    text = "\n\n".join(to_text(grid, width) for grid in grids)
    assert all(word in text for grid in grids for row in grid.words for word in row)
    if width == 80:
        assert max(map(len, text.splitlines())) <= 80
        assert all(grid.title in text for grid in grids)


@rows(("value", "word"))
def test_errors_stand_in_line_and_stay_short(value, word):
    assert error_size(value) == word


def test_shares_and_coefficients_are_short():
    assert [percent(value) for value in (None, -3.0, 99.6)] == ["-", "<0", "100"]
    assert [coefficient(value) for value in (None, float("inf"), -123.456)] == ["-", "-", "-123.5"]


HOSTILE = "dive\n\\input{/etc/passwd}\r\x1b[31m\u2028\u202e=1"


@pytest.mark.parametrize("write", [to_text, to_markdown, to_latex, to_csv])
def test_control_characters_of_names_do_not_reach_a_table(write):
    columns = (Column("log", number=False), Column(f"a{HOSTILE}", number=False))
    plain = Table("t", columns[:1] * 2, (("x", "y"),), ("note",))
    grid = Table(HOSTILE, columns, ((HOSTILE, "x"),), (f"note {HOSTILE}",))
    table = write(grid)
    assert not set(table) & set("\r\x1b\u2028\u202e")
    assert not any(line.lstrip().startswith("\\input") for line in table.splitlines())
    if write is not to_text:  # which wraps its notes
        assert len(table.splitlines()) == len(write(plain).splitlines())


def test_words_that_a_spreadsheet_would_run_are_quoted():
    words = ("=cmd|'/c calc'!A0", "+1+1", "-x", "@a", "-0.5", "-inf", "a=b", "")
    grid = Table("", (Column("log", number=False),), tuple((word,) for word in words))
    expected = ["'=cmd|'/c calc'!A0", "'+1+1", "'-x", "'@a", "-0.5", "-inf", "a=b", '""']
    assert to_csv(grid).splitlines()[1:] == expected
