"""Help of a command: options in sections, then examples as they are typed."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import Any

import typer.core


class HelpCommand(typer.core.TyperCommand):
    """A command whose help has a section for each panel of options, without importing rich."""

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write arguments, then each section of options."""
        sections: dict[str, list[tuple[str, str]]] = {"Arguments": []}
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx)
            if record is not None:
                is_argument = parameter.param_type_name == "argument"
                panel = getattr(parameter, "rich_help_panel", None) or "Options"
                sections.setdefault("Arguments" if is_argument else panel, []).append(record)
        for title, records in sections.items():
            if records:
                with formatter.section(title):
                    formatter.write_dl(records)

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """Write the examples of the command."""
        lines = _examples().get(self.name or "", ())
        if lines:
            with formatter.section("Examples"):
                formatter.write("".join(f"{line}\n" for line in lines))


@cache
def _examples() -> dict[str, list[str]]:
    text = files("hydrodamp.cli").joinpath("examples.txt").read_text("utf-8")
    blocks = (block.splitlines() for block in text.split("\n\n"))
    return {name: lines for name, *lines in blocks}
