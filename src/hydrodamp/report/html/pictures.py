"""The pictures as they hang in a report, and the grades of the log beside them."""

from __future__ import annotations

import base64
from dataclasses import dataclass

from hydrodamp.identification.trust.grades import Grade
from hydrodamp.identification.trust.identifiability import Identifiability
from hydrodamp.report.gallery.findings import Findings
from hydrodamp.report.gallery.picture import Picture

_PIXELS = 96.0 / 72.0
"""Of a page, in a point."""


@dataclass(frozen=True)
class Framed:
    """A picture in a page.

    Attributes
    ----------
    picture : Picture
        Its words.
    source : str
        The drawing, as the address of an image.
    width, height : int
        [px] at its size in print.
    """

    picture: Picture
    source: str
    width: int
    height: int


@dataclass(frozen=True)
class Wall:
    """What a report says of the training log.

    Attributes
    ----------
    framed : tuple of Framed
        The pictures.
    printed : tuple of str
        File of each that is in the folder alone.
    not_drawn : tuple of str
        Why some are missing.
    graded : str
        Key of the model whose grades follow; empty without any.
    grades : tuple of tuple of str
        Axis, rank, predicted share, excited or not, and coefficients by grade.
    """

    framed: tuple[Framed, ...]
    printed: tuple[str, ...]
    not_drawn: tuple[str, ...]
    graded: str
    grades: tuple[tuple[str, ...], ...]


def hung(findings: Findings, room: int) -> Wall | None:
    """Return what a page shows of findings.

    Parameters
    ----------
    findings : Findings
        Grades and pictures.
    room : int
        What all pictures may take [bytes].

    Returns
    -------
    wall : Wall or None
        Pictures in their order; those for which there is no room are named. None where
        nothing was found.
    """
    gallery, grades = findings.gallery, findings.identifiability
    if not gallery.pictures and not gallery.not_drawn and grades is None:
        return None
    framed: list[Framed] = []
    not_drawn = list(gallery.not_drawn)
    for picture in (one for one in gallery.pictures if not one.printed):
        one = _framed(picture)
        if len(one.source) > room:
            not_drawn.append(
                f"{picture.title}: too large for this page; see {picture.name}.svg in the folder "
                "of figures."
            )
            continue
        room -= len(one.source)
        framed.append(one)
    return Wall(
        framed=tuple(framed),
        printed=tuple(f"{one.name}.svg" for one in gallery.pictures if one.printed),
        not_drawn=tuple(not_drawn),
        graded="" if grades is None else grades.model.key,
        grades=() if grades is None else _lines(grades),
    )


def _framed(picture: Picture) -> Framed:
    """Return a picture as an image: in one, nothing of a file runs or asks the network."""
    width, height = picture.size
    words = base64.b64encode(picture.svg).decode("ascii")
    return Framed(
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
