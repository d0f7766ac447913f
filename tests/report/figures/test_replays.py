"""Figures 4 and 5: every replay, as far as it goes, near what was measured."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError
from hydrodamp.report.figures.style import MEASURED, line_styles

from .conftest import labels, legend


def diverged(row, name, after):
    """The row with a replay that runs away in a segment."""
    run = row.trajectory
    (segment,) = (one for one in run.log.segments if one.name == name)
    velocity = run.velocity.copy()
    lost = segment.start + after
    velocity[lost - 1] = 49.0
    velocity[lost : segment.stop] = np.nan
    at = ((name, float(run.log.time[lost] - run.log.time[segment.start])),)
    score = replace(row.score, rms=None, diverged=at)
    return replace(row, trajectory=replace(run, velocity=velocity, diverged=at), score=score)


@pytest.mark.slow
def test_measured_and_every_replay_have_a_line_in_every_panel(sailed, on_sheet):
    rows = [sailed.table.row("linear", key) for key in ("weak", "ai")]
    figure = hd.replays_figure(rows)
    assert labels(figure)[0] == "$u$ [m/s]"
    assert labels(figure)[5] == "$r$ [deg/s]"
    joins = len(sailed.test.segments) - 1
    for panel in figure.axes:
        assert len(panel.lines) == 3 + joins
        colours = [line.get_color() for line in panel.lines[:3]]
        (look,) = line_styles([("linear", "weak")])
        assert colours == [MEASURED, look.colour, look.colour]
    assert legend(figure)[0] == "measured"
    assert legend(figure)[1].startswith("linear by weak, RMS ")
    on_sheet(figure)


def test_a_diverged_replay_is_drawn_as_far_as_it_went_and_said(sailed):
    row = diverged(sailed.table.row("linear", "weak"), sailed.test.segments[0].name, after=50)
    figure = hd.replays_figure([row, sailed.table.row("linear", "ai")])
    assert legend(figure)[1] == f"linear by weak: diverged in {sailed.test.segments[0].name}"
    for panel in figure.axes:
        measured, _, replayed = (np.asarray(line.get_ydata()) for line in panel.lines[:3])
        assert np.flatnonzero(np.isnan(replayed))[0] == 50
        low, high = panel.get_ylim()
        assert high - low < 2.0 * (np.nanmax(measured) - np.nanmin(measured))


def test_a_band_is_drawn_behind_its_replay(sailed):
    row = sailed.table.row("linear", "weak")
    problem = hd.prepare(sailed.vehicle, sailed.test, row.fit.model)
    band = hd.prediction_band(problem, row.fit.damping, level=0.9)
    figure = hd.replays_figure([row], band)
    assert all(len(panel.collections) == 1 for panel in figure.axes)
    assert legend(figure)[1].endswith("90 % band")
    outline = figure.axes[0].collections[0].get_paths()[0].vertices[:, 1]
    assert outline.max() >= np.nanmax(band.upper[: sailed.test.segments[0].stop, 0])


def test_rows_without_a_replay_are_left_out_and_of_other_logs_refused(sailed, refused):
    row = sailed.table.row("linear", "weak")
    lost = replace(row, trajectory=None)
    assert len(legend(hd.replays_figure([row, lost]))) == 2
    refused(MethodError, hd.replays_figure, [lost])
    other = hd.simulate(sailed.vehicle, row.fit.damping, sailed.train)
    refused(MethodError, hd.replays_figure, [row, replace(row, trajectory=other)])
