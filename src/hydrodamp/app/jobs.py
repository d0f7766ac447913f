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
from io import BufferedWriter
from pathlib import Path
from threading import RLock, Thread

from hydrodamp.app.project import Project
from hydrodamp.errors import ProblemError
from hydrodamp.locks import acquire_lock

#: Seconds that an interrupted process has before it is killed.
GRACE = 20.0

#: Characters of messages that are read.
MAX_MESSAGE = 20_000

if sys.platform == "win32":
    INTERRUPT, CREATION = signal.CTRL_BREAK_EVENT, subprocess.CREATE_NEW_PROCESS_GROUP
else:
    INTERRUPT, CREATION = signal.SIGINT, 0


@dataclass
class Job:
    """A command that runs or has ended."""

    process: subprocess.Popen[bytes]
    stream: BufferedWriter  # of the output, with the lock
    command: list[str]
    is_cancelled: bool = False
    started: float = field(default_factory=time.time)

    def __post_init__(self) -> None:
        """Hold the lock until the process ends: on Windows, a process inherits none."""
        self._end = Thread(target=self._release_at_end, daemon=True)
        self._end.start()

    def _release_at_end(self) -> None:
        with self.stream:
            self.process.wait()

    @property
    def is_running(self) -> bool:
        """Whether the command has not ended."""
        return self._end.is_alive()

    @property
    def status(self) -> int | None:
        """The exit status; None while the command runs."""
        return None if self.is_running else self.process.returncode

    @property
    def messages(self) -> str:
        """What the command has written to standard output and error."""
        output = Path(self.stream.name)
        if not output.is_file():
            return ""
        return output.read_text("utf-8", errors="replace")[-MAX_MESSAGE:]

    def interrupt(self) -> None:
        """Interrupt the command as Ctrl-C does."""
        if self.is_running:
            self.is_cancelled = True
            self.process.send_signal(INTERRUPT)

    def wait(self) -> None:
        """Wait for the end of an interrupted command."""
        self._end.join(GRACE)
        if self.is_running:
            self.process.kill()
            self._end.join()


class Jobs:
    """The jobs of all projects."""

    def __init__(self) -> None:
        self._lock = RLock()
        self._jobs: dict[tuple[str, str], Job] = {}

    def find(self, project: Project, name: str) -> Job | None:
        """Return the latest job of a name."""
        return self._jobs.get((project.name, name))

    def is_busy(self, project: Project) -> bool:
        """Return whether a command of a project runs."""
        return any(name == project.name and j.is_running for (name, _), j in self._jobs.items())

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
            stream = output.open("ab")
            try:
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
                    creationflags=CREATION,
                )
            except BaseException:
                stream.close()
                raise
            job = self._jobs[project.name, name] = Job(process, stream, command)
            return job

    def stop_all(self) -> None:
        """Interrupt all commands and wait for their end."""
        running = [job for job in self._jobs.values() if job.is_running]
        for job in running:
            job.interrupt()
        for job in running:
            job.wait()
