"""Commands ``methods``, ``vehicles``, ``presets`` and ``targets``: names that options accept."""

from __future__ import annotations

import inspect
from collections.abc import Mapping

import hydrodamp as hd
from hydrodamp.cli.output import print_output

_MAX_WIDTH = 76  # characters of a description


def methods(json: bool = False) -> None:
    """List the identification methods."""
    texts = {key: inspect.getdoc(type(hd.find_method(key))) or "" for key in hd.METHODS}
    _print_names("methods", {key: text.splitlines()[0] for key, text in texts.items()}, json)


def vehicles(json: bool = False) -> None:
    """List the vehicles of the fleet with the source of their numbers."""
    _print_names("vehicles", {name: vehicle.source for name, vehicle in hd.fleet.items()}, json)


def presets(json: bool = False) -> None:
    """List the presets of mappings for known recordings."""
    from hydrodamp.ingest.mapping.log_mapping import describe_preset, presets as known_presets

    _print_names("presets", {name: describe_preset(name) for name in known_presets()}, json)


def targets(json: bool = False) -> None:
    """List the simulators and controllers that export writes for."""
    _print_names("targets", {key: hd.find_target(key).description for key in hd.TARGETS}, json)


def _print_names(kind: str, descriptions: Mapping[str, str], json: bool) -> None:
    """Print names with a description each."""
    from hydrodamp.report.table import Table

    rows = [(name, text[:_MAX_WIDTH]) for name, text in descriptions.items()]
    table = Table.of_words("", ("name", "description"), "ll", rows)
    print_output(json, {kind: dict(descriptions)}, table)
