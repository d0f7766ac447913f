"""The section of a report with pictures, and the grades of the log above them."""

from __future__ import annotations

import base64
from dataclasses import dataclass

from hydrodamp.identification.grades import Grade, Identifiability
from hydrodamp.report.gallery.findings import Findings, Picture

_PIXELS = 96.0 / 72.0
"""Of a page, in a point."""

_COLUMN = 480
"""Width up to which a picture stands in one of two columns [px]."""


@dataclass(frozen=True)
class PageImage:
    """A picture in a page."""

    picture: Picture
    source: str
    width: int
    height: int

    @property
    def is_broad(self) -> bool:
        """Whether its letters would be too small in one of two columns."""
        return self.width > _COLUMN


@dataclass(frozen=True)
class PicturesSection:
    """What a report says of the training log."""

    images: tuple[PageImage, ...]
    print_only: tuple[str, ...]
    has_files: bool
    folder: str
    not_shown: tuple[str, ...]
    not_graded: str
    graded: str
    grades: tuple[tuple[str, ...], ...]


def pictures_section(findings: Findings, room: int) -> PicturesSection | None:
    """Return what a page shows of findings."""
    gallery, grades = findings.gallery, findings.identifiability
    found = gallery.pictures or gallery.not_drawn or findings.not_graded
    if not found and grades is None:
        return None
    images: list[PageImage] = []
    not_shown = list(gallery.not_drawn)
    for picture in (one for one in gallery.pictures if not one.print_only):
        image = _image(picture)
        if len(image.source) > room:
            not_shown.append(f"{picture.title}: {picture.name}.svg is too large for this page.")
            continue
        room -= len(image.source)
        images.append(image)
    return PicturesSection(
        images=tuple(images),
        print_only=tuple(f"{one.name}.svg" for one in gallery.pictures if one.print_only),
        has_files=bool(gallery.pictures),
        folder=findings.folder,
        not_shown=tuple(not_shown),
        not_graded=findings.not_graded,
        graded="" if grades is None else grades.model.key,
        grades=() if grades is None else _lines(grades),
    )


def _image(picture: Picture) -> PageImage:
    """Return a picture as an image: in one, nothing of a file runs or asks the network."""
    width, height = picture.size
    words = base64.b64encode(picture.svg).decode("ascii")
    return PageImage(
        picture,
        f"data:image/svg+xml;base64,{words}",
        round(_PIXELS * width),
        round(_PIXELS * height),
    )


def _lines(found: Identifiability) -> tuple[tuple[str, ...], ...]:
    return tuple(
        (
            one.axis,
            f"{one.rank} of {len(one.labels)}",
            f"{100.0 * one.share:.0f} %",
            "yes" if one.excited else "no",
            *(str(one.count(grade)) for grade in Grade),
        )
        for one in found.axes
    )
