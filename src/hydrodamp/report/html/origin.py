"""Where the numbers of a report come from: vehicle, files, versions, settings."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from dataclasses import dataclass

from hydrodamp.validation.comparison import Comparison

_KNOWN = {
    "unfinished": "Unfinished",
    "not_replayed": "Fits not replayed",
    "resumed": "Resumed",
    "command": "Command line",
    "options": "Options",
    "vehicle": "Vehicle",
    "train": "Identified on",
    "train_segments": "Segments identified on",
    "test": "Replayed on",
    "test_segments": "Segments replayed on",
    "overlap": "In both",
    "truth": "Simulated truth",
    "note": "Note",
    "seed": "Seed",
    "attitude": "Attitude in replays",
    "rate_unit": "Unit of angular rates",
    "hydrodamp": "hydrodamp of the run",
    "versions": "Versions of the run",
}
_APART = ("files", "warnings")


@dataclass(frozen=True)
class Origin:
    """Where the numbers come from."""

    facts: tuple[tuple[str, str], ...]
    files: tuple[tuple[str, str], ...]
    settings: tuple[tuple[str, str], ...]


def origin(comparison: Comparison, provenance: Mapping[str, object]) -> Origin:
    """Return where a comparison comes from."""
    import hydrodamp

    words = {key: str(value) for key, value in provenance.items() if str(value)}
    known = [(name, words[key]) for key, name in _KNOWN.items() if key in words]
    other = [(key, text) for key, text in words.items() if key not in (*_KNOWN, *_APART)]
    made = f"hydrodamp {hydrodamp.__version__}, Python {platform.python_version()}"
    return Origin(
        facts=(*known, *other, *_stamp(comparison), ("Report made by", made)),
        files=tuple(_file(line) for line in words.get("files", "").splitlines() if line.strip()),
        settings=tuple(_settings(comparison).items()),
    )


def told(provenance: Mapping[str, object]) -> tuple[str, ...]:
    """Return the warnings of a run."""
    return tuple(filter(None, map(str.strip, str(provenance.get("warnings", "")).splitlines())))


def _stamp(comparison: Comparison) -> list[tuple[str, str]]:
    stamps = dict.fromkeys(
        row.fit.damping.vehicle for row in comparison.rows if row.fit.damping.vehicle is not None
    )
    return [
        (
            "Coefficients belong to",
            f"{stamp.name}: weight {stamp.weight:g} N, buoyancy {stamp.buoyancy:g} N, digest of "
            f"the mass matrix {stamp.mass_matrix_digest or 'unknown'}",
        )
        for stamp in stamps
    ]


def _file(line: str) -> tuple[str, str]:
    digest, _, name = line.strip().partition("  ")
    return (name, digest) if name else (digest, "")


def _settings(comparison: Comparison) -> dict[str, str]:
    found: dict[str, str] = {}
    for row in comparison.rows:
        if settings := row.fit.provenance.get("settings"):
            found.setdefault(row.method, settings)
    return found
