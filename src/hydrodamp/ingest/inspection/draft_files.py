"""Draft of a mapping with the steps that the quality report recommends, and axes of commands."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence

from hydrodamp.basis.term import AXES, VELOCITIES
from hydrodamp.conditioning.consistency import QualityIssue
from hydrodamp.files import parse_yaml
from hydrodamp.ingest.inspection.delay import Delay
from hydrodamp.ingest.inspection.quality_report import QualityReport
from hydrodamp.ingest.mapping.log_mapping import resolve_extends

#: Steps that clean a pose, from which others derive velocities.
POSE_STEPS = ("mask_mocap_dropouts", "mask_frozen", "remove_attitude_outliers")

_STEPS_LINE = re.compile(r"(?m)^steps: \[(.*)\]")


def add_steps(draft: str, report: QualityReport | None) -> str:
    """Return the draft of a mapping with the cleaning steps that a report recommends."""
    if report is None:
        return draft
    steps = [*dict.fromkeys(filter(None, map(recommended_step, report.issues)))]
    if not steps:
        return draft
    line = _STEPS_LINE.search(draft)
    derived = line.group(1).split(", ") if line else _inherited_steps(draft)
    of_pose = [step for step in steps if step in POSE_STEPS]  # cleaned before others derive from it
    of_channels = [step for step in steps if step not in POSE_STEPS]
    text = f"steps: [{', '.join([*of_pose, *derived, *of_channels])}]"
    if line:
        return draft.replace(line.group(), text, 1)
    return f"{draft.rstrip()}\n{text}    # recommended by the quality report\n"


def _inherited_steps(draft: str) -> list[str]:
    """Return the steps of the preset that a draft extends: its own steps replace them."""
    content = parse_yaml(draft, "the draft")
    return list(resolve_extends(content).get("steps", [])) if isinstance(content, dict) else []


def recommended_step(issue: QualityIssue) -> str:
    """Return the cleaning step that corrects an issue, empty without one."""
    return issue.fix.value if issue.fix is not None and issue.fix.kind == "step" else ""


def group_commands(delays: Iterable[Delay]) -> dict[str, list[Delay]]:
    """Return the delays of commands by the axis of the velocity that each moves, in order."""
    listed = [delay for delay in delays if delay.command not in AXES]
    groups = {axis: [delay for delay in listed if axis_of(delay) == axis] for axis in AXES}
    return {axis: group for axis, group in groups.items() if group}


def axis_of(delay: Delay) -> str:
    """Return the axis of the velocity that a command moves."""
    return AXES[VELOCITIES.index(delay.velocity)]


def _describe(delay: Delay) -> str:
    direction = "increases" if delay.sign > 0 else "decreases"
    return (
        f"{direction} {delay.velocity}, {100.0 * delay.share:.0f} % of its acceleration, after "
        f"{delay.seconds:.2g} s"
    )


def check_channel_axes(
    delays: Sequence[Delay], gains: Iterable[tuple[str, str]], recorded: Sequence[str] = VELOCITIES
) -> Iterator[str]:
    """Yield a sentence on each gain, a pair of axis and command, on an axis that it does not move.

    A command whose gains include the axis that it moves is not reported, nor one with a gain on an
    axis whose velocity was not recorded.
    """
    axes: dict[str, list[str]] = {}
    for axis, command in gains:
        axes.setdefault(command, []).append(axis)
    for delay in delays:
        assigned, moved = axes.get(delay.command, []), axis_of(delay)
        is_known = all(VELOCITIES[AXES.index(axis)] in recorded for axis in assigned)
        if assigned and is_known and moved not in assigned:
            yield (
                f"the model has a gain of {delay.command} on {' '.join(assigned)}, but it moves "
                f"{delay.velocity} ({_describe(delay)}): assign it to {moved}"
            )
