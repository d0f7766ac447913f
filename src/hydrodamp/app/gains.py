"""Gains of commands of a project, and ``model.yaml``, which extends the chosen models by them.

A ``model.yaml`` that differs from what the page would write was edited by hand: it is not
overwritten.
"""

from __future__ import annotations

from collections.abc import Mapping

import yaml

from hydrodamp.app.project import MODEL, Arguments, Project
from hydrodamp.basis.term import AXES
from hydrodamp.models.catalog import catalog
from hydrodamp.simulation.draft_gains import gain_term

#: Suffix of models with gains of commands.
SUFFIX = "gains"


def format_models(models: tuple[str, ...], gains: Mapping[str, str]) -> str:
    """Return a file of models that extend others by gains of commands, empty without gains."""
    terms = {
        axis: " ".join(map(gain_term, gains[axis].split())) for axis in AXES if gains.get(axis)
    }
    entries = [
        {"name": f"{model}-{SUFFIX}", "extends": model, "terms": dict(terms)}
        for model in models
        if model in catalog
    ]
    return str(yaml.safe_dump({"models": entries}, sort_keys=False)) if terms and entries else ""


def _text_of(arguments: Arguments) -> str:
    return format_models(arguments.models, {str(k): v for k, v in arguments.gains.items()})


def is_edited(project: Project) -> bool:
    """Return whether ``model.yaml`` was edited by hand."""
    text = project.text(MODEL)
    return bool(text.strip()) and text != _text_of(project.arguments)


def update_models(project: Project, version: str, **changes: object) -> None:
    """Change models, methods or gains, and ``model.yaml`` unless it was edited by hand."""
    contents = {}
    if not is_edited(project):
        text = _text_of(project.arguments.model_copy(update=changes))
        if text or project.path(MODEL).is_file():
            contents = {MODEL: text}
    project.update(version, contents, **changes)
