"""Coefficients, intervals and correlations as drawn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.report.figures.apart import colour_of
from hydrodamp.report.figures.coefficients import coefficients_figure
from hydrodamp.report.figures.correlation import correlation_figure
from hydrodamp.report.figures.look import COLUMN, PAGE
from hydrodamp.report.figures.scales import SignedScale, round_numbers
from hydrodamp.report.figures.symbols import coefficient_symbol

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
    many = [replace(fit, method=key) for key in ("ls", "weak", "oe", "rls", "ai", "ridge")]
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


def words_in(panel):
    """Return what is written in and beside a panel, without the empty."""
    return [text.get_text() for text in panel.texts if text.get_text()]


def tied(key, tie=0.0, axes=None):
    """Return a fit whose neighbours err together."""
    model = hd.catalog[key] if axes is None else hd.catalog[key].restricted_to(axes)
    n = model.n_coefficients
    apart = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
    damping = hd.Damping(model, -np.ones(n), covariance=tie**apart)
    return hd.Fit(damping, "ls", hd.Status.OK)


def test_correlation_is_that_of_the_covariance_each_pair_once(sailed, on_sheet):
    fit = sailed.fit("fossen", "weak")
    figure = correlation_figure(fit)
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


def test_squares_of_few_coefficients_have_numbers():
    said = words_in(correlation_figure(tied("fossen", -0.96)).axes[0])
    for number in ("\N{MINUS SIGN}.96", ".92"):
        assert number in said
    assert len(words_in(correlation_figure(tied("fossen", 0.0)).axes[0])) == 6
    many = words_in(correlation_figure(tied("linear", 0.96)).axes[0])
    assert ".96" not in many


def test_pairs_beyond_nine_tenths_are_framed_and_the_most_correlated_listed():
    panel = correlation_figure(tied("linear", 0.95)).axes[0]
    (frames,) = panel.collections
    assert len(frames.get_paths()) == 35 + 34
    said = words_in(panel)
    pairs = [one for one in said if " with " in one]
    assert 5 < len(pairs) <= 12
    assert pairs[0] == "$X_{u}$ with $X_{v}$  $+0.95$"
    assert said[-1] == f"and {69 - len(pairs)} more beyond 0.9"


@pytest.mark.parametrize("key", ["fossen", "linear", "gertler-hagen", "mcfarland-whitcomb"])
def test_it_grows_with_the_model_up_to_the_page_and_no_name_leaves_it(key, on_sheet):
    figure = correlation_figure(tied(key, 0.95))
    assert COLUMN <= figure.get_figwidth() <= PAGE
    assert (figure.get_figwidth() == PAGE) == (hd.catalog[key].n_coefficients > 51)
    on_sheet(figure)


def test_a_coefficient_without_variance_is_left_open():
    fit = tied("gertler-hagen")
    covariance = np.eye(88)
    covariance[3, 3] = 0.0
    covariance[0, 1] = covariance[1, 0] = -0.95
    covariance[6, 7] = covariance[7, 6] = -0.5
    known = replace(fit, damping=replace(fit.damping, covariance=covariance))
    panel = correlation_figure(known).axes[0]
    ground, shown = (image.get_array() for image in panel.images)
    unknown = np.ma.getmaskarray(shown)
    assert unknown[3].all()
    assert not unknown[5, 4]
    assert ground[3, :4].tolist() == [1.0] * 4
    assert ground[4, 4] == 0.0
    assert not panel.get_xticks().size
    named = [text for text in words_in(panel) if text.startswith("$X_") and " with " not in text]
    labels = fit.model.labels
    assert len(named) == 2 * 2, "the pair, on both sides"
    assert set(named) == {coefficient_symbol(labels[0]), coefficient_symbol(labels[1])}
    assert any(text.endswith("$-0.50$") for text in words_in(panel))


def test_where_nothing_is_correlated_no_pair_is_named():
    panel = correlation_figure(tied("fossen", axes=("X", "Y", "N"))).axes[0]
    assert words_in(panel) == ["$X$", "$Y$", "$N$"]
    assert len(panel.lines) == 2 * 2
    assert not panel.collections[0].get_paths()


def test_without_covariance_there_is_no_correlation():
    with pytest.raises(hd.MethodError, match="has no covariance"):
        correlation_figure(made_up("fossen"))
