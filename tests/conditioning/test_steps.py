"""Steps by their names: the same as the functions, and faults told at once."""

import json
from pathlib import Path

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.conditioning import actuator_response, outliers
from hydrodamp.conditioning.pipeline import clean, parse_steps
from hydrodamp.data.log import Log
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError
from table_rows import rows
from value_changes import set_values

WRONG = json.loads(Path(__file__).with_name("wrong_steps.json").read_text("utf-8"))


@pytest.fixture
def turning():
    """Yawing to and fro with a rudder, one spike in the surge."""
    time = np.arange(0.0, 30.0, 0.1)
    surge = np.where(np.arange(300) == 100, 9.0, 1.0 + 0.05 * np.sin(time))
    attitude = np.outer(0.5 * np.sin(0.5 * time), (0, 0, 1))
    rudder = {"rudder": np.sign(np.sin(time))}
    return Log.from_arrays(time, {"u": surge}, attitude=attitude, commands=rudder)


def test_a_mapping_does_its_steps(turning):
    fields = {
        "t": turning.time,
        "speed": turning.velocity[:, 0],
        "yaw": 0.5 * np.sin(0.5 * turning.time),
        "rudder": turning.command("rudder"),
    }
    mapping = hd.LogMapping.from_dict(
        {
            "time": "t",
            "velocity": {"u": "speed"},
            "attitude": {"yaw": "yaw"},
            "commands": ["rudder"],
            "steps": [{"apply_delay": {"rudder": 0.2}}, "rates_from_attitude"],
        }
    )
    log = mapping.log(Recording((Topic("", None, fields),), "dive", "table"))
    assert log.velocity_names == ("u", "r")
    assert any("derived" in said for said in log.notes)


@rows("content, said")
def test_what_is_wrong_is_said(content, said):
    steps, faults = parse_steps(content)
    assert steps == ()
    assert said in faults[0]


@pytest.mark.parametrize("settings", WRONG["settings"])
def test_settings_are_checked_before_any_log_is_read(settings, refused):
    mapping = {"time": "t", "velocity": {"u": "speed"}, "steps": [settings]}
    refused(LogError, hd.LogMapping.from_dict, mapping)


def test_settings_reach_the_function(turning):
    content = [
        "clean",
        {"remove_outliers": {"names": ["u"], "threshold": 1e6}},
        {"rates_from_attitude": {"names": ["r"]}},
        {"apply_first_order_lag": {"rudder": 0.5}},
    ]
    steps, faults = parse_steps(content)
    assert not faults
    cleaned = outliers.remove_outliers(hd.clean(turning), names=["u"], threshold=1e6)
    by_hand = actuator_response.apply_first_order_lag(
        hd.rates_from_attitude(cleaned, ["r"]), {"rudder": 0.5}
    )
    found = clean(turning, steps)
    np.testing.assert_array_equal(found.velocity, by_hand.velocity)
    np.testing.assert_array_equal(found.commands, by_hand.commands)
    assert found.notes == by_hand.notes


def spoilt(swim):
    log = set_values(
        swim,
        "velocity",
        (np.s_[10, :3], -32.768),
        (np.s_[30, 5], lambda r: r + 5.0),
        (np.s_[60:73, 0], swim.velocity[60, 0]),
    )
    return set_values(log, "attitude", (50, [0, 1, 0, 0]))


def test_every_step_counts_its_own(swim, counts):
    made = clean(spoilt(swim))
    assert counts(made, "no measurement") == {"u": 1, "v": 1, "w": 1}
    assert counts(made, "frozen") == {"u": 12}
    assert counts(made, "attitude leaps") == {"attitude": 1}
    assert counts(made, "spikes") == {"r": 1}
    assert len(made.notes) == 6
    rows = np.searchsorted(swim.time, made.time)
    np.testing.assert_allclose(made.velocity, swim.velocity[rows], atol=5e-3)


def test_a_clean_log_stays_as_it_is_and_clean(swim):
    assert clean(swim) is swim
    once = clean(spoilt(swim))
    assert clean(once).notes == once.notes
