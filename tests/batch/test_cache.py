"""A fold is taken from the cache only where everything it was made of is the same."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

import hydrodamp
import hydrodamp as hd
from batch.conftest import MODEL
from hydrodamp.batch import cache as caches

MAPPING = {
    "time": "time",
    "velocity": {name: name for name in "uvwpqr"},
    "attitude": {name: name for name in ("qw", "qx", "qy", "qz")},
}


@pytest.fixture
def run(fleet, tmp_path, threads):
    """Fold one log of ``logs/``; return the damping and how many folds were in the cache."""
    (tmp_path / "logs").mkdir()

    def call(vehicle=fleet.vehicle, **options):
        given = {"by": ["folder"], "client": threads, "cache": tmp_path / "statistics"}
        found = hd.batch(tmp_path / "logs", vehicle, MODEL, **{**given, **options})
        assert not found.failed
        return found.fits[0].fit.damping.coefficients, found.n_cached

    return call


@pytest.mark.slow
@pytest.mark.parametrize("damage", ["cut", "empty", "text", "flipped"])
def test_a_damaged_fold_is_made_again(damage, run, fleet, tmp_path):
    hd.write_log(fleet.dive(1), tmp_path / "logs" / "a.csv")
    expected, _ = run()
    (path,) = (tmp_path / "statistics").iterdir()
    content = path.read_bytes()
    flipped = bytearray(content)
    flipped[len(content) // 2] ^= 64  # within the numbers: a fold of other finite numbers
    path.write_bytes(
        {"cut": content[:-40], "empty": b"", "text": b"no fold", "flipped": bytes(flipped)}[damage]
    )
    coefficients, n_cached = run()
    assert n_cached == 0
    assert coefficients.tolist() == expected.tolist()
    assert run()[1] == 1


def write_mapped(fleet, folder, scale):
    """Write a log and a mapping that extends another, which scales the surge."""
    hd.write_log(fleet.dive(1), folder / "logs" / "a.csv")
    log = hd.read_log(folder / "logs" / "a.csv")
    base = {"commands": {name: name for name in log.command_names}, **MAPPING}
    base["velocity"] = {**MAPPING["velocity"], "u": {"column": "u", "scale": scale}}
    if log.attitude is None:
        base.pop("attitude")
    (folder / "base.yaml").write_text(yaml.safe_dump(base), "utf-8")
    (folder / "mapping.yaml").write_text("extends: base.yaml\n", "utf-8")
    return str(folder / "mapping.yaml")


@pytest.mark.slow
def test_a_change_of_an_extended_mapping_is_noticed(run, fleet, tmp_path):
    mapping = write_mapped(fleet, tmp_path, 1.0)
    first, _ = run(mapping=mapping)
    assert run(mapping=mapping)[1] == 1
    write_mapped(fleet, tmp_path, 1.2)
    second, n_cached = run(mapping=mapping)
    assert n_cached == 0
    assert not np.allclose(first, second, rtol=0.01)


@pytest.mark.slow
def test_a_change_of_the_vehicle_the_method_or_the_code_is_noticed(run, fleet, tmp_path):
    hd.write_log(fleet.dive(1), tmp_path / "logs" / "a.csv")
    run()
    heavier = replace(fleet.vehicle, mass_matrix=1.001 * fleet.vehicle.mass_matrix)
    assert run(heavier)[1] == 0
    assert run(method="ls")[1] == 0
    assert run()[1] == 1
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(caches, "_code_digest", lambda: "other sources")
        assert run()[1] == 0


def test_the_code_digest_covers_every_table_of_the_package():
    root = Path(hydrodamp.__file__).parent
    folders = [root / name for name in caches.SOURCES if (root / name).is_dir()]
    suffixes = {path.suffix for folder in folders for path in folder.rglob("*") if path.is_file()}
    assert suffixes - {".pyc", ".so", ".dll", ".dylib"} <= set(caches.SUFFIXES)
