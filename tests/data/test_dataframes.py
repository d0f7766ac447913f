"""A log as a pandas DataFrame, and a DataFrame as a log."""

import sys

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import GapWarning, LogError


@pytest.fixture(scope="module")
def pandas():
    return pytest.importorskip("pandas", reason="data frames need the extra hydrodamp[pandas]")


@pytest.fixture
def log():
    rng, time = np.random.default_rng(0), 0.1 * np.arange(40)
    columns = {"attitude": 0.1 * rng.standard_normal((40, 3)), "wrench": rng.normal(size=(40, 6))}
    velocity = dict(zip("uvwpqr", 0.1 * rng.standard_normal((6, 40)), strict=True))
    commands = {"rudder": rng.standard_normal(40)}
    return hd.Log.from_arrays(
        time, velocity, commands=commands, segment=["a"] * 15 + ["b"] * 25, **columns
    )


def test_a_log_is_the_same_after_a_data_frame(pandas, log):
    frame = log.to_dataframe()
    again = hd.Log.from_dataframe(frame)
    for name in ("time", "velocity", "attitude", "wrench", "commands"):
        np.testing.assert_array_equal(getattr(again, name), getattr(log, name))
    assert (again.segments, again.command_names) == (log.segments, log.command_names)
    planar = hd.Log.from_dataframe(frame[["u", "r"]])
    assert (planar.velocity_names, planar.attitude) == (("u", "r"), None)


@pytest.mark.parametrize("form", ["column", "stamps", "zone", "differences", "seconds"])
def test_times_are_the_column_or_the_index(pandas, log, form):
    frame = log.to_dataframe().drop(columns="segment")
    start = 0.0
    if form == "column":
        frame = frame.reset_index()
    elif form == "differences":
        frame.index = pandas.to_timedelta(frame.index, unit="s")
    elif form == "seconds":
        frame.index.name = None
    else:
        start = 1.7e9
        frame.index = pandas.to_datetime(start + frame.index, unit="s")
    if form == "zone":
        frame = frame.tz_localize("UTC").tz_convert("Europe/Berlin")
    found = hd.Log.from_dataframe(frame)
    np.testing.assert_allclose(found.time, start + log.time, atol=1e-6)
    np.testing.assert_array_equal(found.velocity, log.velocity)


def test_missing_values_cut_a_log(pandas, log):
    frame = log.to_dataframe().drop(columns="segment").astype("Float64")
    frame.iloc[10:12, frame.columns.get_loc("v")] = pandas.NA
    with pytest.warns(GapWarning, match="2 samples with missing values"):
        cut = hd.Log.from_dataframe(frame, "dive")
    assert [len(piece) for piece in cut.segments] == [10, 28]
    assert cut.source == "dive"


def test_all_faults_of_a_data_frame_are_named(pandas, log, refused):
    frame = log.to_dataframe()
    stamps = pandas.to_datetime(frame.index, unit="s")
    wrong = frame.reset_index(drop=True).assign(u="fast", v=stamps)
    refused(LogError, hd.Log.from_dataframe, wrong)
    refused(LogError, lambda: hd.Log.from_dataframe(pandas.concat([frame, frame[["u"]]], axis=1)))
    refused(LogError, lambda: hd.Log.from_dataframe(frame[["rudder"]]))
    with pytest.raises(LogError):
        hd.Log.from_dataframe(frame.iloc[:0])


def test_without_pandas_the_extra_is_named(log, monkeypatch, refused):
    monkeypatch.setitem(sys.modules, "pandas", None)
    refused(hd.HydrodampError, log.to_dataframe)
