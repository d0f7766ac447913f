"""Command lines that repeat what a project contains, run in the folder of the projects."""

from __future__ import annotations

import shlex

from hydrodamp.app.project import ENVELOPE, EXPORTS, MODEL, PLAN, RESULTS, SUFFIX, VEHICLE, Project
from hydrodamp.identification.general_model import GENERAL_KEY
from hydrodamp.identification.stepwise import SPARSE_KEY
from hydrodamp.report.files import DAMPING


def vehicle_argument(project: Project) -> str:
    """Return the vehicle of a command: a name of the fleet, or the file of the project."""
    vehicle = project.arguments.vehicle
    return project.argument(VEHICLE) if vehicle == VEHICLE else vehicle


def _with_mapping(project: Project) -> list[str]:
    return ["--mapping", project.mapping] if project.mapping else []


def probe_command(project: Project) -> list[str]:
    """Return the command that inspects the logs."""
    return ["probe", *project.arguments.logs, *_with_mapping(project)]


def models_argument(project: Project) -> str:
    """Return the models of the comparison: names, or the file that has gains of commands."""
    models = project.arguments.models
    if project.text(MODEL).strip():
        derived = [name for name in models if name in (GENERAL_KEY, SPARSE_KEY)]
        return ",".join((*derived, project.argument(MODEL)))
    return ",".join(models)


def compare_command(project: Project, *, resume: bool = True) -> list[str]:
    """Return the command that identifies and compares the models."""
    arguments = project.arguments
    command = [
        "compare",
        *arguments.logs,
        "--vehicle",
        vehicle_argument(project),
        *_with_mapping(project),
    ]
    for option, spans in (("--train", arguments.train), ("--test", arguments.test)):
        for span in spans:
            command += [option, span]
    command += ["--models", models_argument(project), "--methods", ",".join(arguments.methods)]
    command += ["--out", project.argument(RESULTS)]
    return [*command, "--resume", "--force"] if resume else command


def export_command(project: Project, target: str) -> list[str]:
    """Return the command that exports the selected model."""
    damping, out = project.argument(f"{RESULTS}/{DAMPING}"), f"{EXPORTS}/{target}"
    logs = [word for log in project.arguments.logs for word in ("--log", log)]
    command = ["export", target, damping, *logs, *_with_mapping(project)]
    is_new = not project.path(f"{out}/fidelity.json").is_file()  # `--force` accepts any error
    return [*command, "--out", project.argument(out), *([] if is_new else ["--force"])]


def plan_command(project: Project, duration: float) -> list[str]:
    """Return the command that designs the next dive for the selected model."""
    return [
        "plan", "--vehicle", vehicle_argument(project), "--damping",
        project.argument(f"{RESULTS}/{DAMPING}"), "--duration", f"{duration:g}", "--out",
        project.argument(PLAN), "--force", "--envelope", project.argument(ENVELOPE),
    ]  # fmt: skip


def script(project: Project, targets: list[str]) -> str:
    """Return all commands as a shell script."""
    commands = [probe_command(project)]
    if project.arguments.vehicle and project.arguments.train:
        commands.append(compare_command(project))
    commands += [export_command(project, target) for target in targets]
    intro = f"# Run in the folder that has the logs and {project.name}{SUFFIX}.\n"
    return intro + "".join(f"{format_command(command)}\n" for command in commands)


def format_command(command: list[str]) -> str:
    """Return a command as it is typed."""
    return shlex.join(["hydrodamp", *command])
