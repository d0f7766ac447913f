"""The state of a live run on disk: whole or not at all, and only for the same vehicle and model."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np

from hydrodamp.errors import FileError
from hydrodamp.files import load_json, save_text
from hydrodamp.kernels.core import Estimate
from hydrodamp.kernels.plant import Sample
from hydrodamp.live.alarm import restored
from hydrodamp.live.loop import State
from hydrodamp.live.screen import Screen

_VERSION = 2


def save(state: State, path: Path) -> None:
    """Write a state; every number keeps all its digits."""
    rls, ai = state.rls, state.ai
    content = {
        "last": rls.last.values.tolist(),
        "block": rls.block.tolist(),
        "estimate": {name: part.tolist() for name, part in rls.estimate._asdict().items()},
        "table": None if ai is None else ai.table.tolist(),
        "screen": state.screen._asdict() | {"time": repr(state.screen.time)},
        "seen": state.seen,
        "counts": state.counts,
        "alarm": state.alarm._asdict(),
    }
    text = json.dumps(content, allow_nan=False, default=np.ndarray.tolist)
    head = {"live_state": _VERSION, "digest": state.digest, "checksum": _checksum(text)}
    save_text(json.dumps(head)[:-1] + f', "state": {text}}}\n', path)


def load(fresh: State, path: Path) -> State:
    """Return the state that a file holds, where it is one of the same vehicle, model and method."""
    document = load_json(path)
    if not isinstance(document, dict) or document.get("live_state") != _VERSION:
        raise FileError(f"{path}: is not a state of `hydrodamp live` of version {_VERSION}.")
    if _checksum(json.dumps(document.get("state"))) != document.get("checksum"):
        raise FileError(f"{path}: is damaged, as its checksum does not fit.")
    if document.get("digest") != fresh.digest:
        raise FileError(
            f"{path}: is the state of another vehicle, model, method or set of channels."
        )
    return _restored(fresh, document["state"])


def _restored(fresh: State, content: dict[str, Any]) -> State:
    sample = Sample(_array(content["last"]))
    estimate = Estimate(**{name: _array(part) for name, part in content["estimate"].items()})
    ai = fresh.ai and fresh.ai._replace(table=_array(content["table"]), last=sample)
    told = {key: _plain(value) for key, value in content["screen"].items()}
    return State(
        fresh.rls._replace(estimate=estimate, block=_array(content["block"]), last=sample),
        ai,
        Screen(**told | {"time": float(told["time"])}),
        content["seen"],
        content["counts"],
        restored(content["alarm"]),
    )


def _checksum(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _array(values: list[Any]) -> Any:
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


def _plain(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value
