"""Checks of the logs of a command before the work: what is missing, too short or suspicious."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import hydrodamp as hd
from hydrodamp.errors import HydrodampWarning, ProblemError


def warn_quality_issues(
    log: hd.Log, length: float | None = None, reference: hd.Log | None = None
) -> None:
    """Warn of quality issues of a log that a reference log does not have."""
    earlier_issues = () if reference is None else hd.check_quality(reference, length)
    known = {(issue.channel, issue.problem) for issue in earlier_issues}
    for issue in hd.check_quality(log, length):
        # The vehicle check covers commands.
        is_new = issue.where or (issue.channel, issue.problem) not in known
        if is_new and issue.channel not in log.command_names:
            _warn(log, issue)


def check_log(
    vehicle: hd.Vehicle,
    log: hd.Log,
    models: Sequence[hd.DampingModel],
    reference: hd.Log | None = None,
) -> None:
    """Raise on an unsuitable log; warn of unused commands and of quality issues."""
    from hydrodamp.simulation import checks

    checks.check_log(vehicle, log, [model.restricted_to(vehicle.axes) for model in models])
    for issue in checks.unused_commands(vehicle, log, models):
        _warn(log, issue)
    warn_quality_issues(log, checks.estimate_length(vehicle), reference)


def check_training(vehicle: hd.Vehicle, log: hd.Log, models: Sequence[hd.DampingModel]) -> None:
    """Check a log; warn of models that it cannot excite; raise if it is too short for all."""
    from hydrodamp.conditioning.current import current_warning
    from hydrodamp.ingest.inspection.command_signs import contradicted_signs
    from hydrodamp.ingest.inspection.delay import estimate_delays
    from hydrodamp.ingest.inspection.draft_files import check_channel_axes
    from hydrodamp.ingest.inspection.equivalent_commands import equivalent_commands
    from hydrodamp.models.model import read_label
    from hydrodamp.simulation.checks import missing_actuation, thruster_signs

    check_log(vehicle, log, models)
    if message := current_warning(log):
        _warn(log, message)
    restricted = [model.restricted_to(vehicle.axes) for model in models]
    for model in restricted:
        if message := missing_actuation(vehicle, log, (model,)):
            warnings.warn(f"'{model.key}' is refused: {message}", HydrodampWarning, stacklevel=2)
    gains = {
        (axis, command)
        for model in restricted
        for axis, term in map(read_label, model.labels)
        for command in term.commands
    }
    if gains:
        for message in check_channel_axes(estimate_delays(log), sorted(gains), log.velocity_names):
            warnings.warn(message, HydrodampWarning, stacklevel=2)
        for group in equivalent_commands(log, {command for _, command in gains}):
            _warn(log, group.issue())
    if signs := {} if log.wrench is not None else thruster_signs(vehicle):
        for issue in contradicted_signs(log, estimate_delays(log), signs):
            _warn(log, issue)
    n_terms = min(max(map(len, model.terms), default=0) for model in restricted)
    if log.n < n_terms:
        raise ProblemError(
            f"{log.source or 'log'}: {log.n} samples are fewer than the terms of an axis; the "
            f"smallest model needs {n_terms}. Use a longer log."
        )


def warn_wrong_gains(problem: hd.Problem, models: Sequence[hd.DampingModel]) -> None:
    """Warn of a wrench that is inconsistent with the motion."""
    from hydrodamp.validation.actuator_gains import check_gains

    for issue in check_gains(problem, models):
        _warn(problem.log, issue)


def _warn(log: hd.Log, issue: object) -> None:
    warnings.warn(f"{log.source or 'log'}: {issue}", HydrodampWarning, stacklevel=3)
