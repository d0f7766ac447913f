"""What may be said on the command line, once for all commands."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

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
"""What a user gets who names none."""

DEMO_METHODS = "ls,ai,ai-scaled,recommended"
"""The paper's two, the second with scaled gains, and what hydrodamp recommends."""

Logs = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="LOG",
        help="Logs: files or folders of any format. Left out where --train and --test name files.",
    ),
]
SomeLogs = Annotated[
    list[str],
    typer.Argument(
        metavar="LOG",
        help="Logs, one after another: files or folders of any format; `a+b` are one recording.",
    ),
]
_WHICH = f"A vehicle of the fleet ({FLEET}) or a YAML file. [required]"
VehicleName = Annotated[str, typer.Option(metavar="V", help=_WHICH, show_default=False)]
_PART = "Identify on this: files, START:END seconds of LOG, or segment names. Repeatable."
Train = Annotated[list[str] | None, typer.Option(metavar="PART", help=_PART)]
_OTHER_PART = "Replay on this; said like --train. Repeatable."
Test = Annotated[list[str] | None, typer.Option(metavar="PART", help=_OTHER_PART)]
_MODELS = (
    "Models by name and YAML files of models, or FILE:NAME, with commas; `sparse` selects one from "
    "the training data. [default: the paper's eight]"
)
Models = Annotated[str | None, typer.Option(metavar="LIST", help=_MODELS)]
_METHODS = f"Methods by name, with commas, of {KEYS}."
Methods = Annotated[str, typer.Option(metavar="LIST", help=_METHODS)]
_MAPPING = "Names, units, frames and steps of a log: a YAML file, or a preset such as mavros."
MappingFile = Annotated[str | None, typer.Option(metavar="M", help=_MAPPING)]
Attitude = Annotated[
    Literal["measured", "simulated"],
    typer.Option(help="In replays, the attitude as measured or simulated too."),
]
Rates = Annotated[Literal["deg", "rad"], typer.Option(help="Unit of angular rates in RMS errors.")]
_HORIZON = "Fit in per cent too, over windows of so many seconds."
Horizon = Annotated[float | None, typer.Option(metavar="S", help=_HORIZON)]
_FOLDER = "Write comparison.json, tables, fits, replays, pictures and report.html."
OutFolder = Annotated[Path | None, typer.Option(metavar="DIR", help=_FOLDER)]
_RESUME = "Go on with what the same command left in --out when it was interrupted."
Resume = Annotated[bool, typer.Option("--resume", help=_RESUME)]
_GAINS = (
    "Identify a gain of the known wrench on each axis too: `X_actuation_X` is what it is more than "
    "one."
)
FreeGains = Annotated[bool, typer.Option("--free-gains", help=_GAINS)]
_REPLACE = "Replace files that exist; in a folder, those alone that hydrodamp wrote."
Force = Annotated[bool, typer.Option("--force", help=_REPLACE)]
Json = Annotated[
    bool, typer.Option("--json", help="Print machine-readable results on standard output.")
]
