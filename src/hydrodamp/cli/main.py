"""Command ``hydrodamp``: its subcommands and options."""

from __future__ import annotations

import os
import sys
from typing import Annotated

import typer

from hydrodamp.cli import lists
from hydrodamp.cli.app import app as serve_app
from hydrodamp.cli.batch import batch
from hydrodamp.cli.compare import compare
from hydrodamp.cli.control import control
from hydrodamp.cli.demo import demo
from hydrodamp.cli.evaluate import simulate
from hydrodamp.cli.export import export
from hydrodamp.cli.identify import identify
from hydrodamp.cli.live import live
from hydrodamp.cli.logs import convert, probe
from hydrodamp.cli.manoeuvre import manoeuvre
from hydrodamp.cli.options import HelpCommand, HelpGroup
from hydrodamp.cli.output import INTERRUPTED, handle_errors
from hydrodamp.cli.plan import plan
from hydrodamp.cli.report import report
from hydrodamp.cli.vehicle import new

app = typer.Typer(
    name="hydrodamp",
    cls=HelpGroup,
    help="Identify hydrodynamic damping models of marine vehicles from logs.",
    epilog="Start with: hydrodamp demo. Exit status: 0 success, 1 failure, 2 wrong usage or input, "
    "130 interrupted.",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
vehicle_app = typer.Typer(help="Create vehicle files.", no_args_is_help=True, rich_markup_mode=None)

COMMANDS = {
    "Start": (demo, serve_app),
    "Names": (lists.list,),
    "Logs": (probe, convert),
    "Identification and validation": (compare, identify, report),
    "Use of a model": (simulate, manoeuvre, control, export, live),
    "Next dives and many logs": (plan, batch),
}
for title, commands in COMMANDS.items():
    for command in commands:
        app.command(cls=HelpCommand, rich_help_panel=title)(handle_errors(command))
vehicle_app.command(cls=HelpCommand)(handle_errors(new))
app.add_typer(vehicle_app, name="vehicle", rich_help_panel="Logs")


@app.command("help", hidden=True)
def show_help(names: Annotated[list[str] | None, typer.Argument(metavar="COMMAND")] = None) -> None:
    """Show the help of a command."""
    app([*(names or ()), "--help"], prog_name="hydrodamp")


def _print_version(is_requested: bool) -> None:
    if is_requested:
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
    """Identify hydrodynamic damping models of marine vehicles from logs."""


def main() -> None:
    """Run the command line."""
    try:
        app()
    except SystemExit as error:
        if error.code == INTERRUPTED:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(INTERRUPTED)
        raise
