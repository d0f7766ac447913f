"""Reading of the logs of a batch, with the messages on their outliers."""

from __future__ import annotations

from collections.abc import Sequence

from hydrodamp.batch.discovery import ResolvedMapping, local_copy
from hydrodamp.data.concatenation import concatenate
from hydrodamp.data.log import Log
from hydrodamp.errors import OutlierWarning, WarningList, suppress_warnings
from hydrodamp.ingest.read import read_log


def read_logs(addresses: Sequence[str], mapping: ResolvedMapping | None) -> Log:
    """Read and concatenate logs."""
    logs = []
    for address in addresses:
        with local_copy(address) as path:
            logs.append(read_log(path, mapping.mapping if mapping else None))
    return logs[0] if len(logs) == 1 else concatenate(logs)


def outlier_messages(collected: WarningList, source: str = "") -> tuple[str, ...]:
    """Return the messages on outliers without their source; `probe` reports other issues."""
    texts = (text for text, kind in collected if kind is OutlierWarning)
    return tuple(dict.fromkeys(text.removeprefix(f"{source}: ") for text in texts))


def read_start(address: str, mapping: ResolvedMapping | None = None) -> float:
    """Return the clock time of the first sample [s]."""
    with suppress_warnings():
        return float(read_logs([address], mapping).time[0])
