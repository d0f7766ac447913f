"""Reading of the logs of a batch, with the messages on their outliers."""

from __future__ import annotations

from collections.abc import Sequence

from hydrodamp.batch.discovery import ResolvedMapping, local_copy
from hydrodamp.data.log import Log, concatenate
from hydrodamp.errors import OutlierWarning, WarningList, suppress_warnings
from hydrodamp.ingest.read import read_log
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.ranges import remove_implausible
from hydrodamp.vehicle.vehicle import Vehicle


def read_logs(addresses: Sequence[str], mapping: ResolvedMapping | None) -> Log:
    """Read and concatenate logs."""
    logs = []
    for address in addresses:
        with local_copy(address) as path:
            logs.append(read_log(path, mapping.mapping if mapping else None))
    return logs[0] if len(logs) == 1 else concatenate(logs)


def outlier_messages(collected: WarningList) -> tuple[str, ...]:
    """Return the messages on outliers; `probe` reports the other quality issues."""
    return tuple(dict.fromkeys(text for text, kind in collected if kind is OutlierWarning))


def read_start(
    address: str,
    vehicle: Vehicle,
    models: Sequence[DampingModel],
    mapping: ResolvedMapping | None = None,
) -> tuple[float, tuple[str, ...]]:
    """Return the clock time of the first sample [s], and the outliers of the log."""
    with suppress_warnings() as collected:
        log = read_logs([address], mapping)
        remove_implausible(vehicle, log, models)
    return float(log.time[0]), outlier_messages(collected)
