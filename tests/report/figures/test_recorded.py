"""Figures 2 and 3: panels, units, joins; lines of long series."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd

from .conftest import labels


def planar(n=60):
    time = np.arange(n) * 0.1
    velocity = {"u": np.ones(n), "v": np.sin(time), "r": 0.1 * np.cos(time)}
    return hd.Log.from_arrays(time, velocity, commands={"left": time, "right": 19.0 * time})


@pytest.mark.parametrize(("unit", "factor"), [("deg", np.degrees(1.0)), ("rad", 1.0)])
def test_velocities_have_a_panel_each_in_the_unit_of_its_label(sailed, unit, factor):
    figure = hd.velocities_figure(sailed.train, unit)
    assert labels(figure) == [
        *(f"${name}$ [m/s]" for name in "uvw"),
        *(f"${name}$ [{unit}/s]" for name in "pqr"),
    ]
    shown = np.asarray(figure.axes[5].lines[0].get_ydata())
    assert np.nanmax(shown) == pytest.approx(factor * sailed.train.velocity[:, 5].max())


def test_joins_are_dotted_in_every_panel_and_segments_named(sailed):
    figure = hd.velocities_figure(sailed.train)
    names = [segment.name for segment in sailed.train.segments]
    assert all(len(panel.lines) == 1 + len(names) - 1 for panel in figure.axes)
    assert [text.get_text() for text in figure.axes[0].texts] == names
    said = figure.axes[-1].get_xlabel()
    assert said == f"recorded time, {len(names)} segments end to end [s]"


def test_commands_of_one_order_of_magnitude_share_a_panel(sailed, on_sheet):
    figure = hd.commands_figure(sailed.train)
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
    time = np.arange(5.0)
    commands = {f"thruster{k}": np.ones(5) for k in range(8)}
    eight = hd.commands_figure(hd.Log.from_arrays(time, {"u": time}, commands=commands))
    assert [len(panel.lines) for panel in eight.axes] == [6, 2]  # as many as there are colours


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
    figure = hd.commands_figure(log)
    assert labels(figure) == [r"$\bar\eta$ [1]", "force [N]", "moment [N m]", "depth [m]"]
    low, high = figure.axes[-1].get_ylim()
    assert low > high
    assert len(figure.axes[1].lines) == 2


def test_a_log_with_nothing_to_draw_is_refused():
    with pytest.raises(hd.MethodError, match="nothing to draw"):
        hd.commands_figure(hd.Log.from_arrays(np.arange(5), {"u": np.ones(5)}))
    with pytest.raises(hd.MethodError, match="no velocity"):
        hd.velocities_figure(hd.Log(np.arange(5.0), np.zeros((5, 6)), velocity_names=()))
