"""Residuals and power."""

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError
from hydrodamp.identification.dissipativity import OperatingBox
from hydrodamp.report.figures.diagnostics import horizons_figure, power_figure

from .conftest import labels, legend


@pytest.mark.slow
def test_residuals_by_axis(sailed, on_sheet):
    figure = hd.residuals_figure(sailed.problem, sailed.fit("linear", "weak"))
    assert labels(figure, "y") == [f"${x}$" for x in "XYZKMN"]
    assert figure.axes[-1].get_xlabel() == "lag [s]"
    assert figure.get_supylabel() == "autocorrelation [1]"
    assert legend(figure)[-1] == "white residuals, 95 %"
    on_sheet(figure)


@pytest.mark.slow
def test_only_axes_with_coefficients_have_residuals(sailed):
    model = hd.DampingModel.from_table({"X": "u", "N": "r"}, key="two")
    fit = hd.Fit(hd.Damping(model, np.array([-1.0, -1.0])), "ls", hd.Status.OK)
    assert len(hd.residuals_figure(sailed.problem, fit).axes) == 2


BOX = OperatingBox([1.0, -0.5, 0.0, 0.0, 0.0, 0.0], [2.0, 0.5, 0.0, 0.0, 0.0, 0.0])
ONE = hd.Fit(hd.Damping.from_dict(None, {"X_u": -2.0, "Y_v": 4.0}), "ls", hd.Status.OK)
TURN = OperatingBox([1, -1, 0, 0, 0, -0.3], [2, 1, 0, 0, 0, 0.3])


@pytest.mark.slow
def test_velocities_that_move_have_a_panel_of_power(on_sheet):
    figure = power_figure(ONE, TURN, "rad")
    assert labels(figure, "x") == ["$u$ [m/s]", "$v$ [m/s]", "$r$ [rad/s]"]
    on_sheet(figure)


def test_the_band_is_the_power_over_the_box_and_the_legend_says_the_most():
    """Power -2 u^2 + 4 v^2 is greatest at v = 0.5, for every u; over the box at u = 1."""
    figure = power_figure(ONE, BOX)
    greatest = figure.axes[0].lines[0]
    assert greatest.get_ydata() == pytest.approx(-2.0 * greatest.get_xdata() ** 2 + 1.0)
    assert legend(figure) == ["custom by ls: at most -1 W"]


FAILED = hd.Fit(ONE.damping, "ls", hd.Status.FAILED)
POINT = OperatingBox([0.0] * 6, [0.0] * 6)


def test_what_has_nothing_to_draw_is_refused(sailed, refused):
    refused(MethodError, hd.residuals_figure, sailed.problem, FAILED)
    refused(MethodError, power_figure, FAILED, BOX)
    refused(MethodError, power_figure, ONE, POINT)
    refused(MethodError, hd.front_figure, hd.Comparison(()))
    refused(MethodError, horizons_figure, {})
