"""Findings as files: grades, band and pictures, both ways, so that a report is made again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from hydrodamp.errors import FileError
from hydrodamp.files import as_json, load_json, save_all
from hydrodamp.identification.grades import AxisIdentifiability, Grade, Identifiability
from hydrodamp.models.model import DampingModel
from hydrodamp.report.gallery.band_file import BAND, band_bytes, read_band
from hydrodamp.report.gallery.findings import FIGURES, Findings, chosen_row
from hydrodamp.report.gallery.picture import Gallery, Picture
from hydrodamp.report.plain_names import is_plain
from hydrodamp.validation.comparison import Comparison

GRADES = "identifiability.json"
"""The file with the grades, or why there are none, in a folder of results."""

INDEX = "index.json"
"""The file with their words, among the pictures."""

_AGAIN = "The command that wrote the folder makes it again."

_NOT_GRADED = "not_graded"
"""Key for why there are no grades."""

_GRADES = {grade.word: grade for grade in Grade}


def write_findings(findings: Findings, home: Path) -> None:
    """Write grades, band and pictures into a folder of results, in place of earlier ones."""
    contents = _contents(findings.gallery, home / FIGURES)
    if grades := _grades_document(findings):
        contents[home / GRADES] = as_json(grades).encode("utf-8")
    if findings.band is not None:
        contents[home / BAND] = band_bytes(findings.band)
    for path in earlier_findings(home):
        path.unlink(missing_ok=True)
    save_all(contents)


def write_gallery(gallery: Gallery, folder: Path) -> None:
    """Write pictures and their words into a folder, in place of those of an earlier gallery."""
    contents = _contents(gallery, folder)
    for path in earlier_pictures(folder):
        path.unlink(missing_ok=True)
    save_all(contents)


def read_findings(home: Path, comparison: Comparison) -> Findings:
    """Read what :func:`write_findings` wrote."""
    index, row = home / FIGURES / INDEX, chosen_row(comparison)
    gallery = _read_gallery(index) if index.is_file() else Gallery()
    if row is None:
        return Findings(gallery=gallery)
    grades, not_graded = _read_graded(home / GRADES, row.fit.model)
    band = None
    if row.trajectory is not None and (home / BAND).is_file():
        band = read_band(home / BAND, row.trajectory)
    return Findings(grades, gallery, not_graded, band)


def earlier_findings(home: Path) -> list[Path]:
    """Return what an earlier :func:`write_findings` wrote into a folder."""
    return [home / GRADES, home / BAND, *earlier_pictures(home / FIGURES)]


def earlier_pictures(folder: Path) -> list[Path]:
    """Return the pictures that the index of a folder names, and the index."""
    try:
        document: Any = load_json(folder / INDEX)
        names = [str(entry["file"]) for entry in document["figures"]]
    except (FileError, KeyError, TypeError):
        return []
    return [*(folder / name for name in names if _is_drawing(name)), folder / INDEX]


def _contents(gallery: Gallery, folder: Path) -> dict[Path, bytes]:
    """Return what each file of a gallery holds."""
    contents = {folder / f"{picture.name}.svg": picture.svg for picture in gallery.pictures}
    contents[folder / INDEX] = as_json(_index(gallery)).encode("utf-8")
    return contents


def _grades_document(findings: Findings) -> dict[str, object]:
    """Return the grades, or why there are none; empty where none were asked for."""
    if findings.identifiability is not None:
        return dict(findings.identifiability.as_dict())
    return {_NOT_GRADED: findings.not_graded} if findings.not_graded else {}


def _index(gallery: Gallery) -> dict[str, object]:
    return {
        "figures": [
            {
                "file": f"{one.name}.svg",
                "title": one.title,
                "caption": one.caption,
                "alt": one.alt,
                "print_only": one.print_only,
            }
            for one in gallery.pictures
        ],
        "not_drawn": list(gallery.not_drawn),
    }


def _read_gallery(path: Path) -> Gallery:
    """Return the pictures of an index; one that was deleted or spoilt since is not drawn."""
    document: Any = load_json(path)
    try:
        told = [_words(entry, path) for entry in document["figures"]]
        not_drawn = list(map(str, document["not_drawn"]))
    except (KeyError, TypeError) as error:
        raise FileError(f"{path}: is no index of figures of hydrodamp: {error!r}.") from error
    pictures: list[Picture] = []
    for words in told:
        try:
            pictures.append(_with_drawing(words, path.parent))
        except FileError as error:
            not_drawn.append(f"{words.title}: {error}")
    return Gallery(tuple(pictures), tuple(not_drawn))


def _words(entry: dict[str, Any], index: Path) -> Picture:
    """Return a picture of an index, without its drawing."""
    name = str(entry["file"])
    if not _is_drawing(name):
        raise FileError(f"{index}: `file` must name an .svg file beside it, got '{name}'.")
    title, caption, alt = (str(entry[key]) for key in ("title", "caption", "alt"))
    return Picture(Path(name).stem, title, caption, alt, b"", bool(entry["print_only"]))


def _with_drawing(words: Picture, folder: Path) -> Picture:
    name = f"{words.name}.svg"
    try:
        picture = replace(words, svg=(folder / name).read_bytes())
    except OSError as error:
        raise FileError(f"{name} cannot be read: {error.strerror}. {_AGAIN}") from error
    if not all(picture.size):
        raise FileError(f"{name} has no extent. {_AGAIN}")
    return picture


def _is_drawing(name: str) -> bool:
    """Tell whether a name is that of an SVG file in the same folder."""
    return is_plain(name) and name.endswith(".svg")


def _read_graded(path: Path, model: DampingModel) -> tuple[Identifiability | None, str]:
    """Return the grades of a file, or why there are none."""
    if not path.is_file():
        return None, ""
    document: Any = load_json(path)
    if isinstance(document, dict) and _NOT_GRADED in document:
        return None, str(document[_NOT_GRADED])
    return _read_grades(document, path, model), ""


def _read_grades(document: Any, path: Path, model: DampingModel) -> Identifiability:
    try:
        if document["model"] != model.key:
            raise FileError(
                f"{path}: has the grades of '{document['model']}', and the comparison chooses "
                f"'{model.key}': run the command again that wrote the folder."
            )
        axes = tuple(_axis(axis, found, document) for axis, found in document["axes"].items())
        labels = tuple(label for one in axes for label in one.labels)
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise FileError(f"{path}: has no grades of hydrodamp: {error!r}.") from error
    if set(labels) != set(model.labels):
        raise FileError(f"{path}: has grades of other coefficients than fits/ has.")
    return Identifiability(model, axes)


def _axis(axis: str, found: dict[str, Any], document: dict[str, Any]) -> AxisIdentifiability:
    coefficients: dict[str, dict[str, Any]] = document["coefficients"]
    own = {k: v for k, v in coefficients.items() if k.partition("_")[0] == axis}
    return AxisIdentifiability(
        axis=axis,
        labels=tuple(own),
        grades=tuple(_GRADES[one["grade"]] for one in own.values()),
        inflation=tuple(_infinite(one["vif"]) for one in own.values()),
        rank=int(found["rank"]),
        condition=_infinite(found["condition"]),
        share=float(found["predicted_share"]),
        excited=bool(found["excited"]),
        groups=tuple(tuple(map(str, group)) for group in found["groups"]),
    )


def _infinite(value: float | None) -> float:
    return float("inf") if value is None else float(value)
