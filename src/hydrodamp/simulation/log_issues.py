"""Issues of the logs of a comparison before the work: what is missing, too short or suspicious."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Sequence

from hydrodamp.conditioning.current import current_warning
from hydrodamp.conditioning.quality_checks import QualityIssue, check_quality
from hydrodamp.data.log import Log
from hydrodamp.errors import HydrodampWarning, ProblemError
from hydrodamp.ingest.inspection.command_signs import contradicted_signs
from hydrodamp.ingest.inspection.delay import estimate_delays
from hydrodamp.ingest.inspection.draft_files import check_channel_axes
from hydrodamp.ingest.inspection.equivalent_commands import equivalent_commands
from hydrodamp.models.model import DampingModel, read_label
from hydrodamp.simulation.checks import (
    check_log,
    estimate_length,
    thruster_signs,
    unused_commands,
)
from hydrodamp.vehicle.vehicle import Vehicle

Issue = QualityIssue | str


def warn_issues(log: Log, issues: Iterable[Issue]) -> None:
    """Warn of issues of a log."""
    for issue in issues:
        warnings.warn(f"{log.source or 'log'}: {issue}", HydrodampWarning, stacklevel=3)


def quality_issues(
    log: Log, length: float | None = None, reference: Log | None = None
) -> Iterator[QualityIssue]:
    """Yield the quality issues of a log that a reference log does not have."""
    earlier_issues = () if reference is None else check_quality(reference, length)
    known = {(issue.channel, issue.problem) for issue in earlier_issues}
    for issue in check_quality(log, length):
        # The vehicle check covers commands.
        is_new = issue.where or (issue.channel, issue.problem) not in known
        if is_new and issue.channel not in log.command_names:
            yield issue


def log_issues(
    vehicle: Vehicle, log: Log, models: Sequence[DampingModel], reference: Log | None = None
) -> Iterator[Issue]:
    """Yield unused commands and quality issues of a log; raise if it is unsuitable."""
    check_log(vehicle, log, [model.restricted_to(vehicle.axes) for model in models])
    yield from unused_commands(vehicle, log, models)
    yield from quality_issues(log, estimate_length(vehicle), reference)


def training_issues(vehicle: Vehicle, log: Log, models: Sequence[DampingModel]) -> Iterator[Issue]:
    """Yield the issues of training data for models; raise if they are too short for all."""
    yield from log_issues(vehicle, log, models)
    if message := current_warning(log):
        yield message
    restricted = [model.restricted_to(vehicle.axes) for model in models]
    gains = {
        (axis, command)
        for model in restricted
        for axis, term in map(read_label, model.labels)
        for command in term.commands
    }
    if gains:
        yield from check_channel_axes(estimate_delays(log), sorted(gains), log.velocity_names)
        commands = {command for _, command in gains}
        yield from (group.issue() for group in equivalent_commands(log, commands))
    if signs := {} if log.wrench is not None else thruster_signs(vehicle):
        yield from contradicted_signs(log, estimate_delays(log), signs)
    n_terms = min(max(map(len, model.terms), default=0) for model in restricted)
    if log.n < n_terms:
        raise ProblemError(
            f"{log.source or 'log'}: {log.n} samples are fewer than the terms of an axis; the "
            f"smallest model needs {n_terms}. Use a longer log."
        )
