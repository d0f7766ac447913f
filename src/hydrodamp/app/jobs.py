"""Commands that run in the background, one for each project and name.

A job is a process of its own: an interrupt leaves finished fits on disk, as Ctrl-C does. It holds
the lock of the file of its output, by which other servers know that it runs.
"""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from threading import RLock

from hydrodamp.app.project import Project
from hydrodamp.errors import ProblemError
from hydrodamp.locks import acquire_lock

#: Seconds that an interrupted process has before it is killed.
GRACE = 20.0

#: Characters of messages that are read.
MAX_MESSAGE = 20_000


@dataclass
class Job:
    """A command that runs or has ended."""

    process: subprocess.Popen[bytes]
    output: Path
    command: list[str]
    is_cancelled: bool = False
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
            self.is_cancelled = True
            self.process.send_signal(signal.SIGINT)

    def wait(self) -> None:
        """Wait for the end of an interrupted command."""
        try:
            self.process.wait(GRACE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


class Jobs:
    """The jobs of all projects."""

    def __init__(self) -> None:
        self._lock = RLock()
        self._jobs: dict[tuple[str, str], Job] = {}

    def find(self, project: Project, name: str) -> Job | None:
        """Return the latest job of a name."""
        return self._jobs.get((project.name, name))

    def start(self, project: Project, name: str, command: list[str]) -> Job:
        """Start a command in the folder of the projects, unless it runs already."""
        with self._lock:
            job = self.find(project, name)
            if job is not None and job.is_cancelled:
                job.wait()
            if job is not None and job.is_running:
                if job.command != command:
                    raise ProblemError(
                        f"`hydrodamp {name}` runs with earlier choices: cancel it, or wait for its "
                        "end, then start it again"
                    )
                return job
            output = project.path(f"{name}.log")
            with output.open("ab") as stream:
                if not acquire_lock(stream.fileno()):
                    raise ProblemError(
                        f"this project has a job of another server, or of one that was killed: "
                        f"wait for its end, or end the process that writes {output}"
                    )
                stream.truncate(0)
                process = subprocess.Popen(
                    [sys.executable, "-m", "hydrodamp", *command],
                    cwd=project.root,
                    stdin=subprocess.DEVNULL,
                    stdout=stream,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,  # Ctrl-C in the terminal reaches it once, by stop_all
                )
            job = self._jobs[project.name, name] = Job(process, output, command)
            return job

    def stop_all(self) -> None:
        """Interrupt all commands and wait for their end."""
        running = [job for job in self._jobs.values() if job.is_running]
        for job in running:
            job.interrupt()
        for job in running:
            job.wait()
