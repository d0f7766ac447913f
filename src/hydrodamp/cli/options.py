"""Options that several commands share, their help sections, and shell completion."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable
from functools import cache
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Annotated, Any, Literal

import typer

from hydrodamp.identification.methods import METHODS

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


NAMES: dict[str, Callable[[], Iterable[str]]] = {
    "vehicles": lambda: FLEET.split(", "),
    "models": model_names,
    "methods": lambda: METHODS,
    "targets": lambda: TARGETS.split(", "),
    "mappings": preset_names,
    "datasets": dataset_names,
}
"""Names for the shell completion of options."""


@cache
def _definitions() -> dict[str, dict[str, Any]]:
    text = files("hydrodamp.cli").joinpath("options.toml").read_text("utf-8")
    names = {"fleet": FLEET, "targets": TARGETS, "methods": KEYS}
    return tomllib.loads(Template(text).substitute(names))


def _settings(key: str) -> tuple[list[str], dict[str, Any]]:
    definition = dict(_definitions()[key])
    flags, names = definition.pop("flags", "").split(), definition.pop("complete", None)
    definition["rich_help_panel"] = definition.pop("panel", None)
    if names:
        definition["autocompletion"] = complete_list(NAMES[names])
    return flags, definition


def option(key: str) -> Any:
    """Return an option of ``options.toml``."""
    flags, settings = _settings(key)
    return typer.Option(*flags, **settings)


def argument(key: str) -> Any:
    """Return an argument of ``options.toml``."""
    return typer.Argument(**_settings(key)[1])


Logs = Annotated[list[str] | None, argument("logs")]
SomeLogs = Annotated[list[str], argument("some-logs")]
VehicleName = Annotated[str, option("vehicle-name")]
Train = Annotated[list[str] | None, option("train")]
Test = Annotated[list[str] | None, option("test")]
Models = Annotated[str | None, option("models")]
OneModel = Annotated[str, option("one-model")]
Methods = Annotated[str, option("methods")]
MappingFile = Annotated[str | None, option("mapping-file")]
Attitude = Annotated[Literal["measured", "simulated"], option("attitude")]
Rates = Annotated[Literal["deg", "rad"], option("rates")]
Horizon = Annotated[float | None, option("horizon")]
OutFolder = Annotated[Path | None, option("out-folder")]
Resume = Annotated[bool, option("resume")]
EstimateGains = Annotated[bool, option("estimate-gains")]
Force = Annotated[bool, option("force")]
Json = Annotated[bool, option("json")]
Quiet = Annotated[bool, option("quiet")]
