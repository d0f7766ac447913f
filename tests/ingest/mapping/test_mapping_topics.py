"""Topics on clocks of their own become one log."""

import warnings

import numpy as np
import pytest

from hydrodamp.data.attitude import euler_from_quaternion
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import ClockWarning, GapWarning, LogError
from hydrodamp.ingest.mapping import LogMapping
from hydrodamp.ingest.mapping.assemble import build_record
from table_rows import rows

FAST, SLOW = np.arange(0, 20, 0.1), np.arange(0.03, 20, 0.25)


def dive(*more, notes=()):
    """A Doppler log at 4 Hz, a gyroscope at 10 Hz, a fin; and more, or others in their place."""
    dvl = Topic("/dvl", SLOW, {"v.x": 1 + 0.1 * SLOW, "v.y": 0 * SLOW, "ok": 1 + 0 * SLOW})
    imu = Topic("/imu", FAST, {"r": 0.5 * np.cos(FAST), "yaw": 0.5 * np.sin(FAST)})
    fin = Topic("/fin", np.arange(0, 20.0), {"angle": np.arange(20.0)})
    topics = {topic.name: topic for topic in (dvl, imu, fin, *more)}
    return Recording(tuple(topics.values()), "dives/dive7.bag", "a test", notes)


def mapping(**more):
    content = {
        "time": "recorded",
        "velocity": {"u": "/dvl.v.x", "r": "/imu.r"},
        "attitude": {"yaw": "/imu.yaw"},
        "commands": {"rudder": "/fin.angle"},
    }
    return LogMapping.from_dict({**content, **more}, "map.yaml")


def read_quietly(recording, given):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", GapWarning)
        return given.log(recording)


def test_the_fastest_velocity_gives_the_clock():
    with pytest.warns(GapWarning, match="no samples|missing values"):
        log = mapping().log(dive())
    first, last = SLOW[[0, -1]]
    assert log.time.tolist() == FAST[(first <= FAST) & (last >= FAST)].tolist()
    np.testing.assert_allclose(log.velocity[:, 0], 1 + 0.1 * log.time)
    np.testing.assert_allclose(log.velocity[:, 5], 0.5 * np.cos(log.time))
    np.testing.assert_allclose(log.command("rudder"), np.floor(log.time + 1e-9))
    assert log.notes[0] == "2 topics resampled to the clock of `/imu`"


@pytest.mark.parametrize("clock", ["/dvl", {"topic": "/dvl"}, {"rate": 2.0}])
def test_a_topic_or_a_rate_gives_the_clock(clock):
    log = read_quietly(dive(), mapping(clock=clock))
    np.testing.assert_allclose(log.velocity[:, 0], 1 + 0.1 * log.time)
    if clock == {"rate": 2.0}:
        np.testing.assert_allclose(np.diff(log.time), 0.5)
        assert "resampled to 2 Hz over the messages of `/imu`" in log.notes
    else:
        assert set(log.time.tolist()) <= set(SLOW.tolist())


ODD = {
    # angles in degrees; no clock; a simulator's seconds beside the seconds since 1970; no message
    "spun": Topic("/spun", FAST, {"roll": 0 * FAST, "pitch": 0 * FAST + 9, "yaw": 90 * FAST % 360}),
    "bare": Topic("/bare", None, {"angle": np.arange(3.0), "stamps": np.arange(3.0)}),
    "late": Topic("/late", 1.7e9 + np.arange(20.0), {"a": np.arange(20.0)}),
    "early": Topic("/early", -100 + np.arange(20.0), {"a": np.arange(20.0)}),
    "empty": Topic("/empty", np.empty(0), {"a": np.empty(0)}),
}


@rows("topic, more")
def test_what_the_topics_do_not_give_is_told(topic, more, refused):
    topics = [ODD[topic]] if topic else []
    refused(LogError, lambda: mapping(**more).log(dive(*topics)))


def test_a_delay_is_taken_off_the_stamps():
    delayed = {"u": {"column": "/dvl.v.x", "delay": 0.4}, "r": "/imu.r"}
    log = read_quietly(dive(), mapping(velocity=delayed))
    np.testing.assert_allclose(log.velocity[:, 0], 1 + 0.1 * (log.time + 0.4))


def test_rows_that_do_not_meet_a_condition_do_not_count():
    """Without bottom lock for two seconds the Doppler log says nonsense: a gap in it."""
    dropped = (SLOW > 5) & (SLOW < 7)
    nonsense = np.where(dropped, 99.0, 1 + 0.1 * SLOW)
    dvl = Topic("/dvl", SLOW, {"v.x": nonsense, "ok": np.where(dropped, 0.0, 1.0)})
    for where in ("ok", "/dvl.ok", {"ok": 1}):
        velocity = {"u": {"column": "/dvl.v.x", "where": where}, "r": "/imu.r"}
        log = read_quietly(dive(dvl), mapping(velocity=velocity))
        assert len(log.segments) == 2
        assert log.velocity[:, 0].max() < 3.1


def test_a_drop_out_becomes_a_cut_and_is_told():
    keep = (SLOW < 8) | (SLOW > 11)
    log = read_quietly(dive(Topic("/dvl", SLOW[keep], {"v.x": 1 + 0.1 * SLOW[keep]})), mapping())
    assert [segment.name for segment in log.segments] == ["dive7.1", "dive7.2"]
    assert not ((log.time > 8) & (log.time < 11)).any()
    assert any("`/dvl`: once no message for longer than 1.25 s" in note for note in log.notes)


def test_times_told_count_from_the_first_sample_of_the_log():
    """A gyroscope from 0 s and a Doppler log from 5.03 s that drops out after 7.78 s."""
    keep = (SLOW > 5) & ((SLOW < 8) | (SLOW > 11))
    dvl, fin = ({"v.x": 1 + 0.1 * SLOW[keep]}, {"angle": SLOW[keep]})
    log = read_quietly(
        dive(Topic("/dvl", SLOW[keep], dvl), Topic("/fin", SLOW[keep], fin)), mapping()
    )
    assert log.time[0] == pytest.approx(5.1)
    expected = (
        "`/dvl` `/fin`: once no message for longer than 1.25 s (first after 2.68 s (by the clock"
    )
    (note,) = (note for note in log.notes if "no message" in note)
    assert note.startswith(expected), note


def test_numbers_that_are_missing_are_passed_over_and_told():
    speed = np.where(np.isin(np.arange(len(SLOW)), (10, 11)), np.nan, 1 + 0.1 * SLOW)
    log = read_quietly(dive(Topic("/dvl", SLOW, {"v.x": speed})), mapping())
    np.testing.assert_allclose(log.velocity[:, 0], 1 + 0.1 * log.time)
    assert any("2 messages without a value of u, dropped" in note for note in log.notes)


def test_commands_hold_or_interpolate_as_asked():
    """A command sent only when it changes holds until the next: `hold: true`."""
    given = dive(Topic("/fin", np.array([0, 0.5, 1, 2, 15]), {"angle": np.arange(5.0)}))
    until = {"rudder": {"column": "/fin.angle", "hold": True}}
    log = read_quietly(given, mapping(commands=until))
    assert log.duration == pytest.approx(19.6)
    np.testing.assert_array_equal(
        log.command("rudder"), np.searchsorted([0.5, 1, 2, 15], log.time, "right")
    )
    log = read_quietly(given, mapping())
    assert not ((log.time > 2.0) & (log.time < 15.0)).any()
    assert log.time.max() <= 15.75
    ramp = {"rudder": {"column": "/fin.angle", "hold": False}}
    log = read_quietly(dive(), mapping(commands=ramp))
    np.testing.assert_allclose(log.command("rudder"), log.time, atol=1e-12)


def test_numbers_are_scaled_shifted_and_added():
    """A pulse width as a share of full thrust; half the difference of opposite fins."""
    pwm = Topic("/pwm", np.arange(21.0), {"c": np.linspace(1100, 1900, 21)})
    fins = Topic("/fins", np.arange(21.0), {"top": np.full(21, 0.3), "bottom": np.full(21, -0.1)})
    commands = {
        "motor": {"column": "/pwm.c", "scale": 0.0025, "offset": -3.75, "hold": False},
        "rudder": {"column": "/fins.bottom", "scale": 0.5, "plus": {"/fins.top": -0.5}},
    }
    log = read_quietly(dive(pwm, fins), mapping(commands=commands))
    np.testing.assert_allclose(log.command("motor"), -1 + log.time / 10, atol=1e-12)
    np.testing.assert_allclose(log.command("rudder"), -0.2)


def test_angles_of_several_topics_and_constants_go_together():
    """Roll is not recorded; pitch comes from another topic than yaw, which wraps."""
    time = np.arange(0.02, 20, 0.1)
    pitch = Topic("/pitch", time, {"deg": 5 + 0 * time})
    yaw = Topic("/yaw", time, {"rad": (3 + 0.2 * time + np.pi) % (2 * np.pi) - np.pi})
    attitude = {
        "roll": {"value": 90, "unit": "deg"},
        "pitch": {"column": "/pitch.deg", "unit": "deg"},
        "yaw": "/yaw.rad",
    }
    log = read_quietly(dive(pitch, yaw), mapping(attitude=attitude))
    roll, tilt, heading = euler_from_quaternion(log.attitude).T
    np.testing.assert_allclose(roll, np.pi / 2)
    assert "`roll` was not recorded; the mapping sets it to the constant 1.5708" in log.notes
    np.testing.assert_allclose(np.degrees(tilt), 5)
    np.testing.assert_allclose(np.unwrap(heading), 3 + 0.2 * log.time, atol=1e-9)


@pytest.mark.parametrize("order", ["wxyz", "xyzw", None])
def test_quaternions_come_in_either_order_or_by_name(order):
    time = np.arange(0.05, 20, 0.1)
    values = {"w": np.cos(time / 2), "x": 0 * time, "y": 0 * time, "z": np.sin(time / 2)}
    names = {
        component: f".{component}" if order is None else f"[{order.index(component)}]"
        for component in "wxyz"
    }
    # An estimator that has not started yet sends zeros.
    fields = {
        f"q{names[component]}": np.where(time < 1, 0.0, values[component]) for component in "wxyz"
    }
    quaternion = {"column": "/att.q"} | ({} if order is None else {"order": order})
    given = mapping(attitude={"quaternion": quaternion})
    log = read_quietly(dive(Topic("/att", time, fields)), given)
    assert log.time[0] > 1
    np.testing.assert_allclose(
        np.unwrap(euler_from_quaternion(log.attitude)[:, 2])[-1] % (2 * np.pi),
        log.time[-1] % (2 * np.pi),
        atol=1e-9,
    )


def test_the_first_choice_that_a_log_has_is_taken_in_its_unit():
    choices = [{"column": "/gyro.r", "unit": "deg/s"}, {"column": "/imu.r", "unit": "rad/s"}]
    velocity = {"u": "/dvl.v.x", "r": choices}
    log = read_quietly(dive(), mapping(velocity=velocity))
    np.testing.assert_allclose(log.velocity[:, 5], 0.5 * np.cos(log.time))
    gyro = Topic("/gyro", FAST, {"r": 90 + 0 * FAST}, units={"r": "deg/sec"})
    for r in (choices, "/gyro.r"):
        log = read_quietly(dive(gyro), mapping(velocity={"u": "/dvl.v.x", "r": r}))
        np.testing.assert_allclose(log.velocity[:, 5], np.pi / 2)


def test_a_position_alone_makes_a_record_to_be_completed():
    given = LogMapping.from_dict(
        {"time": "recorded", "position": {"north": "/gps.n", "east": "/gps.e"}}
    )
    gps = Topic("/gps", np.arange(3.0), {"n": np.arange(3.0), "e": np.arange(3.0)})
    record = build_record(given, Recording((gps,), "dive.bag", "a test"))
    assert record.velocity_names == ()
    assert record.blocks["position"][2].tolist() == [2, 2, 0]


def test_odd_clocks_are_put_right_with_a_warning():
    time = SLOW.copy()
    time[5] = time[4]
    given = dive(Topic("/dvl", time, {"v.x": 1 + 0.1 * time}), notes=("the bag was cut short",))
    with pytest.warns(ClockWarning, match="1 message with a duplicate timestamp"):
        log = read_quietly(given, mapping())
    np.testing.assert_allclose(log.velocity[:, 0], 1 + 0.1 * log.time)
    assert log.notes[0] == "the bag was cut short"
    assert any("duplicate" in note for note in log.notes)


@pytest.mark.parametrize(
    ("change", "back", "says"),
    [
        (lambda time: np.where(time > 10, time - 60, time), 60.0, "reset or changed its epoch"),
        (lambda time: time + np.where(time < 10, 0, 1.7e9), -1.7e9, "its epoch once"),
    ],
)
def test_where_the_clock_of_all_topics_runs_anew_a_segment_begins(change, back, says):
    topics = (Topic(topic.name, change(topic.time), topic.fields) for topic in dive().topics)
    with pytest.warns(ClockWarning, match=says):
        log = read_quietly(dive(*topics), mapping())
    assert [segment.name for segment in log.segments] == ["dive7.1", "dive7.2"]
    after = slice(log.segments[1].start, None)
    np.testing.assert_allclose(np.diff(log.elapsed), np.median(log.steps), rtol=1e-3)
    np.testing.assert_allclose(log.velocity[after, 0], 1 + 0.1 * (log.time[after] + back))


def test_a_command_sent_once_holds_and_a_velocity_sent_once_is_no_clock(refused):
    once = Topic("/once", np.array([1.0]), {"a": np.array([7.0])})
    commands = {"a": {"column": "/once.a", "hold": True}}
    log = read_quietly(dive(once), mapping(commands=commands))
    assert set(log.command("a").tolist()) == {7.0}
    assert log.time[0] == 1.0
    empty = Topic("/none", np.array([np.nan]), {"a": np.array([1.0])})
    for velocity, topic in (("/once.a", once), ("/none.a", empty)):
        given = Recording((topic,), "dive.bag", "a test")
        alone = LogMapping.from_dict({"time": "recorded", "velocity": {"u": velocity}})
        refused(LogError, alone.log, given)


def test_topics_without_a_message_may_be_optional():
    commands = {"a": {"column": "/empty.a", "optional": True}}
    assert read_quietly(dive(ODD["empty"]), mapping(commands=commands)).command_names == ()


def test_a_command_that_holds_may_be_older_than_the_log():
    commands = {"a": {"column": "/early.a", "hold": True}}
    log = read_quietly(dive(ODD["early"]), mapping(commands=commands))
    assert set(log.command("a").tolist()) == {19.0}


def test_infinite_numbers_are_missing():
    time = np.arange(0, 5, 0.1)
    speed = np.where(time == 2.0, np.inf, 1.0)
    table = Recording((Topic("", None, {"t": time, "u": speed}),), "log.csv", "a test")
    with pytest.warns(GapWarning, match="1 sample with missing values at 2.00 s"):
        assert LogMapping.from_dict({"time": "t", "velocity": {"u": "u"}}).log(table).n == 49


def test_a_held_value_ends_with_its_run():
    time = np.concatenate((np.arange(10.0), np.arange(10.0)))  # the clock begins anew
    rpm = np.repeat([5.0, 7.0], 10)
    rpm[[2, 3, 10, 11, 12, 15]] = np.nan
    table = Topic("", None, {"t": time, "u": np.arange(20.0), "rpm": rpm})
    commands = {"rpm": {"column": "rpm", "hold": True}}
    mapping = LogMapping.from_dict({"time": "t", "velocity": {"u": "u"}, "commands": commands})
    with pytest.warns(ClockWarning):
        record = build_record(mapping, Recording((table,), "runs.csv", "a test"))
    want = np.repeat([5.0, np.nan, 7.0], [10, 3, 7])
    np.testing.assert_array_equal(record.blocks["commands"][:, 0], want)
