from dataclasses import replace

import hydrodamp as hd
from hydrodamp.report.comparison_tables import (
    axis_tables,
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

from .conftest import column


def test_models_stand_against_methods_and_the_paper(comparison):
    (grid,) = summary_tables(comparison)
    assert grid.header == ("model", "n", "rank", "ls", "ai", "paper LS", "paper AI")
    # The printed columns are those of Table I.
    assert grid.words == [
        ["linear", "36", "36", "0.460", "~14.020", "0.50", "0.74"],
        ["fossen", "12", "12", "diverged", "~1234", "2.24", "2.08"],
        ["uncoupled", "24", "22", "2.150", "failed", "2.15", "1.98"],
        ["coe", "33", "-", "too few", "-", "1.29", "2.29"],
    ]
    assert grid.best == {(0, 3)}  # no error of a fit that has not settled


def test_remarks_say_what_happened_where(comparison):
    notes = " ".join(summary_tables(comparison)[-1].notes)
    assert "fossen by ls diverged in segment dive after 12.3 s, segment turn after 0.1 s." in notes
    assert "[ls: uncoupled]" in notes
    assert "[ls: coe]" in notes
    assert "~ not converged" in notes
    assert "[ai: linear, fossen]" in notes


def test_a_fit_that_was_refused_has_its_reason_among_the_remarks(comparison):
    row = comparison.rows[3]
    fit = replace(row.fit, status=hd.Status.REFUSED, remarks=("The log is too short.",))
    (grid,) = summary_tables(replace(comparison, rows=(comparison.rows[0], replace(row, fit=fit))))
    assert column(grid, "ls") == ("0.460", "refused")
    assert "coe by ls: The log is too short." in grid.notes


def test_axes_have_error_and_fit(comparison):
    first, second = axis_tables(comparison)
    assert first.title == "ls by axis: RMS error (m/s, deg/s), fit in %"
    assert first.words[0][:5] == ["linear", "0.460", "90", "0.920", "50"]
    assert first.words[0][-2:] == ["2.760", "<0"]
    assert column(second, "model") == ("linear", "fossen")


def test_locked_axes_are_left_out(comparison):
    score = hd.Score(0.1, {"u": 0.1, "r": 0.02}, {"u": None, "r": 5.0}, "rad", ())
    planar = hd.Comparison((Row(comparison.rows[0].fit, score),), "rad")
    (grid,) = axis_tables(planar)
    assert grid.header == ("model", "u", "%", "r", "%")
    assert grid.words == [["linear", "0.100", "-", "0.0200", "5"]]


def test_many_methods_go_on_several_tables_that_are_legible_in_80_columns(comparison):
    row = comparison.rows[0]
    more = [replace(row, fit=replace(row.fit, method=f"method-{k}")) for k in range(3)]
    many = hd.Comparison((*comparison.rows, *more))
    grids = summary_tables(many)
    assert [len(grid.header) for grid in grids] == [6, 5]
    assert [bool(grid.notes) for grid in grids] == [False, True]
    for grid in (
        *detail_tables(comparison),
        *summary_tables(comparison),
        *detail_tables(many),
        *grids,
    ):
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


def test_the_score_of_one_replay_ends_with_all_velocities_together():
    score = hd.Score(0.25, {"u": 0.1, "r": 2.0}, {"u": 90.0, "r": -5.0}, "deg", ())
    assert replay_table("Replay", score).words == [
        ["u", "0.100", "m/s", "90"],
        ["r", "2.000", "deg/s", "<0"],
        ["all", "0.250", "m/s, deg/s", "-"],
    ]


def test_runs_and_windows_have_tables_of_their_own(comparison):
    first, second = comparison.rows[:2]
    errors = {"dive": 0.2, "turn": 0.8}
    own = replace(first, score=replace(first.score, rms_by_segment=errors))
    windows = HorizonScore(10.0, first.score, 4, 0)
    lost = HorizonScore(10.0, second.score, 4, 1)
    rows = (replace(own, windows=windows), replace(second, windows=lost))
    found = replace(comparison, rows=rows)
    runs, parts = to_text(segment_tables(found)[0]), to_text(horizon_tables(found)[0])
    assert "dive   turn" in runs
    assert "0.200  0.800" in runs
    assert "windows of 10 s" in parts
    assert "25 % off" in parts
    assert not segment_tables(comparison)
    alike = {"run_11_40": 0.2, "run_11_46": 0.8}
    named = replace(own, score=replace(first.score, rms_by_segment=alike))
    (grid,) = segment_tables(replace(comparison, rows=(named,)))
    assert grid.title.endswith(", run_11_…")
    assert grid.header == ("model", "method", "40", "46")
    assert not horizon_tables(comparison)
