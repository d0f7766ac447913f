"""Messages of several topics become the samples that a mapping makes of a recording of them."""

import math
from itertools import chain, starmap
from pathlib import Path

import numpy as np
import pytest

from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import GapWarning, ProblemError
from hydrodamp.files import load_yaml
from hydrodamp.ingest.mapping import LogMapping
from hydrodamp.live.synchroniser import Message, MessageSynchroniser, stream_mapping

MAPPING = load_yaml(Path(__file__).with_name("synchroniser.yaml"))


def messages(until=20.0, start=100.0):
    """Three topics at rates of their own, and one that spoke once."""
    random = np.random.default_rng(7)
    yield Message("lamp", start, {"stamp": start - 0.1, "level": 0.5})
    for k in range(round(until / 0.02)):
        at = start + 0.02 * k + 0.003 * random.random()
        if k % 10 == 0:
            yield Message("fin", at, {"stamp": at, "angle": math.sin(0.3 * at)})
        if k % 4 == 1:
            moves = dict(zip(("vx", "vy", "vz"), random.normal(size=3).tolist(), strict=True))
            yield Message("/nortek", at, {"stamp": at, "valid": float(k % 3 > 0), **moves})
        q = {"q[0]": 0.0, "q[1]": 0.0, "q[2]": math.sin(0.1 * at), "q[3]": math.cos(0.1 * at)}
        yield Message("imu", at, {"stamp": at, "rate": 0.2, **q})


def recorded(stream):
    topics = []
    for name in dict.fromkeys(one.topic for one in stream):
        those = [one for one in stream if one.topic == name]
        fields = {field: [one.fields[field] for one in those] for field in those[0].fields}
        topics.append(Topic(name, [one.received for one in those], fields))
    return Recording(tuple(topics), "dive", "example")


def synchronise(stream, mapping=MAPPING):
    reports = []
    live = stream_mapping(LogMapping.from_dict(mapping), reports.append)
    synchroniser = MessageSynchroniser(live, reports.append)
    return [*synchroniser.synchronise(stream)], reports, synchroniser


def numbers(rows):
    return [tuple(row.values()) for row in rows if not np.isnan([*row.values()]).any()]


@pytest.mark.slow
def test_samples_are_those_of_the_recording_bit_for_bit():
    stream = [*messages()]
    rows, reports, synchroniser = synchronise(stream)
    with pytest.warns(GapWarning):  # where topics begin and end
        log = LogMapping.from_dict(MAPPING).log(recorded(stream))
    assert reports == []
    assert synchroniser.n_discarded == 0
    columns = [log.time, *log.attitude.T, *log.velocity[:, [0, 1, 2, 5]].T, *log.commands.T]
    assert numbers(rows) == [*zip(*(column.tolist() for column in columns), strict=True)]
    assert list(rows[0]) == ["time", "qw", "qx", "qy", "qz", "u", "v", "w", "r", "fin", "lamp"]


JUNK = [("", 0.0, {}), ("lights", 100.0, {"stamp": 1.0}), ("imu", 100.0, {"x": 1})]
HARMLESS = {
    "a pause each 5 messages": (lambda sent: with_pauses(sent, 5), 0),
    "a pause each 1000 messages": (lambda sent: with_pauses(sent, 1000), 0),
    "messages twice": (lambda sent: [*(sent[k // 2] for k in range(200)), *sent[100:]], 100),
    "messages late": (lambda sent: [*sent[:300], *sent[290:]], 10),
    "junk and topics that nobody asked for": (lambda sent: [*starmap(Message, JUNK), *sent], None),
    "a clock of the receiver that is set back": (lambda sent: [*map(set_back, sent)], 0),
}


def set_back(message):
    return message._replace(received=message.received - 3600.0 * (message.received > 110))


def with_pauses(stream, each):
    pairs = ([message, None] if k % each == 0 else [message] for k, message in enumerate(stream))
    return [*chain.from_iterable(pairs)]


@pytest.mark.slow
@pytest.mark.parametrize("kind", HARMLESS)
def test_samples_are_the_same_whatever_the_receiver_adds_or_repeats(kind):
    (change, n_discarded), stream = HARMLESS[kind], [*messages()]
    rows, reports, synchroniser = synchronise(change(stream))
    assert numbers([row for row in rows if row]) == numbers(synchronise(stream)[0])
    assert n_discarded in (None, synchroniser.n_discarded)
    assert reports == []


@pytest.mark.slow
def test_a_sample_waits_a_second_for_a_topic_that_fell_silent():
    stream = [one for one in messages(18.0) if one.topic != "fin" or one.received < 110.0]
    rows, reports, _ = synchronise(stream)
    assert len(rows) == len(synchronise([*messages(18.0)])[0])
    assert reports == []
    known = [row for row in rows if not math.isnan(row["fin"])]
    assert 109.8 < known[-1]["time"] < 110.1


@pytest.mark.slow
def test_a_topic_that_stays_silent_is_told_once_and_comes_back():
    stream = [one for one in messages(60.0) if one.topic != "fin" or not 110 < one.received < 140]
    rows, reports, _ = synchronise(stream)
    assert len(reports) == 1
    assert "no topic `fin`" in reports[0]
    assert sum(row["time"] > 141.0 for row in rows) > 900


@pytest.mark.slow
def test_a_clock_that_is_set_back_is_followed():
    stream = [*messages(10.0), *messages(10.0, start=50.0)]
    times = [row["time"] for row in synchronise(stream)[0]]
    assert (max(times) > 109.0, 49.9 < min(times) < 50.1, times[-1] < 60.1) == (True, True, True)
    assert sum(time < 60.1 for time in times) > 480


@pytest.mark.slow
def test_memory_is_bounded_while_no_sample_can_be_made():
    stream = (Message("imu", 0.001 * k, {"stamp": 0.001 * k, "rate": 0.1}) for k in range(25_000))
    rows, reports, synchroniser = synchronise(stream)
    assert rows == []
    assert "no topic `dvl`" in reports[0]
    assert len(reports) == 1
    assert sum(len(one.messages) for one in synchroniser._buffers.values()) <= 20_000


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"steps": ["rates_from_attitude"]}, "need a whole log"),
        ({"time": {"rate": 50}}, "counts rows"),
    ],
)
def test_mappings_that_need_a_whole_log_are_refused(change, sentence):
    with pytest.raises(ProblemError, match=sentence):
        synchronise([], MAPPING | change)


def test_a_rate_is_told_to_count_for_nothing():
    rows, reports, _ = synchronise([*messages(5.0)], MAPPING | {"clock": {"rate": 2}})
    assert "is ignored" in reports[0]
    assert len(rows) > 200


def test_other_peoples_topics_are_forgotten_and_told_in_part():
    stream = (Message(f"lights{k}", 100.0 + 0.001 * k, {"level": 1.0}) for k in range(5000))
    rows, reports, synchroniser = synchronise(stream)
    assert rows == []
    assert len(synchroniser._unused_topics) == 1000
    assert "lights11, ... and 988 more topics" in reports[0]
