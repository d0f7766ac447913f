"""Which of hydrodamp's own files a content is, told by its keys, where the wrong one is given."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

_SPELT = 3
"""Keys that a sentence names as its evidence."""


@dataclass(frozen=True)
class FileKind:
    """A kind of file."""

    name: str
    use: str
    keys: tuple[str, ...] = ()
    least: int = 2

    def own(self, content: Mapping[object, object]) -> list[str]:
        """Return the keys of a content that are of this kind alone, in their order."""
        return [str(key) for key in content if key in self.keys]


LOG = FileKind("a log", "give it as LOG")
VEHICLE = FileKind(
    "a vehicle",
    "give it as `--vehicle`",
    (
        *("mass_matrix", "rigid_body", "added_mass", "weight", "buoyancy"),
        *("center_of_gravity", "center_of_buoyancy", "axes", "actuators"),
    ),
)
MAPPING = FileKind(
    "a mapping of a log",
    "give it as `--mapping`",
    (
        *("time", "velocity", "attitude", "commands", "frame", "world", "clock", "topics"),
        *("position", "accelerometer", "acceleration", "wrench", "eta", "segment", "sensors"),
        "steps",
    ),
)
MODELS = FileKind(
    "a file of models", "give it as `--models` or `--model`", ("terms", "models"), least=1
)
DAMPING = FileKind(
    "a damping file",
    "give it as `--damping` to `hydrodamp simulate`",
    ("coefficients", "covariance", "sign_convention", "reference_point"),
)
COMPARISON = FileKind(
    "the result of a comparison",
    "look at it with `hydrodamp report` and its folder",
    ("rows", "provenance"),
)

KINDS = (VEHICLE, MAPPING, MODELS, DAMPING, COMPARISON)
"""All that have keys of their own."""


def mistaken(content: object, source: str, wanted: FileKind) -> str:
    """Return what to say of a file that is another one of ours than was asked for."""
    if not isinstance(content, Mapping) or _is_numbers(content.get("time")):
        return ""
    found = max(KINDS, key=lambda kind: len(kind.own(content)))
    own = found.own(content)
    if len(own) < found.least or len(own) <= len(wanted.own(content)):
        return ""
    return (
        f"{source} is {found.name} (it has {', '.join(_spelt(own))}), not {wanted.name}: "
        f"{found.use}."
    )


def _is_numbers(value: object) -> bool:
    """Tell the samples of a log from what a mapping says of its columns."""
    return isinstance(value, list) and all(isinstance(one, int | float) for one in value)


def _spelt(keys: list[str]) -> Iterator[str]:
    yield from keys[:_SPELT]
    if len(keys) > _SPELT:
        yield "..."
