"""Jobs of two servers, and a job that follows a cancelled one."""

import os
import subprocess
import sys
import time
from types import SimpleNamespace

import pytest

from hydrodamp.app.jobs import Jobs
from hydrodamp.app.project import Project
from hydrodamp.errors import ProblemError
from hydrodamp.locks import acquire_lock

COMMAND = ["compare"]

#: A process that writes when an interrupt can reach it, and needs a moment to end.
SCRIPT = """
import time
try:
    print("ready", flush=True)
    time.sleep(60.0)
except KeyboardInterrupt:
    time.sleep(0.3)
"""


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A project whose jobs wait."""
    started, real = [], subprocess.Popen

    def start(command, **options):
        started.append(real([sys.executable, "-c", SCRIPT], **options))
        return started[-1]

    monkeypatch.setattr(subprocess, "Popen", start)
    project = Project(tmp_path, "dive")
    project.folder.mkdir()
    yield project
    for process in started:
        process.kill()
        process.wait()


def wait_until_ready(job):
    while "ready" not in job.messages:
        time.sleep(0.01)


def test_a_run_after_a_cancelled_one_starts_when_that_has_ended(project):
    jobs = Jobs()
    first = jobs.start(project, "compare", COMMAND)
    wait_until_ready(first)
    first.interrupt()
    second = jobs.start(project, "compare", COMMAND)
    assert not first.is_running
    assert second.is_running
    assert second is not first


def test_a_run_with_other_choices_does_not_replace_one_that_runs(project, refused):
    jobs = Jobs()
    first = jobs.start(project, "compare", COMMAND)
    assert jobs.start(project, "compare", COMMAND) is first
    refused(ProblemError, jobs.start, project, "compare", [*COMMAND, "--resume"])


def test_the_job_of_another_server_is_found_by_its_lock(project, refused):
    first = Jobs().start(project, "compare", COMMAND)
    wait_until_ready(first)
    refused(ProblemError, Jobs().start, project, "compare", COMMAND)
    assert "ready" in first.messages
    first.process.kill()
    first.wait()
    assert Jobs().start(project, "compare", COMMAND).is_running


def test_the_server_holds_the_lock_until_the_job_ends(project):
    job = Jobs().start(project, "compare", COMMAND)
    wait_until_ready(job)
    assert not job.stream.closed
    job.interrupt()
    job.wait()
    assert job.stream.closed
    assert job.status == 0


def test_a_lock_of_windows_leaves_the_offset_of_the_output(tmp_path, monkeypatch):
    locking = SimpleNamespace(LK_NBLCK=2, locking=lambda *_: None)
    monkeypatch.setitem(sys.modules, "msvcrt", locking)
    monkeypatch.setattr(sys, "platform", "win32")
    with (tmp_path / "compare.log").open("wb") as stream:
        assert acquire_lock(stream.fileno())
        assert os.lseek(stream.fileno(), 0, os.SEEK_CUR) == 0


def test_the_number_of_a_foreign_process_is_not_believed(project):
    project.path(".compare.pid").write_text(str(os.getppid()), "utf-8")
    assert Jobs().start(project, "compare", COMMAND).is_running
