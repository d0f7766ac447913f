"""The state of a live run on disk: whole or not at all, for one vehicle and model, and one run."""

from __future__ import annotations

import hashlib
import json
import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

import numpy as np

from hydrodamp.errors import FileError
from hydrodamp.files import load_json, save_text, temporary_prefix
from hydrodamp.kernels.core import Estimate
from hydrodamp.kernels.plant import Sample
from hydrodamp.live.change_detection import restore_alarm
from hydrodamp.live.estimator import LiveState
from hydrodamp.live.sample_validation import SampleValidator

_VERSION = 2
_HEAD = b'{"live_state":'  # how every state begins


@contextmanager
def locked(path: Path | None) -> Iterator[None]:
    """Hold the lock on a state, refuse what is none, and remove what killed runs left of it.

    The operating system releases the lock when the process ends, however it ends. The lock file
    stays.
    """
    if path is None:
        yield
        return
    try:
        stream = path.with_name(f"{temporary_prefix(path)}lock").open("a+")
    except OSError:  # no folder, or one that may not be written: no state can be written either
        yield
        return
    with stream:
        if not _lock(stream):
            stream.seek(0)
            raise FileError(
                f"{path}: another run of `hydrodamp live` (process {stream.read(20) or 'unknown'})"
                " keeps its state there. End that one, or give this one another `--checkpoint`."
            )
        stream.truncate(0)
        stream.write(str(os.getpid()))
        stream.flush()
        _check_kind(path)
        _remove_temporaries(path)
        yield


def _lock(stream: IO[str]) -> bool:
    """Return whether this process has the lock of a file; so too where there are no locks."""
    try:
        if sys.platform == "win32":
            import msvcrt

            stream.seek(0x7FFF0000)  # a byte behind the content, which others may read
            msvcrt.locking(stream.fileno(), msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):
        return False
    except OSError:
        return True
    return True


def _check_kind(path: Path) -> None:
    """Refuse a file that holds something else than a state; a damaged state is still one."""
    try:
        with path.open("rb") as stream:
            head = stream.read(4096)
    except OSError:
        return
    if head.strip(b"\0 \r\n") and not head.startswith(_HEAD):
        raise FileError(
            f"{path}: is not a state of `hydrodamp live`, and would be replaced by one. Give"
            " `--checkpoint` the name of a new file, or move this one away."
        )


def _remove_temporaries(path: Path) -> None:
    name = re.compile(re.escape(temporary_prefix(path)) + "[0-9a-f]{16}")
    for one in path.parent.iterdir():
        if name.fullmatch(one.name):
            with suppress(OSError):
                one.unlink()


def save(state: LiveState, path: Path) -> None:
    """Write a state; every number keeps all its digits."""
    rls, ai = state.rls, state.ai
    content = {
        "last": rls.last.values.tolist(),
        "block": rls.block.tolist(),
        "estimate": {name: part.tolist() for name, part in rls.estimate._asdict().items()},
        "table": None if ai is None else ai.table.tolist(),
        "screen": state.validator._asdict() | {"time": repr(state.validator.time)},
        "seen": state.n_rows,
        "counts": state.counts,
        "alarm": state.alarm._asdict(),
    }
    text = json.dumps(content, allow_nan=False, default=np.ndarray.tolist)
    head = {"live_state": _VERSION, "digest": state.digest, "checksum": _checksum(text)}
    save_text(json.dumps(head)[:-1] + f', "state": {text}}}\n', path)


def load(fresh: LiveState, path: Path) -> LiveState:
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


def _restored(fresh: LiveState, content: dict[str, Any]) -> LiveState:
    sample = Sample(_array(content["last"]))
    estimate = Estimate(**{name: _array(part) for name, part in content["estimate"].items()})
    ai = fresh.ai and fresh.ai._replace(table=_array(content["table"]), last=sample)
    told = {key: _plain(value) for key, value in content["screen"].items()}
    return LiveState(
        fresh.rls._replace(estimate=estimate, block=_array(content["block"]), last=sample),
        ai,
        SampleValidator(**told | {"time": float(told["time"])}),
        content["seen"],
        content["counts"],
        restore_alarm(content["alarm"]),
    )


def _checksum(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _array(values: list[Any]) -> Any:
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


def _plain(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value
