from dataclasses import replace

import pytest

import hydrodamp as hd
from hydrodamp.report.comparison_tables import (
    axis_tables,
    brief_table,
    detail_tables,
    horizon_tables,
    replay_table,
    score_table,
    segment_tables,
    summary_tables,
)
from hydrodamp.report.table import to_text
from hydrodamp.simulation.replay import HorizonScore
from hydrodamp.validation.compare import Row


def with_row(comparison, **score):
    row = comparison.rows[0]
    return replace(comparison, rows=(replace(row, score=replace(row.score, **score)),))


def refused(comparison):
    row = comparison.rows[3]
    fit = replace(row.fit, status=hd.Status.REFUSED, remarks=("The log is too short.",))
    return summary_tables(replace(comparison, rows=(comparison.rows[0], replace(row, fit=fit))))


def planar(comparison):
    score = hd.Score(0.1, {"u": 0.1, "r": 0.02}, {"u": None, "r": 5.0}, "rad", ())
    return axis_tables(hd.Comparison((Row(comparison.rows[0].fit, score),), "rad"))


def of_windows(comparison):
    pairs = zip(comparison.rows[:2], (0, 1), strict=True)
    rows = [replace(row, windows=HorizonScore(10.0, row.score, 4, lost)) for row, lost in pairs]
    return horizon_tables(replace(comparison, rows=tuple(rows)))


SCORE = hd.Score(0.25, {"u": 0.1, "r": 2.0}, {"u": 90.0, "r": -5.0}, "deg", ())
TABLES = {
    "summary": summary_tables,
    "axes": axis_tables,
    "refused": refused,
    "locked axes": planar,
    "one replay": lambda _: [replay_table("Replay", SCORE)],
    "runs": lambda c: segment_tables(with_row(c, rms_by_segment={"dive": 0.2, "turn": 0.8})),
    "alike": lambda c: segment_tables(with_row(c, rms_by_segment={"run_1": 0.2, "run_2": 0.8})),
    "windows": of_windows,
}


@pytest.mark.parametrize("name", TABLES)
def test_tables_of_a_comparison(comparison, name, snapshot):
    """The columns of the paper are those of its Table I."""
    assert "\n\n".join(map(to_text, TABLES[name](comparison))) == snapshot


def test_no_error_of_a_fit_that_has_not_settled_is_the_best(comparison):
    assert summary_tables(comparison)[0].best == {(0, 3)}
    assert not segment_tables(comparison)
    assert not horizon_tables(comparison)


def test_many_methods_go_on_several_tables_that_are_legible_in_80_columns(comparison):
    row = comparison.rows[0]
    more = [replace(row, fit=replace(row.fit, method=f"method-{k}")) for k in range(3)]
    many = hd.Comparison((*comparison.rows, *more))
    grids = summary_tables(many)
    assert [len(grid.header) for grid in grids] == [6, 5]
    assert [bool(grid.notes) for grid in grids] == [False, True]
    for each in (comparison, many):
        for grid in (*detail_tables(each), *summary_tables(each)):
            assert max(map(len, to_text(grid).splitlines())) <= 80


def test_rows_have_names_for_programs_and_full_precision(comparison):
    grid = score_table(comparison, comparison.rows)
    keys = [column.key or column.name for column in grid.columns]
    rows = [dict(zip(keys, row, strict=True)) for row in grid.rows]
    assert [row["rms_deg"] for row in rows[:2]] == [0.46, None]
    assert rows[0]["paper_rms"] == 0.5
    assert rows[0]["rms_v"] == 0.46 * 2
    assert rows[0]["n_coefficients"] == 36
    assert [row["status"] for row in rows[:3]] == ["ok", "diverged", "rank deficient"]
    assert rows[4]["rank"] is None
    assert all(column.meaning for column in grid.columns)


def test_a_mark_in_the_table_on_screen_has_a_legend(comparison):
    table = brief_table(comparison)
    assert any("~" in str(cell) for row in table.rows for cell in row)
    assert any(note.startswith("~ not converged: ") for note in table.notes)
