"""Steps of a project: the state of each, what it needs, and whether results are outdated."""

from __future__ import annotations

import hashlib
import shlex
from dataclasses import dataclass
from itertools import takewhile
from typing import Any

from hydrodamp.app.commands import compare_command
from hydrodamp.app.project import EXPORTS, RESULTS, Project
from hydrodamp.app.recordings import read_vehicle, resolve_content
from hydrodamp.errors import HydrodampError
from hydrodamp.files import load_json
from hydrodamp.ingest.inspection.mapping_editor import assignments
from hydrodamp.report.files import COMPARISON, DAMPING, REPORT
from hydrodamp.results import complete_exchange

#: Addresses and titles of the steps.
STEPS = {
    "open": "Open",
    "channels": "Channels",
    "vehicle": "Vehicle",
    "split": "Split",
    "run": "Run",
    "verdict": "Verdict",
    "files": "Take away",
}

#: States in which a step has all that it needs.
COMPLETE = ("done", "outdated")


@dataclass(frozen=True)
class Step:
    """A step with its state and what it needs.

    The states are ``done``, ``outdated``, ``needs`` (a choice of the user), ``ready`` (to be
    started), ``running``, and ``waits`` (for an earlier step).
    """

    name: str
    state: str
    note: str = ""

    @property
    def title(self) -> str:
        """The name on the pages."""
        return STEPS[self.name]


def step_states(project: Project | None, is_running: bool = False) -> tuple[Step, ...]:
    """Return all steps of a project, or those before a log is open."""
    if project is None:
        return Step("open", "needs", "choose a log"), *(
            Step(name, "waits") for name in [*STEPS][1:]
        )
    arguments = project.arguments
    lacking = {
        "channels": _describe_mapping(project),
        "vehicle": _describe_vehicle(project),
        "split": "" if arguments.train and arguments.test else "choose training and test data",
        "run": "" if arguments.models and arguments.methods else "choose a model and a method",
    }
    steps = [Step("open", "done")]
    steps += [Step(key, "needs" if note else "done", note) for key, note in lacking.items()]
    has_report = project.path(f"{RESULTS}/{REPORT}").is_file()
    is_old = has_report and is_outdated(project)
    verdict = ("outdated" if is_old else "done") if has_report else "waits"
    if is_running:
        steps[-1] = Step("run", "running")
    elif any(step.state == "needs" for step in steps[:-1]):
        steps[-1] = Step("run", "waits")
    elif steps[-1].state == "done" and (is_old or not has_report):
        note = "the choices have changed: run again" if is_old else "start the run"
        steps[-1] = Step("run", "outdated" if is_old else "ready", note)
    return *steps, Step("verdict", verdict), _export_step(project, is_old)


def find_blocker(steps: tuple[Step, ...], screen: str) -> Step | None:
    """Return the first step that keeps the action of a screen from being available."""
    reached = [*takewhile(lambda step: step.name != screen, steps)]
    current = next((step for step in steps if step.name == screen and step.state == "needs"), None)
    missing = [step for step in reached if step.state not in COMPLETE]
    return missing[0] if missing else current


def _describe_mapping(project: Project) -> str:
    """Return what the mapping lacks; a canonical log has none, or one of steps alone."""
    try:
        content = resolve_content(project, project.text("mapping.yaml"))
    except HydrodampError:
        return "the mapping has an error"
    if set(content) <= {"steps"}:
        return ""
    roles = {each.role.partition(".")[0] for each in assignments(content)}
    return "" if "velocity" in roles else "no column is a velocity"


def _describe_vehicle(project: Project) -> str:
    vehicle, fault = read_vehicle(project)
    return "" if vehicle else "the vehicle has an error" if fault else "choose a vehicle"


def _export_step(project: Project, is_old: bool) -> Step:
    if not project.path(f"{RESULTS}/{DAMPING}").is_file():
        return Step("files", "waits")
    exported = exported_targets(project)
    if outdated_exports(project) or (is_old and exported):
        return Step("files", "outdated", "export again")
    return Step("files", "done" if exported else "ready")


def is_outdated(project: Project) -> bool:
    """Return whether the comparison was made by another command, or files have changed since.

    The folder of a project may have been renamed since.
    """
    complete_exchange(project.path(RESULTS))
    path = project.path(f"{RESULTS}/{COMPARISON}")
    if not path.is_file():
        return False
    try:
        document: Any = load_json(path)
        provenance = document["provenance"]
        words = shlex.split(provenance["command"])
        home = words[words.index("--out") + 1].removesuffix(RESULTS)
        made_by = [word.replace(home, project.argument("")) for word in words]
        if made_by != ["hydrodamp", *compare_command(project)]:
            return True
        lines = (line.partition("  ") for line in provenance.get("files", "").splitlines())
        files = [(digest, name.removeprefix(home)) for digest, _, name in lines if home in name]
        return any(  # a log may be large; `compare --resume` digests it
            hashlib.sha256(project.path(name).read_bytes()).hexdigest() != digest
            for digest, name in files
        )
    except (HydrodampError, KeyError, TypeError, ValueError, IndexError, OSError):
        return True


def exported_targets(project: Project) -> set[str]:
    """Return the targets that have an export."""
    return {card.parent.name for card in project.path(EXPORTS).glob("*/fidelity.json")}


def outdated_exports(project: Project) -> set[str]:
    """Return the targets whose files are older than the damping."""
    damping = project.path(f"{RESULTS}/{DAMPING}")
    if not damping.is_file():
        return set()
    moment, folder = damping.stat().st_mtime, project.path(EXPORTS)
    times = {key: (folder / key / "fidelity.json").stat() for key in exported_targets(project)}
    return {key for key, card in times.items() if card.st_mtime < moment}
