"""A season on a Dask cluster of this machine, and logs from a store that fsspec knows."""

from __future__ import annotations

import os
import signal
import time
from threading import Timer

import pytest

import hydrodamp as hd
from batch.conftest import MODEL
from hydrodamp.batch.executor import Failure, open_pool

distributed = pytest.importorskip("distributed", reason="needs the extra `batch`")
fsspec = pytest.importorskip("fsspec", reason="needs the extra `batch`")


SETTINGS = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": ":0"}


@pytest.fixture(scope="module")
def client():
    with distributed.LocalCluster(**SETTINGS) as cluster, distributed.Client(cluster) as one:
        yield one


@pytest.mark.slow
def test_a_killed_worker_changes_nothing(fleet, season, client):
    workers = client.run(os.getpid)
    expected = hd.batch(season, fleet.vehicle, MODEL, workers=2, by=["month"]).fits[0]
    assert client.run(os.getpid) == workers  # those of a cluster in this process live on
    doomed = client.submit(signal.raise_signal, signal.SIGKILL, retries=0, pure=False)
    found = hd.batch(season, fleet.vehicle, MODEL, client=client, by=["month"]).fits[0]
    with pytest.raises(distributed.scheduler.KilledWorker):
        doomed.result()
    assert found.n_logs == expected.n_logs == 6
    assert found.fit.n_samples == expected.fit.n_samples
    one, other = (each.fit.damping.coefficients for each in (found, expected))
    assert one.tobytes() == other.tobytes()


@pytest.mark.slow
def test_a_node_that_hangs_and_a_scheduler_that_is_lost_cost_their_work_alone():
    with distributed.LocalCluster(**SETTINGS) as cluster, distributed.Client(cluster) as one:
        with open_pool(one, None, 2.0) as pool:
            found = list(pool.map(time.sleep, [(0.0,), (30.0,), (0.1,)], "working"))
            assert [found[0], found[2]] == [None, None]
            assert "timeout of 2 s" in found[1]
        with open_pool(one, None, 60.0) as pool:
            Timer(0.5, cluster.close).start()
            lost = list(pool.map(time.sleep, [(30.0,), (31.0,)], "working"))
    assert all(isinstance(each, Failure) for each in lost)
    assert "the scheduler is lost" in lost[0]


@pytest.mark.slow
def test_logs_come_from_a_store(fleet, season, tmp_path):
    """The memory of fsspec is of one process: threads see it."""
    from concurrent.futures import ThreadPoolExecutor

    store = fsspec.filesystem("memory")
    for log in season.iterdir():
        store.put(str(log), f"/season/{log.name}")
    with ThreadPoolExecutor(2) as threads:
        given = {"client": threads, "cache": tmp_path}
        found = hd.batch("memory://season/*05-01*.csv", fleet.vehicle, MODEL, **given)
        all_of_them = hd.batch("memory://season", fleet.vehicle, MODEL, **given)
    assert [one.n_logs for one in found.fits] == [2]
    assert [one.n_logs for one in all_of_them.fits] == [2, 2, 2]
    assert all_of_them.n_cached == 2
