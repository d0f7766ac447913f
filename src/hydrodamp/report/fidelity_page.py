"""The page of an export: its fidelity card as one HTML file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from hydrodamp.errors import FileError
from hydrodamp.files import load_json, save_text
from hydrodamp.report.page import render_page
from hydrodamp.report.table import NOTHING, Table

CARD, PAGE = "fidelity.json", "fidelity.html"
"""The card in the folder of an export, and its page."""

_FORMAT = "hydrodamp-fidelity"


def read_card(folder: Path) -> dict[str, Any]:
    """Return the card in the folder of an export."""
    document = load_json(folder / CARD)
    if not isinstance(document, dict) or document.get("format") != _FORMAT:
        raise FileError(
            f"{folder / CARD}: `format` must be '{_FORMAT}': export again with `hydrodamp export`."
        )
    return document


def write_fidelity_page(folder: Path, path: Path | None = None) -> Path:
    """Write the page of an export's card, into its folder unless told otherwise."""
    document = read_card(folder)
    title, subtitle = f"{document['vehicle']} for {document['target']}", "Fidelity of the export"
    content = render_page(
        title, subtitle, [document["text"]], [*_grids(document)], facts=_origin(document)
    )
    save_text(content, path or folder / PAGE)
    return path or folder / PAGE


def _grids(card: dict[str, Any]) -> Iterator[Table]:
    errors = {
        "wrench error [% of rms]": card["wrench_error"],
        "at a tenth of the velocities": card.get("slow_error", {}),
        "added mass / rigid body": card["mass_ratio"],
    }
    yield _side_by_side(f"By axis, at {card['asked_at']}", "axis", errors)
    if card["replays"] is not None:
        pairs = ("source", "target"), ("source", "log"), ("target", "log")
        scores = {f"{a} and {b}": card["replays"][f"{a}_to_{b}"] for a, b in pairs}
        errors = {key: {"all": one["rms"], **one["rms_by_axis"]} for key, one in scores.items()}
        title = f"Replay errors: RMS in m/s and deg/s. {card['replays']['step']}."
        yield _side_by_side(title, "", errors)
    power = {f"of the {key}": value for key, value in card["power"].items()}
    yield _side_by_side(f"Greatest power of the damping within {card['box']}", "", {"[W]": power})


def _side_by_side(
    title: str, first: str, columns: Mapping[str, Mapping[str, float | None]]
) -> Table:
    """Return a table of numbers by name, a column each."""
    names = dict.fromkeys(name for one in columns.values() for name in one)
    rows = ((name, *(_word(one.get(name)) for one in columns.values())) for name in names)
    return Table.of_words(title, (first, *columns), "l" + "r" * len(columns), rows)


def _origin(card: dict[str, Any]) -> dict[str, str]:
    facts = {
        "meant for": card["description"],
        "model": card["model"],
        "inputs": card["inputs"],
        "fitted with other terms": card["projected"],
        "left out": card["ignores"],
        "run by": card["run_by"],
        "not run": card["not_run"],
        "failed": card.get("run_error", ""),
        **card["settings"],
        "hydrodamp": card["hydrodamp"],
    }
    words = {key: [fact] if isinstance(fact, str) else fact for key, fact in facts.items()}
    return {key: ", ".join(word) for key, word in words.items() if any(word)}


def _word(value: float | None) -> str:
    return NOTHING if value is None else format(value, ".3g")
