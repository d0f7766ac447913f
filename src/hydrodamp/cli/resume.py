"""Going on where an interrupted run stopped: the fits of a folder, if they are of this run."""

from __future__ import annotations

import shlex
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from hydrodamp.cli.experiment import Key, key_of
from hydrodamp.errors import FileError, ProblemError

if TYPE_CHECKING:
    from hydrodamp.cli.run import Task
    from hydrodamp.identification.fit import Fit
    from hydrodamp.report.unfinished import Earlier

OPTIONS = "options"
"""Key in the provenance for what was asked for, a line an option."""

_AFRESH = "Leave out `--resume` to start afresh; that replaces what is in the folder."


def options_in_words(asked: Mapping[str, str | Iterable[str] | None]) -> str:
    """Return what was asked for, so that another run can be compared with it."""
    return "\n".join(
        f"{name} {shlex.quote(value)}"
        for name, given in asked.items()
        for value in ((given,) if isinstance(given, str) else given or ())
    )


def command_to_resume(command: Iterable[str] | None = None) -> str:
    """Return the command line that goes on where this one stopped."""
    words = list(sys.argv[1:] if command is None else command)
    options = words[: words.index("--")] if "--" in words else words
    if "--resume" not in options:  # behind a `--` it would be the name of a log
        words.insert(1, "--resume")
    return _in_shell(["hydrodamp", *words])


def _in_shell(words: list[str]) -> str:
    """Return words as the shell of this system wants them; that of Windows knows no ' quotes."""
    return subprocess.list2cmdline(words) if sys.platform == "win32" else shlex.join(words)


def check_resume(out: str | None, said: Mapping[str, str]) -> Earlier:
    """Refuse to go on with what is not there, or was made from something else."""
    if out is None:
        raise ProblemError(
            "`--resume` goes on with what an interrupted run left in a folder: name it with "
            "`--out DIR`."
        )
    if not (Path(out) / "comparison.json").is_file():
        raise ProblemError(
            f"`--resume`: {out} holds no comparison.json, so there is nothing to go on with. "
            "Leave out `--resume`, or name the folder of the interrupted run with `--out`."
        )
    earlier = _earlier(out)
    faults = differences(earlier, said)
    if faults:
        raise ProblemError(
            "\n".join((f"`--resume`: what is in {out} is of another run:", *faults, _AFRESH))
        )
    return earlier


def _earlier(out: str) -> Earlier:
    from hydrodamp.report.unfinished import read_earlier

    try:
        return read_earlier(out)
    except FileError as error:
        raise FileError(f"{error} {_AFRESH}") from error


def differences(earlier: Earlier, said: Mapping[str, str]) -> tuple[str, ...]:
    """Return in what a folder of results is of another run."""
    return tuple(_differences(earlier.provenance, {**said, "hydrodamp": _version()}))


def go_on(earlier: Earlier, task: Task, said: Mapping[str, str]) -> tuple[Task, dict[str, str]]:
    """Return a task with the fits that an earlier run has made."""
    fits = earlier_fits(earlier, task)
    warned = earlier.provenance.get("warnings", "")
    words = {"resumed": f"{len(fits)} of {len(task.keys)} fits are of an earlier run"}
    return (
        replace(task, earlier=fits),
        {**said, **words, **({"warnings": warned} if warned else {})},
    )


def earlier_fits(earlier: Earlier, task: Task) -> dict[Key, Fit]:
    """Return the fits of a folder."""
    out = earlier.folder
    fits = {key_of(fit): fit for fit in earlier.fits()}
    models = {model.key: model.restricted_to(task.vehicle.axes) for model in task.models}
    methods = {method.key: repr(method) for method in task.methods}
    for (model, method), fit in fits.items():
        settings = fit.provenance.get("settings")
        if model not in models or fit.model.terms != models[model].terms:
            raise ProblemError(f"`--resume`: the model '{model}' in {out} is another. {_AFRESH}")
        if method not in methods or settings not in (None, methods[method]):
            raise ProblemError(f"`--resume`: the method '{method}' in {out} is another. {_AFRESH}")
    return fits


def _version() -> str:
    import hydrodamp

    return hydrodamp.__version__


def _differences(then: Mapping[str, str], now: Mapping[str, str]) -> Iterator[str]:
    """Return what differs, a sentence each."""
    if OPTIONS not in then:
        yield "it does not say with what options."
        return
    yield from _differing_options(then[OPTIONS], now.get(OPTIONS, ""))
    yield from _differing_files(then.get("files", ""), now.get("files", ""))
    for key, what in (("hydrodamp", "hydrodamp"), ("versions", "the environment")):
        if then.get(key) != now.get(key):
            yield f"{what} was {then.get(key) or 'unknown'} and is {now.get(key)}."


def _differing_options(then: str, now: str) -> Iterator[str]:
    before, after = _values(then), _values(now)
    for name in dict.fromkeys((*before, *after)):
        was, is_now = before.get(name, "not given"), after.get(name, "not given")
        if was != is_now:
            yield f"{name} was {was} and is {is_now}."


def _values(lines: str) -> dict[str, str]:
    """Return the values of each option, side by side."""
    found: dict[str, str] = {}
    for name, _, value in (line.partition(" ") for line in lines.splitlines()):
        found[name] = f"{found[name]} {value}" if name in found else value
    return found


def _differing_files(then: str, now: str) -> Iterator[str]:
    before, after = _digests(then), _digests(now)
    for path in dict.fromkeys((*before, *after)):
        if path not in after:
            yield f"the file {path} was read, and is not now."
        elif path not in before:
            yield f"the file {path} is read, and was not."
        elif before[path] != after[path]:
            yield f"the file {path} has changed: its SHA-256 is another."


def _digests(lines: str) -> dict[str, str]:
    found = (line.partition("  ") for line in lines.split("\n") if line)
    return {path: digest for digest, _, path in found}
