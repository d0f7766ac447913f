from dataclasses import replace

import numpy as np
import pytest

from hydrodamp.data.attitude import quaternion_from_euler
from hydrodamp.data.log import Log
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.ingest.inspection import columns
from hydrodamp.ingest.inspection.delay import estimate_delays
from hydrodamp.ingest.inspection.draft_names import command_names
from hydrodamp.ingest.inspection.probe import describe_join, probe
from hydrodamp.ingest.mapping import LogMapping


def test_a_log_of_days_tells_its_units_as_one_of_minutes(monkeypatch):
    """A clock that is thinned tenfold has no gap from tick to tick."""
    monkeypatch.setattr(columns, "_MAX_SAMPLES", 200)
    time = np.arange(2000.0)
    yaw = 0.6 * np.sin(time / 40)
    turning = {"yaw_deg": np.degrees(yaw), "yaw_rate": np.degrees(np.gradient(yaw, time))}
    table = Topic("", None, {"t": time, **turning})
    assert probe(Recording((table,), "days.csv", "text in columns")).roles.rates.unit == "deg/s"


def test_a_topic_without_a_message_hinders_no_joining():
    time, nothing = np.arange(50.0), Topic("/none", np.empty(0), {"u": np.empty(0)})
    pose, fins = Topic("/pose", time, {"x": time}), Topic("/fins", time, {"rudder": time})
    made = [Recording((one, nothing), name, "") for one, name in ((pose, "a"), (fins, "b"))]
    assert describe_join([replace(made[0], topics=(pose,)), made[1]]).startswith("`a+b` ")
    assert describe_join([Recording((nothing,), "c", ""), made[1]]) == ""


def surge(delay, step, irregular=False, n=3000):
    """Surge with quadratic drag that answers a thruster some steps late; noise on top."""
    rng = np.random.default_rng(7)
    command = np.repeat(rng.choice([-1.0, 0.0, 0.5, 1.0], n // 50 + 1), 50)[:n]
    speed = np.zeros(n)
    for k in range(n - 1):
        force = command[max(k - delay, 0)]
        speed[k + 1] = speed[k] + step * (force - 0.8 * speed[k] * abs(speed[k]))
    keep = np.sort(rng.permutation(n)[: n * 3 // 4]) if irregular else np.arange(n)
    time = step * np.arange(n)
    return Log.from_arrays(
        time[keep] + 1.7e9,
        {"u": speed[keep] + 1e-3 * rng.standard_normal(len(keep)), "r": 0.01 * np.sin(time[keep])},
        commands={"rpm": command[keep], "light": np.ones(len(keep)), "still": 0 * keep},
    )


@pytest.mark.parametrize(("delay", "irregular"), [(0, False), (4, False), (12, False), (6, True)])
def test_delay_comes_back(delay, irregular):
    (found,) = estimate_delays(surge(delay, 0.05, irregular))
    assert (found.command, found.velocity, found.sign) == ("rpm", "u", 1)
    assert found.seconds == pytest.approx(0.05 * delay, abs=0.05)
    assert found.confidence > 90
    assert found.standard_deviation < 0.05


def test_a_righting_moment_is_not_taken_for_the_response():
    """Pitch obeys q' = c - 4 theta - 0.3 q: lightly damped, it rings for longer than commands."""
    rng, step, n = np.random.default_rng(2), 0.1, 3000
    command = 0.3 * np.repeat(rng.choice([-1.0, 0.0, 0.0, 1.0], n // 15), 15)
    pitch, rate = np.zeros(n), np.zeros(n)
    for k in range(n - 1):
        rate[k + 1] = rate[k] + step * (command[k] - 4.0 * pitch[k] - 0.3 * rate[k])
        pitch[k + 1] = pitch[k] + step * rate[k + 1]
    noise = 1e-3 * rng.standard_normal(n)
    log = Log.from_arrays(
        step * np.arange(n),
        {"u": 0.01 * np.sin(np.arange(n)), "q": rate + noise},
        attitude=quaternion_from_euler(np.column_stack((0 * pitch, pitch, 0 * pitch))),
        commands={"elevator": command},
    )
    (found,) = estimate_delays(log)
    assert (found.velocity, found.sign) == ("q", 1)
    assert found.seconds == pytest.approx(0.0, abs=0.1)


def test_a_command_that_does_nothing_has_no_delay():
    rng = np.random.default_rng(3)
    time = np.arange(0.0, 200.0, 0.1)
    command = np.repeat(rng.choice([0.0, 1.0], 40), 50)
    log = Log.from_arrays(time, {"u": rng.standard_normal(2000)}, commands={"lamp": command})
    assert estimate_delays(log) == ()


def test_command_names_are_short_legal_and_unlike():
    names = command_names(["/a/port.data", "/b/port.data", "yes", "1", "a b", "a-b", "!", "u|v"])
    assert len(set(names)) == len(names)
    content = {"time": "t", "velocity": {"u": "u"}, "commands": dict.fromkeys(names, "c")}
    assert tuple(LogMapping.from_dict(content).commands) == tuple(names)


def test_a_channel_rests_only_where_it_rests_in_all_logs():
    time = np.arange(0.0, 60.0, 0.1)

    def turns(yaw):
        fields = {"t": time, "r": np.sin(time), "ch_yaw": yaw * np.cos(time), "ch_roll": 0 * time}
        return Recording((Topic("", None, fields),), "turns.csv", "text in columns")

    assert probe(turns(0.0)).roles.all_of("commands") == ()
    found = probe(turns(0.0), turns(0.5)).roles
    assert [one.column for one in found.all_of("commands")] == ["ch_yaw"]
    assert found.without_role["ch_roll"] == "never changes from 0"
