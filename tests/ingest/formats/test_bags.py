"""ROS bags that rosbags writes; every field against what rosbags itself makes of it."""

import struct

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import hydrodamp as hd
from hydrodamp.errors import LogError
from hydrodamp.ingest.formats import rosbag

JOINTS = "sensor_msgs/msg/JointState"


def one_by_one(path):
    """The messages of a bag as rosbags reads them."""
    from rosbags.highlevel import AnyReader

    messages_by_topic = {}
    with AnyReader([path]) as bag:
        for connection, time, raw in bag.messages():
            message = bag.deserialize(raw, connection.msgtype)
            messages_by_topic.setdefault(connection.topic, []).append((time, message))
    return messages_by_topic


def write_twists(bag, folder, kind, n):
    """Write twists to a bag; return its path."""
    if kind == "ROS1":
        return bag.ros1(folder / "dive.bag", bag.twists(n, old=True))
    return bag.ros2(folder / "dive", bag.twists(n), kind)


@pytest.mark.parametrize("kind", ["MCAP", "SQLITE3", "ROS1"])
def test_fields_are_those_of_rosbags(tmp_path, bag, kind):
    path = write_twists(bag, tmp_path, kind, 30)
    topic = rosbag.read_file(path).topic("/dvl")
    expected = one_by_one(path)["/dvl"]
    np.testing.assert_allclose(topic.time, [time / 1e9 for time, _ in expected], rtol=1e-15)
    for row, (_, message) in enumerate(expected):
        _check(topic.fields, topic.texts, row, "twist", message.twist)
        stamp = message.header.stamp
        assert topic.fields["header.stamp"][row] == stamp.sec + stamp.nanosec / 1e9
        assert topic.texts["header.frame_id"][row] == message.header.frame_id
    assert topic.units == {"header.stamp": "s"}


def test_messages_of_changing_shape(tmp_path, bag):
    """Strings and sequences of changing lengths; NaN where there is no such element."""
    angles = [[0.1], [0.2, 0.3], [], [0.4, 0.5], [0.6]]
    names = [["fin"], ["fin", "propeller"], [], ["a", "b"], ["screw"]]
    messages = [
        ("/joints", JOINTS, 1.0 + k, bag.joints(5.0 + k, *pair))
        for k, pair in enumerate(zip(angles, names, strict=True))
    ]
    topic = rosbag.read_file(bag.ros2(tmp_path / "dive", messages)).topics[0]
    nan = np.nan
    np.testing.assert_array_equal(topic.fields["position[0]"], [0.1, 0.2, nan, 0.4, 0.6])
    np.testing.assert_array_equal(topic.fields["position[1]"], [nan, 0.3, nan, 0.5, nan])
    assert topic.texts["name[0]"] == ("fin", "fin", "", "a", "screw")
    assert topic.fields["header.stamp"].tolist() == [5, 6, 7, 8, 9]


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(data=st.data())
@pytest.mark.parametrize("form", ["ROS 2", "ROS 2 in big-endian order", "ROS 1"])
def test_any_message_lies_where_rosbags_finds_it(form, data):
    """A message of every base type, nested, with arrays and sequences of each."""
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.EMPTY)
    base = ["bool", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64"]
    base += ["float32", "float64", "string"]
    kinds = data.draw(
        st.lists(
            st.tuples(st.sampled_from(base), st.sampled_from(["", "[3]", "[]"])),
            min_size=1,
            max_size=6,
        )
    )
    inner = "\n".join(f"{kind}{length} f{k}" for k, (kind, length) in enumerate(kinds))
    store.register(typesys.get_types_from_msg(inner, "a/msg/Inner"))
    outer = "uint8 first\na/Inner one\na/Inner[2] two\na/Inner[] many\nfloat64 last"
    store.register(typesys.get_types_from_msg(outer, "a/msg/Outer"))
    messages = [_message(store, kinds, data.draw) for _ in range(3)]
    old, orders = form == "ROS 1", [{"little_endian": False}, {}] if "big" in form else [{}]
    pack = store.serialize_ros1 if old else store.serialize_cdr
    raw = [
        bytes(pack(message, "a/msg/Outer", **orders[k % len(orders)]))
        for k, message in enumerate(messages)
    ]
    columns = rosbag.deserialize_columns(raw, "a/msg/Outer", store.fielddefs, aligned=not old)
    assert columns.truncated == []
    for row, message in enumerate(messages):
        _check(columns.numbers, columns.texts, row, "", message)


NUMBERS = {"bool": st.booleans(), "float64": st.floats(allow_nan=False)}
NUMBERS["float32"] = st.floats(width=32, allow_nan=False)
NUMBERS["string"] = st.text(st.characters(codec="ascii", exclude_characters="\0"), max_size=5)
for bits in (8, 16, 32, 64):
    NUMBERS[f"int{bits}"] = st.integers(-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    NUMBERS[f"uint{bits}"] = st.integers(0, 2**bits - 1)


def _message(store, kinds, draw):
    def value(kind, length):
        if not length:
            return draw(NUMBERS[kind])
        size = {"min_size": 3, "max_size": 3} if length == "[3]" else {"max_size": 4}
        values = draw(st.lists(NUMBERS[kind], **size))
        return values if kind == "string" else np.array(values, dtype=kind)

    def inner():
        fields = {f"f{k}": value(*kind) for k, kind in enumerate(kinds)}
        return store.types["a/msg/Inner"](**fields)

    many = [inner() for _ in range(draw(st.integers(0, 3)))]
    return store.types["a/msg/Outer"](
        first=draw(NUMBERS["uint8"]),
        one=inner(),
        two=[inner(), inner()],
        many=many,
        last=draw(NUMBERS["float64"]),
    )


def _check(numbers, texts, row, path, value):
    """Compare a field with its column, or go into what it holds."""
    if isinstance(value, str):
        assert texts[path][row] == value
    elif isinstance(value, (list, np.ndarray)):
        for index, item in enumerate(value):
            _check(numbers, texts, row, f"{path}[{index}]", item)
    elif hasattr(value, "__dataclass_fields__"):
        for name in value.__dataclass_fields__:
            if name != "__msgtype__":
                _check(numbers, texts, row, f"{path}.{name}".lstrip("."), getattr(value, name))
    else:
        assert numbers[path][row] == float(value)


def test_long_arrays_and_large_messages_are_left_out(tmp_path, bag):
    typesys = pytest.importorskip("rosbags.typesys")
    text = "float64[100] fixed\nint32[] free\na/Part[] parts\nfloat32 last"
    bag.modern.register(typesys.get_types_from_msg("string name\nint16 n", "a/msg/Part"))
    bag.modern.register(typesys.get_types_from_msg(text, "a/msg/Long"))
    part_type = bag.modern.types["a/msg/Part"]
    message = bag.modern.types["a/msg/Long"](
        fixed=np.zeros(100),
        free=np.zeros(70, "i4"),
        last=2.5,
        parts=[part_type(name="x" * (k % 3), n=k) for k in range(65)],
    )
    heavy = bag.modern.types["a/msg/Long"](
        fixed=np.zeros(100), free=np.zeros(20_000, "i4"), last=2.5, parts=[]
    )
    sent = [("/long", "a/msg/Long", 1.0, message), ("/heavy", "a/msg/Long", 2.0, heavy)]
    recording = rosbag.read_file(bag.ros2(tmp_path / "dive", sent))
    assert recording.topic("/long").fields["last"].tolist() == [2.5]
    assert list(recording.topic("/long").fields) == ["last"]
    assert "`/heavy`: messages of 8" in recording.notes[0]


def test_broken_messages_are_noted_and_left_out(tmp_path, bag, monkeypatch, refused):
    pack = bag.modern.serialize_cdr
    sizes = iter([None, -8, 9, None, 20])
    monkeypatch.setattr(bag.modern, "serialize_cdr", lambda *it: pack(*it)[: next(sizes)])
    recording = rosbag.read_file(bag.ros2(tmp_path / "dive", bag.twists(4)))
    assert recording.topics[0].fields["twist.linear.x"].tolist() == [0.0, 0.03]
    assert "2 messages are truncated" in recording.notes[0]
    refused(ValueError, lambda: rosbag.read_file(bag.ros2(tmp_path / "other", bag.twists(1))))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["MCAP", "ROS1"])
@pytest.mark.parametrize("share", [0.3, 0.6, 0.9])
def test_whole_messages_before_a_cut(tmp_path, bag, kind, share):
    path = write_twists(bag, tmp_path, kind, 300)
    path = path if kind == "ROS1" else next(path.glob("*.mcap"))
    whole = rosbag.read_file(path).topic("/dvl")
    cut = tmp_path / f"cut{path.suffix}"
    cut.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    recording = rosbag.read_file(cut)
    topic = recording.topic("/dvl")
    assert 0.5 * share * whole.n < topic.n <= whole.n
    assert "the whole messages before the cut were read" in recording.notes[0]
    np.testing.assert_array_equal(topic.time, whole.time[: topic.n])
    for name, values in topic.fields.items():
        np.testing.assert_array_equal(values, whole.fields[name][: topic.n])
    if kind == "MCAP":  # also in the folder of the bag
        path.with_name("later.mcap").write_bytes(path.read_bytes())
        path.write_bytes(cut.read_bytes())
        assert hd.read_recording(path.parent).topic("/dvl").n == topic.n + whole.n
        path.with_name("later.mcap").unlink()
        path.write_bytes(cut.read_bytes()[:8])
        with pytest.raises(LogError, match=r"MCAP.*mcap recover"):
            hd.read_recording(path.parent)


@pytest.mark.slow
def test_a_cut_bag_with_two_publishers_of_a_topic(tmp_path, bag):
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    path, kind = tmp_path / "a.bag", "std_msgs/msg/Float64"
    message = struct.pack("<d", 0.5)
    with Writer(path) as writer:
        publishers = [
            writer.add_connection("/a", kind, typestore=store, callerid=name) for name in "xy"
        ]
        for k in range(40000):
            writer.write(publishers[k % 2], 10**9 + k * 10**7, message)
    path.write_bytes(path.read_bytes()[: int(0.6 * path.stat().st_size)])
    topic = hd.read_recording(path).topic("/a")
    assert topic.n > 20000
    np.testing.assert_allclose(topic.time, 1.0 + 0.01 * np.arange(topic.n))
