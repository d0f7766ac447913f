"""Page of the fidelity of an export."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from hydrodamp.errors import FileError
from hydrodamp.files import load_json
from hydrodamp.report.page import Page, render_page
from hydrodamp.report.provenance import today
from hydrodamp.report.table import NOTHING, Table
from hydrodamp.results import save_result

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
    """Write the page of an export's card, by default into its folder."""
    document, page_path = read_card(folder), path or folder / PAGE
    page = Page(
        title=f"{document['vehicle']} for {document['target']}",
        about={
            "vehicle": document["vehicle"],
            "log": document["asked_at"],
            "date": today(),
            "units": "SI; angular rates of replays in deg/s",
        },
        notes=[document["text"]],
        tables=[*_card_tables(document)],
        facts=_card_facts(document),
    )
    save_result(render_page(page), page_path)
    return page_path


def _card_tables(card: dict[str, Any]) -> Iterator[Table]:
    errors = {
        "wrench error [% of rms]": card["wrench_error"],
        "at a tenth of the velocities": card.get("slow_error", {}),
        "added mass / rigid-body mass": card["mass_ratio"],
    }
    yield _merge_columns(f"By axis, at {card['asked_at']}", "axis", errors)
    if replays := card["replays"]:
        pairs = ("source", "target"), ("source", "log"), ("target", "log")
        scores = {f"{a} and {b}": replays[f"{a}_to_{b}"] for a, b in pairs}
        rms = {key: {"all": score["rms"], **score["rms_by_axis"]} for key, score in scores.items()}
        bands = {
            "fit of the target [%]": replays["target_to_log"]["fit_by_axis"],
            "predicted error": card["predicted_error"],
            "recorded samples in the band [%]": replays.get("coverage", {}),
        }
        yield _merge_columns("Replay in the target against the log", "velocity", bands)
        title = f"Replay RMS in m/s and deg/s. {replays['step']}."
        yield _merge_columns(title, "velocity", rms)
    power = {f"of the {key}": value for key, value in card["power"].items()}
    title = f"Greatest power of the damping within {card['box']}"
    yield _merge_columns(title, "damping", {"[W]": power})


def _merge_columns(
    title: str, first: str, columns: Mapping[str, Mapping[str, float | None]]
) -> Table:
    """Return a table of numbers by name, one column each."""
    names = dict.fromkeys(name for values in columns.values() for name in values)
    columns = {head: values for head, values in columns.items() if {*values.values()} - {None}}
    rows = (
        (name, *(_format_number(values.get(name)) for values in columns.values())) for name in names
    )
    return Table.of_words(title, (first, *columns), "l" + "r" * len(columns), rows)


def _card_facts(card: dict[str, Any]) -> dict[str, str]:
    facts = {
        "written for": card["description"],
        "model": card["model"],
        "inputs": card["inputs"],
        "projected terms": card["projected"],
        "reservations": card.get("reservations", ()),
        "unrepresented effects": card["ignores"],
        "run by": card["run_by"],
        "not run": card["not_run"],
        "failed": card.get("run_error", ""),
        **card["settings"],
        "exported by": f"hydrodamp {card['hydrodamp']}",
    }
    texts = {key: [fact] if isinstance(fact, str) else fact for key, fact in facts.items()}
    return {key: ", ".join(text) for key, text in texts.items() if any(text)}


def _format_number(value: float | None) -> str:
    return NOTHING if value is None else format(value, ".3g")
