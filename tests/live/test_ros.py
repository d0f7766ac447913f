"""Messages of ROS 2 have the fields of a bag; heard by ROS itself they give the batch fit."""

import os
import threading
import time
from dataclasses import fields, is_dataclass
from types import SimpleNamespace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.data.attitude import quaternion_product
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import GapWarning, ProblemError
from hydrodamp.ingest.formats.rosbag import deserialize_columns
from hydrodamp.live import estimator
from hydrodamp.live.readers import message_fields, subscribe_new_topics
from live.conftest import MODEL, open_stream

MAPPING = """
extends: rep103-odometry
commands: {rudder: "/fins.position[0]", elevator: "/fins.position[1]", rpm: "/fins.position[2]"}
"""


def as_ros(value):
    """Return a message of rosbags as rclpy has it."""
    if not is_dataclass(value):
        return [*map(as_ros, value)] if isinstance(value, list) else value
    names = [one.name for one in fields(value) if one.name != "__msgtype__"]
    parts = {name: as_ros(getattr(value, name)) for name in names}
    kinds = dict.fromkeys(names, "")
    return SimpleNamespace(**parts, get_fields_and_field_types=lambda: kinds)


@pytest.mark.parametrize(
    "kind", ["nav_msgs/msg/Odometry", "sensor_msgs/msg/JointState", "sensor_msgs/msg/Imu"]
)
def test_fields_are_those_of_a_bag(kind):
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.LATEST)
    random = np.random.default_rng(3)

    def filled(name):
        parts = {}
        for part, (family, detail) in store.fielddefs[name][1]:
            family = int(family)
            if family == 2:
                parts[part] = filled(detail)
            elif family == 1:
                whole = detail[0].startswith(("int", "uint"))
                number = int(random.integers(1, 1000)) if whole else float(random.normal())
                parts[part] = "word" if detail[0] == "string" else number
            elif detail[0][1][0] == "string":
                parts[part] = ["a", "b"]
            else:
                parts[part] = random.normal(size=detail[1] or 3)
        return store.types[name](**parts)

    message = filled(kind)
    raw = bytes(store.serialize_cdr(message, kind))
    wanted = deserialize_columns([raw], kind, store.fielddefs, aligned=True).numbers
    assert message_fields(as_ros(message)) == {name: column[0] for name, column in wanted.items()}


def test_only_wanted_topics_are_subscribed_each_once():
    asked = []
    node = SimpleNamespace(
        get_topic_names_and_types=lambda: [("/odom", ["nav_msgs/msg/Odometry"]), ("/tf", ["x"])]
    )
    look = subscribe_new_topics(node, lambda topic: asked.append(topic) or False, print)
    look()
    assert asked == ["/odom", "/tf"]


@pytest.mark.skipif("ROS_DISTRO" in os.environ, reason="ROS is there")
def test_without_ros_a_sentence_says_so(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "rclpy", None)
    with pytest.raises(ProblemError, match="source the setup file"):
        open_stream("ros2", "rep103-odometry")


def odometry(log):
    """Return messages of a log in the axes of REP 103, and commands before each."""
    nav, joints = pytest.importorskip("nav_msgs.msg"), pytest.importorskip("sensor_msgs.msg")
    quarter = np.array([np.sqrt(0.5), 0.0, 0.0, -np.sqrt(0.5)])
    turned = quaternion_product(quarter, log.attitude) * (1.0, 1.0, -1.0, -1.0)
    moves = log.velocity * (1.0, -1.0, -1.0, 1.0, -1.0, -1.0)
    nanoseconds, messages = 0, []
    for run in log.segments:
        start = nanoseconds + 5_000_000_000
        for k in range(run.start, run.stop):
            nanoseconds = start + round(1e9 * (log.time[k] - log.time[run.start]))
            pose, fins = nav.Odometry(), joints.JointState()
            fins.position = log.commands[k].tolist()
            quaternion, twist = pose.pose.pose.orientation, pose.twist.twist
            for name, value in zip("wxyz", turned[k].tolist(), strict=True):
                setattr(quaternion, name, value)
            for part, values in ((twist.linear, moves[k, :3]), (twist.angular, moves[k, 3:])):
                for name, value in zip("xyz", values.tolist(), strict=True):
                    setattr(part, name, value)
            for topic, message in (("/fins", fins), ("/odom", pose)):
                stamp = message.header.stamp
                stamp.sec, stamp.nanosec = divmod(nanoseconds, 10**9)
                messages.append((topic, message))
    return messages


def recorded(messages):
    topics = []
    for name in ("/fins", "/odom"):
        rows = [message_fields(message) for topic, message in messages if topic == name]
        columns = {key: [row[key] for row in rows] for key in rows[0]}
        topics.append(Topic(name, np.arange(float(len(rows))), columns))
    return Recording(tuple(topics), "dive", "ROS 2 bag")


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # of what rclpy imports
def test_two_thousand_messages_in_order_are_the_batch_fit(dive, run, tmp_path):
    rclpy = pytest.importorskip("rclpy")
    vehicle, log = dive
    path = tmp_path / "mapping.yaml"
    path.write_text(MAPPING)
    messages = odometry(log)
    rclpy.init()
    node = rclpy.create_node("vehicle")
    out = {name: node.create_publisher(type(one), name, 5000) for name, one in messages[:2]}
    source = open_stream("ros2", path)

    def send():
        while any(one.get_subscription_count() < 1 for one in out.values()):
            time.sleep(0.05)
        for topic, message in messages:
            out[topic].publish(message)
            time.sleep(0.0005)

    sender = threading.Thread(target=send)
    sender.start()
    rows = iter(source.rows)
    received = iter(lambda: next(rows) if sender.is_alive() else next(rows) or 0, 0)
    record = run(received, source_counts=source.counts)
    source.close()
    node.destroy_node()
    rclpy.shutdown()
    with pytest.warns(GapWarning):
        whole = hd.read_mapping(path).log(recorded(messages))
    way = hd.RecursiveLeastSquares(typical_velocity=estimator.TYPICAL_VELOCITY)
    fit = way.identify(hd.prepare(vehicle, whole, MODEL), MODEL)
    assert record.counts == {"taken": log.n, "first": 1, "gap": 3}
    assert record.coefficients == fit.damping.coefficients.tolist()
