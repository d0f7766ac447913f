"""Whether the results of a project belong to its present files and arguments."""

from __future__ import annotations

import hashlib

from hydrodamp.app.commands import compare_command, format_command
from hydrodamp.app.project import EXPORTS, RESULTS, SUFFIX, Project
from hydrodamp.errors import HydrodampError
from hydrodamp.files import load_json
from hydrodamp.report.files import COMPARISON, DAMPING
from hydrodamp.results import complete_exchange


def is_outdated(project: Project) -> bool:
    """Return whether the comparison was made by another command, or files have changed since."""
    complete_exchange(project.path(RESULTS))
    path = project.path(f"{RESULTS}/{COMPARISON}")
    if not path.is_file():
        return False
    try:
        document = load_json(path)
        command = format_command(compare_command(project))
    except HydrodampError:
        return True
    provenance = document.get("provenance", {}) if isinstance(document, dict) else {}
    return provenance.get("command") != command or any(
        _has_changed(project, line) for line in str(provenance.get("files", "")).splitlines()
    )


def _has_changed(project: Project, line: str) -> bool:
    """Return whether a file of the project differs from its digest in the provenance."""
    digest, _, name = line.partition("  ")
    if not name.startswith(f"{project.name}{SUFFIX}/"):
        return False  # a log may be large; `compare --resume` digests it
    path = project.root / name
    return not path.is_file() or hashlib.sha256(path.read_bytes()).hexdigest() != digest


def outdated_exports(project: Project) -> set[str]:
    """Return the targets whose files are older than the damping."""
    damping = project.path(f"{RESULTS}/{DAMPING}")
    if not damping.is_file():
        return set()
    moment = damping.stat().st_mtime
    cards = project.path(EXPORTS).glob("*/fidelity.json")
    return {card.parent.name for card in cards if card.stat().st_mtime < moment}
