"""Workers that die, hang or fail cost the log that they had, and no other."""

from __future__ import annotations

import os
import signal
import time

from hydrodamp.batch.crew import Failed, crew


def work(what):
    if what == "kill":
        os.kill(os.getpid(), signal.SIGKILL)
    if what == "hang":
        time.sleep(60.0)
    if what == "raise":
        raise ValueError("no such number")
    return 2 * what


def done(given, patience=60.0):
    with crew(None, 2, patience) as team:
        return list(team.each(work, [(one,) for one in given], "working"))


def test_what_kills_a_worker_costs_itself_alone():
    found = done([*range(5), "kill", *range(5, 9), "raise"])
    assert found[:5] + found[6:10] == [2 * one for one in range(9)]
    assert isinstance(found[5], Failed)
    assert "killed" in found[5]
    assert found[10] == "ValueError: no such number"


def test_what_hangs_is_given_up():
    begun = time.monotonic()
    found = done([1, "hang", 2], patience=1.0)
    assert [found[0], found[2]] == [2, 4]
    assert "given up after 1 s" in found[1]
    assert time.monotonic() - begun < 30.0
