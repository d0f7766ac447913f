"""Options that several commands share, their help sections, and shell completion."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from hydrodamp.identification.methods import METHODS

DATA, MODEL, OUTPUT = "Data", "Model and method", "Output"
"""Sections of the help of a command."""

FLEET = "bluerov2, bluerov2-heavy, lauv, remus100, vt690"
"""All vehicles of the fleet, for help; those of ``vehicle.file.fleet``."""

TARGETS = (
    "python, c, octave, casadi, fmu, gz-sim, vrx, mujoco, uuv, urdf, marinegym, stonefish, "
    "randomisation"
)
"""All targets of an export, for help; those of ``export.export.TARGETS``."""

#: All methods, for help.
KEYS = ", ".join(METHODS)

DEFAULT_METHOD = "recommended"
"""The method of commands that name none."""

DEMO_METHODS = "ls,ai,ai-scaled,recommended"
"""The two methods of the paper, the second with scaled gains, and the default method."""


def complete_list(list_values: Callable[[], Iterable[str]]) -> Callable[[str], list[str]]:
    """Return a shell completion of the last name in a list with commas."""

    def complete(incomplete: str) -> list[str]:
        start, comma, last = incomplete.rpartition(",")
        return [f"{start}{comma}{name}" for name in list_values() if name.startswith(last)]

    return complete


def model_names() -> tuple[str, ...]:
    """Return the names of the catalogue."""
    import hydrodamp

    return (*hydrodamp.catalog, "sparse")


def preset_names() -> tuple[str, ...]:
    """Return the names of the mappings in the package."""
    from hydrodamp.ingest.mapping.log_mapping import presets

    return presets()


def dataset_names() -> tuple[str, ...]:
    """Return the names of the public logs."""
    from hydrodamp.ingest.datasets import datasets

    return tuple(datasets())


complete_vehicles = complete_list(lambda: FLEET.split(", "))
complete_models = complete_list(model_names)
complete_methods = complete_list(lambda: METHODS)
complete_targets = complete_list(lambda: TARGETS.split(", "))
complete_presets = complete_list(preset_names)
complete_datasets = complete_list(dataset_names)


def out_option(metavar: str, text: str) -> Any:
    """Return the option ``--out/-o`` of a result path."""
    return typer.Option("--out", "-o", metavar=metavar, help=text, rich_help_panel=OUTPUT)


def vehicle_option(text: str) -> Any:
    """Return the option ``--vehicle/-v``."""
    return typer.Option(
        *("--vehicle", "-v"),
        metavar="V",
        help=text,
        show_default=False,
        autocompletion=complete_vehicles,
        rich_help_panel=MODEL,
    )


def model_option(text: str, *names: str, metavar: str = "M") -> Any:
    """Return the option ``--model/-m`` or ``--models/-m``."""
    return typer.Option(
        *(names or ("--model",)),
        "-m",
        metavar=metavar,
        help=text,
        show_default=False,
        autocompletion=complete_models,
        rich_help_panel=MODEL,
    )


def method_option(text: str, name: str = "--method", metavar: str = "KEY") -> Any:
    """Return the option ``--method`` or ``--methods``."""
    return typer.Option(
        name,
        metavar=metavar,
        help=text,
        autocompletion=complete_methods,
        rich_help_panel=MODEL,
    )


def _data(metavar: str, text: str, **settings: Any) -> Any:
    return typer.Option(metavar=metavar, help=text, rich_help_panel=DATA, **settings)


Logs = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="LOG",
        help="Log files or folders of any format. Optional if --train and --test give files.",
    ),
]
SomeLogs = Annotated[
    list[str],
    typer.Argument(
        metavar="LOG",
        help="Log files or folders of any format, in order of time; `a+b` joins files of one run.",
    ),
]
VehicleName = Annotated[
    str, vehicle_option(f"Vehicle of the fleet ({FLEET}) or a YAML file. [required]")
]
Train = Annotated[
    list[str] | None,
    _data("DATA", "Training data: files, START:END in seconds of LOG, or segments. Repeatable."),
]
Test = Annotated[
    list[str] | None,
    _data("DATA", "Data to validate on; same syntax as --train. Repeatable."),
]
Models = Annotated[
    str | None,
    model_option(
        "Comma-separated model names, YAML files of models, or FILE:NAME; `sparse` selects terms "
        "from the training data. [default: the eight models of the paper]",
        "--models",
        metavar="LIST",
    ),
]
OneModel = Annotated[
    str,
    model_option(
        "Model name, YAML file of one model, or FILE:NAME; `sparse` selects terms from the log. "
        "[required]"
    ),
]
Methods = Annotated[
    str, method_option(f"Comma-separated methods: {KEYS}.", "--methods", metavar="LIST")
]
MappingFile = Annotated[
    str | None,
    _data(
        "M",
        "Mapping of columns, units, frames and processing steps: a YAML file or a preset such as "
        "mavros.",
        autocompletion=complete_presets,
    ),
]
Attitude = Annotated[
    Literal["measured", "simulated"],
    typer.Option(
        help="Attitude in replays: use the recorded one, or integrate it.", rich_help_panel=MODEL
    ),
]
Rates = Annotated[
    Literal["deg", "rad"],
    typer.Option(help="Unit of angular rates in RMS errors.", rich_help_panel=OUTPUT),
]
Horizon = Annotated[
    float | None,
    typer.Option(
        metavar="S",
        help="Also report the fit percentage over prediction windows of S seconds.",
        rich_help_panel=OUTPUT,
    ),
]
OutFolder = Annotated[
    Path | None, out_option("DIR", "Folder for comparison.json, tables, fits, replays and report.")
]
Resume = Annotated[
    bool,
    typer.Option(
        "--resume",
        help="Reuse the finished fits that an interrupted run left in --out.",
        rich_help_panel=OUTPUT,
    ),
]
EstimateGains = Annotated[
    bool,
    typer.Option(
        "--estimate-actuator-gains",
        help="Also estimate an actuator gain per axis (reported as the deviation from 1).",
        rich_help_panel=MODEL,
    ),
]
Force = Annotated[
    bool,
    typer.Option(
        "--force",
        help="Overwrite existing results; in a folder, only files that hydrodamp wrote.",
        rich_help_panel=OUTPUT,
    ),
]
Json = Annotated[
    bool,
    typer.Option("--json", help="Print the results as JSON.", rich_help_panel=OUTPUT),
]
Quiet = Annotated[
    bool,
    typer.Option("--quiet", "-q", help="Show no progress bars.", rich_help_panel=OUTPUT),
]
