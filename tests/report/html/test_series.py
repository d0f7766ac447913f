from __future__ import annotations

import base64

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from hydrodamp.report.html.levels import level
from hydrodamp.report.html.packing import pack, pack_exactly
from hydrodamp.report.html.plots import plots
from hydrodamp.report.html.stage import staged_time, worst_window


def unpacked(packed: dict[str, object]) -> np.ndarray:
    counts = np.frombuffer(base64.b64decode(str(packed["steps"])), "<u2").astype(float)
    counts[counts == 65535] = np.nan
    return packed["low"] + packed["step"] * counts


@settings(max_examples=60, deadline=None)
@given(
    lengths=st.lists(st.integers(1, 40), min_size=1, max_size=4),
    points=st.integers(2, 60),
    seed=st.integers(0, 99),
)
def test_a_level_keeps_every_extreme_and_its_order(lengths, points, seed):
    edges = np.concatenate([[0], np.cumsum(lengths)])
    bounds = list(zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True))
    rng = np.random.default_rng(seed)
    values, time = rng.standard_normal(edges[-1]), np.cumsum(rng.uniform(0.1, 1.0, edges[-1]))
    coarse = level(bounds, points)
    shown, when = coarse.values(values), coarse.times(time)
    assert shown.shape == when.shape
    assert np.all(np.diff(when) > 0.0)
    assert np.isnan(shown).sum() == len(lengths) - 1
    assert np.nanmin(shown) == values.min()
    assert np.nanmax(shown) == values.max()
    for start, stop in bounds:
        inside = shown[(when >= time[start]) & (when <= time[stop - 1])]
        assert inside.min() == values[start:stop].min()
        assert inside.max() == values[start:stop].max()
    low, high = coarse.lowest(values), coarse.highest(values)
    assert low.shape == high.shape == when.shape
    assert np.array_equal(np.isnan(low), np.isnan(shown))
    for start, stop in zip(coarse.starts.tolist(), coarse.stops.tolist(), strict=True):
        inside = (when >= time[start]) & (when <= time[stop - 1])
        assert set(low[inside]) == {values[start:stop].min()}
        assert set(high[inside]) == {values[start:stop].max()}
    if len(values) <= points:
        assert coarse.exact
        np.testing.assert_array_equal(shown[np.isfinite(shown)], values)


def test_a_stretch_runs_the_way_its_samples_do():
    pair = level([(0, 4)], 2)
    assert pair.values(np.array([3.0, 2.0, 1.0, 0.0])).tolist() == [3.0, 0.0]
    assert pair.values(np.array([0.0, 1.0, 2.0, 3.0])).tolist() == [0.0, 3.0]
    assert pair.values(np.array([0.0, 5.0, np.nan, np.nan])).tolist() == [0.0, 5.0]
    assert np.isnan(pair.values(np.full(4, np.nan))).all()


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_packing_errs_by_less_than_half_a_step(scale):
    values = scale * np.random.default_rng(1).standard_normal(500)
    values[7] = np.nan
    packed = pack(values)
    again = unpacked(packed)
    assert np.isnan(again[7])
    assert np.nanmax(np.abs(again - values)) <= 0.5001 * packed["step"]
    assert packed["step"] <= np.ptp(values[np.isfinite(values)]) / 60000


def test_packing_what_does_not_vary_or_is_not_there():
    assert unpacked(pack(np.full(3, 2.5))).tolist() == [2.5] * 3
    assert np.isnan(unpacked(pack(np.full(2, np.nan)))).all()
    values = np.array([0.1, 1e9 + 0.1])
    assert np.frombuffer(base64.b64decode(pack_exactly(values)), "<f8").tolist() == values.tolist()


def test_segments_stand_one_after_another(make_log):
    log = make_log(100.0, 10.0, ("a", "b", "c"))
    time = staged_time(log)
    assert time[0] == 0.0
    assert np.all(np.diff(time) > 0.0)


def test_the_worst_minute_lies_in_one_segment_and_holds_the_worst(make_log):
    log = make_log(400.0, 10.0)
    errors = np.full((log.n, 2), np.nan)
    errors[:] = 0.1
    errors[2300:2400] = 5.0
    errors[100] = np.nan
    bounds = np.array(log.bounds)
    window = worst_window(staged_time(log), bounds, errors, 10_000)
    assert window.start <= 2300
    assert window.stop >= 2400
    assert window.start >= bounds[1, 0]
    assert window.stop - window.start in (600, 601)  # by the rounding of the clock
    assert worst_window(staged_time(log), bounds, errors, 50).stop <= window.stop + 600


def test_a_minute_is_all_of_a_shorter_segment(make_log):
    log = make_log(40.0, 10.0)
    errors = np.zeros((log.n, 1))
    errors[250] = 1.0
    window = worst_window(staged_time(log), np.array(log.bounds), errors, 10_000)
    assert (window.start, window.stop) == tuple(log.bounds[1])


def test_levels_get_finer_and_the_last_is_the_worst_minute(make_log, make_comparison):
    log = make_log(3600.0, 20.0)
    drawn = plots(make_comparison(log, ("linear", "fossen", "coe"), ("ls", "weak")))
    assert drawn is not None
    levels = drawn.document["levels"]
    counts = [len(base64.b64decode(each["time"])) // 8 for each in levels]
    assert counts[0] <= 1602
    assert counts[0] < counts[1] < log.n
    assert counts[2] == 1201
    fine = unpacked(levels[2]["series"][0][0])
    samples = np.lib.stride_tricks.sliding_window_view(log.velocity[:, 0], 1201)[:, ::100]
    assert np.abs(samples - fine[::100]).max(axis=1).min() < 1e-4
    first, last = drawn.document["worst"]
    assert drawn.worst.endswith(f"({first:.0f} to {last:.0f} s in the plots)")
    assert len(drawn.stretches) == 12
    assert drawn.left_out == 0


def test_a_short_log_is_drawn_as_it_is(comparison):
    drawn = plots(comparison)
    assert drawn is not None
    assert len(drawn.document["levels"]) == 1
    assert len(drawn.rows) == 5
    assert drawn.rows[0].rms == 0.46


def test_a_band_is_never_narrower_than_itself_at_any_level(make_log, make_comparison, make_band):
    comparison = make_comparison(make_log(3600.0, 20.0), ("linear", "fossen"), ("ls", "weak"))
    band = make_band(comparison)
    drawn = plots(comparison, band)
    assert drawn is not None
    run = comparison.best().trajectory
    turn = np.degrees(1.0)
    for each in drawn.document["levels"]:
        assert len(each["band"]) == 6
        lower, upper = (unpacked(edge) for edge in each["band"][3])
        line = unpacked(each["series"][1][3])
        seen = np.isfinite(line)
        assert np.array_equal(seen, np.isfinite(lower))
        assert np.all(upper[seen] - line[seen] > 0.19 * turn)
        assert np.all(line[seen] - lower[seen] > 0.19 * turn)
    widest = turn * np.max(band.upper[:, 3])
    for each in drawn.document["levels"][:2]:
        assert np.nanmax(unpacked(each["band"][3][1])) == pytest.approx(widest, rel=1e-3)
    assert run is not None


def test_the_band_says_whose_it_is_and_how_wide(make_log, make_comparison, make_band):
    comparison = make_comparison(make_log(200.0, 10.0), ("linear", "fossen"), ("ls",))
    drawn = plots(comparison, make_band(comparison, half=0.0123))
    assert drawn is not None
    assert drawn.band is not None
    assert drawn.document["band"] == {"name": drawn.band.name, "colour": drawn.lines[0].colour}
    assert drawn.band.name == "95 % band of linear by ls"
    assert drawn.band.words.startswith("Shaded, of linear by ls: where 95 % of the replays")
    assert "Half its width, in the root mean square: u 0.013 m/s, v 0.013 m/s" in drawn.band.words
    assert drawn.band.words.endswith("r 0.74 deg/s.")
    without = plots(comparison)
    assert without is not None
    assert without.band is None
    assert without.document["band"] is None
    assert all(each["band"] == [] for each in without.document["levels"])


def test_a_band_without_a_number_says_no_width(make_log, make_comparison, make_band):
    comparison = make_comparison(make_log(60.0, 10.0), ("fossen",), ("ls",))
    band = make_band(comparison, half=np.nan)
    drawn = plots(comparison, band)
    assert drawn is not None
    assert drawn.band is not None
    assert drawn.band.words.endswith("is in a band.")


def test_colour_is_the_method_and_dashes_are_the_model(make_log, make_comparison):
    names = ("linear", "prestero", "fossen"), ("ls", "weak")
    comparison = make_comparison(make_log(60.0, 10.0), *names)
    drawn = plots(comparison)
    assert drawn is not None
    looks = {line.name: (line.colour, line.dashes) for line in drawn.lines}
    assert len(set(looks.values())) == 6
    for method in names[1]:
        assert len({looks[f"{model} by {method}"][0] for model in names[0]}) == 1
    for model in names[0]:
        assert len({looks[f"{model} by {method}"][1] for method in names[1]}) == 1
    chosen = comparison.best()
    assert looks[f"{chosen.model} by {chosen.method}"][1] == ()
    assert [each["dashes"] for each in drawn.document["replays"]] == [
        line.dashes for line in drawn.lines
    ]
