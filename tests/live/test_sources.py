"""Sources: what is lost is counted, what fails is raised, what is open is closed."""

import json
import socket
import sys

import pytest

from hydrodamp.live import readers, sources
from hydrodamp.live.readers import BoundedQueue, SourceError
from hydrodamp.live.samples import rows_of
from live.conftest import open_stream


def listening():
    sentences = []
    source = open_stream("udp://127.0.0.1:0", on_message=sentences.append)
    return source, int(sentences[0].rpartition(" ")[2])


def test_an_error_of_a_reader_is_raised_behind_what_it_read():
    def read(queue):
        queue.put({"time": 1.0})
        raise OSError("the cable is cut")

    queue, rows = BoundedQueue().start_reader(read), []
    with pytest.raises(SourceError, match="OSError: the cable is cut"):
        rows.extend(queue)
    assert rows == [{"time": 1.0}]


def test_blank_lines_of_a_datagram_are_no_samples():
    queue = BoundedQueue()
    receiver = readers.bind_socket("udp://127.0.0.1:0", allow_remote=False)
    datagrams = readers.DatagramSocket(receiver)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for data in (b"\n" * 1300, b" \n\t\n", b'\n{"time": 1}\n\n', b"{\n"):
            sender.sendto(data, receiver.getsockname())
    queue.start_reader(datagrams.reader())
    rows = iter(queue)
    assert next(rows) == {"time": 1}
    assert next(rows) is readers.UNREADABLE
    assert next(rows) is None
    queue.cancel()


def test_a_socket_is_closed_at_the_end():
    source, port = listening()
    source.close()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as again:
        again.bind(("127.0.0.1", port))


@pytest.mark.skipif(sys.platform != "linux", reason="other kernels do not tell")
def test_what_the_kernel_drops_is_counted():
    receiver = readers.bind_socket("udp://127.0.0.1:0", allow_remote=False)
    receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
    datagrams, queue = readers.DatagramSocket(receiver), BoundedQueue()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for k in range(500):
            sender.sendto(json.dumps({"time": k}).encode(), receiver.getsockname())
        queue.start_reader(datagrams.reader())
        rows = [*iter(lambda: next(iter(queue)), None)]
    assert datagrams.counts()["kernel drops"] == 500 - len(rows) > 0
    queue.cancel()
    assert datagrams.counts()["kernel drops"] == 500 - len(rows)


def test_a_paced_log_does_not_wait_for_what_was_taken(dive, monkeypatch):
    _, log = dive
    rows, pauses = sources.LogRows(log.between(0.0, 30.0), is_real_time=True), []
    monkeypatch.setattr(sources.time, "sleep", pauses.append)
    monkeypatch.setattr(sources.time, "monotonic", lambda: sum(pauses))
    samples = iter(rows)
    assert next(samples) == next(rows_of(log))
    rows.skip_to(290)
    assert [row for row in samples if row][-1]["time"] == pytest.approx(29.9)
    assert sum(pauses) == pytest.approx(0.9)


@pytest.mark.slow
def test_a_datagram_of_any_size_is_read_and_its_senders_are_counted():
    source, port = listening()
    line = json.dumps({"time": 1.0, "u": 1.0}).encode() + b"\n"
    for _ in range(2):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            sender.bind(("127.0.0.1", 0))
            sender.sendto(line * 2000, ("127.0.0.1", port))
            rows = (row for row in source.rows if row is not None)  # None at each poll
            assert [next(rows) for _ in range(2000)] == [{"time": 1.0, "u": 1.0}] * 2000
    source.close()
    assert source.counts() == {"dropped": 0, "kernel drops": 0, "other senders": 1}
