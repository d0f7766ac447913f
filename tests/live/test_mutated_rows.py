"""Mutated rows end no run and leave a finite estimate near that of the rows between them."""

import json
import math
import warnings
from itertools import islice
from random import Random

import pytest

import hydrodamp as hd
from hydrodamp.live.readers import LineParser
from hydrodamp.live.sample_validator import REJECTED, RESTARTS
from live.conftest import angles, run_live, wrench
from live.row_mutator import CHANGES, mutated, poisoned, rows

MODEL = hd.catalog["linear"]


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


FORMS = {
    "commands": (dict, ("u", "r", "qz", "rudder", "rpm")),
    "wrench": (lambda row: wrench(angles(row)), ("w", "roll", "pitch", "yaw", *"XYN", "eta")),
}
BY_COLUMN = {
    "commands": {"angles", "roll beside a quaternion", "upside down", "quaternion of zeros", "rpm"}
    | {"other columns"},
    "wrench": {"quaternion", "qw beside angles", "roll 1e308", "roll 3", "pitch 400", "force"}
    | {"degrees"},
}
POISONED = [
    (form, kind)
    for form, (_, names) in FORMS.items()
    for kind in (*CHANGES, *(f"without {name}" for name in names))
    if kind in BY_COLUMN[form] or not any(kind in kinds for kinds in BY_COLUMN.values())
]


@pytest.fixture(scope="module")
def clean(dive):
    """Rows of each form and the record of a run over them."""
    samples = [*islice(rows(), 1000)]
    forms = {name: [*map(form, samples)] for name, (form, _) in FORMS.items()}
    return {name: (each, run_live(each, dive[0], model=MODEL)) for name, each in forms.items()}


@pytest.mark.slow
@pytest.mark.parametrize(("form", "kind"), POISONED)
@pytest.mark.parametrize("n", [1, 300])
def test_no_poisoned_row_moves_an_estimate_silently(dive, clean, form, kind, n):
    full, expected = clean[form]
    record = run_live(poisoned(full, kind, n, Random(kind)), dive[0], model=MODEL)
    number = {each: record.counts.get(each, 0) for each in (*REJECTED, *RESTARTS)}
    if kind.startswith("without "):
        assert number["incomplete"] == n
    if any(count > expected.counts.get(each, 0) for each, count in number.items()):
        return
    after = record.lines[-1]["coefficients"]
    for label, old in expected.lines[-1]["coefficients"].items():
        new = after[label]
        assert new["grade"] == hd.Grade.NOT_DETERMINED.word or (
            abs(new["value"] - old["value"]) <= 0.5 * old["standard_error"]
        )
