"""Correlations as drawn."""

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.report.figures.style import COLUMN, PAGE

from .conftest import made_up, tied


@pytest.mark.slow
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


@pytest.mark.slow
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
