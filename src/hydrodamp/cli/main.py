"""The command ``hydrodamp``."""

from __future__ import annotations

import os
import sys
from typing import Annotated

import typer

from hydrodamp.cli.batch import batch
from hydrodamp.cli.compare import compare
from hydrodamp.cli.convert import convert
from hydrodamp.cli.datasets import datasets
from hydrodamp.cli.demo import demo
from hydrodamp.cli.export import export
from hydrodamp.cli.identify import identify
from hydrodamp.cli.live import live
from hydrodamp.cli.models import models
from hydrodamp.cli.output import INTERRUPTED, handle_errors
from hydrodamp.cli.plan import plan
from hydrodamp.cli.probe import probe
from hydrodamp.cli.report import report
from hydrodamp.cli.simulate import simulate
from hydrodamp.cli.validate import validate
from hydrodamp.cli.vehicle import new

app = typer.Typer(
    name="hydrodamp",
    help="From a vehicle's log to a hydrodynamic damping model that can be trusted.",
    epilog="Start with: hydrodamp demo. Exit status: 0 done, 1 the work failed, 2 the call or "
    "the input is wrong, 130 interrupted.",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
vehicle_app = typer.Typer(help="Vehicle files.", no_args_is_help=True, rich_markup_mode=None)

COMMANDS = (
    *(demo, models, datasets, probe, convert, compare, validate, identify, simulate, report),
    export,
    live,
    plan,
    batch,
)
for command in COMMANDS:
    app.command()(handle_errors(command))
vehicle_app.command()(handle_errors(new))
app.add_typer(vehicle_app, name="vehicle")


def _print_version(wanted: bool) -> None:
    if wanted:
        import hydrodamp

        typer.echo(f"hydrodamp {hydrodamp.__version__}")
        raise typer.Exit


@app.callback()
def hydrodamp_command(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version."
        ),
    ] = False,
) -> None:
    """From a vehicle's log to a hydrodynamic damping model that can be trusted."""


def main() -> None:
    """Run the command line; ``hydrodamp.__main__`` calls this."""
    try:
        app()
    except SystemExit as end:
        if end.code == INTERRUPTED:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(INTERRUPTED)
        raise
