"""Checkpoint of a live run: a JSON file of one vehicle, model and method, written atomically.

A lock file reserves it for one process.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, get_args, get_type_hints

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.errors import FileError
from hydrodamp.files import load_json, save_text, temporary_prefix
from hydrodamp.kernels.core import Estimate
from hydrodamp.kernels.plant import Sample
from hydrodamp.live.change_detection import Alarm
from hydrodamp.live.estimator import LiveState
from hydrodamp.live.sample_validator import SampleValidator
from hydrodamp.locks import acquire_lock

VERSION = 8
HEAD = b'{"live_state":'  # the first bytes of every checkpoint


@contextmanager
def locked(path: Path | None) -> Iterator[None]:
    """Hold the lock of a checkpoint, and remove the temporary files of killed runs.

    The operating system releases the lock when the process ends. The lock file stays. Raises
    ``FileError`` where another run has the lock or the file is no checkpoint.
    """
    if path is None:
        yield
        return
    try:
        stream = path.with_name(f"{temporary_prefix(path)}lock").open("a+b", buffering=0)
    except OSError:  # a folder that cannot be written: the checkpoint cannot either
        yield
        return
    with stream:
        if not acquire_lock(stream.fileno()):
            stream.seek(0)
            process = stream.read(20).decode("ascii", "replace") or "unknown"
            raise FileError(
                f"{path}: another run of `hydrodamp live` (process {process}) uses this checkpoint."
                " Stop that run, or give this one another `--checkpoint`."
            )
        with suppress(OSError):  # on a full disk the process is unknown
            stream.truncate(0)
            stream.write(str(os.getpid()).encode())
        _check_kind(path)
        name = re.compile(re.escape(temporary_prefix(path)) + "[0-9a-f]{16}")
        for file in path.parent.iterdir():
            if name.fullmatch(file.name):
                with suppress(OSError):
                    file.unlink()
        yield


def _check_kind(path: Path) -> None:
    """Refuse a file with other content; a damaged checkpoint passes."""
    try:
        with path.open("rb") as stream:
            head = stream.read(4096)
    except OSError:
        return
    if head.strip(b"\0 \r\n") and not head.startswith(HEAD):
        raise FileError(
            f"{path}: is not a state of `hydrodamp live` and would be overwritten. Give "
            "`--checkpoint` the name of a new file, or move this one."
        )


class _Content(NamedTuple):
    """The part of a state that is no setting; that of a file may be NaN only in the time."""

    last: FloatArray
    block: FloatArray
    estimate: Estimate
    values: FloatArray  # of the adaptive identifier, empty without
    validator: SampleValidator
    n_rows: int
    counts: dict[str, int]
    alarm: Alarm


def save(state: LiveState, path: Path) -> None:
    """Write a state; every number keeps all its digits."""
    content = _Content(
        state.rls.last.values,
        state.rls.block,
        state.rls.estimate,
        state.ai.values if state.ai else np.empty(0),
        state.validator._replace(time=repr(state.validator.time)),  # type: ignore[arg-type]
        *(state.n_rows, state.counts, state.alarm),
    )
    text = json.dumps(content._asdict(), allow_nan=False, default=np.ndarray.tolist)
    head = {"live_state": VERSION, "digest": state.digest, "checksum": _checksum(text)}
    save_text(json.dumps(head)[:-1] + f', "state": {text}}}\n', path)


def load(fresh: LiveState, path: Path) -> LiveState:
    """Return the state of a file, which must be of the vehicle, model and method of ``fresh``."""
    document = load_json(path)
    if not isinstance(document, dict) or document.get("live_state") != VERSION:
        raise FileError(f"{path}: is not a state of `hydrodamp live` of version {VERSION}.")
    if _checksum(json.dumps(document.get("state"))) != document.get("checksum"):
        raise FileError(f"{path}: is damaged: its checksum does not match.")
    if document.get("digest") != fresh.digest:
        raise FileError(
            f"{path}: is the state of another vehicle, model, method or set of channels."
        )
    hints = get_type_hints(_Content)
    content = _Content(*(_restore(kind, document["state"][key]) for key, kind in hints.items()))
    last = Sample(content.last)
    return fresh._replace(
        rls=replace(fresh.rls, estimate=content.estimate, block=content.block, last=last),
        ai=fresh.ai and replace(fresh.ai, values=content.values, last=last),
        validator=content.validator._replace(time=float(content.validator.time)),
        n_rows=content.n_rows,
        counts=content.counts,
        alarm=content.alarm,
    )


def _restore(kind: Any, value: Any) -> Any:
    """Return a value of JSON as an array, a tuple or a named tuple, according to its type."""
    types = [each for each in get_args(kind) if each is not type(None)]
    if value is None or not isinstance(value, list):
        return value
    if hasattr(kind, "_fields"):
        hints = get_type_hints(kind)
        return kind(*map(_restore, hints.values(), value))
    if type(None) in get_args(kind):
        return _restore(types[0], value)
    if getattr(kind, "__origin__", kind) is tuple:
        kinds = [types[0]] * len(value) if types[-1] is Ellipsis else types
        return tuple(map(_restore, kinds, value))
    return frozen(value)


def _checksum(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
