"""What a report shows beside a comparison: grades, a band and pictures, as values and as files."""

from __future__ import annotations

import io
import re
import zipfile
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, TypeVar

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from hydrodamp.errors import FileError
from hydrodamp.files import load_text, save_all
from hydrodamp.identification.grades import AxisIdentifiability, Identifiability
from hydrodamp.simulation.replay import Trajectory
from hydrodamp.validation.bands import PredictionBand
from hydrodamp.validation.compare import Comparison, Row

#: The folder of the pictures, in a folder of results.
FIGURES = "figures"

#: The element ``svg`` begins in so many bytes of a file.
_HEAD = 2000


@dataclass(frozen=True)
class Picture:
    """A drawing and its words; the drawing is a file of its own beside theirs."""

    name: Annotated[str, Field(pattern="^[a-z0-9-]+$")]
    title: str
    caption: str
    svg: Annotated[bytes, Field(exclude=True)] = b""
    print_only: bool = False

    @property
    def alt(self) -> str:
        """The words in its place for those who do not see it."""
        return f"Figure: {self.title}. The caption describes it."

    @property
    def size(self) -> tuple[float, float]:
        """Width and height [pt]; zero where the drawing does not begin as ours do."""
        head = self.svg[:_HEAD]
        width = re.search(rb'<svg\b[^>]*?\swidth="([\d.]+)pt"', head)
        height = re.search(rb'<svg\b[^>]*?\sheight="([\d.]+)pt"', head)
        return (float(width[1]), float(height[1])) if width and height else (0.0, 0.0)


@dataclass(frozen=True)
class Gallery:
    """The pictures of a run."""

    pictures: tuple[Picture, ...] = ()
    not_drawn: tuple[str, ...] = ()


@dataclass(frozen=True)
class Findings:
    """What is found out about the chosen row after the fits."""

    identifiability: Identifiability | None = None
    gallery: Gallery = field(default_factory=Gallery)
    not_graded: str = ""
    band: PredictionBand | None = None
    folder: str = FIGURES


def chosen_row(comparison: Comparison) -> Row | None:
    """Return the row whose pictures are drawn."""
    if all(row.rms is None for row in comparison.rows):
        alone = len(comparison.rows) == 1 and comparison.rows[0].fit.status.usable
        return comparison.rows[0] if alone else None
    return comparison.choice().row


def models_of(comparison: Comparison, first: Row | None) -> tuple[str, ...]:
    """Return the models in the order in which they take dashes: the chosen one, then by error."""
    scored = [row for row in comparison.rows if row.rms is not None]
    ranked = [row.model for row in sorted(scored, key=lambda row: row.rms or 0.0)]
    chosen = () if first is None else (first.model,)
    return tuple(dict.fromkeys((*chosen, *ranked, *comparison.models)))


#: Files in a folder of results: the grades or why there are none, and the band of a replay.
GRADES = "identifiability.json"
BAND = "band.npz"

#: The file with their words, among the pictures.
INDEX = "index.json"

_AGAIN = "Run the command again that wrote the folder"


class Grades(BaseModel):
    """The document of grades, or why there are none."""

    model_config = ConfigDict(ser_json_inf_nan="strings")

    model: str = ""
    axes: tuple[AxisIdentifiability, ...] = ()
    not_graded: str = ""


_GALLERY = TypeAdapter(Gallery)
_GRADES = TypeAdapter(Grades)
Kind = TypeVar("Kind")


def write_findings(findings: Findings, home: Path) -> None:
    """Write grades, band and pictures into a folder of results, in place of earlier ones."""
    contents: dict[Path, bytes] = {}
    grades = Grades(not_graded=findings.not_graded)
    if (found := findings.identifiability) is not None:
        grades = Grades(model=found.model.key, axes=found.axes)
    if grades != Grades():
        contents[home / GRADES] = _GRADES.dump_json(grades, indent=2)
    if (band := findings.band) is not None:
        stream = io.BytesIO()
        numbers = np.array([band.level, band.diverged])
        np.savez(stream, lower=band.lower, upper=band.upper, level_diverged=numbers)
        contents[home / BAND] = stream.getvalue()
    for path in earlier_findings(home):
        path.unlink(missing_ok=True)
    save_all(contents)
    write_gallery(findings.gallery, home / FIGURES)


def write_gallery(gallery: Gallery, folder: Path) -> None:
    """Write pictures and their words into a folder, in place of those of an earlier gallery."""
    for path in earlier_pictures(folder):
        path.unlink(missing_ok=True)
    contents = {folder / f"{one.name}.svg": one.svg for one in gallery.pictures}
    save_all({**contents, folder / INDEX: _GALLERY.dump_json(gallery, indent=2)})


def earlier_findings(home: Path) -> list[Path]:
    """Return what an earlier :func:`write_findings` wrote into a folder."""
    return [home / GRADES, home / BAND, *earlier_pictures(home / FIGURES)]


def earlier_pictures(folder: Path) -> list[Path]:
    """Return the pictures that the index of a folder names, and the index."""
    try:
        gallery = _read(_GALLERY, folder / INDEX)
    except FileError:
        return []
    return [*(folder / f"{one.name}.svg" for one in gallery.pictures), folder / INDEX]


def read_findings(home: Path, comparison: Comparison) -> Findings:
    """Read what :func:`write_findings` wrote."""
    row, gallery = chosen_row(comparison), Gallery()
    if (home / FIGURES / INDEX).is_file():
        gallery = _with_drawings(_read(_GALLERY, home / FIGURES / INDEX), home / FIGURES)
    if row is None:
        return Findings(gallery=gallery)
    grades = _read(_GRADES, home / GRADES) if (home / GRADES).is_file() else Grades()
    found, band = None, None
    if grades.axes:
        found = Identifiability(row.fit.model, grades.axes)
        if grades.model != found.model.key or set(found.grades) != set(found.model.labels):
            raise FileError(
                f"{home / GRADES}: has grades of '{grades.model}', and the comparison chooses "
                f"'{found.model.key}'. {_AGAIN}."
            )
    if row.trajectory is not None and (home / BAND).is_file():
        band = _read_band(home / BAND, row.trajectory)
    return Findings(found, gallery, grades.not_graded, band)


def _read(kind: TypeAdapter[Kind], path: Path) -> Kind:
    """Return what a file of ours holds."""
    try:
        return kind.validate_json(load_text(path))
    except ValidationError as error:
        fault = error.errors()[0]
        where = ".".join(map(str, fault["loc"]))
        raise FileError(
            f"{path}: is not what hydrodamp writes there: {where}: {fault['msg']}. {_AGAIN}."
        ) from error


def _with_drawings(gallery: Gallery, folder: Path) -> Gallery:
    """Return a gallery with its drawings; one that was deleted or spoilt since is not drawn."""
    pictures, not_drawn = [], list(gallery.not_drawn)
    for words in gallery.pictures:
        path = folder / f"{words.name}.svg"
        picture = replace(words, svg=path.read_bytes() if path.is_file() else b"")
        if all(picture.size):
            pictures.append(picture)
        else:
            fault = f"{path.name} is not there or is no picture of hydrodamp"
            not_drawn.append(f"{words.title}: {fault}. {_AGAIN}.")
    return Gallery(tuple(pictures), tuple(not_drawn))


def _read_band(path: Path, replay: Trajectory) -> PredictionBand:
    try:
        with np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as arrays:
            lower, upper = arrays["lower"], arrays["upper"]
            level, diverged = arrays["level_diverged"].tolist()
    except (OSError, EOFError, KeyError, TypeError, ValueError, zipfile.BadZipFile) as error:
        raise FileError(f"{path}: is no band of hydrodamp. {_AGAIN}.") from error
    if lower.shape != replay.velocity.shape or upper.shape != replay.velocity.shape:
        raise FileError(f"{path}: has the band of another replay. {_AGAIN}.")
    return PredictionBand(replay.log, replay.velocity, lower, upper, level, diverged)
