"""The parts of a page beside its plots: coefficients, pictures with grades, and the origin."""

from __future__ import annotations

import base64
import platform
from collections.abc import Sequence
from dataclasses import dataclass

from hydrodamp.identification.grades import Grade, Identifiability
from hydrodamp.report.documents import provenance_of
from hydrodamp.report.fit_tables import fit_grid
from hydrodamp.report.gallery.findings import Picture
from hydrodamp.report.grid import Grid
from hydrodamp.validation.compare import Comparison, Row

#: Coefficients listed in all, whole fits at a time; the files have every one.
COEFFICIENTS = 2500

_PIXELS = 96.0 / 72.0  # of a page, in a point
_COLUMN = 480  # px, width up to which a picture stands in one of two columns


def coefficient_grids(
    rows: Sequence[Row], chosen: Row | None = None, grades: Identifiability | None = None
) -> list[tuple[Row, Grid]]:
    """Return the coefficients of the first rows; those of the chosen one with their grades."""
    grids: list[tuple[Row, Grid]] = []
    for row in (row for row in rows if row.fit.status.usable):
        listed = sum(other.n_coefficients for other, _ in grids)
        if grids and listed + row.n_coefficients > COEFFICIENTS:
            break
        grids.append((row, fit_grid(row.fit, grades if row is chosen else None)))
    return grids


@dataclass(frozen=True)
class PageImage:
    """A picture in a page: as an image, in which nothing of a file runs or asks the network."""

    picture: Picture
    source: str
    width: int
    height: int

    @classmethod
    def of(cls, picture: Picture) -> PageImage:
        """Return a picture as it stands in a page."""
        width, height = (round(_PIXELS * length) for length in picture.size)
        words = base64.b64encode(picture.svg).decode("ascii")
        return cls(picture, f"data:image/svg+xml;base64,{words}", width, height)

    @property
    def is_broad(self) -> bool:
        """Whether its letters would be too small in one of two columns."""
        return self.width > _COLUMN


def grade_grid(found: Identifiability) -> Grid:
    """Return how many coefficients of each axis have which grade."""
    title = (
        f"Coefficients of {found.model.key} by how well they are known, by the log and by the fit; "
        "the response is the force at each moment, predicted on stretches of the training log that "
        "were held out"
    )
    header = ("axis", "rank", "response predicted", "enough", *(grade.word for grade in Grade))
    rows = [
        (
            one.axis,
            f"{one.rank} of {len(one.labels)}",
            f"{100.0 * one.share:.0f} %",
            "yes" if one.excited else "no",
            *map(one.count, Grade),
        )
        for one in found.axes
    ]
    return Grid.of_words(title, header, "lrrlrrr", rows)


@dataclass(frozen=True)
class Origin:
    """Where the numbers come from."""

    facts: tuple[tuple[str, str], ...]
    files: Grid
    settings: Grid


def origin(comparison: Comparison) -> Origin:
    """Return where a comparison comes from: vehicle, files, versions and settings."""
    import hydrodamp

    words = {key: text for key, text in provenance_of(comparison).items() if text}
    files = words.pop("files", "").splitlines()
    facts = [(key.replace("_", " "), text) for key, text in words.items() if key != "warnings"]
    for stamp in dict.fromkeys(row.fit.damping.vehicle for row in comparison.rows):
        if stamp is not None:
            mass = f"digest of the mass matrix {stamp.mass_matrix_digest or 'unknown'}"
            forces = f"weight {stamp.weight:g} N, buoyancy {stamp.buoyancy:g} N"
            facts.append(("coefficients belong to", f"{stamp.name}: {forces}, {mass}"))
    made = f"hydrodamp {hydrodamp.__version__}, Python {platform.python_version()}"
    read = [(name or digest, digest if name else "") for digest, name in map(_digest, files)]
    settings = {row.method: row.fit.provenance.get("settings") for row in comparison.rows[::-1]}
    used = [(method, settings[method]) for method in comparison.methods if settings[method]]
    return Origin(
        facts=(*facts, ("report made by", made)),
        files=Grid.of_words("Files that were read", ("file", "SHA-256"), "ll", read),
        settings=Grid.of_words("Settings of the methods", ("method", "settings"), "ll", used),
    )


def _digest(line: str) -> tuple[str, str]:
    digest, _, name = line.strip().partition("  ")
    return digest, name
