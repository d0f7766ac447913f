"""Steps by their names: the same as the functions, and faults told at once."""

from __future__ import annotations

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.conditioning.steps import STEPS, Step, prepared, steps_of
from hydrodamp.data.log import Log
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError


@pytest.fixture
def turning() -> Log:
    """Yawing to and fro with a rudder, one spike in the surge."""
    time = np.arange(0.0, 30.0, 0.1)
    surge = 1.0 + 0.05 * np.sin(time)
    surge[100] = 9.0
    yaw = 0.5 * np.sin(0.5 * time)
    attitude = np.column_stack([0 * time, 0 * time, yaw])
    return Log.from_arrays(
        time, {"u": surge}, attitude=attitude, commands={"rudder": np.sign(np.sin(time))}
    )


def test_a_list_of_steps_is_the_functions_in_turn(turning: Log) -> None:
    steps, faults = steps_of(
        ["clean", {"rates_from_attitude": {"names": ["r"]}}, {"lagged": {"rudder": 0.3}}]
    )
    assert not faults
    found = prepared(turning, steps)
    by_hand = hd.lagged(hd.rates_from_attitude(hd.clean(turning).log, ["r"]), {"rudder": 0.3})
    np.testing.assert_array_equal(found.velocity, by_hand.velocity)
    np.testing.assert_array_equal(found.commands, by_hand.commands)
    assert found.notes == by_hand.notes
    assert found.velocity[:, 0].max() < 2.0


def test_a_mapping_does_its_steps(turning: Log) -> None:
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
            "steps": [{"delayed": {"rudder": 0.2}}, "rates_from_attitude"],
        }
    )
    log = mapping.log(Recording((Topic("", None, fields),), "dive", "table"))
    assert log.velocity_names == ("u", "r")
    assert any("derived" in said for said in log.notes)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("clean", "`steps` must be a list"),
        ([3], "a step must be a name"),
        ([{"clean": None, "lagged": None}], "a step must be a name"),
        (["polish"], "unknown step `polish`"),
        (["claen"], "Did you mean 'clean'"),
        ([{"clean": 3}], "must be a table"),
        (["lagged"], "`lagged` needs commands"),
        ([{"remove_spikes": {"treshold": 3}}], "Did you mean 'threshold'"),
    ],
)
def test_what_is_wrong_is_said(content: object, said: str) -> None:
    steps, faults = steps_of(content)
    assert steps == ()
    assert said in faults[0]


def test_all_faults_at_once_with_those_of_the_mapping() -> None:
    with pytest.raises(LogError) as raised:
        hd.LogMapping.from_dict({"time": "t", "velocity": {"x": "y"}, "steps": ["polish"]})
    assert len(raised.value.faults) >= 2


def test_a_setting_of_the_wrong_kind_names_the_step(turning: Log) -> None:
    with pytest.raises(LogError, match="remove_spikes"):
        Step("remove_spikes", (("threshold", "much"),))(turning)


def test_an_unknown_mixing_is_refused(turning: Log) -> None:
    settings = (("demanded", ["a", "b"]), ("fins", ["c", "d"]), ("mixing", "mine"))
    with pytest.raises(LogError, match=r"unknown mixing 'mine'\. Known: rotation avl690"):
        Step("roll_from_mixing", settings)(turning)


def test_every_step_is_a_public_function() -> None:
    assert all(callable(getattr(hd, name)) for name in STEPS)
