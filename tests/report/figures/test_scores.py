"""The front of error and size, and errors by horizon."""

from dataclasses import replace

import numpy as np

import hydrodamp as hd
from hydrodamp.errors import MethodError
from hydrodamp.report.figures.diagnostics import horizons_figure
from hydrodamp.report.figures.style import model_colours
from hydrodamp.simulation.replay import HorizonScore
from hydrodamp.validation.selection import pareto_front

from .conftest import legend


def points(panel):
    """Return the points of a front by marker."""
    return [line for line in panel.lines if line.get_marker() not in ("None", None)]


def test_every_row_is_there_and_the_front_joins_the_best(comparison, on_sheet):
    figure = hd.front_figure(comparison)
    (panel,) = figure.axes
    steps, *_ = panel.lines
    names, front = comparison.select().velocities, pareto_front(comparison)
    errors = [100.0 * row.blocks.relative_error(names) for row in front]
    np.testing.assert_allclose(steps.get_ydata(), errors)
    drawn = points(panel)
    crosses = [line for line in drawn if line.get_marker() == "x"]
    assert len(drawn) == len(comparison.rows)
    assert len(crosses) == sum(row.rms is None for row in comparison.rows) > 0
    marks = ["ls", "ai", "Pareto front", "not converged"]
    assert legend(figure) == [*marks, "diverged or failed: fossen, coe, uncoupled"]
    names = [text.get_text() for text in panel.get_xticklabels()]
    assert names == ["fossen, 12", "uncoupled, 24", "coe, 33", "linear, 36"]
    faces = {(one.get_color(), one.get_markerfacecolor()) for one in drawn}
    colours = set(model_colours(["fossen", "uncoupled", "coe", "linear"]).values())
    assert {colour for colour, _ in faces} == colours
    assert {face for _, face in faces} <= {*colours, "white"}
    on_sheet(figure)


def test_many_models_take_the_page(comparison, on_sheet):
    first = comparison.rows[0].fit
    rows = []
    for k in range(15):
        model = replace(first.model, key=f"a-model-of-my-own-with-a-long-name-{k}")
        fit = replace(first, damping=replace(first.damping, model=model))
        rows.append(replace(comparison.rows[0], fit=fit))
    figure = hd.front_figure(hd.Comparison(tuple(rows)))
    assert figure.get_figwidth() > 7.0
    on_sheet(figure)


def scores(errors, lost=()):
    """Scores by horizon; those of `lost` have no error."""
    found = []
    for horizon, error in errors.items():
        score = hd.Score(None if horizon in lost else error, {}, {}, "deg", ())
        found.append(HorizonScore(horizon, score, 12, 3 if horizon in lost else 0))
    return tuple(found)


def test_horizons_rise_and_divergence_is_marked(on_sheet):
    good = scores({"step": 0.1, 1.0: 0.2, 10.0: 0.5, "run": 0.9})
    bad = scores({"step": 0.1, 1.0: 0.3, 10.0: 0.0, "run": 0.0}, lost=(10.0, "run"))
    figure = horizons_figure({("linear", "ls"): good, ("fossen", "ls"): bad})
    (panel,) = figure.axes
    ticks = [text.get_text() for text in panel.get_xticklabels()]
    assert ticks == ["one step", "1 s", "10 s", "whole run"]
    first, second = panel.lines
    assert list(first.get_ydata()) == [0.1, 0.2, 0.5, 0.9]
    low, high = panel.get_ylim()
    assert {low, high} <= {0.05, 0.1, 1.0, 2.0}  # ends are ticks
    said = "fossen by ls, up to 25 % of windows diverged"
    assert legend(figure) == ["linear by ls", said]
    assert first.get_color() != second.get_color()
    assert first.get_linestyle() == second.get_linestyle()
    on_sheet(figure)


def test_mixed_units_are_refused(refused):
    first = scores({"run": 1.0})
    (one,) = first
    other = (replace(one, score=replace(one.score, rate_unit="rad")),)
    refused(MethodError, horizons_figure, {("a", "ls"): first, ("b", "ls"): other})
