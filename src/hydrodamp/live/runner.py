"""A live run: process rows, emit estimate lines and messages, save checkpoints."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np

from hydrodamp.data.log import Log
from hydrodamp.errors import FileError, HydrodampError, ProblemError
from hydrodamp.live.checkpoint import load, locked, save
from hydrodamp.live.estimator import LiveState, estimate_line, start, update
from hydrodamp.live.samples import ACCEPTED, REJECTED, RESTARTS, Row
from hydrodamp.models.model import DampingModel
from hydrodamp.vehicle.vehicle import Vehicle


@dataclass
class LiveRun:
    """Settings and state of a live run."""

    vehicle: Vehicle
    model: DampingModel
    method: str
    on_estimate: Callable[[dict[str, Any]], None]
    on_message: Callable[[str], None]
    output_interval: float = 1.0  # s of sample time between two estimate lines
    checkpoint_path: Path | None = None
    checkpoint_interval: float = 10.0  # s
    log: Log | None = None  # the source, if it is a log
    source_counts: Callable[[], dict[str, int]] = lambda: {"dropped": 0}
    skip_to: Callable[[int], None] = lambda first: None  # of the source
    state: LiveState | None = None
    is_stopped: bool = False
    _n_incomplete: int = 0  # rows before the first complete one
    _first_error: str = ""  # of those

    def process_rows(self, rows: Iterable[Row | None]) -> None:
        """Process all rows, None for an interval without one; save and emit the last estimate.

        Raises ``FileError`` where the checkpoint is in use or has other content, and any error
        of the source.
        """
        with locked(self.checkpoint_path), np.errstate(all="ignore"):
            try:
                self._process_all(rows)
            finally:
                self.save_checkpoint()
            if self.state is None and not self.is_stopped:
                raise ProblemError(
                    f"there was no sample to begin with. {self._first_error}".strip()
                )
            self.emit_estimate()

    def _process_all(self, rows: Iterable[Row | None]) -> None:
        saved_at, index, n_skipped = monotonic(), 0, 0
        for row in rows:
            if self.is_stopped:
                break
            if row is not None:
                if self.state is None:
                    n_skipped = self._try_start(row)
                if self.state is not None and index >= n_skipped:
                    self._process(self.state, row)
                index += 1
            if monotonic() - saved_at >= self.checkpoint_interval:
                self.save_checkpoint()
                saved_at = monotonic()

    def emit_estimate(self) -> None:
        """Emit an estimate line."""
        if self.state is not None:
            line = estimate_line(self.state)
            line["counts"] = line["counts"] | self.source_counts()
            self.on_estimate(line)

    def save_checkpoint(self) -> None:
        """Write the state; an error is reported and does not end the run."""
        if self.checkpoint_path is not None and self.state is not None:
            try:
                save(self.state, self.checkpoint_path)
            except (FileError, ValueError) as error:
                self.on_message(f"The state is not saved: {error}")

    def _try_start(self, row: Row) -> int:
        """Start at a row if it is complete; return the number of rows in the checkpoint."""
        try:
            return self._start(row)
        except Exception as error:  # a bad row must not end the run
            self._first_error = self._first_error or _describe(error)
            self._n_incomplete += 1
            if self._n_incomplete == 1:
                self.on_message(f"samples are rejected until one is complete: {self._first_error}")
            return 0

    def _start(self, row: Row) -> int:
        """Start, or resume from the checkpoint; return the number of rows it contains."""
        n, path = self._n_incomplete, self.checkpoint_path
        fresh = start(self.vehicle, self.model, self.method, row)
        counts = fresh.counts | ({"incomplete": n} if n else {})
        self.state = fresh._replace(n_rows=n, counts=counts)
        if path is None or not path.exists():
            return 0
        try:
            state = self.state = load(fresh, path)
        except FileError as error:
            self._move_aside(path, str(error))
            return 0
        if self.log is None:
            return 0
        if state.n_rows <= self.log.n and self.log.time[state.n_rows - 1] == state.validator.time:
            self.on_message(f"{path}: resumes after sample {state.n_rows} of the log.")
            self.skip_to(state.n_rows)
            return state.n_rows
        self.on_message(f"{path}: is of another log; this one starts at its first sample.")
        self.state = state._replace(validator=state.validator._replace(velocity=()), n_rows=0)
        return 0

    def _move_aside(self, path: Path, reason: str) -> None:
        """Rename an unusable checkpoint."""
        names = (path.with_name(f"{path.name}.other{number or ''}") for number in count())
        target = next(name for name in names if not name.exists())
        self.on_message(f"{reason} It is renamed to {target.name}; the estimate starts anew.")
        try:
            path.replace(target)
        except OSError as error:
            self.on_message(f"{path}: cannot be renamed: {error.strerror}.")
            self.checkpoint_path = None

    def _process(self, before: LiveState, row: Row) -> None:
        try:
            self.state, kind = update(before, row)
        except Exception as error:  # a bad row must not end the run
            self.state, kind = before.reject("failed"), "failed"
            if self.state.counts[kind] == 1:
                self.on_message(_describe(error))
        if kind != ACCEPTED:
            self._report(kind, self.state.counts[kind])
        change = self.state.alarm.last
        if change and self.state.alarm.changes > before.alarm.changes:
            self.on_message(
                f"the vehicle has changed at about {change.since:.0f} s, "
                f"detected on {', '.join(change.axes)} at {change.time:.0f} s."
            )
        now, previous = self.state.validator.time, before.validator.time
        if kind not in RESTARTS and now // self.output_interval != previous // self.output_interval:
            self.emit_estimate()

    def _report(self, kind: str, n: int) -> None:
        """Report the first sample of a class, the tenth, the hundredth and so on."""
        if kind == "first" or 10 ** round(math.log10(n)) != n:
            return
        times = f"{n} {'time' if n == 1 else 'times'} so far"
        if kind in REJECTED:
            self.on_message(f"a sample {REJECTED[kind]} is rejected ({times}).")
        else:
            self.on_message(f"the estimator restarts after {RESTARTS[kind]} ({times}).")


def _describe(error: Exception) -> str:
    is_known = isinstance(error, HydrodampError)
    return str(error) if is_known else f"{type(error).__name__}: {error}"
