import base64
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import hydrodamp as hd
from hydrodamp.data.log import Segment
from hydrodamp.report.decimation import encode_values, trace
from hydrodamp.report.figures.style import model_colours
from hydrodamp.report.series import replay_series

from .conftest import make_comparison, make_log


def unpacked(packed):
    counts = np.frombuffer(base64.b64decode(str(packed["steps"])), "<u2").astype(float)
    counts[counts == 65535] = np.nan
    return packed["low"] + packed["step"] * counts


def drawn_of(comparison, band=None, rows=None):
    drawn = replay_series(comparison, comparison.rows if rows is None else rows, band)
    assert drawn is not None
    return drawn


def times_of(document):
    return np.frombuffer(base64.b64decode(str(document["time"])), "<f8")


@settings(max_examples=60, deadline=None)
@given(
    lengths=st.lists(st.integers(2, 40), min_size=1, max_size=4),
    points=st.integers(2, 60),
    seed=st.integers(0, 99),
)
def test_stretches_keep_every_extreme_and_its_order(lengths, points, seed):
    edges = np.concatenate([[0], np.cumsum(lengths)])
    bounds = list(zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True))
    rng = np.random.default_rng(seed)
    values, time = rng.standard_normal(edges[-1]), np.cumsum(rng.uniform(0.1, 1.0, edges[-1]))
    segments = tuple(Segment(str(k), *each) for k, each in enumerate(bounds))
    log = hd.Log(time, np.zeros((len(time), 6)), segments=segments)
    when, shown = trace(log, values, points)
    assert shown.shape == when.shape
    assert np.all(np.diff(when) >= 0.0)
    if len(values) <= points:
        seen = np.isfinite(shown)
        assert np.isnan(shown).sum() == len(lengths) - 1
        np.testing.assert_array_equal(shown[seen], values)
    assert np.nanmin(shown) == values.min()
    assert np.nanmax(shown) == values.max()


@pytest.mark.parametrize("values", [[0.0, np.nan, 1e300, -1e300], [np.nan, np.nan], [3.0, 3.0], []])
def test_values_of_any_size_survive_the_encoding(values):
    packed = encode_values(np.array(values))
    np.testing.assert_allclose(unpacked(packed), values, atol=packed["step"])


def test_a_short_log_is_drawn_as_it_is(comparison):
    """Of one row the replay diverged: it has no number at its last sample."""
    drawn = drawn_of(comparison)
    assert not drawn["is_thinned"]
    assert len(drawn["lines"]) == 5
    measured, first, second = (unpacked(drawn["panels"][0]["series"][k]) for k in range(3))
    log = comparison.rows[0].trajectory.log
    seen = np.isfinite(measured)
    assert np.flatnonzero(~seen).tolist() == [3]  # between two segments
    np.testing.assert_allclose(measured[seen], log.velocity[:, 0], atol=1e-3)
    np.testing.assert_allclose(first[seen], log.velocity[:, 0] + 0.5, atol=1e-3)
    assert np.isnan(second[-1])
    rate = unpacked(drawn["panels"][3]["series"][0])
    np.testing.assert_allclose(rate[seen], np.degrees(log.velocity[:, 3]), rtol=1e-3)
    time = times_of(drawn)
    assert time[0] == 0.0
    assert np.all(np.diff(time) >= 0.0)


@pytest.mark.slow
def test_a_long_log_is_thinned_to_what_a_page_can_carry():
    log = make_log(1000.0, 40.0)
    drawn = drawn_of(make_comparison(log, ("linear", "fossen", "coe"), ("ls", "weak")))
    assert drawn["is_thinned"]
    assert 4_000 < len(times_of(drawn)) < 25_000 < log.n
    measured = unpacked(drawn["panels"][0]["series"][0])
    step = drawn["panels"][0]["series"][0]["step"]
    assert np.nanmax(measured) == pytest.approx(log.velocity[:, 0].max(), abs=step)
    assert np.nanmin(measured) == pytest.approx(log.velocity[:, 0].min(), abs=step)
    assert drawn["left_out"] == 0
    methods = tuple(f"m{k}" for k in range(17))
    many = drawn_of(make_comparison(make_log(20.0, 10.0), ("linear", "fossen"), methods))
    assert (len(many["lines"]), many["left_out"]) == (32, 2)


def test_replays_have_the_colours_of_the_table_in_any_order():
    """Models outside the catalogue take free colours, in the order of the comparison."""
    comparison = make_comparison(make_log(60.0, 10.0), ("linear", "prestero", "fossen"), ("weak",))
    renamed = []
    for row in comparison.rows:
        model = replace(row.fit.model, key=f"{row.model}-gains")
        fit = replace(row.fit, damping=replace(row.fit.damping, model=model))
        renamed.append(replace(row, fit=fit))
    comparison = replace(comparison, rows=tuple(renamed))
    expected = model_colours(comparison.models)
    drawn = drawn_of(comparison, rows=comparison.rows[::-1])
    assert {each["model"]: each["colour"] for each in drawn["lines"]} == expected
