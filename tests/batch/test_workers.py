"""Workers that die, hang or fail cost the log that they had, and no other."""

from __future__ import annotations

import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from batch.calls import work
from hydrodamp.batch.executor import Failure, open_pool


def results(tasks, timeout=60.0, client=None):
    with open_pool(client, 2, timeout) as pool:
        return list(pool.map(work, [(each,) for each in tasks], "working"))


@pytest.mark.slow
def test_a_call_that_kills_its_worker_costs_itself_alone():
    found = results([*range(5), "kill", *range(5, 9), "raise", "function"])
    assert found[:5] + found[6:10] == [2 * each for each in range(9)]
    assert isinstance(found[5], Failure)
    assert found[5] == "its process was killed, possibly as memory ran out."
    assert found[10] == "ValueError: no such number"
    assert "pickle" in found[11]


def test_a_worker_that_somebody_else_kills_costs_nothing(tmp_path):
    with open_pool(None, 2, 60.0) as pool:
        calls = [(1, None), ("kill once", tmp_path), (2, None)]
        assert list(pool.map(work, calls, "working")) == [2, "kill once" * 2, 4]


@pytest.mark.slow
@pytest.mark.parametrize("executor", ["processes", "threads"])
def test_as_many_hung_calls_as_workers_cost_no_other(executor):
    """Time counts from the start of a call: the last one starts after both timeouts."""
    tasks = ["hang", "hang", 1, 2, "hang", 3]
    if executor == "processes":
        found = results(tasks, timeout=0.5)
    else:
        with ThreadPoolExecutor(2) as threads:
            found = results(tasks, 0.5, threads)
    assert [found[2], found[3], found[5]] == [2, 4, 6]
    assert all("timeout of 0.5 s" in found[index] for index in (0, 1, 4))


SCRIPT = r"""
import os, time
from hydrodamp.batch.executor import open_pool

def work(seconds):
    os.write(1, b"started\n")
    time.sleep(seconds)

if __name__ == "__main__":
    with open_pool(None, 2, 600.0) as pool:
        list(pool.map(work, [(300.0,), (300.0,)], "working"))
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize("name", ["SIGTERM", "SIGKILL", "SIGINT"])
def test_workers_end_with_their_parent(name, tmp_path):
    script = Path(tmp_path, "parent.py")
    script.write_text(SCRIPT, encoding="utf-8")
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    with subprocess.Popen([sys.executable, script], **pipes) as parent:
        try:
            assert [parent.stdout.readline() for _ in range(2)] == [b"started\n"] * 2
            parent.send_signal(getattr(signal, name))
            # Both workers hold the pipe: it ends with the last of them.
            assert parent.communicate(timeout=60.0) == (b"", None)
        finally:
            parent.kill()
