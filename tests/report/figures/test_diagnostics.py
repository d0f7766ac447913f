"""Excitation, residuals, power, and the history of an adaptive estimate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd

from .conftest import labels, legend, made_up, words_in


def test_bars_are_shares_and_counts(sailed, on_sheet):
    found = hd.identifiability(sailed.problem, hd.catalog["prestero"])
    quiet = replace(found.axes[2], share=0.1, excited=False)
    found = replace(found, axes=(*found.axes[:2], quiet, *found.axes[3:]))
    figure = hd.excitation_figure(found)
    left, right = figure.axes
    assert [bar.get_width() for bar in left.patches] == [one.share for one in found.axes]
    assert sum(bar.get_width() for bar in right.patches) == len(found.grades)
    assert "10 %, not predicted" in words_in(left)
    assert words_in(right) == [f"rank {one.rank}" for one in found.axes]
    assert legend(figure) == ["determined", "weak", "not determined"]
    on_sheet(figure)


def test_residuals_by_axis_in_correlation_and_spectrum(sailed, on_sheet):
    fits = [sailed.fit("linear", "weak"), sailed.fit("fossen", "weak")]
    figure = hd.residuals_figure(sailed.problem, fits, support=1.0)
    assert len(figure.axes) == 12
    assert [one.get_ylabel() for one in figure.axes[::2]] == [f"${x}$" for x in "XYZKMN"]
    assert figure.axes[-2].get_xlabel() == "lag [s]"
    assert figure.axes[-1].get_xlabel() == "frequency [Hz]"
    assert len(figure.axes[1].lines) == 2
    assert legend(figure)[-1] == "white residuals, 95 %"
    on_sheet(figure)


def test_only_axes_with_coefficients_have_residuals(sailed):
    model = hd.DampingModel.from_table({"X": "u", "N": "r"}, key="two")
    fit = hd.Fit(hd.Damping(model, np.array([-1.0, -1.0])), "ls", hd.Status.OK)
    figure = hd.residuals_figure(sailed.problem, [fit, sailed.fit("linear", "weak")], support=1.0)
    assert [len(panel.lines) for panel in figure.axes[1::2]] == [2, 1, 1, 1, 1, 2]
    assert len(hd.residuals_figure(sailed.problem, [fit], support=1.0).axes) == 4


def test_residuals_that_are_zero_make_a_figure(sailed):
    still = replace(
        sailed.train,
        velocity=np.zeros((sailed.train.n, 6)),
        wrench=np.zeros((sailed.train.n, 6)),
        attitude=None,
        command_names=(),
        commands=np.empty((sailed.train.n, 0)),
    )
    vehicle = replace(sailed.vehicle, actuators=(), axes=("X", "Y", "N"))
    model = hd.DampingModel.from_table({"X": "u"}, key="drag")
    fit = hd.Fit(hd.Damping(model, np.array([-1.0])), "ls", hd.Status.OK)
    figure = hd.residuals_figure(hd.prepare(vehicle, still, model), [fit], support=1.0)
    assert not np.asarray(figure.axes[0].lines[0].get_ydata()).any()


BOX = hd.OperatingBox([1.0, -0.5, 0.0, 0.0, 0.0, 0.0], [2.0, 0.5, 0.0, 0.0, 0.0, 0.0])
TURN = hd.OperatingBox([1, -1, 0, 0, 0, -0.3], [2, 1, 0, 0, 0, 0.3])


@pytest.mark.parametrize(
    ("box", "unit", "panels"),
    [
        (BOX, "deg", ["$u$ [m/s]", "$v$ [m/s]"]),
        (TURN, "rad", ["$u$ [m/s]", "$v$ [m/s]", "$r$ [rad/s]"]),
    ],
)
def test_velocities_that_move_have_a_panel_of_power(box, unit, panels, on_sheet):
    damping = hd.Damping.from_dict(None, {"X_u": -2.0, "Y_v": 4.0})
    figure = hd.power_figure([hd.Fit(damping, "ls", hd.Status.OK)], box, unit)
    assert labels(figure, "x") == panels
    on_sheet(figure)


def test_the_band_is_the_power_over_the_box_and_the_legend_says_the_most():
    """Power -2 u^2 + 4 v^2 is greatest at v = 0.5, for every u; over the box at u = 1."""
    damping = hd.Damping.from_dict(None, {"X_u": -2.0, "Y_v": 4.0})
    figure = hd.power_figure([hd.Fit(damping, "ls", hd.Status.OK)], BOX)
    greatest = figure.axes[0].lines[0]
    assert greatest.get_ydata() == pytest.approx(-2.0 * greatest.get_xdata() ** 2 + 1.0)
    assert legend(figure) == ["custom by ls: at most \N{MINUS SIGN}1 W"]


def test_coefficients_and_errors_over_time(sailed, on_sheet):
    history = hd.AdaptiveIdentifier().history(sailed.problem, hd.catalog["fossen"])
    figure = hd.history_figure(history, sailed.fit("fossen", "weak").damping)
    assert labels(figure)[0] == "$X$\ncoefficients [SI]"
    assert labels(figure)[-2:] == ["error\n[m/s]", "error\n[deg/s]"]
    assert len(figure.axes) == 8
    first = figure.axes[0].lines[0]
    assert first.get_ydata()[-1] == history.coefficients[-1, 0]
    assert figure.axes[-1].get_xlim()[1] == pytest.approx(sailed.train.duration, rel=0.01)
    on_sheet(figure)


def test_passes_run_on_and_many_are_not_marked():
    time = np.tile(np.arange(1.0, 21.0), 30)
    values = np.column_stack([np.linspace(-1.0, -9.0, 600), np.zeros(600)])
    history = hd.History(time, np.zeros((600, 6)), values, ("X_u", "Y_v"))
    figure = hd.history_figure(history, hd.Damping.from_dict(None, {"X_u": -5.0, "Y_v": -1e9}))
    assert figure.axes[-1].get_xlim() == (0.0, 599.0)
    _, reference = figure.axes[0].lines
    assert reference.get_ydata() == [-5.0]
    assert len(figure.axes[1].lines) == 1, "a reference out of the panel is not drawn"


def test_of_many_coefficients_those_that_move_farthest_are_named():
    terms = hd.catalog["mcfarland-whitcomb"].labels[:36]
    values = np.outer(np.linspace(0.0, 1.0, 50), np.arange(36.0))
    panel = hd.history_figure(hd.History(np.arange(50.0), np.zeros((50, 6)), values, terms)).axes[0]
    assert len(panel.get_legend().get_texts()) == 6
    assert len([line for line in panel.lines if line.get_color() == "#c4c4c4"]) == 30


POINT = hd.OperatingBox([0.0] * 6, [0.0] * 6)
STILL = hd.History(np.zeros(0), np.zeros((0, 6)), np.zeros((0, 1)), ("X_u",))
BARE = hd.Identifiability(hd.catalog["linear"].restricted_to(()), ())
ONE = hd.Fit(hd.Damping.from_dict(None, {"X_u": -2.0}), "ls", hd.Status.OK)


@pytest.mark.parametrize(
    ("draw", "words"),
    [
        (lambda sailed: hd.residuals_figure(sailed.problem, []), "no residuals"),
        (lambda _: hd.power_figure([], BOX), "box with an extent"),
        (lambda _: hd.power_figure([ONE], POINT), "box with an extent"),
        (lambda _: hd.history_figure(STILL), "no step"),
        (lambda _: hd.excitation_figure(BARE), "has no coefficient"),
        (lambda _: hd.front_figure(hd.Comparison(())), "no row with coefficients has an error"),
        (lambda _: hd.correlation_figure(made_up("fossen")), "has no covariance"),
    ],
)
def test_what_has_nothing_to_draw_is_refused(sailed, draw, words):
    with pytest.raises(hd.MethodError, match=words):
        draw(sailed)
