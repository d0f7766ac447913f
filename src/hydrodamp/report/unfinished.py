"""What an interrupted run leaves in its folder: finished rows, and fits without a replay."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from hydrodamp.errors import FileError
from hydrodamp.files import load_json
from hydrodamp.identification.fit import Fit
from hydrodamp.report.fit_names import fit_names, fit_path
from hydrodamp.report.reading import read_fit
from hydrodamp.validation.comparison import Comparison

UNFINISHED = "unfinished"
"""Key in the provenance of a comparison that lacks rows; its value says how many."""

NOT_REPLAYED = "not_replayed"
"""Key in the provenance for the names of fits that wait for their replay."""


@dataclass(frozen=True)
class Earlier:
    """What lies in a folder of results, finished or not."""

    folder: Path
    provenance: dict[str, str]
    n_rows: int
    names: tuple[str, ...]

    @property
    def worth(self) -> tuple[int, int]:
        """Numbers of fits and of rows: a fit takes longer than its replay."""
        return len(self.names), self.n_rows

    def fits(self) -> tuple[Fit, ...]:
        """Return the fits."""
        return tuple(read_fit(fit_path(self.folder, name)) for name in self.names)


def read_earlier(folder: str | os.PathLike[str]) -> Earlier:
    """Read what lies in a folder of results; the fits only when they are asked for."""
    path = Path(folder) / "comparison.json"
    document: Any = load_json(path)
    if not isinstance(document, dict) or not isinstance(document.get("provenance"), dict):
        raise FileError(f"{path}: is no comparison of hydrodamp: it has no provenance.")
    try:
        words = {str(key): str(value) for key, value in document["provenance"].items()}
        named = fit_names((entry["model"], entry["method"]) for entry in document["rows"])
    except (KeyError, TypeError, AttributeError) as error:
        raise FileError(f"{path}: is no comparison of hydrodamp: {error!r}.") from error
    return Earlier(Path(folder), words, len(named), (*named, *waiting_names(words)))


def unfinished(comparison: Comparison, wanted: int, why: str = "interrupted") -> Comparison:
    """Return a comparison that says it lacks rows."""
    words = f"{len(comparison.rows)} of {wanted} rows: {why}"
    return replace(comparison, provenance={**comparison.provenance, UNFINISHED: words})


def with_waiting(comparison: Comparison, names: Sequence[str]) -> Comparison:
    """Return a comparison that names the fits that wait for their replay."""
    if not names:
        return comparison
    waiting = {NOT_REPLAYED: " ".join(names)}
    return replace(comparison, provenance={**comparison.provenance, **waiting})


def waiting_names(provenance: Mapping[str, str]) -> tuple[str, ...]:
    """Return the names of the fits that wait for their replay."""
    return tuple(provenance.get(NOT_REPLAYED, "").split())
