"""The page of an export: its fidelity card as one HTML file."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hydrodamp.errors import FileError
from hydrodamp.files import load_json, save_text
from hydrodamp.report.grid import NOTHING, Grid
from hydrodamp.report.page import template, text_of

CARD, PAGE = "fidelity.json", "fidelity.html"
"""The card in the folder of an export, and its page."""

_FORMAT = "hydrodamp-fidelity"


def write_fidelity_page(folder: Path, path: Path | None = None) -> Path:
    """Write the page of an export's card, into its folder unless told otherwise."""
    document = load_json(folder / CARD)
    if not isinstance(document, dict) or document.get("format") != _FORMAT:
        raise FileError(
            f"{folder / CARD}: `format` must be '{_FORMAT}': export again with `hydrodamp export`."
        )
    title = f"{document['vehicle']} for {document['target']}"
    content = {"title": title, "text": document["text"], "styles": text_of("report.css")}
    grids = {"grids": [*_grids(document)], "origin": _origin(document)}
    save_text(template("fidelity.html.j2").render({**content, **grids}), path or folder / PAGE)
    return path or folder / PAGE


def _grids(card: dict[str, Any]) -> Iterator[Grid]:
    axes = sorted({**card["wrench_error"], **card["mass_ratio"]}, key="XYZKMN".index)
    yield Grid.of_words(
        f"By axis, at {card['asked_at']}",
        ("axis", "wrench error [% of rms]", "added mass / rigid body"),
        "lrr",
        [
            (axis, *(_word(card[key].get(axis)) for key in ("wrench_error", "mass_ratio")))
            for axis in axes
        ],
    )
    if card["replays"] is not None:
        scores = {
            "source and target": card["replays"]["source_to_target"],
            "source and log": card["replays"]["source_to_log"],
            "target and log": card["replays"]["target_to_log"],
        }
        names = [*scores["source and log"]["rms_by_axis"]]
        yield Grid.of_words(
            f"Replay errors: RMS in m/s and deg/s. {card['replays']['step']}.",
            ("between", "all (eq. 24)", *names),
            "l" + "r" * (1 + len(names)),
            [
                (key, _word(each["rms"]), *map(_word, each["rms_by_axis"].values()))
                for key, each in scores.items()
            ],
        )
    power = [(f"of the {key}", _word(value)) for key, value in card["power"].items()]
    yield Grid.of_words(
        f"Greatest power of the damping within {card['box']}", ("", "[W]"), "lr", power
    )


def _origin(card: dict[str, Any]) -> dict[str, str]:
    facts = {
        "meant for": card["meant"],
        "model": card["model"],
        "inputs": card["inputs"],
        "fitted with other terms": card["projected"],
        "left out": card["ignores"],
        "run by": card["run_by"],
        "not run": card["not_run"],
        **card["settings"],
        "hydrodamp": card["hydrodamp"],
    }
    words = {key: [fact] if isinstance(fact, str) else fact for key, fact in facts.items()}
    return {key: ", ".join(word) for key, word in words.items() if any(word)}


def _word(value: float | None) -> str:
    return NOTHING if value is None else format(value, ".3g")
