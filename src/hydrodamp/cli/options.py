"""Options of the commands from ``options.toml``, shell completion, and help with examples."""

from __future__ import annotations

import inspect
import tomllib
from collections.abc import Callable
from functools import cache
from importlib.resources import files
from pkgutil import resolve_name
from string import Template
from typing import Annotated, Any

import typer.core


@cache
def _definitions() -> dict[str, dict[str, Any]]:
    text = files("hydrodamp.cli").joinpath("options.toml").read_text("utf-8")
    return tomllib.loads(Template(text).substitute(tomllib.loads(text)["names"]))


@cache
def examples() -> dict[str, list[str]]:
    """Return the example lines of each command."""
    text = files("hydrodamp.cli").joinpath("examples.txt").read_text("utf-8")
    blocks = (block.splitlines() for block in text.split("\n\n"))
    return {name: lines for name, *lines in blocks}


def definition(command: str, parameter: str) -> dict[str, Any]:
    """Return the definition of a command's option or argument."""
    key = parameter.replace("_", "-")
    known = _definitions()
    settings = known.get(f"{command}-{key}") or known[key]
    return known[settings["like"]] if "like" in settings else settings


def command_signature(command: Callable[..., object]) -> inspect.Signature:
    """Return the signature of a command for typer, with definitions and the option ``--quiet``."""
    signature = inspect.signature(command, eval_str=True)
    quiet = inspect.Parameter(
        "quiet", inspect.Parameter.KEYWORD_ONLY, default=False, annotation=bool
    )
    parameters = (*signature.parameters.values(), quiet)
    return signature.replace(
        parameters=[_define(command.__name__, parameter) for parameter in parameters]
    )


def _define(command: str, parameter: inspect.Parameter) -> inspect.Parameter:
    settings = dict(definition(command, parameter.name))
    settings.pop("missing", None)
    kind = typer.Argument if settings.pop("argument", False) else typer.Option
    if location := settings.pop("complete", ""):
        settings["autocompletion"] = complete_list(location)
    info = kind(*settings.pop("flags", "").split(), **settings)
    return parameter.replace(annotation=Annotated[parameter.annotation, info])


def complete_list(location: str) -> Callable[[str], list[str]]:
    """Return a completion of the last name in a list with commas: ``MODULE:NAMES [NAME]``."""
    path, *more = location.split()

    def complete(incomplete: str) -> list[str]:
        known = resolve_name(path)
        names = (*(known() if callable(known) else known), *more)
        start, comma, last = incomplete.rpartition(",")
        return [f"{start}{comma}{name}" for name in names if name.startswith(last)]

    return complete


def _write_sections(formatter: Any, sections: dict[str, list[tuple[str, str]]]) -> None:
    """Write names with their descriptions under a title each; no empty section."""
    for title, records in sections.items():
        if records:
            with formatter.section(title):
                formatter.write_dl(records)


class HelpGroup(typer.core.TyperGroup):
    """A group whose help lists commands by subject, without importing rich."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write a section of commands for each panel."""
        sections: dict[str, list[tuple[str, str]]] = {}
        for name in self.list_commands(ctx):
            command = self.get_command(ctx, name)
            if command is not None and not command.hidden:
                panel = getattr(command, "rich_help_panel", None) or "Commands"
                text = (command.help or "").split("\n")[0]
                sections.setdefault(panel, []).append((name, text))
        _write_sections(formatter, sections)


class HelpCommand(typer.core.TyperCommand):
    """A command whose help has a section for each panel of options, without importing rich."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse arguments; refuse a list with commas that is given twice: only one would count."""
        order = [] if ctx.resilient_parsing else self.make_parser(ctx).parse_args([*args])[2]
        for parameter in order:
            if parameter.metavar == "LIST" and order.count(parameter) > 1:
                name = parameter.opts[0]
                ctx.fail(f"`{name}` is given twice: give one list, separated by commas.")
        return super().parse_args(ctx, args)

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write arguments, then each section of options."""
        sections: dict[str, list[tuple[str, str]]] = {"Arguments": []}
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx)
            is_argument = parameter.param_type_name == "argument"
            if record is not None:
                record = (parameter.metavar or "", record[1]) if is_argument else record
                panel = getattr(parameter, "rich_help_panel", None) or "Options"
                sections.setdefault("Arguments" if is_argument else panel, []).append(record)
        _write_sections(formatter, sections)

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """Write the examples of the command."""
        if lines := examples().get(self.name or ""):
            with formatter.section("Examples"):
                formatter.write("".join(f"{line}\n" for line in lines))
