"""Froude similitude of logs: segments, cleaning, quality issues, delays and lags scale.

Physical constants do not scale and are not here: the speed of ocean currents and their change,
the rounding of sensors, and the delays of computers between messages.
"""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.conditioning.quality_checks import check_quality
from hydrodamp.identification.command_response import estimate_command_response
from hydrodamp.ingest.inspection.delay import estimate_delays
from similitude import scale_log, scale_vehicle

RATIOS = (0.1, 10.0, 160.0)
LENGTH = 2.2  # m
MODEL = hd.catalog["linear"].with_terms({"M": "u^2*elevator", "N": "u^2*rudder", "X": "rpm"})


@pytest.fixture(scope="module")
def campaign():
    return hd.reenact(seed=1, duration=40.0)


@pytest.fixture(scope="module")
def log(campaign):
    """A log with outliers, a frozen rate and two short dropouts."""
    train = campaign.train
    velocity = train.velocity.copy()
    velocity[[100, 200, 300], 0] += 1.0
    velocity[150:180, 5] = velocity[150, 5]
    return replace(train, velocity=velocity)


def read_again(log):
    """Return a log made from the arrays of another, segments and gaps found anew."""
    labels = [segment.name for segment in log.segments for _ in range(len(segment))]
    commands = {name: log.command(name) for name in log.command_names}
    arrays = {"attitude": log.attitude, "commands": commands, "segment": labels}
    return hd.Log.from_arrays(log.time, log.velocity, **arrays)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::hydrodamp.errors.GapWarning")
@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("gap", [0.3, 0.5])
def test_gaps_scale(log, ratio, gap):
    time = log.time.copy()
    time[70:] += gap * log.time_scale
    paused = replace(log, time=time)
    expected, scaled = read_again(paused), read_again(scale_log(paused, ratio))
    assert scaled.segments == expected.segments
    assert (len(scaled.segments) > len(log.segments)) == (gap > 0.4)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::hydrodamp.errors.GapWarning")
@pytest.mark.parametrize("ratio", RATIOS)
def test_cleaned_logs_scale(log, ratio):
    expected, cleaned = hd.clean(log), hd.clean(scale_log(log, ratio))
    assert cleaned.segments == expected.segments
    changed = [
        [note for note in each.notes if "samples of" in note] for each in (expected, cleaned)
    ]
    assert changed[0] == changed[1] != []
    reference = scale_log(expected, ratio)
    np.testing.assert_allclose(cleaned.velocity, reference.velocity, rtol=1e-9, atol=1e-12)


# No marine vehicle exceeds 30 m/s, so a larger ratio would give an issue of the unit.
@pytest.mark.slow
@pytest.mark.parametrize("ratio", [0.1, 10.0, 40.0])
def test_quality_issues_scale(log, ratio):
    rates = log.velocity * np.r_[np.ones(3), 180.0 / np.pi, np.ones(2)]
    wrong = replace(log, velocity=rates)
    expected = [(each.channel, each.problem) for each in check_quality(wrong, LENGTH)]
    found = check_quality(scale_log(wrong, ratio), LENGTH * ratio)
    assert [(each.channel, each.problem) for each in found] == expected != []


@pytest.mark.parametrize("ratio", RATIOS)
def test_delays_scale(log, ratio):
    expected, scaled = estimate_delays(log), estimate_delays(scale_log(log, ratio))
    assert [each.command for each in expected] == ["rudder", "elevator"]
    for each, reference in zip(scaled, expected, strict=True):
        for name in ("command", "velocity", "sign", "confidence"):
            assert getattr(each, name) == getattr(reference, name)
        # rounding of the clock decides whether the last sample of a segment is used
        step = float(np.median(log.steps))
        assert each.seconds / np.sqrt(ratio) == pytest.approx(reference.seconds, abs=1e-3 * step)


@pytest.mark.slow
@pytest.mark.parametrize("ratio", RATIOS)
def test_lags_of_commands_scale(campaign, ratio):
    """A command in advance of the motion has a lag."""
    vehicle, train = scale_vehicle(campaign.vehicle, 1.0), campaign.train
    early = replace(train, commands=np.roll(train.commands, -2, axis=0))
    expected, response = (
        estimate_command_response(
            hd.prepare(scale_vehicle(vehicle, each), scale_log(early, each), MODEL), MODEL
        )
        for each in (1.0, ratio)
    )
    assert response.is_significant == expected.is_significant
    root = np.sqrt(ratio)
    assert response.estimates["lag"] / root == pytest.approx(expected.estimates["lag"], rel=1e-3)
    assert response.significance == pytest.approx(expected.significance, rel=1e-3)
