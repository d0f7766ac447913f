"""Mutated rows end no run and leave a finite estimate near that of the rows between them."""

import json
import math
import warnings
from itertools import islice
from random import Random

import pytest

import hydrodamp as hd
from hydrodamp.ingest.formats.mavlink import Decoder
from hydrodamp.ingest.mapping import read_mapping
from hydrodamp.live.readers import MAX_DATAGRAM_SIZE, LineParser, packet_parser, parse_datagram
from hydrodamp.live.sample_validator import REJECTED, RESTARTS
from hydrodamp.live.synchroniser import MessageSynchroniser, stream_mapping
from live.conftest import angles, wrench
from live.row_mutator import CHANGES, endless_rows, mutated, poisoned

MODEL = hd.catalog["linear"]


@pytest.fixture(scope="module")
def lines():
    return [*islice(mutated(seed=1), 20_000)]


@pytest.mark.slow
def test_mutated_rows_end_no_run(run, lines, tmp_path):
    """By turns lines of standard input and datagrams."""
    path, read = tmp_path / "state.json", LineParser()
    parts = [[read(x)] if k % 2 else parse_datagram(x) for k, x in enumerate(lines)]
    samples = [row for part in parts for row in part if row is not None]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        record = run(samples, checkpoint_path=path)
    clean = run(islice(endless_rows(), 18_000))
    counts = record.counts
    assert sum(n for kind, n in counts.items() if kind not in RESTARTS) == len(samples)
    kinds = {"unreadable", "incomplete", "absurd", "late", "spike"}
    assert kinds <= counts.keys() & REJECTED.keys()
    assert "failed" not in counts
    assert counts["taken"] > 17_000
    assert all(map(math.isfinite, record.coefficients))
    assert json.loads(path.read_text())["state"]["n_rows"] == len(samples)
    drag, near = (one.lines[-1]["coefficients"]["X_u|u|"] for one in (clean, record))
    assert abs(near["value"] - drag["value"]) < drag["standard_error"]


@pytest.mark.slow
def test_noise_at_the_port_of_mavlink_is_counted(lines):
    parse = packet_parser(Decoder())
    mapping = stream_mapping(read_mapping("ardusub-mavlink"), print)
    messages = [message for line in lines for message in parse(line[:MAX_DATAGRAM_SIZE])]
    found = [*MessageSynchroniser(mapping, print).synchronise(messages)]
    assert [row for row in found if row is not None] == [{}] * len(messages)
    assert len(messages) >= sum(map(bool, lines))  # an empty datagram is no message


FORMS = {"commands": dict, "wrench": lambda row: wrench(angles(row))}
BY_COLUMN = {
    "commands": {"angles", "roll beside a quaternion", "upside down", "quaternion of zeros", "rpm"}
    | {"other columns"},
    "wrench": {"quaternion", "qw beside angles", "roll 1e308", "roll 3", "pitch 400", "force"}
    | {"degrees"},
}
POISONED = [
    (form, kind)
    for form in FORMS
    for kind in CHANGES
    if kind in BY_COLUMN[form] or not any(kind in kinds for kinds in BY_COLUMN.values())
]


@pytest.fixture(scope="module")
def clean(run):
    """Rows of each form and the record of a run over them."""
    samples = [*islice(endless_rows(), 1000)]
    forms = {name: [*map(form, samples)] for name, form in FORMS.items()}
    return {name: (each, run(each, model=MODEL)) for name, each in forms.items()}


@pytest.mark.slow
@pytest.mark.parametrize(("form", "kind"), POISONED)
@pytest.mark.parametrize("n", [1, 300])
def test_no_poisoned_row_moves_an_estimate_silently(run, clean, form, kind, n):
    full, expected = clean[form]
    record = run(poisoned(full, kind, n, Random(kind)), model=MODEL)
    number = {each: record.counts.get(each, 0) for each in (*REJECTED, *RESTARTS)}
    if any(count > expected.counts.get(each, 0) for each, count in number.items()):
        return
    after = record.lines[-1]["coefficients"]
    for label, old in expected.lines[-1]["coefficients"].items():
        new = after[label]
        assert new["grade"] == hd.Grade.NOT_DETERMINED.word or (
            abs(new["value"] - old["value"]) <= 0.5 * old["standard_error"]
        )
