"""Figures 2 and 3: panels, units, joins."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.report.figures.estimation import commands_figure, velocities_figure
from hydrodamp.report.figures.look import COLUMN

from .conftest import labels


def planar(n=60):
    time = np.arange(n) * 0.1
    velocity = {"u": np.ones(n), "v": np.sin(time), "r": 0.1 * np.cos(time)}
    return hd.Log.from_arrays(time, velocity, commands={"left": time, "right": 9.0 * time})


def test_velocities_have_a_panel_each_with_units(sailed):
    figure = velocities_figure(sailed.train)
    assert labels(figure) == [
        *(f"${name}$ [m/s]" for name in "uvw"),
        *(f"${name}$ [deg/s]" for name in "pqr"),
    ]
    assert figure.get_figwidth() == COLUMN
    assert figure.axes[-1].get_xlabel() == "recorded time, segments end to end [s]"


def test_values_are_in_the_unit_of_the_label(sailed):
    for unit, factor in (("deg", np.degrees(1.0)), ("rad", 1.0)):
        figure = velocities_figure(sailed.train, unit)
        shown = np.asarray(figure.axes[5].lines[0].get_ydata())
        assert np.nanmax(shown) == pytest.approx(factor * sailed.train.velocity[:, 5].max())
        assert figure.axes[5].get_ylabel() == f"$r$ [{unit}/s]"


def test_joins_are_dotted_in_every_panel_and_segments_named(sailed):
    figure = velocities_figure(sailed.train)
    names = [segment.name for segment in sailed.train.segments]
    assert all(len(panel.lines) == 1 + len(names) - 1 for panel in figure.axes)
    assert [text.get_text() for text in figure.axes[0].texts] == names


def test_one_segment_has_neither_joins_nor_names():
    figure = velocities_figure(planar())
    assert labels(figure) == ["$u$ [m/s]", "$v$ [m/s]", "$r$ [deg/s]"]
    assert [len(panel.lines) for panel in figure.axes] == [1, 1, 1]
    assert figure.axes[-1].get_xlabel() == "time [s]"
    assert not figure.axes[0].texts


def test_of_many_segments_the_number_is_said(sailed):
    edges = np.linspace(0, sailed.train.n, 31).astype(int)
    segments = tuple(
        hd.Segment(f"s{k}", int(start), int(stop))
        for k, (start, stop) in enumerate(itertools.pairwise(edges))
    )
    figure = velocities_figure(replace(sailed.train, segments=segments))
    assert figure.axes[-1].get_xlabel() == "recorded time, 30 segments end to end [s]"
    assert not figure.axes[0].texts


def test_long_names_are_cut_to_their_room(on_sheet):
    segments = tuple(hd.Segment(f"{'mission' * 20}{k}", 30 * k, 30 * k + 30) for k in range(2))
    log = replace(planar(), segments=segments, velocity_names=("u",))
    figure = velocities_figure(log)
    assert all(text.get_text().endswith("…") for text in figure.axes[0].texts)
    on_sheet(figure)


def test_commands_of_like_size_share_a_panel(sailed, on_sheet):
    figure = commands_figure(sailed.train)
    assert labels(figure) == [
        "commands\n[as recorded]",
        "rpm\n[as recorded]",
        r"$\phi$, $\theta$ [deg]",
        r"yaw $\psi$ [deg]",
    ]
    fins = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert fins == ["rudder", "elevator"]
    assert figure.axes[0].lines[0].get_drawstyle() == "steps-post"
    on_sheet(figure)


def test_wrench_ratio_and_depth_are_drawn_where_recorded():
    n = 40
    log = replace(
        planar(n),
        command_names=(),
        commands=np.empty((n, 0)),
        wrench=np.tile([1.0, 2.0, 0.0, 0.0, 0.0, 3.0], (n, 1)),
        propulsion_ratio=np.ones(n),
        position=np.column_stack([np.arange(n), np.arange(n), np.linspace(1, 5, n)]),
    )
    figure = commands_figure(log)
    assert labels(figure) == [r"$\bar\eta$ [1]", "force [N]", "moment [N m]", "depth [m]"]
    low, high = figure.axes[-1].get_ylim()
    assert low > high
    assert len(figure.axes[1].lines) == 2


def test_angles_run_on_where_they_wrap():
    n = 100
    yaw = np.linspace(0.0, 3.0 * np.pi, n)
    log = hd.Log.from_arrays(
        np.arange(n), {"u": np.ones(n)}, attitude=np.column_stack([0 * yaw, 0 * yaw, yaw])
    )
    line = np.asarray(commands_figure(log).axes[-1].lines[0].get_ydata())
    assert np.nanmax(line) == pytest.approx(540.0)


def test_a_log_with_nothing_to_draw_is_refused():
    with pytest.raises(hd.MethodError, match="nothing to draw"):
        commands_figure(hd.Log.from_arrays(np.arange(5), {"u": np.ones(5)}))
    with pytest.raises(hd.MethodError, match="no velocity"):
        velocities_figure(hd.Log(np.arange(5.0), np.zeros((5, 6)), velocity_names=()))
