"""``hydrodamp live``: recursive identification from a stream of samples."""

from __future__ import annotations

import io
import json
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import hydrodamp as hd
from hydrodamp.cli.inputs import find_model
from hydrodamp.cli.output import WORK_FAILED, fail, note
from hydrodamp.errors import demand
from hydrodamp.results import check_new_file

if TYPE_CHECKING:
    from hydrodamp.live.runner import LiveRun


def live(
    vehicle: str = "",
    model: str = "",
    source: str = "",
    method: Literal["ai-composite", "rls", "ai"] = "ai-composite",
    mapping: str | None = None,
    real_time: bool = False,
    checkpoint: Path | None = None,
    checkpoint_interval: float = 10.0,
    output_interval: float = 1.0,
    foxglove: int | None = None,
    allow_remote: bool = False,
) -> None:
    """Identify recursively from live samples; print JSON lines, or a table on a terminal."""
    from hydrodamp.cli.live_table import live_table
    from hydrodamp.live.display import LAYOUT, Display
    from hydrodamp.live.readers import SourceError
    from hydrodamp.live.runner import LiveRun
    from hydrodamp.live.sources import open_source

    demand(output_interval > 0.0, "--output-interval", "positive", f"{output_interval:g}")
    interval = f"{checkpoint_interval:g}"
    demand(checkpoint_interval >= 0.0, "--checkpoint-interval", "zero or positive", interval)
    check_new_file(checkpoint, force=True)
    craft, (damping_model,) = hd.find_vehicle(vehicle), find_model(model).with_terms()
    with ExitStack() as ends:
        display = None
        if foxglove is not None:
            display = Display(foxglove)
            ends.callback(display.close)
            note(f"Foxglove server at {display.address}; layout file {LAYOUT}")

        def emit_line(line: dict[str, Any]) -> None:
            write(line)
            if display is not None:
                display.show_estimate(line)

        def report(message: str) -> None:
            note(message)
            if display is not None:
                display.show_message(message)

        samples = open_source(
            source, mapping, allow_remote=allow_remote, real_time=real_time, on_message=report
        )
        ends.callback(samples.close)
        intervals = output_interval, checkpoint, checkpoint_interval
        run = LiveRun(craft, damping_model, method, emit_line, report, *intervals)
        run.log, run.source_counts, run.skip_to = samples.log, samples.counts, samples.skip_to
        is_terminal = sys.stdout.isatty()
        write = ends.enter_context(live_table()) if is_terminal else Printer().write
        ends.enter_context(_stopped_by_signals(run))
        try:
            run.process_rows(samples.rows)
        except SourceError as error:
            fail(f"{source}: {error}", WORK_FAILED)


class Printer:
    """Writes JSON lines to standard output without buffering.

    A write error, such as a full disk, is reported once and the run continues. A closed pipe ends
    the run like a signal.
    """

    has_failed = False  # an error was reported
    is_torn = False  # half a line was written

    def write(self, line: dict[str, Any]) -> None:
        """Write a line."""
        text = json.dumps(line, allow_nan=False) + "\n"
        try:
            self._write(text.encode())
        except OSError as error:
            if isinstance(error, BrokenPipeError):
                signal.raise_signal(signal.SIGTERM)
                message = "standard output was closed: the run ends."
            else:
                message = f"lines cannot be written: {error.strerror}; the run continues."
            if not self.has_failed:
                note(message)
            self.has_failed = True

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
