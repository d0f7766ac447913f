"""Checks of screen 2: the quality report of the log, and the issues of each column."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from starlette.requests import Request
from starlette.responses import Response

from hydrodamp.app.channels import displayed_content, list_rows
from hydrodamp.app.recordings import inspect_project, read_files
from hydrodamp.app.web import Form, project_of, render_screen
from hydrodamp.errors import HydrodampError
from hydrodamp.ingest.inspection.probe import Inspection
from hydrodamp.ingest.inspection.quality_report import QualityReport


def show_checks(request: Request, form: Form) -> Response:
    """Return the quality report of the log, and the issues of each column."""
    project = project_of(request)
    fault, inspection = "", None
    try:
        inspection = inspect_project(project)
    except HydrodampError as error:
        fault = str(error)
    report = None if inspection is None else inspection.report
    issues = () if report is None else (*report.issues, *report.options)
    stated = tuple(each.evidence for each in issues)
    remarks = (
        [] if report is None else [each for each in report.remarks if not each.startswith(stated)]
    )
    by_channel = _issues_by_channel(report)
    rows = list_rows(read_files(project), displayed_content(project))
    return render_screen(
        request,
        project,
        "channels",
        "checks.html.j2",
        fault=fault or ("" if inspection is None else inspection.reason),
        report=report,
        issues=issues,
        remarks=remarks,
        light=_light(report),
        rows=[
            (row, [text for name in row.channels for text in by_channel.get(name, [])])
            for row in rows
        ],
        vertical=[]
        if report is None or report.is_planar
        else [*_describe_depth(inspection), report.frame],
    )


def _light(report: QualityReport | None) -> str:
    if report is None or report.missing:
        return "red"
    return "green" if report.is_usable else "amber"


def _issues_by_channel(report: QualityReport | None) -> dict[str, list[str]]:
    channels: dict[str, list[str]] = {}
    for issue in () if report is None else report.issues:
        for name in issue.channel.split():
            channels.setdefault(name, []).append(f"{issue.problem}: {issue.evidence}")
    return channels


def _describe_depth(inspection: Inspection | None) -> Iterator[str]:
    """Yield how far down the log goes by its mapping."""
    log = None if inspection is None else inspection.log
    if log is not None and log.position is not None:
        down = log.position[:, 2] - log.position[0, 2]
        moment = float(log.elapsed[int(np.argmax(np.abs(down)))])
        yield (
            f"By this mapping the vehicle goes from {down.min():+.2g} m to {down.max():+.2g} m "
            f"down from its start, farthest at {moment:.4g} s."
        )
