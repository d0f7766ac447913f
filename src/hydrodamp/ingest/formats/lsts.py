"""LSTS logs of IMC messages (``.lsf``): recognised, and how to convert them told."""

from __future__ import annotations

from pathlib import Path
from typing import NoReturn

from hydrodamp.errors import LogError


def read(path: str | Path) -> NoReturn:
    """Refuse a log, and say how to convert it."""
    raise LogError(
        "LSTS logs (.lsf) cannot be read here: no maintained reader exists for Python. Open the log"
        " in Neptus (Mission Review and Analysis), choose `Export to CSV` or `MatLab format .MAT`,"
        " and read what it writes: a folder of CSV files, one a message, is read as topics",
        source=str(path),
    )
