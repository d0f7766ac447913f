"""Mutated rows end no run and leave a finite estimate near that of the rows between them."""

import json
import math
import warnings
from itertools import islice

import pytest

from hydrodamp.live.readers import LineParser
from hydrodamp.live.sample_validator import REJECTED, RESTARTS
from live.conftest import run_live
from live.row_mutator import mutated, rows


@pytest.mark.slow
def test_mutated_rows_end_no_run(dive, tmp_path):
    vehicle, _ = dive
    path, read = tmp_path / "state.json", LineParser()
    lines = [*islice(mutated(seed=1), 20_000)]
    samples = [row for line in lines if (row := read(line)) is not None]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        record = run_live(samples, vehicle, checkpoint_path=path)
    clean = run_live(islice(rows(), 18_000), vehicle)
    counts = record.counts
    assert sum(n for kind, n in counts.items() if kind not in RESTARTS) == len(samples)
    assert {
        "unreadable",
        "incomplete",
        "absurd",
        "late",
        "spike",
    } <= counts.keys() & REJECTED.keys()
    assert "failed" not in counts
    assert counts["taken"] > 17_000
    assert all(map(math.isfinite, record.coefficients))
    assert json.loads(path.read_text())["state"]["n_rows"] == len(samples)
    drag, near = (one.lines[-1]["coefficients"]["X_u|u|"] for one in (clean, record))
    assert abs(near["value"] - drag["value"]) < drag["standard_error"]
