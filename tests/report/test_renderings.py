from __future__ import annotations

import csv
import io

import pytest

from hydrodamp.report.grid import Grid
from hydrodamp.report.renderings import to_csv, to_html, to_latex, to_markdown, to_text, wrapped

GRID = Grid(
    "Errors & more",
    ("model_a", "rms"),
    (("u|u|", "~1"), ("v^2", "<0")),
    "lr",
    ("first note", "second <note>"),
    best=frozenset({(1, 0)}),
)


def test_text_is_aligned() -> None:
    assert to_text(GRID).splitlines() == [
        *("Errors & more", ""),
        "model_a  rms",
        "-------  ---",
        "u|u|      ~1",
        "v^2       <0",
        *("", "first note", "second <note>"),
    ]


def test_markdown_escapes_its_marks() -> None:
    text = to_markdown(GRID)
    assert text.startswith("**Errors & more**\n\n| model_a | rms |\n| :--- | ---: |\n")
    assert r"| u\|u\| | \~1 |" in text
    assert "| **v^2** | &lt;0 |" in text
    assert text.endswith("- first note\n- second &lt;note>")


def test_latex_escapes_its_marks() -> None:
    text = to_latex(GRID)
    assert r"\caption{Errors \& more}" in text
    assert r"\begin{tabular}{lr}" in text
    assert r"model\_a & rms \\" in text
    assert r"u\textbar{}u\textbar{} & \textasciitilde{}1 \\" in text
    assert r"\textbf{v\textasciicircum{}2} & \textless{}0 \\" in text
    assert text.startswith("% first note\n% second <note>\n")


def test_csv_reads_back() -> None:
    assert [*csv.reader(io.StringIO(to_csv(GRID)))] == [
        ["model_a", "rms"],
        ["u|u|", "~1"],
        ["v^2", "<0"],
    ]


def test_html_escapes_its_marks() -> None:
    text = to_html(GRID)
    assert "<caption>Errors &amp; more</caption>" in text
    assert '<td style="text-align:right">&lt;0</td>' in text
    assert "<td><strong>v^2</strong></td>" in text
    assert text.endswith("<ul><li>first note</li><li>second &lt;note&gt;</li></ul>")


def test_a_bare_grid_has_neither_title_nor_notes() -> None:
    bare = Grid("", ("a",), (("1",),), "l")
    assert to_text(bare) == "a\n-\n1"
    assert to_markdown(bare) == "| a |\n| :--- |\n| 1 |"
    assert "<ul>" not in to_html(bare)


def test_notes_never_break_a_number_from_its_unit() -> None:
    assert wrapped("after 12\u00a0s", 8) == ["after", "  12 s"]


def test_a_ragged_grid_is_refused() -> None:
    with pytest.raises(ValueError, match="must be equally long"):
        Grid("", ("a", "b"), (("1",),), "lr")
