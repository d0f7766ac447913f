"""A season of logs: one folded, many on two cores, and what a Dask cluster adds."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import pytest
from interleaving import interleaved, on_all_cores

import hydrodamp as hd
from hydrodamp.batch.sufficient_statistics import summarise_address
from hydrodamp.data.concatenation import concatenate

MODEL, VEHICLE = hd.catalog["prestero"], hd.fleet["vt690"]
METHODS = {"ls": hd.LeastSquares(), "weak": hd.WeakForm()}
LONG = 40  # campaigns one after the other: a log that takes a second or so

pytestmark = pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="a season takes two cores")


#: glibc gives memory back at once under a Dask nanny's own setting, and faults it in again.
KEEP = {"MALLOC_TRIM_THRESHOLD_": "1000000000", "MALLOC_MMAP_THRESHOLD_": "1000000000"}


@pytest.fixture(scope="module")
def log() -> hd.Log:
    """The 8004 samples of a campaign."""
    return hd.reenact(seed=0).train


def shifted_logs(path: Path, n: int) -> Path:
    """Return a folder with the log at so many times: equal logs count once."""
    folder, log = path.with_suffix(""), hd.read_log(path)
    folder.mkdir()
    for k in range(n):
        hd.write_log(replace(log, time=log.time + k), folder / f"dive{k}{path.suffix}")
    return folder


@pytest.mark.parametrize("key", METHODS)
@pytest.mark.parametrize("kind", ["parquet", "csv"])
def test_fold(benchmark, ledger, log, tmp_path, kind, key):
    """From a file to its triangles, CPU time."""
    hd.write_log(log, path := tmp_path / f"log.{kind}")
    mine, _ = interleaved(
        benchmark,
        lambda: summarise_address(str(path), VEHICLE, [MODEL], METHODS[key]),
        lambda: hd.read_log(path),
        rounds=21,
    )
    what = f"{log.n} samples of {kind} read, prepared and folded, {key}: what was asked for"
    ledger.within(what, mine, 0.02, target=1.0 if kind == "parquet" else None)


def test_two_processes(benchmark, ledger, log, tmp_path):
    """A hundred logs, read and folded."""
    hd.write_log(log, path := tmp_path / "log.parquet")
    folder = shifted_logs(path, 100)
    two, one = on_all_cores(
        benchmark,
        lambda: hd.batch(folder, VEHICLE, MODEL, by=["folder"], workers=2),
        lambda: hd.batch(folder, VEHICLE, MODEL, by=["folder"], workers=1),
        rounds=5,
    )
    what = "a season of 100 logs: two processes, against one"
    ledger.reaches(what, 1e2 / two.best, 1e2 / one.best, unit="logs/s", target=1.8)


@pytest.mark.parametrize("kept", [False, True], ids=["as it comes", "memory kept"])
def test_dask(benchmark, ledger, log, tmp_path, kept):
    """Logs of a second each, on two processes of ours and on two of a cluster."""
    distributed = pytest.importorskip("distributed")
    import dask

    hd.write_log(concatenate([log] * LONG), path := tmp_path / "log.parquet")
    folder = shifted_logs(path, 12)
    settings = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": ":0"}
    environment = {"distributed.nanny.pre-spawn-environ": KEEP} if kept else {}
    with (
        dask.config.set(environment),
        distributed.LocalCluster(**settings) as cluster,
        distributed.Client(cluster) as client,
    ):
        cluster_time, own = on_all_cores(
            benchmark,
            lambda: hd.batch(folder, VEHICLE, MODEL, by=["folder"], client=client),
            lambda: hd.batch(folder, VEHICLE, MODEL, by=["folder"], workers=2),
            rounds=3,
        )
    how = " with memory kept" if kept else ""
    what = f"12 logs of {2 * own.best / 12:.1f} s each on Dask{how}: two processes without"
    ledger.within(what, cluster_time.best, own.best, target=1.1)
