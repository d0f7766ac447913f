"""The names that fits have in the files of a comparison."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from hydrodamp.data.record import unique_names
from hydrodamp.errors import FileError
from hydrodamp.identification.fit import Fit
from hydrodamp.report.plain_names import is_plain


def fit_names(fits: Iterable[Fit]) -> tuple[str, ...]:
    """Return model, method and digest of each fit; a number makes names different."""
    return unique_names(
        ".".join(filter(None, (fit.model.key, fit.method, fit.provenance.get("digest", "")[:8])))
        for fit in fits
    )


def fit_path(home: Path, name: str) -> Path:
    """Return the file of a fit."""
    if not is_plain(name):
        raise FileError(
            f"{home / 'comparison.json'}: each fit must be named by a plain file name, got "
            f"'{name}': make the folder again by the command that wrote it."
        )
    return home / "fits" / f"{name}.json"
