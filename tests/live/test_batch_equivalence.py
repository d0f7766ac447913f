"""A log through a live run is the batch fit, bit for bit, whatever the source."""

import itertools
import json
import socket

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import GapWarning
from hydrodamp.live import estimator, readers, sources
from hydrodamp.live.readers import BoundedQueue
from hydrodamp.live.samples import rows_of
from live.conftest import MODEL


def batch(vehicle, log, method):
    return estimator.METHODS[method].identify(hd.prepare(vehicle, log, MODEL), MODEL)


def from_log(log, _):
    return sources.LogRows(log)


def from_text(path):
    with path.open("rb") as stream:
        reader = readers.line_reader(stream.fileno())
        yield from BoundedQueue(blocks_when_full=True).start_reader(reader)


def from_json_lines(log, folder):
    path = folder / "dive.jsonl"
    path.write_text("\n".join(map(json.dumps, rows_of(log))))
    return from_text(path)


def from_csv(log, folder):
    hd.write_log(log, folder / "dive.csv")
    return from_text(folder / "dive.csv")


def from_datagrams(log, _):
    receiver = readers.bind_socket("udp://127.0.0.1:0", allow_remote=False)
    queue = BoundedQueue().start_reader(readers.DatagramSocket(receiver).reader())
    rows = (row for row in queue if row is not None)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for row in rows_of(log):
            sender.sendto(json.dumps(row).encode(), receiver.getsockname())
            yield next(rows)
    queue.cancel()


@pytest.mark.slow
@pytest.mark.parametrize("source", [from_log, from_json_lines, from_csv, from_datagrams])
@pytest.mark.parametrize("method", estimator.METHODS)
def test_live_is_the_batch_fit_bit_for_bit(dive, run, method, source, tmp_path):
    vehicle, log = dive
    record = run(source(log, tmp_path), method=method)
    fit = batch(vehicle, log, method)
    assert record.coefficients == fit.damping.coefficients.tolist()
    assert record.counts == {"taken": log.n, "first": 1, "joined": 3}


@pytest.mark.slow
@pytest.mark.parametrize("method", ["ai-composite", "rls"])
def test_standard_errors_are_those_of_the_batch_fit(dive, reference, method):
    line = reference[method].lines[-1]
    errors = [one["standard_error"] for one in line["coefficients"].values()]
    wanted = np.sqrt(batch(*dive, method).damping.covariance.diagonal())
    np.testing.assert_allclose(errors, wanted, rtol=1e-12)


@pytest.mark.slow
def test_gaps_and_missing_values_begin_runs_as_in_a_log(dive, run):
    vehicle, log = dive
    rows = [*itertools.islice(rows_of(log), 400)]
    rows = [*rows[:150], *rows[180:250], rows[250] | {"u": float("nan")}, *rows[251:]]
    names = [name for name in rows[0] if name in "uvwpqr"]
    with pytest.warns(GapWarning):
        whole = hd.Log.from_arrays(
            [row["time"] for row in rows],
            {name: [row[name] for row in rows] for name in names},
            attitude=[[row[f"q{part}"] for part in "wxyz"] for row in rows],
            commands={name: [row[name] for row in rows] for name in log.command_names},
        )
    assert len(whole.segments) == 3
    record = run(rows)
    assert record.coefficients == batch(vehicle, whole, "rls").damping.coefficients.tolist()
    assert record.counts == {"taken": 369, "first": 1, "gap": 1, "incomplete": 1, "again": 1}


@pytest.mark.slow
def test_a_line_each_second_of_samples(rows, run):
    record = run(rows[:101], output_interval=1.0)
    assert [line["time"] for line in record.lines] == [*map(float, range(1, 11)), 10.0]
