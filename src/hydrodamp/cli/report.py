"""``hydrodamp report``: the report of a folder of results, without fitting again."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hydrodamp.cli.output import note, warned

if TYPE_CHECKING:
    from hydrodamp.data.log import Log
    from hydrodamp.identification.fit import Fit
    from hydrodamp.report.files import Findings
    from hydrodamp.validation.compare import Comparison
    from hydrodamp.vehicle.vehicle import Vehicle


def report(
    folder: Annotated[
        str, typer.Argument(metavar="DIR", help="A folder that compare or demo wrote with --out.")
    ],
    out: Annotated[
        str | None,
        typer.Option("--out", metavar="FILE", help="The file to write. [default: DIR/report.html]"),
    ] = None,
) -> None:
    """Make the report of a folder of results again, without fitting again."""
    from hydrodamp.cli.targets import check_out_file
    from hydrodamp.errors import FileError
    from hydrodamp.report.files import REPORT

    home = Path(folder)
    if not (home / "comparison.json").is_file():
        raise FileError(
            f"{folder}: is no folder of results, for there is no comparison.json in it; name one "
            "that `compare` or `demo` wrote with `--out`."
        )
    target = home / REPORT if out is None else Path(out)
    inputs = (path for path in home.rglob("*") if path != home / REPORT)
    check_out_file(str(target), map(str, inputs))
    if offer(folder, target):
        note(f"written to {target}")


def offer(
    results: Comparison | str,
    path: Path,
    findings: Findings | None = None,
    then: str = "run the command again",
) -> bool:
    """Write a report, or say how to get it where what it needs is not installed."""
    from hydrodamp.report.page import MISSING, installed, write_report

    if not installed():
        note(f"{MISSING}, then {then}.")
        return False
    write_report(results, path, findings)
    return True


def illustrate(comparison: Comparison, vehicle: Vehicle, train: Log, home: Path) -> tuple[str, ...]:
    """Write grades, pictures and the report of a comparison into its folder."""
    from hydrodamp.report.files import BAND, FIGURES, GRADES, REPORT, write_findings

    findings = look_closer(comparison, vehicle, train)
    write_findings(findings, home)
    again = f"`{shlex.join(('hydrodamp', 'report', str(home)))}` makes it"
    there = {
        GRADES: findings.identifiability is not None,
        BAND: findings.band is not None,
        FIGURES: bool(findings.pictures),
        REPORT: offer(comparison, home / REPORT, findings, again),
    }
    return tuple(name for name, written in there.items() if written)


def look_closer(comparison: Comparison, vehicle: Vehicle, train: Log) -> Findings:
    """Grade and draw the chosen row, with a bar; say how to get pictures where there are none."""
    from hydrodamp.report.examine import MISSING, drawable, examine

    if not drawable():
        note(MISSING)
    return examine(comparison, vehicle, train)


@dataclass(frozen=True)
class Beside:
    """A damping file, and the pictures and the report that lie beside it, named after it."""

    damping: Path

    @property
    def stem(self) -> str:
        """The path of the damping file without its suffix."""
        path = str(self.damping)
        return path[: -len(".json")] if path.lower().endswith(".json") else path

    @property
    def figures(self) -> Path:
        """Folder of the pictures."""
        return Path(f"{self.stem}.figures")

    @property
    def page(self) -> Path:
        """The report."""
        return Path(f"{self.stem}.report.html")

    def check(self, inputs: Iterable[str | None]) -> None:
        """Refuse targets that cannot be written or would replace an input."""
        from hydrodamp.cli.targets import check_out_file
        from hydrodamp.files import check_folder

        read = tuple(inputs)
        check_out_file(str(self.damping), read)
        check_out_file(str(self.page), read)
        check_folder(self.figures)

    def remove_earlier(self) -> None:
        """Remove the report and the pictures of an earlier fit."""
        from hydrodamp.report.files import earlier_pictures

        for path in (self.page, *earlier_pictures(self.figures)):
            path.unlink(missing_ok=True)

    def illustrate(
        self,
        fit: Fit,
        words: tuple[str, ...],
        vehicle: Vehicle,
        log: Log,
        said: Mapping[str, str],
    ) -> None:
        """Write report and pictures of the fit."""
        from hydrodamp.report.files import write_pictures
        from hydrodamp.validation.compare import compare

        told = replace(fit, remarks=(*fit.remarks, *words))
        alone = compare((told,), vehicle, log)
        origin = {**alone.provenance, "overlap": f"all {log.n} samples", **said}
        alone = replace(alone, provenance=origin)
        findings = look_closer(alone, vehicle, log)
        if lines := warned():
            alone = replace(alone, provenance={**origin, "warnings": "\n".join(lines)})
        if findings.pictures:
            write_pictures(findings, self.figures)
            note(f"written to {self.figures}")
        if offer(alone, self.page, findings):
            note(f"written to {self.page}")
