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
from hydrodamp.live.sources import open_source
from live.conftest import MODEL, run_live

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
def test_what_is_sent_is_identified_as_from_its_log(dive, sent, tmp_path):
    vehicle, _ = dive
    path = tmp_path / "dive.tlog"
    path.write_bytes(b"".join(round(1e6 * (START + at)).to_bytes(8) + one for at, one in sent))
    with pytest.warns(GapWarning):
        log = hd.read_log(path, MAPPING)
    batch = hd.RecursiveLeastSquares(typical_velocity=estimator.TYPICAL_VELOCITY).identify(
        hd.prepare(vehicle, log, MODEL), MODEL
    )
    messages = []
    where = "mavlink://127.0.0.1:0"
    source = open_source(
        where, MAPPING, allow_remote=False, real_time=False, on_message=messages.append
    )
    port = int(messages[0].rpartition(" ")[2])
    rows = rows_of(source, port, [packet for _, packet in sent])
    record = run_live(rows, vehicle, source_counts=source.counts)
    assert record.coefficients == batch.damping.coefficients.tolist()
    assert record.counts == {"taken": log.n, "first": 1, "gap": 3}


def test_an_address_says_whom_to_listen_to(sent):
    with pytest.raises(ProblemError, match="needs `--mapping`"):
        open_source("mavlink://:0", None, allow_remote=False, real_time=False, on_message=print)
    with pytest.raises(ProblemError, match="`system` of"):
        open_source(
            "mavlink://:0?system=x", MAPPING, allow_remote=False, real_time=False, on_message=print
        )
    with pytest.raises(ProblemError, match="--allow-remote"):
        open_source(
            "mavlink://0.0.0.0:0", MAPPING, allow_remote=False, real_time=False, on_message=print
        )
