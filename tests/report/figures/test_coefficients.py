"""Coefficients, intervals and correlations as drawn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.report.figures.coefficients import coefficients_figure
from hydrodamp.report.figures.correlation import correlation_figure
from hydrodamp.report.figures.look import COLUMN, PAGE, colour_of
from hydrodamp.report.figures.scales import SignedScale, round_numbers

from .conftest import legend


def bare(fit):
    """The fit without any uncertainty."""
    return replace(fit, uncertainty=None, damping=replace(fit.damping, covariance=None))


def made_up(key, method="ls"):
    model = hd.catalog[key]
    values = np.linspace(-3.0, 5.0, model.n_coefficients)
    return hd.Fit(hd.Damping(model, values), method, hd.Status.OK)


def test_every_coefficient_stands_at_its_value_with_its_interval(sailed, on_sheet):
    fit = sailed.fit("fossen", "weak")
    figure = coefficients_figure([fit], level=0.9)
    assert [panel.get_title("left")[:3] for panel in figure.axes] == [f"${x}$" for x in "XYZKMN"]
    points = np.concatenate([panel.lines[0].get_xdata() for panel in figure.axes])
    assert points == pytest.approx(fit.damping.coefficients)
    ends = np.concatenate(
        [np.array(panel.collections[0].get_segments())[:, :, 0] for panel in figure.axes]
    )
    assert ends == pytest.approx(fit.uncertainty.interval(fit.damping.coefficients, 0.9))
    assert legend(figure) == ["fossen by weak, 90 % intervals"]
    assert figure.axes[3].get_title("left").endswith("[N m per unit of the term]")
    on_sheet(figure)


def test_methods_stand_beside_each_other_in_their_colours(sailed):
    figure = coefficients_figure([sailed.fit("fossen", key) for key in ("weak", "ai")])
    drawn = [line for line in figure.axes[0].lines if len(line.get_xdata()) == 2]
    colours = {line.get_color() for line in drawn if line.get_marker() != "None"}
    assert colours == {colour_of("weak"), colour_of("ai")}
    assert legend(figure)[1] == "fossen by ai, no intervals"


def test_coefficients_not_told_apart_are_hollow():
    fit = replace(made_up("uncoupled"), aliased=(("X_u^2", "X_u|u|"),))
    faces = {}
    for line in coefficients_figure([fit]).axes[0].lines:
        if line.get_marker() != "None":
            faces[line.get_markerfacecolor()] = len(line.get_xdata())
    assert faces == {colour_of("ls"): 2, "white": 2}


def test_a_covariance_alone_is_said_to_be_for_white_residuals():
    fit = made_up("fossen")
    known = replace(fit, damping=replace(fit.damping, covariance=np.eye(12)))
    figure = coefficients_figure([known])
    assert legend(figure) == ["fossen by ls, 95 % intervals for white residuals"]
    low, high = np.array(figure.axes[0].collections[0].get_segments())[0, :, 0]
    assert high - low == pytest.approx(2.0 * 1.959964, rel=1e-6)


def test_what_is_too_tall_for_a_column_takes_the_page(on_sheet):
    fit = made_up("linear")
    assert coefficients_figure([fit]).get_figwidth() == COLUMN
    figure = coefficients_figure([replace(fit, method=key) for key in ("ls", "weak", "oe")])
    assert figure.get_figwidth() == PAGE
    on_sheet(figure)


def test_axes_without_coefficients_have_no_panel():
    model = hd.catalog["linear"].restricted_to(("X", "Y", "N"))
    fit = hd.Fit(hd.Damping(model, -np.ones(model.n_coefficients)), "ls", hd.Status.OK)
    assert len(coefficients_figure([fit]).axes) == 3
    four = hd.catalog["linear"].restricted_to(("X", "Y", "Z", "N"))
    fit = hd.Fit(hd.Damping(four, np.ones(16)), "ls", hd.Status.OK)
    many = [replace(fit, method=key) for key in ("ls", "weak", "oe", "gls", "ai", "ridge")]
    assert len(coefficients_figure(many).axes) == 4


def test_zeros_alone_can_be_drawn():
    model = hd.catalog["fossen"]
    figure = coefficients_figure([hd.Fit(hd.Damping(model, np.zeros(12)), "ls", hd.Status.OK)])
    low, high = figure.axes[0].get_xlim()
    assert low < 0.0 < high


def test_fits_that_cannot_share_a_figure_are_refused():
    lost = replace(made_up("linear"), status=hd.Status.FAILED)
    assert legend(coefficients_figure([made_up("linear"), lost]))[1] == "linear by ls: failed"
    with pytest.raises(hd.MethodError, match="no fit has coefficients"):
        coefficients_figure([lost])
    with pytest.raises(hd.MethodError, match="of one model; got linear, fossen"):
        coefficients_figure([made_up("linear"), made_up("fossen")])


@pytest.mark.parametrize("seed", range(5))
def test_a_signed_scale_holds_zero_and_every_number(seed):
    values = np.random.default_rng(seed).standard_normal(20) * 10.0 ** np.arange(-10, 10)
    scale = SignedScale.of(values, beyond=1.5, decades=4)
    assert scale.low < min(values.min(), 0.0) <= max(values.max(), 0.0) < scale.high
    ticks = scale.ticks(2)
    assert 0.0 in ticks
    assert all(scale.low <= tick <= scale.high for tick in ticks)
    assert len(ticks) <= 5


def test_round_numbers_stay_in_their_range():
    for low, high in ((0.013, 0.9), (1e-8, 1e12), (4.4, 260.0)):
        numbers = round_numbers(low, high)
        assert 3 <= len(numbers) <= 12
        assert low <= min(numbers) < max(numbers) <= high


def test_correlation_is_that_of_the_covariance(sailed, on_sheet):
    fit = sailed.fit("fossen", "weak")
    figure = correlation_figure(fit)
    shown = np.asarray(figure.axes[0].images[0].get_array())
    size = fit.uncertainty.standard_errors
    assert shown == pytest.approx(fit.damping.covariance / np.outer(size, size))
    assert figure.axes[0].get_yticklabels()[0].get_text() == "$X_{u}$"
    assert figure.axes[0].get_title("left").startswith("fossen by weak\nmost correlated: ")
    on_sheet(figure)


def test_a_coefficient_without_variance_is_left_open():
    fit = made_up("gertler-hagen")
    covariance = np.eye(88)
    covariance[3, 3] = 0.0
    covariance[0, 1] = covariance[1, 0] = -0.5
    known = replace(fit, damping=replace(fit.damping, covariance=covariance))
    figure = correlation_figure(known)
    shown = figure.axes[0].images[0].get_array()
    assert np.ma.getmaskarray(shown)[3].all()
    assert not np.ma.getmaskarray(shown)[4, 5]
    assert "$-0.50$" in figure.axes[0].get_title("left")
    assert [text.get_text() for text in figure.axes[0].get_xticklabels()] == [
        f"${axis}$" for axis in "XYZKMN"
    ]


def test_where_nothing_is_correlated_no_pair_is_named():
    model = hd.catalog["fossen"].restricted_to(("X", "Y", "N"))
    damping = hd.Damping(model, -np.ones(6), covariance=np.eye(6))
    panel = correlation_figure(hd.Fit(damping, "ls", hd.Status.OK)).axes[0]
    assert panel.get_title("left") == "fossen by ls"
    assert len(panel.lines) == 2 * 2


def test_without_covariance_there_is_no_correlation():
    with pytest.raises(hd.MethodError, match="has no covariance"):
        correlation_figure(made_up("fossen"))
