"""The directive ``commands``: every command with its options, from the program itself."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import typer
from docutils import nodes
from sections import section
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from hydrodamp import __version__
from hydrodamp.cli.main import app as program


def leaves(command: Any, name: str = "hydrodamp") -> Iterator[tuple[str, Any]]:
    """Yield the commands that do something, with their full names.

    Parameters
    ----------
    command : Command
        A command, or a group of them.
    name : str, optional
        What it is called by.

    Yields
    ------
    name : str
        Such as ``hydrodamp vehicle new``.
    command : Command
        With its parameters.
    """
    inside = getattr(command, "commands", None)
    if inside is None:
        yield name, command
        return
    for key, one in inside.items():
        yield from leaves(one, f"{name} {key}")


def all_commands() -> dict[str, Any]:
    """Return every command by its full name."""
    return dict(leaves(typer.main.get_command(program)))


def usage(name: str, command: Any) -> str:
    """Return the call of a command in one line, required options shown."""
    parts = [name]
    for one in command.params:
        if one.param_type_name == "argument":
            word = (one.metavar or one.name.upper()) + ("..." if one.nargs == -1 else "")
            parts.append(word if one.required else f"[{word}]")
        elif one.required:
            parts.append(f"{one.opts[0]} {one.metavar}")
    return " ".join([*parts, "[OPTIONS]"])


def described(name: str, command: Any) -> Iterator[str]:
    """Yield a command in reStructuredText.

    Parameters
    ----------
    name : str
        Its full name.
    command : Command
        With its parameters.

    Yields
    ------
    line : str
        What it does, its call, its arguments and options.
    """
    yield from (f".. program:: {name}", "", *(command.help or "").splitlines(), "")
    yield from (".. code-block:: text", "", f"   {usage(name, command)}", "")
    for one in command.params:
        if one.param_type_name == "argument":
            yield from (f"``{one.metavar or one.name.upper()}``", f"   {one.help or ''}", "")
    for one in command.params:
        if one.param_type_name == "option":
            value = "" if one.is_flag else f" {_value(one)}"
            yield from (f".. option:: {one.opts[0]}{value}", "", f"   {_help(one)}", "")


def _value(option: Any) -> str:
    return str(option.metavar or option.name.upper())


def _help(option: Any) -> str:
    said = (option.help or "").replace("`", "``")
    if option.required:
        return f"{said} Required."
    if option.is_flag or option.default in (None, ""):
        return said
    return f"{said} Default: ``{option.default}``."


class Commands(SphinxDirective):
    """A section for each command."""

    def run(self) -> list[nodes.Node]:
        """Return the sections."""
        return [
            section(self, nodes.literal("", name), name, described(name, command))
            for name, command in all_commands().items()
        ]


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive."""
    app.add_directive("commands", Commands)
    return {"version": __version__, "parallel_read_safe": True}
