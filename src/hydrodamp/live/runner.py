"""A live run: rows are taken, lines told, the state kept; no row ends it."""

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
from hydrodamp.live.estimator import LiveState, count_rejected, estimate_line, start, update
from hydrodamp.live.sample_validation import BEGIN, LEFT_OUT
from hydrodamp.live.samples import Row
from hydrodamp.models.model import DampingModel
from hydrodamp.vehicle.vehicle import Vehicle


@dataclass
class LiveRun:
    """What is run, and where it stands."""

    vehicle: Vehicle
    model: DampingModel
    method: str
    on_estimate: Callable[[dict[str, Any]], None]  # a line of estimates
    on_message: Callable[[str], None]  # a sentence
    output_interval: float = 1.0  # s of samples from line to line
    checkpoint_path: Path | None = None  # of the state
    checkpoint_interval: float = 10.0  # s, between two writings of it
    log: Log | None = None  # the source, where it is one
    source_counts: Callable[[], dict[str, int]] = lambda: {"dropped": 0}  # what the source counts
    skip_to: Callable[[int], None] = lambda first: None  # tells the source where to go on
    state: LiveState | None = None
    is_stopped: bool = False
    _refused: int = 0  # rows that no run could begin with
    _refusal: str = ""  # why, of the first

    def process_rows(self, rows: Iterable[Row | None]) -> None:
        """Take every row, None for a while without one; the end is told, the state kept.

        Raises ``FileError`` where the state is in use or is none, and what the source raises.
        """
        with locked(self.checkpoint_path), np.errstate(all="ignore"):
            try:
                self._take_all(rows)
            finally:
                self.save_checkpoint()
            if self.state is None and not self.is_stopped:
                raise ProblemError(f"there was no sample to begin with. {self._refusal}".strip())
            self.emit_estimate()

    def _take_all(self, rows: Iterable[Row | None]) -> None:
        kept, index, skip = monotonic(), 0, 0
        for row in rows:
            if self.is_stopped:
                break
            if row is not None:
                if self.state is None:
                    skip = self._try_to_begin(row)
                if self.state is not None and index >= skip:
                    self._take(self.state, row)
                index += 1
            if monotonic() - kept >= self.checkpoint_interval:
                self.save_checkpoint()
                kept = monotonic()

    def _try_to_begin(self, row: Row) -> int:
        """Begin with a row, if it will do; return how many rows the state has seen."""
        try:
            return self._begun(row, self._refused)
        except Exception as error:  # whatever a row holds, the next one may do
            self._refused, self._refusal = self._refused + 1, self._refusal or _text(error)
            if self._refused == 1:
                self.on_message(f"samples are left out until one will do: {self._refusal}")
            return 0

    def emit_estimate(self) -> None:
        """Tell where the estimate stands."""
        if self.state is not None:
            told = estimate_line(self.state)
            told["counts"] = told["counts"] | self.source_counts()
            self.on_estimate(told)

    def save_checkpoint(self) -> None:
        """Write the state; a disk that is full ends nothing."""
        if self.checkpoint_path is not None and self.state is not None:
            try:
                save(self.state, self.checkpoint_path)
            except (FileError, ValueError) as error:
                self.on_message(f"The state is not kept: {error}")

    def _begun(self, row: Row, failed: int) -> int:
        """Begin, or go on with the state that is kept; return how many rows it has seen."""
        fresh = start(self.vehicle, self.model, self.method, row)
        counts = fresh.counts | ({"incomplete": failed} if failed else {})
        self.state = fresh._replace(n_rows=failed, counts=counts)
        if self.checkpoint_path is None or not self.checkpoint_path.exists():
            return 0
        try:
            kept = load(fresh, self.checkpoint_path)
        except FileError as error:
            aside = _free_name(self.checkpoint_path)
            self.on_message(f"{error} It is put aside as {aside.name}, and nothing is known yet.")
            self._put_aside(aside)
            return 0
        self.state = kept
        if self.log is None:
            return 0
        if kept.n_rows <= self.log.n and self.log.time[kept.n_rows - 1] == kept.validator.time:
            self.on_message(
                f"{self.checkpoint_path}: goes on behind sample {kept.n_rows} of the log."
            )
            self.skip_to(kept.n_rows)
            return kept.n_rows
        self.on_message(
            f"{self.checkpoint_path}: is of another log; this one is taken from its first sample."
        )
        self.state = kept._replace(validator=kept.validator._replace(velocity=()), n_rows=0)
        return 0

    def _put_aside(self, aside: Path) -> None:
        if self.checkpoint_path is not None:
            try:
                self.checkpoint_path.replace(aside)
            except OSError as error:
                self.on_message(f"{self.checkpoint_path}: cannot be put aside: {error.strerror}.")
                self.checkpoint_path = None

    def _take(self, before: LiveState, row: Row) -> None:
        try:
            self.state, told = update(before, row)
        except Exception as error:  # whatever a row holds, the next one may do
            self.state, told = count_rejected(before, "failed"), "failed"
            if self.state.counts[told] == 1:
                self.on_message(_text(error))
        if told in LEFT_OUT or told in BEGIN:
            self._say(told, self.state.counts[told])
        change = self.state.alarm.last
        if change and self.state.alarm.changes > before.alarm.changes:
            self.on_message(
                f"the vehicle has changed at about {change.since:.0f} s, "
                f"told by {', '.join(change.axes)} at {change.time:.0f} s."
            )
        now, then = self.state.validator.time, before.validator.time
        if told not in BEGIN and now // self.output_interval != then // self.output_interval:
            self.emit_estimate()

    def _say(self, told: str, count: int) -> None:
        """Say the first of a kind, the tenth, the hundredth and so on."""
        if told == "first" or 10 ** round(math.log10(count)) != count:
            return
        at = f"{count} {'time' if count == 1 else 'times'} so far"
        if told in BEGIN:
            self.on_message(f"a run begins anew after {BEGIN[told]} ({at}).")
        else:
            self.on_message(f"a sample {LEFT_OUT[told]} is left out ({at}).")


def _text(error: Exception) -> str:
    known = isinstance(error, HydrodampError)
    return str(error) if known else f"{type(error).__name__}: {error}"


def _free_name(path: Path) -> Path:
    """Return a name beside a path that no file has yet."""
    names = (f"{path.name}.other{number or ''}" for number in count())
    return next(one for one in map(path.with_name, names) if not one.exists())
