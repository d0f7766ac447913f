"""What Foxglove is sent, as a client of its own protocol receives it."""

import json
import struct
from contextlib import suppress

import pytest

from hydrodamp.errors import ProblemError
from hydrodamp.live import display

pytest.importorskip("foxglove")
client = pytest.importorskip("websockets.sync.client")


def hears(connection, shown):
    """Subscribe to all that is advertised, and return a function that gives the next message."""
    channels = json.loads(connection.recv(timeout=5))["channels"]
    asked = [{"id": one["id"], "channelId": one["id"]} for one in channels]
    connection.send(json.dumps({"op": "subscribe", "subscriptions": asked}))
    names = {one["id"]: one["topic"] for one in channels}

    def following():
        message = connection.recv(timeout=5)
        return names[struct.unpack_from("<I", message, 1)[0]], message[13:]

    for _ in range(100):  # the server has no word for having heard that
        shown.show_message("hello")
        with suppress(TimeoutError):
            connection.recv(timeout=0.1)
            break
    return lambda: next(one for one in iter(following, None) if b"hello" not in one[1])


@pytest.fixture
def shown():
    one = display.Display(0)
    yield one
    one.close()


def test_estimates_and_sentences_are_shown(rows, run, shown):
    lines = run(rows[:101], output_interval=1.0).lines
    with client.connect(shown.address, subprotocols=["foxglove.sdk.v1"]) as connection:
        assert json.loads(connection.recv(timeout=5))["op"] == "serverInfo"
        following = hears(connection, shown)
        for line in lines:
            shown.show_estimate(line)
        shown.show_message("a run begins anew.")
        for line in lines:
            topic, payload = following()
            record = json.loads(payload)
            assert topic == "/hydrodamp/estimate"
            assert record["excitation"] == line["excitation"]
            assert {one["label"]: one["value"] for one in record["coefficients"]} == {
                label: one["value"] for label, one in line["coefficients"].items()
            }
            assert {one["label"] for one in record["K"]} == {"K_p|p|"}
        topic, payload = following()
        assert topic == "/hydrodamp/said"
        assert b"a run begins anew." in payload


def test_the_layout_shows_what_is_sent(rows, run):
    sent = {**run(rows[:11]).lines[-1], **{axis: [] for axis in "XYZKMN"}}
    layout = json.loads(display.LAYOUT.read_text())
    panels = layout["configById"]
    paths = [one["value"] for panel in panels.values() for one in panel.get("paths", ())]
    paths += [panel["topicPath"] for panel in panels.values() if "topicPath" in panel]
    for path in paths:
        topic, *fields = path.removesuffix("[:]").split(".")
        assert topic == "/hydrodamp/estimate"
        for place, field in enumerate(fields):
            assert field in (sent if place == 0 else sent[fields[0]])
    assert sorted(leaves(layout["layout"])) == sorted(panels)


def leaves(node):
    if isinstance(node, str):
        return [node]
    return leaves(node["first"]) + leaves(node["second"])


def test_a_port_that_is_taken_is_told(shown):
    with pytest.raises(ProblemError, match="cannot be served"):
        display.Display(int(shown.address.rpartition(":")[2]))
