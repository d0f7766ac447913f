"""A function that workers import: it works, dies, hangs or fails."""

from __future__ import annotations

import os
import signal
import time


def work(task, folder=None):
    if task == "kill" or (task == "kill once" and not (folder / "killed").exists()):
        if folder:
            (folder / "killed").touch()
        os.kill(os.getpid(), signal.SIGKILL)
    if task == "hang":
        time.sleep(60.0)
    if task == "raise":
        raise ValueError("no such number")
    if task == "function":
        return lambda: None
    return 2 * task
