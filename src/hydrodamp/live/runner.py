"""A live run: process rows, emit estimate lines and messages, save checkpoints."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np

from hydrodamp.data.log import Log
from hydrodamp.errors import FileError, HydrodampError, ProblemError
from hydrodamp.live.checkpoint import load, locked, save
from hydrodamp.live.estimator import LiveState, estimate_line, find_stray, start, update
from hydrodamp.live.sample_validator import ACCEPTED, REJECTED, RESTARTS
from hydrodamp.live.samples import Row
from hydrodamp.models.model import DampingModel
from hydrodamp.vehicle.vehicle import Vehicle

MAX_REASONS = 100  # different ones that are reported before the first complete row; by choice
MAX_SILENCE = 5.0  # s without data, which is reported; by choice

#: Counts of a source that are reported, with what they mean.
LOSSES = {
    "dropped": "samples come faster than they are processed: the oldest in the queue are dropped",
    "kernel drops": "datagrams come faster than they are read: the operating system drops some",
    "other senders": "datagrams come from several senders: if these are several vehicles, give"
    " each a port of its own",
}


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
    #: Class and reason of those before the first complete row.
    _rejected: Counter[tuple[str, str]] = field(default_factory=Counter)
    _reported: set[str] = field(default_factory=set)  # counts of the source

    def process_rows(self, rows: Iterable[Row | None]) -> None:
        """Process all rows, None for an interval without one; save and emit the last estimate.

        Raises ``FileError`` where the checkpoint is in use or has other content, and any error
        of the source.
        """
        saved_at = received_at = monotonic()
        index = n_skipped = 0
        with locked(self.checkpoint_path), np.errstate(all="ignore"):
            try:
                for row in itertools.takewhile(lambda _: not self.is_stopped, rows):
                    now = monotonic()
                    if row is None:
                        if now - received_at > MAX_SILENCE:
                            self.on_message(f"no data for {MAX_SILENCE:g} s; the run waits.")
                            received_at = math.inf
                    else:
                        received_at = now
                        if self.state is None:
                            n_skipped = self._try_start(row)
                        if self.state is not None and index >= n_skipped:
                            self._process(self.state, row)
                        index += 1
                    self._report_losses()
                    if now - saved_at >= self.checkpoint_interval:
                        self.save_checkpoint()
                        saved_at = monotonic()
            finally:
                self.save_checkpoint()
                self._report_losses(is_end=True)
            if self.state is None:
                counts = (
                    (kind == "incomplete", n, text) for (kind, text), n in self._rejected.items()
                )
                *_, reason = max(counts, default=("",))
                message = f"there was no sample to begin with. {reason}".strip()
                if not self.is_stopped:
                    raise ProblemError(message)
                self.on_message(message)
            self.emit_estimate()

    def emit_estimate(self) -> None:
        """Emit an estimate line."""
        if self.state is not None:
            line = estimate_line(self.state)
            line["counts"] = line["counts"] | self.source_counts()
            self.on_estimate(line)

    def _report_losses(self, is_end: bool = False) -> None:
        """Report what the source lost, once when it begins and the number at the end."""
        for name, n in self.source_counts().items():
            if n and name in LOSSES and (is_end or name not in self._reported):
                self._reported.add(name)
                self.on_message(f"{LOSSES[name]} ({n} {'in all' if is_end else 'so far'}).")

    def save_checkpoint(self) -> None:
        """Write the state; an error is reported and does not end the run."""
        if self.checkpoint_path is not None and self.state is not None:
            try:
                save(self.state, self.checkpoint_path)
            except (FileError, ValueError) as error:
                self.on_message(f"The state is not saved: {error}")

    def _try_start(self, row: Row) -> int:
        """Start at a row if it is complete; return the number of rows in the checkpoint."""
        kind = find_stray(row) or "incomplete"
        reason = f"A sample {REJECTED[kind]}."
        if kind == "incomplete":
            try:
                return self._start(row)
            except Exception as error:  # a bad row must not end the run
                reason = _describe(error)
        if (kind, reason) not in self._rejected:
            if len(self._rejected) < MAX_REASONS:
                self.on_message(f"samples are rejected until one is complete: {reason}")
            else:
                reason = ""
        self._rejected[kind, reason] += 1
        return 0

    def _start(self, row: Row) -> int:
        """Start, or resume from the checkpoint; return the number of rows it contains."""
        path = self.checkpoint_path
        state = fresh = start(self.vehicle, self.model, self.method, row)
        if path is not None and path.exists():
            try:
                state = load(fresh, path)
            except FileError as error:
                self._move_aside(path, str(error))
        if self.log is not None and state is not fresh:
            if _is_of_log(state, self.log):
                self.on_message(f"{path}: resumes after sample {state.n_rows} of the log.")
                self.state = state
                self.skip_to(state.n_rows)
                return state.n_rows
            self.on_message(f"{path}: is of another log; this one starts at its first sample.")
            state = state._replace(validator=state.validator._replace(motion=()), n_rows=0)
        for (kind, _), n in self._rejected.items():
            state = state.add_count(kind, n)
        self.state = state
        return 0

    def _move_aside(self, path: Path, reason: str) -> None:
        """Rename an unusable checkpoint."""
        names = (path.with_name(f"{path.name}.other{number or ''}") for number in itertools.count())
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
        n = self.state.counts[kind]
        if kind not in (ACCEPTED, "first") and 10 ** round(math.log10(n)) == n:
            times = f"{n} {'time' if n == 1 else 'times'} so far"
            reason = (
                f"a sample {REJECTED[kind]} is rejected"
                if kind in REJECTED
                else f"the estimator restarts after {RESTARTS[kind]}"
            )
            self.on_message(f"{reason} ({times}).")
        change = self.state.alarm.last
        if change and self.state.alarm.changes > before.alarm.changes:
            self.on_message(
                f"the vehicle has changed at about {change.since:.0f} s, "
                f"detected on {', '.join(change.axes)} at {change.time:.0f} s."
            )
        now, previous = self.state.validator.time, before.validator.time
        if kind not in RESTARTS and now // self.output_interval != previous // self.output_interval:
            self.emit_estimate()


def _is_of_log(state: LiveState, log: Log) -> bool:
    """Return whether a log has the last accepted sample of a state among its processed ones."""
    free, last = state.rls.adaptation.equations.vehicle.free, state.validator
    if state.n_rows > log.n or not last.motion:
        return False
    (rows,) = np.nonzero(log.time[: state.n_rows] == last.time)
    return bool((log.velocity[rows][:, free] == np.array(last.motion[:6])[free]).all(axis=1).any())


def _describe(error: Exception) -> str:
    is_known = isinstance(error, HydrodampError)
    return str(error) if is_known else f"{type(error).__name__}: {error}"
