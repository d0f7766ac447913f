"""Names in a draft: commands that are valid in terms, and columns as YAML scalars."""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Mapping, Sequence

from hydrodamp.basis.term import check_command_name
from hydrodamp.data.channels import RESERVED
from hydrodamp.errors import HydrodampError

_YAML_KEYWORDS = frozenset(("y", "n", "yes", "no", "on", "off", "true", "false", "null", "none"))
_PLAIN_SCALAR = re.compile(r"[A-Za-z_/][\w./ -]*\w|[A-Za-z_]")
_GENERIC_FIELDS = frozenset(["data", "value", "x", "y", "z", "output", "input", "xyz", "channels"])


def command_names(columns: Sequence[str], reserved: Collection[str] = ()) -> list[str]:
    """Return short names of commands that are valid in terms, none of the reserved."""
    names: dict[str, str] = {}
    for column in columns:
        topic, _, last = column.rpartition(".")
        is_generic = last.partition("[")[0].lower() in _GENERIC_FIELDS
        short = "/".join(topic.split("/")[-2:]) + f".{last}" if is_generic else last
        short = short.removesuffix(".data").removesuffix(".value") if topic else short
        candidates = map(_valid_name, (short, column, *(f"{column}_{k}" for k in range(2, 99))))
        names[next(name for name in candidates if name not in (*names, *reserved))] = column
    return [*names]


def _valid_name(text: str) -> str:
    """Return a name that is valid in terms."""
    name = re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_") or "command"
    name = f"c{name}" if name[0].isdigit() else name
    try:
        check_command_name(name)
    except HydrodampError:
        return f"{name}_command"
    return f"{name}_command" if name in RESERVED or name.lower() in _YAML_KEYWORDS else name


def quote_name(text: str) -> str:
    """Return the text as a YAML scalar."""
    plain = _PLAIN_SCALAR.fullmatch(text) and text.lower() not in _YAML_KEYWORDS
    return text if plain else json.dumps(text, ensure_ascii=False)


def format_source(column: str, items: Mapping[str, str | None]) -> str:
    """Return a column with its settings in the syntax of mappings."""
    settings = "".join(f", {key}: {text}" for key, text in items.items() if text is not None)
    return f"{{column: {column}{settings}}}" if settings else column
