"""Screen 4: training and test data on the time of the log, with the excitation of both."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from starlette.requests import Request
from starlette.responses import Response

from hydrodamp.app.project import Arguments, Project
from hydrodamp.app.recordings import read_log, read_vehicle
from hydrodamp.app.web import Form, field_value, project_of, render_screen
from hydrodamp.basis.term import AXES, VELOCITIES, VELOCITY_OF
from hydrodamp.data.concatenation import concatenate
from hydrodamp.data.intervals import find_overlap, select_data
from hydrodamp.data.log import Log
from hydrodamp.errors import HydrodampError, ProblemError
from hydrodamp.identification.dissipativity import velocity_unit
from hydrodamp.report.provenance import horizontal_track
from hydrodamp.validation.excitation import compare_logs, describe_overlap, propose_split

#: Velocities of a panel.
PANELS = ("uvw", "pqr")


def show_split(request: Request, form: Form) -> Response:
    """Return the screen; without a split it has the default, which the page saves."""
    project = project_of(request)
    log, arguments = read_log(project), project.arguments
    is_new = not arguments.train and not arguments.test
    if is_new:
        vehicle, _ = read_vehicle(project)
        train, test = propose_split(log, AXES if vehicle is None else vehicle.axes)
        arguments = arguments.model_copy(update={"train": train, "test": test})
    variables = _variables(project, arguments, log)
    names = [[name for name in log.velocity_names if name in group] for group in PANELS]
    names += [[*log.command_names[k : k + 4]] for k in range(0, len(log.command_names), 4)]
    panels = [*filter(None, names), *([[]] if horizontal_track(log) else [])]
    units = {name: velocity_unit(name) for name in log.velocity_names}
    return render_screen(
        request, project, "split", is_new=is_new, panels=panels, units=units, **variables
    )


def _variables(project: Project, arguments: Arguments, log: Log) -> dict[str, Any]:
    vehicle, _ = read_vehicle(project)
    axes = AXES if vehicle is None else vehicle.axes
    rows: list[tuple[str, ...]] = []
    sentences: tuple[str, ...] = ()
    fault = ""
    try:
        if not arguments.train or not arguments.test:
            raise ProblemError("training and test data need at least one interval each")
        train, test = (
            concatenate(select_data(log, text) for text in each)
            for each in (arguments.train, arguments.test)
        )
        sentences = (*_describe_overlap(log, arguments), *compare_logs(train, test, axes).sentences)
        sentences += tuple(_constant_commands(project, train))
        rows = [_excitation(VELOCITY_OF[axis], train, test) for axis in axes]
    except HydrodampError as error:
        fault = str(error)
    starts = [
        (segment.name, float(log.elapsed[segment.start]), float(log.elapsed[segment.stop - 1]))
        for segment in log.segments
    ]
    return {
        "segments": starts,
        "train": arguments.train,
        "test": arguments.test,
        "rows": rows,
        "sentences": sentences,
        "fault": fault,
    }


def _describe_overlap(log: Log, arguments: Arguments) -> Iterator[str]:
    if overlap := find_overlap(log, arguments.train, arguments.test):
        yield describe_overlap(overlap)


def _constant_commands(project: Project, train: Log) -> Iterator[str]:
    """Yield which commands with a gain never change in the training data."""
    gains = {name for names in project.arguments.gains.values() for name in names.split()}
    varying = np.ptp(train.commands, axis=0) > 0.0
    pairs = zip(train.command_names, varying, strict=True)
    constant = [name for name, varies in pairs if name in gains and not varies]
    if constant:
        yield (
            f"{' '.join(constant)} never change in the training data: their gains cannot be "
            "identified. Train on other data, or remove the gains (screen Vehicle)."
        )


def _excitation(name: str, train: Log, test: Log) -> tuple[str, ...]:
    """Return velocity, unit, and mean ± standard deviation in training and in test data."""
    index = VELOCITIES.index(name)
    texts = [
        f"{np.mean(each.velocity[:, index]):.2g} ± {np.std(each.velocity[:, index]):.2g}"
        for each in (train, test)
    ]
    return name, velocity_unit(name), *texts


def change_split(request: Request, form: Form) -> Response:
    """Set the intervals of training and test data."""
    project = project_of(request)
    log = read_log(project)
    spans = {
        side: tuple(
            dict.fromkeys(filter(None, map(str.strip, field_value(form, side).splitlines())))
        )
        for side in ("train", "test")
    }
    for each in (*spans["train"], *spans["test"]):
        select_data(log, each)  # raises the fault of an interval before anything is written
    project.update(field_value(form, "version"), train=spans["train"], test=spans["test"])
    return render_screen(
        request,
        project,
        "split",
        "split_change.html.j2",
        **_variables(project, project.arguments, log),
    )
