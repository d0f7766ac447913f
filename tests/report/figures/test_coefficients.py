"""Coefficients, intervals and correlations as drawn."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.report.figures.look import COLUMN, PAGE, colour_of

from .conftest import legend, lost, made_up, tied


def test_every_coefficient_stands_at_its_value_with_its_interval(sailed, on_sheet):
    fit = sailed.fit("fossen", "weak")
    both = hd.coefficients_figure([fit, sailed.fit("fossen", "ai")])
    colours = {line.get_color() for line, *_ in both.axes[0].containers}
    assert colours == {colour_of("weak"), colour_of("ai")}
    assert legend(both)[1] == "fossen by ai, no intervals"
    figure = hd.coefficients_figure([fit])
    assert [panel.get_title("left")[:3] for panel in figure.axes] == [f"${x}$" for x in "XYZKMN"]
    drawn = [one for panel in figure.axes for one in panel.containers]
    points = np.concatenate([line.get_xdata() for line, _, _ in drawn])
    assert points == pytest.approx(fit.damping.coefficients)
    ends = np.array([bar[:, 0] for _, _, (bars,) in drawn for bar in bars.get_segments()])
    assert ends == pytest.approx(fit.uncertainty.interval(fit.damping.coefficients))
    assert legend(figure) == ["fossen by weak, 95 % intervals"]
    assert figure.axes[3].get_title("left").endswith("[N m per unit of the term]")
    on_sheet(figure)


def test_aliased_coefficients_are_hollow():
    fit = replace(made_up("uncoupled"), aliased=(("X_u^2", "X_u|u|"),))
    values = fit.damping.as_dict()
    _, hollow, _ = hd.coefficients_figure([fit]).axes[0].lines
    assert hollow.get_markerfacecolor() == "white"
    assert {*hollow.get_xdata()} == {values["X_u^2"], values["X_u|u|"]}


def test_a_covariance_alone_is_said_to_be_for_white_residuals():
    figure = hd.coefficients_figure([made_up("fossen", covariance=np.eye(12))])
    assert legend(figure) == ["fossen by ls, 95 % intervals for white residuals"]
    _, _, (bars,) = figure.axes[0].containers[0]
    low, high = bars.get_segments()[0][:, 0]
    assert high - low == pytest.approx(2.0 * 1.959964, rel=1e-6)


@pytest.mark.parametrize(("axes", "methods"), [(("X",), 1), (("X", "Y", "Z", "N"), 6)])
def test_axes_without_coefficients_have_no_panel(axes, methods, on_sheet):
    model = hd.catalog["linear"].restricted_to(axes)
    fit = hd.Fit(hd.Damping(model, -np.ones(model.n_coefficients)), "ls", hd.Status.OK)
    fits = [replace(fit, method=key) for key in list(hd.METHODS)[:methods]]
    figure = hd.coefficients_figure(fits)
    assert len(figure.axes) == len(axes)
    on_sheet(figure)


def test_fits_that_cannot_share_a_figure_are_refused():
    failed = lost(made_up("linear"))
    assert len(legend(hd.coefficients_figure([made_up("linear"), failed]))) == 1
    with pytest.raises(hd.MethodError, match="no fit has coefficients"):
        hd.coefficients_figure([failed])
    with pytest.raises(hd.MethodError, match="of one model; got linear, fossen"):
        hd.coefficients_figure([made_up("linear"), made_up("fossen")])


def test_correlation_is_that_of_the_covariance_each_pair_once(sailed, on_sheet):
    fit = sailed.fit("fossen", "weak")
    figure = hd.correlation_figure(fit)
    panel = figure.axes[0]
    shown = panel.images[-1].get_array()
    size = fit.uncertainty.standard_errors
    below = np.tri(12, k=-1, dtype=bool)
    expected = fit.damping.covariance / np.outer(size, size)
    assert np.asarray(shown)[below] == pytest.approx(expected[below])
    assert np.array_equal(np.ma.getmaskarray(shown), ~below)
    assert panel.get_yticklabels()[0].get_text() == "$X_{u}$"
    assert panel.get_title("left") == "fossen by weak"
    on_sheet(figure)


@pytest.mark.parametrize("key", ["fossen", "linear", "gertler-hagen", "mcfarland-whitcomb"])
def test_it_grows_with_the_model_up_to_the_page_and_no_name_leaves_it(key, on_sheet):
    figure = hd.correlation_figure(tied(key, 0.95))
    n = hd.catalog[key].n_coefficients
    assert COLUMN <= figure.get_figwidth() <= PAGE
    assert (figure.get_figwidth() == PAGE) == (n > 51)
    assert len(figure.axes[0].get_xticks()) == (n if n <= 51 else 0)
    on_sheet(figure)


def test_a_coefficient_without_variance_is_left_grey():
    covariance = np.eye(12)
    covariance[3, 3] = 0.0
    ground, shown = hd.correlation_figure(made_up("fossen", covariance=covariance)).axes[0].images
    assert np.ma.getmaskarray(shown.get_array())[3].all()
    assert not np.ma.getmaskarray(ground.get_array())[3, :3].any()
