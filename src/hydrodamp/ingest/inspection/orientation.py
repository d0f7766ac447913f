"""Evidence on the direction of z in a log, and issues that contradict it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from hydrodamp.basis.atoms import VELOCITY_OF
from hydrodamp.conditioning.consistency import QualityIssue
from hydrodamp.conditioning.vertical import VerticalAxis
from hydrodamp.ingest.inspection.delay import Delay

#: Share of the variance of an acceleration from which a command has an effect.
MIN_RESPONSE_SHARE = 0.05
_MIN_DELAY_CONFIDENCE = 50  # %, confidence of a delay from which its sign counts
UNDECIDED = "The direction of z is undetermined"
#: Motion of the vehicle when a velocity increases that changes sign with the axes.
_MOVES = {"v": "to starboard", "w": "down", "q": "bow up", "r": "to starboard"}
_OPPOSITE_MOVES = {"v": "to port", "w": "up", "q": "bow down", "r": "to port"}


def describe_frame(upright: VerticalAxis, responses: Sequence[str]) -> str:
    """Return the evidence for the direction of z, or what would determine it."""
    evidence = "; ".join(test.message for test in upright.evidence)
    if upright.is_sure:
        return f"{upright.body} by {upright.confidence} %: {evidence}."
    observed = f" Responses: {'; '.join(responses)}." if responses else ""
    return (
        f"{UNDECIDED}: motion alone cannot distinguish FRD over NED from FLU over a world with z up"
        f"{f'; {evidence}' if evidence else ''}.{observed} Compare with the actual motion, or "
        "record a specific force or a depth."
    )


def misread_positions(measured: Mapping[str, str]) -> Iterator[QualityIssue]:
    """Yield commands whose names are those of positions."""
    names = [name for name, role in measured.items() if not role.endswith("depth")]
    if names:
        yield QualityIssue(
            " ".join(names),
            "has the name of a position but was read as a command",
            "the canonical form calls a position x y z, in metres",
            remedy="rename it, or name it under `position` in a mapping (`--draft`)",
        )


def wrong_frame(upright: VerticalAxis, issues: Sequence[QualityIssue]) -> Iterator[QualityIssue]:
    """Yield that z is up, unless an issue of the specific force reports it."""
    if (
        upright.body == "FLU"
        and upright.is_sure
        and all(issue.channel != "specific_force" for issue in issues)
    ):
        yield QualityIssue(
            "frame",
            "is forward-port-up, not forward-starboard-down",
            "; ".join(test.message for test in upright.evidence if test.log_odds < 0.0),
            remedy="write `frame: FLU` in a mapping, and list deviating sensors under `sensors`",
        )


def reversed_wrench(delays: Sequence[Delay]) -> Iterator[QualityIssue]:
    """Yield axes of a recorded wrench that accelerate the vehicle against their sign."""
    reversed_delays = [
        delay
        for delay in delays
        if VELOCITY_OF.get(delay.command) == delay.velocity
        and delay.sign < 0
        and delay.share >= MIN_RESPONSE_SHARE
        and delay.confidence >= _MIN_DELAY_CONFIDENCE
    ]
    if reversed_delays:
        yield QualityIssue(
            " ".join(delay.command for delay in reversed_delays),
            "acts against its sign",
            ", ".join(
                f"{delay.velocity} decreases when {delay.command} increases"
                for delay in reversed_delays
            ),
            remedy="write `sign: -1` for it, or other axes under `sensors`, in the mapping",
        )


def list_responses(delays: Sequence[Delay]) -> Iterator[str]:
    """Yield the motion of the vehicle when a command increases, in the axes of the log."""
    for delay in delays:
        if delay.velocity in _MOVES and delay.share >= MIN_RESPONSE_SHARE:
            motion = (_MOVES if delay.sign > 0 else _OPPOSITE_MOVES)[delay.velocity]
            yield f"increasing {delay.command} moves the vehicle {motion}"
