"""MAVLink on loopback through a live run is the batch fit of its telemetry log, bit for bit."""

import socket
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from threading import Thread
from time import sleep

import pytest

import hydrodamp as hd
from hydrodamp.errors import GapWarning, ProblemError
from hydrodamp.live import estimator
from live.conftest import MODEL, open_stream

pytest.importorskip("pymavlink")
EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "onboard"
MAPPING = EXAMPLE / "mapping.yaml"
START = 1_700_000_000


@pytest.fixture(scope="module")
def sent(dive):
    """What the example's vehicle sends of four runs, with the times [s]."""
    spec = spec_from_file_location("example_vehicle", EXAMPLE / "vehicle.py")
    example = module_from_spec(spec)
    spec.loader.exec_module(example)
    return [*example.sent(dive[1])]


def rows_of(source, port, packets):
    """Send packets from a thread, and yield what comes of them."""

    def send():
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            for place, packet in enumerate(packets):
                out.sendto(packet, ("127.0.0.1", port))
                if place % 20 == 0:
                    sleep(0.001)  # so that the receiver's buffer does not overflow

    sender = Thread(target=send)
    sender.start()
    for row in source.rows:
        if row is None and not sender.is_alive():
            return
        yield row


@pytest.mark.slow
def test_what_is_sent_is_identified_as_from_its_log(dive, run, sent, tmp_path):
    path = tmp_path / "dive.tlog"
    path.write_bytes(b"".join(round(1e6 * (START + at)).to_bytes(8) + one for at, one in sent))
    with pytest.warns(GapWarning):
        log = hd.read_log(path, MAPPING)
    batch = hd.RecursiveLeastSquares(typical_velocity=estimator.TYPICAL_VELOCITY).identify(
        hd.prepare(dive[0], log, MODEL), MODEL
    )
    messages = []
    source = open_stream("mavlink://127.0.0.1:0", MAPPING, messages.append)
    port = int(messages[0].rpartition(" ")[2])
    rows = rows_of(source, port, [packet for _, packet in sent])
    record = run(rows, source_counts=source.counts)
    assert record.coefficients == batch.damping.coefficients.tolist()
    assert record.counts == {"taken": log.n, "first": 1, "gap": 3}


@pytest.mark.parametrize(
    ("address", "mapping", "words"),
    [
        ("mavlink://:0", None, "needs `--mapping`"),
        ("mavlink://:0?system=x", MAPPING, "`system` of"),
        ("mavlink://0.0.0.0:0", MAPPING, "--allow-remote"),
    ],
)
def test_an_address_says_whom_to_listen_to(address, mapping, words):
    with pytest.raises(ProblemError, match=words):
        open_stream(address, mapping)
