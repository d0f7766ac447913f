"""Commands that run in the background, one for each project and name.

A job is a process of its own: an interrupt leaves finished fits on disk, as Ctrl-C does.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from threading import RLock

from hydrodamp.app.project import Project
from hydrodamp.errors import ProblemError

#: Seconds that an interrupted process has before it is killed.
GRACE = 20.0

#: Characters of messages that are read.
MAX_MESSAGE = 20_000


@dataclass
class Job:
    """A command that runs or has ended."""

    process: subprocess.Popen[bytes]
    output: Path
    started: float = field(default_factory=time.time)

    @property
    def is_running(self) -> bool:
        """Whether the command has not ended."""
        return self.process.poll() is None

    @property
    def status(self) -> int | None:
        """The exit status; None while the command runs."""
        return self.process.poll()

    @property
    def messages(self) -> str:
        """What the command has written to standard output and error."""
        if not self.output.is_file():
            return ""
        return self.output.read_text("utf-8", errors="replace")[-MAX_MESSAGE:]

    def interrupt(self) -> None:
        """Interrupt the command as Ctrl-C does."""
        if self.is_running:
            self.process.send_signal(signal.SIGINT)


class Jobs:
    """The jobs of all projects."""

    def __init__(self) -> None:
        self._lock = RLock()
        self._jobs: dict[tuple[str, str], Job] = {}

    def find(self, project: Project, name: str) -> Job | None:
        """Return the latest job of a name."""
        return self._jobs.get((project.name, name))

    def start(self, project: Project, name: str, command: list[str]) -> Job:
        """Start a command in the folder of the projects, unless one of the name is running."""
        with self._lock:
            job = self.find(project, name)
            if job is not None and job.is_running:
                return job
            self._check_elsewhere(project, name)
            output = project.path(f"{name}.log")
            with output.open("wb") as stream:
                process = subprocess.Popen(
                    [sys.executable, "-m", "hydrodamp", *command],
                    cwd=project.root,
                    stdin=subprocess.DEVNULL,
                    stdout=stream,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,  # Ctrl-C in the terminal reaches it once, by stop_all
                )
            project.path(f".{name}.pid").write_text(str(process.pid), "utf-8")
            job = self._jobs[project.name, name] = Job(process, output)
            return job

    def _check_elsewhere(self, project: Project, name: str) -> None:
        """Raise if another server, or one that was killed, has started the job and it runs."""
        path = project.path(f".{name}.pid")
        text = path.read_text("utf-8") if path.is_file() else ""
        known = self.find(project, name)
        if not text.isdigit() or (known is not None and known.process.pid == int(text)):
            return
        with suppress(OSError):  # there is no such process
            os.kill(int(text), 0)
            raise ProblemError(
                f"a job `{name}` of this project runs already as process {text}: wait for its end, "
                f"or end it and remove {path}"
            )

    def stop_all(self) -> None:
        """Interrupt all commands and wait for their end."""
        running = [job for job in self._jobs.values() if job.is_running]
        for job in running:
            job.interrupt()
        for job in running:
            try:
                job.process.wait(GRACE)
            except subprocess.TimeoutExpired:
                job.process.kill()
