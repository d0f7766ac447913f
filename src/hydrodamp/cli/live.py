"""``hydrodamp live``: recursive identification from a stream of samples."""

from __future__ import annotations

import io
import json
import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import hydrodamp as hd
from hydrodamp.cli import options, resolve
from hydrodamp.cli.output import WORK_FAILED, fail, note
from hydrodamp.errors import ProblemError

if TYPE_CHECKING:
    from hydrodamp.live.runner import LiveRun

Message = TypeVar("Message")


def live(
    vehicle: options.VehicleName = "",
    model: Annotated[str, options.option("live-model")] = "",
    source: Annotated[str, options.option("live-source")] = "",
    method: Annotated[str, options.option("live-method")] = "rls",
    mapping: options.MappingFile = None,
    real_time: Annotated[bool, options.option("live-real-time")] = False,
    checkpoint: Annotated[Path | None, options.option("live-checkpoint")] = None,
    checkpoint_interval: Annotated[float, options.option("live-checkpoint-interval")] = 10.0,
    output_interval: Annotated[float, options.option("live-output-interval")] = 1.0,
    foxglove: Annotated[int | None, options.option("live-foxglove")] = None,
    allow_remote: Annotated[bool, options.option("live-allow-remote")] = False,
) -> None:
    """Identify recursively from live samples; print estimates as JSON lines."""
    from hydrodamp.files import check_file
    from hydrodamp.live.display import LAYOUT, Display
    from hydrodamp.live.estimator import METHODS
    from hydrodamp.live.readers import SourceError
    from hydrodamp.live.runner import LiveRun
    from hydrodamp.live.sources import open_source

    if not source:
        raise ProblemError("`--source` is missing: see `hydrodamp live --help`.")
    if not output_interval > 0.0:
        raise ProblemError(f"`--output-interval` must be positive; got {output_interval:g}.")
    if not checkpoint_interval >= 0.0:
        raise ProblemError(
            f"`--checkpoint-interval` must not be negative; got {checkpoint_interval:g}."
        )
    if method not in METHODS:
        raise hd.MethodError(f"`--method` must be one of {', '.join(METHODS)}; got '{method}'.")
    if checkpoint is not None:
        check_file(checkpoint)
    vehicle_model, models = resolve.find_vehicle(vehicle), resolve.find_model(model).models
    if not models:
        raise ProblemError("`--model sparse` needs a whole log: give a model with terms.")
    with ExitStack() as ends:
        printer = Printer()
        emit_line: Callable[[dict[str, Any]], None] = printer
        report: Callable[[str], None] = note
        if foxglove is not None:
            display = Display(foxglove)
            ends.callback(display.close)
            note(f"Foxglove server at {display.address}; layout file {LAYOUT}")
            emit_line, report = (
                _both(printer, display.show_estimate),
                _both(note, display.show_message),
            )
        samples = open_source(
            source, mapping, allow_remote=allow_remote, real_time=real_time, on_message=report
        )
        ends.callback(samples.close)
        intervals = output_interval, checkpoint, checkpoint_interval
        run = LiveRun(vehicle_model, models[0], method, emit_line, report, *intervals)
        run.log, run.source_counts, run.skip_to = samples.log, samples.counts, samples.skip_to
        printer.run = run
        ends.enter_context(_stopped_by_signals(run))
        try:
            run.process_rows(samples.rows)
        except SourceError as error:
            fail(f"{source}: {error}", WORK_FAILED)


def _both(
    first: Callable[[Message], None], second: Callable[[Message], None]
) -> Callable[[Message], None]:
    def call_both(message: Message) -> None:
        first(message)
        second(message)

    return call_both


class Printer:
    """Writes JSON lines to standard output without buffering.

    A write error, such as a full disk, is reported once and the run continues. A closed pipe ends
    the run like a signal.
    """

    run: LiveRun | None = None
    has_failed = False  # a write error was reported
    is_closed = False
    is_torn = False  # half a line was written

    def __call__(self, line: dict[str, Any]) -> None:
        """Write a line."""
        if self.is_closed:
            return
        text = json.dumps(line, allow_nan=False) + "\n"
        try:
            self._write(text.encode())
        except BrokenPipeError:
            self.is_closed = True
            note("standard output was closed: the run ends.")
            if self.run is not None:
                self.run.is_stopped = True
        except OSError as error:
            if not self.has_failed:
                self.has_failed = True
                note(f"lines cannot be written: {error.strerror}; the run continues.")

    def _write(self, data: bytes) -> None:
        """Write without Python's buffer, which keeps data after a write error."""
        try:
            descriptor = sys.stdout.fileno()
        except io.UnsupportedOperation:
            sys.stdout.write(data.decode())
            return
        remaining = b"\n" * self.is_torn + data
        while remaining:
            n_written = os.write(descriptor, remaining)
            remaining = remaining[n_written:]
            self.is_torn = bool(remaining)


@contextmanager
def _stopped_by_signals(run: LiveRun) -> Iterator[None]:
    """End a run after the present sample at a signal, with a last checkpoint."""

    def stop(*_: object) -> None:
        run.is_stopped = True

    names = ("SIGINT", "SIGTERM", "SIGHUP")
    signals = [getattr(signal, name) for name in names if hasattr(signal, name)]
    before = {number: signal.signal(number, stop) for number in signals}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
