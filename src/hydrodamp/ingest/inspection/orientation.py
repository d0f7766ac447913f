"""Whether the axes of a log are forward-starboard-down: what decides, and what contradicts it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from hydrodamp.basis.atoms import VELOCITY_OF
from hydrodamp.conditioning.consistency import QualityIssue
from hydrodamp.conditioning.vertical import VerticalAxis
from hydrodamp.ingest.inspection.delay import Delay

#: Share of the variance of a growth from which a command visibly acts.
MIN_RESPONSE_SHARE = 0.05
_MIN_DELAY_CONFIDENCE = 50  # %, confidence of a delay from which its sign counts
UNDECIDED = "Nothing in this log decides which way is down"
#: For every velocity that turns over with the axes, what the vehicle does when it grows.
_MOVES = {"v": "to starboard", "w": "down", "q": "bow up", "r": "to starboard"}
_OPPOSITE_MOVES = {"v": "to port", "w": "up", "q": "bow down", "r": "to port"}


def describe_frame(upright: VerticalAxis, responses: Sequence[str]) -> str:
    """Say what decides which way is down; or that nothing does, and what would."""
    told = "; ".join(sign.message for sign in upright.evidence)
    if upright.is_sure:
        return f"{upright.body} by {upright.confidence} %: {told}."
    seen = f" By the log, {'; '.join(responses)}." if responses else ""
    return (
        f"{UNDECIDED}: motion is the same in FRD over NED and in FLU over a world with z up"
        f"{f'; {told}' if told else ''}.{seen} Compare with what the vehicle did, or record a "
        "specific force or a depth."
    )


def misread_positions(measured: Mapping[str, str]) -> Iterator[QualityIssue]:
    """Yield commands that are positions by their names."""
    names = [one for one, role in measured.items() if not role.endswith("depth")]
    if names:
        yield QualityIssue(
            " ".join(names),
            "is a position by its name and was read as a command",
            "the canonical form calls a position x y z, in metres",
            remedy="rename it, or name it under `position` in a mapping (`--draft`)",
        )


def wrong_frame(upright: VerticalAxis, odd: Sequence[QualityIssue]) -> Iterator[QualityIssue]:
    """Yield that z is up, unless a suspicion of the specific force has it already."""
    if (
        upright.body == "FLU"
        and upright.is_sure
        and all(o.channel != "specific_force" for o in odd)
    ):
        yield QualityIssue(
            "frame",
            "is forward-port-up, not forward-starboard-down",
            "; ".join(sign.message for sign in upright.evidence if sign.log_odds < 0.0),
            remedy="write `frame: FLU` in a mapping, and under `sensors` what differs from it",
        )


def reversed_wrench(late: Sequence[Delay]) -> Iterator[QualityIssue]:
    """Yield axes of a recorded wrench that move the vehicle against their sign."""
    against = [
        one
        for one in late
        if VELOCITY_OF.get(one.command) == one.velocity
        and one.sign < 0
        and one.share >= MIN_RESPONSE_SHARE
        and one.confidence >= _MIN_DELAY_CONFIDENCE
    ]
    if against:
        yield QualityIssue(
            " ".join(one.command for one in against),
            "pushes against its sign",
            ", ".join(f"{one.velocity} falls when {one.command} rises" for one in against),
            remedy="write `sign: -1` for it, or other axes under `sensors`, in the mapping",
        )


def list_responses(late: Sequence[Delay]) -> Iterator[str]:
    """Yield what the vehicle does when a command rises, by the axes that the log is in."""
    for one in late:
        if one.velocity in _MOVES and one.share >= MIN_RESPONSE_SHARE:
            way = (_MOVES if one.sign > 0 else _OPPOSITE_MOVES)[one.velocity]
            yield f"{one.command} rising moves it {way}"
