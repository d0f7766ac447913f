"""``hydrodamp live``: the identifier on board, from samples to estimates."""

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

import typer

import hydrodamp as hd
from hydrodamp.cli import options, resolve
from hydrodamp.cli.output import WORK_FAILED, fail, note
from hydrodamp.errors import ProblemError

if TYPE_CHECKING:
    from hydrodamp.live.runner import LiveRun

Said = TypeVar("Said")

_MODEL = "A model by name, a YAML file of one, or FILE:NAME. [required]"
_SOURCE = (
    "`stdin` (JSON lines or a table), udp://HOST:PORT (JSON), mavlink://HOST:PORT, `ros2`, or a"
    " log. [required]"
)
_STATE = "Keep the state here, and go on with what is there."
_INTERVAL = "Write the state each so many seconds; at the end anyway."
_EVERY = "Print a line each so many seconds of samples."
_FOXGLOVE = "Show it to Foxglove at this port of the machine; 0 takes a free one."
_ALLOW = "Let an address be bound that other machines reach."


def live(
    vehicle: options.VehicleName = "",
    model: Annotated[str, typer.Option(metavar="M", help=_MODEL, show_default=False)] = "",
    source: Annotated[str, typer.Option(metavar="S", help=_SOURCE, show_default=False)] = "",
    method: Annotated[
        str, typer.Option(metavar="KEY", help="How: rls, or ai with the paper's gains.")
    ] = "rls",
    mapping: options.MappingFile = None,
    state: Annotated[Path | None, typer.Option(metavar="FILE", help=_STATE)] = None,
    state_every: Annotated[float, typer.Option(metavar="S", help=_INTERVAL)] = 10.0,
    every: Annotated[float, typer.Option(metavar="S", help=_EVERY)] = 1.0,
    paced: Annotated[bool, typer.Option("--paced", help="Read a log at its own pace.")] = False,
    foxglove: Annotated[int | None, typer.Option(metavar="PORT", help=_FOXGLOVE)] = None,
    allow: Annotated[bool, typer.Option("--allow", help=_ALLOW)] = False,
) -> None:
    """Identify on board, sample by sample: JSON lines of estimates on standard output."""
    from hydrodamp.files import check_file
    from hydrodamp.live.bounded_queue import SourceError
    from hydrodamp.live.display import LAYOUT, Display
    from hydrodamp.live.estimator import METHODS
    from hydrodamp.live.runner import LiveRun
    from hydrodamp.live.sources import open_source

    if not source:
        raise ProblemError(f"`--source` is missing. It is {_SOURCE.removesuffix(' [required]')}")
    if not every > 0.0:
        raise ProblemError(f"`--every` must be positive; got {every:g}.")
    if not state_every >= 0.0:
        raise ProblemError(f"`--state-every` must be zero or more seconds; got {state_every:g}.")
    if method not in METHODS:
        raise hd.MethodError(f"`--method` must be one of {', '.join(METHODS)}; got '{method}'.")
    if state is not None:
        check_file(state)
    craft, named = resolve.choose_vehicle(vehicle), resolve.choose_model(model)
    if not named:
        raise ProblemError("`--model sparse` is selected from a whole log, so not on board.")
    with ExitStack() as ends:
        printer = Printer()
        tell: Callable[[dict[str, Any]], None] = printer
        say: Callable[[str], None] = note
        if foxglove is not None:
            display = Display(foxglove)
            ends.callback(display.close)
            note(f"Foxglove finds it at {display.address}; its layout is {LAYOUT}")
            tell, say = _both(printer, display.show_estimate), _both(note, display.show_message)
        samples = open_source(source, mapping, allow_remote=allow, real_time=paced, on_message=say)
        ends.callback(samples.close)
        run = LiveRun(craft, named[0], method, tell, say, every, state, state_every)
        run.log, run.source_counts, run.skip_to = samples.log, samples.counts, samples.skip_to
        printer.run = run
        ends.enter_context(_stopped_by_signals(run))
        try:
            run.process_rows(samples.rows)
        except SourceError as error:
            fail(f"{source}: {error}", WORK_FAILED)


def _both(one: Callable[[Said], None], other: Callable[[Said], None]) -> Callable[[Said], None]:
    def say(what: Said) -> None:
        one(what)
        other(what)

    return say


class Printer:
    """Writes lines of JSON on standard output, each whole and at once.

    A full disk is reported once and ends nothing. A closed pipe ends the run like a signal:
    whoever read the lines wants no more of them.
    """

    run: LiveRun | None = None
    has_failed = False  # and said so
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
            note("whoever read standard output is gone, so the run ends.")
            if self.run is not None:
                self.run.is_stopped = True
        except OSError as error:
            if not self.has_failed:
                self.has_failed = True
                note(f"lines cannot be written: {error.strerror}; the run goes on.")

    def _write(self, data: bytes) -> None:
        """Write past Python's buffer, which would keep what it cannot write."""
        try:
            descriptor = sys.stdout.fileno()
        except io.UnsupportedOperation:
            sys.stdout.write(data.decode())
            return
        rest = b"\n" * self.is_torn + data
        while rest:
            done = os.write(descriptor, rest)
            rest = rest[done:]
            self.is_torn = bool(rest)


@contextmanager
def _stopped_by_signals(run: LiveRun) -> Iterator[None]:
    """End a run after the sample under way at a signal, its state kept."""

    def stop(*_: object) -> None:
        run.is_stopped = True

    names = ("SIGINT", "SIGTERM", "SIGHUP")
    there = [getattr(signal, name) for name in names if hasattr(signal, name)]
    before = {one: signal.signal(one, stop) for one in there}
    try:
        yield
    finally:
        for one, handler in before.items():
            signal.signal(one, handler)
