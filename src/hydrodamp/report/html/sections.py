"""The parts of a page beside its plots: coefficients, pictures with grades, and the origin."""

from __future__ import annotations

import base64
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from hydrodamp.identification.grades import Grade, Identifiability
from hydrodamp.report.fit_tables import fit_grid
from hydrodamp.report.gallery.findings import Picture
from hydrodamp.report.grid import Column, Grid, percent
from hydrodamp.validation.compare import Comparison, Row

COEFFICIENTS = 2500
"""Coefficients listed in all, whole fits at a time; the files have every one."""

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
    columns = (
        Column("axis", number=False),
        Column("rank"),
        Column("response predicted"),
        Column("enough", number=False),
        *(Column(grade.word) for grade in Grade),
    )
    return Grid(
        title=f"Coefficients of {found.model.key} by how well they are known, by the log and by "
        "the fit; the response is the force at each moment, predicted on stretches of the training "
        "log that were held out",
        columns=columns,
        rows=tuple(
            (
                one.axis,
                f"{one.rank} of {len(one.labels)}",
                f"{percent(100.0 * one.share)} %",
                "yes" if one.excited else "no",
                *map(one.count, Grade),
            )
            for one in found.axes
        ),
    )


@dataclass(frozen=True)
class Origin:
    """Where the numbers come from."""

    facts: tuple[tuple[str, str], ...]
    files: Grid
    settings: Grid


def origin(comparison: Comparison, provenance: Mapping[str, object]) -> Origin:
    """Return where a comparison comes from: vehicle, files, versions and settings."""
    import hydrodamp

    words = {key: str(value) for key, value in provenance.items() if str(value)}
    facts = [
        (key.replace("_", " "), text)
        for key, text in words.items()
        if key not in ("files", "warnings")
    ]
    stamps = {row.fit.damping.vehicle for row in comparison.rows}
    facts += [
        (
            "coefficients belong to",
            f"{stamp.name}: weight {stamp.weight:g} N, buoyancy {stamp.buoyancy:g} N, digest of "
            f"the mass matrix {stamp.mass_matrix_digest or 'unknown'}",
        )
        for stamp in stamps
        if stamp is not None
    ]
    made = f"hydrodamp {hydrodamp.__version__}, Python {platform.python_version()}"
    lines = (line.strip().partition("  ") for line in words.get("files", "").splitlines())
    files = [(name or digest, digest if name else "") for digest, _, name in lines if digest]
    settings = {row.method: row.fit.provenance.get("settings") for row in comparison.rows[::-1]}
    used = [(method, settings[method]) for method in comparison.methods if settings[method]]
    return Origin(
        facts=(*facts, ("report made by", made)),
        files=Grid.of_words("Files that were read", ("file", "SHA-256"), "ll", files),
        settings=Grid.of_words("Settings of the methods", ("method", "settings"), "ll", used),
    )
