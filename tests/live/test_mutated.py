"""Mutated rows end no run and leave a finite estimate near that of the rows between them."""

import json
import math
import warnings
from itertools import islice

from hydrodamp.live.sample_validation import BEGIN, LEFT_OUT
from hydrodamp.live.sources import LineParser
from live.conftest import heard
from live.mutator import mutated, rows


def test_mutated_rows_end_no_run(dive, tmp_path):
    vehicle, _ = dive
    path, read = tmp_path / "state.json", LineParser()
    lines = [*islice(mutated(seed=1), 20_000)]
    samples = [row for line in lines if (row := read(line)) is not None]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        told = heard(samples, vehicle, checkpoint_path=path, output_interval=1e9)
    clean = heard(islice(rows(), 18_000), vehicle, output_interval=1e9)
    counts = told.counts
    assert sum(n for kind, n in counts.items() if kind not in BEGIN) == len(samples)
    assert {
        "unreadable",
        "incomplete",
        "absurd",
        "late",
        "spike",
    } <= counts.keys() & LEFT_OUT.keys()
    assert "failed" not in counts
    assert counts["taken"] > 17_000
    assert all(map(math.isfinite, told.coefficients))
    assert json.loads(path.read_text())["state"]["seen"] == len(samples)
    drag, near = (one.lines[-1]["coefficients"]["X_u|u|"] for one in (clean, told))
    assert abs(near["value"] - drag["value"]) < drag["standard_error"]
