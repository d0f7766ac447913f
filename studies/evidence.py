"""Make the tables of ``docs/evidence``: ``python studies/evidence.py --out FOLDER [--budget 80]``.

Studies run one a core, each in a process, those that take times alone after the others. Finished
rows stand in FOLDER: a run that its budget ends continues with the next call. A page whose studies
have all finished gets its provenance: commit, date, machine, and the digest of the sources that its
numbers depend on, which are the syntax trees of modules without docstrings, C code and tables.
"""

from __future__ import annotations

import ast
import hashlib
import os
import platform
import shlex
import subprocess
import sys
import time
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from datetime import date
from pathlib import Path
from typing import Annotated, NamedTuple

import typer

import hydrodamp
from tables import replace_table

ROOT = Path(__file__).parents[1]
PAGES = ROOT / "docs/evidence"
MARKS = "<!-- provenance -->", "<!-- end of provenance -->"

ESTIMATOR = "basis", "conditioning", "data", "identification", "kernels", "models", "simulation"
"""Packages that decide an estimate."""

FURTHER = {
    "constants": ["validation"],
    "export-fidelity": ["export"],
    "measured-logs": ["beluga"],
}
"""Packages that decide the numbers of a page, too."""

SUFFIXES = {".py", ".c", ".h", ".toml", ".yaml"}


class Study(NamedTuple):
    """A script with its arguments, the page of its tables, and whether it takes times."""

    page: str
    arguments: str
    takes_times: bool = False


SAMPLE = (
    "sname/80s/coloured-pushed,sname/60s/3x,sname2022/80s/coloured-pushed,sname2022/60s/0.3x,"
    "crossflow/60s/3x,drifting/60s/2x,lag-0.12s/110s/5Hz,remus/60s/0.3x,remus-theory/60s/2x,"
    "rov/60s/0.3x,heavy-rov/80s/20Hz/tether,tanker/100s/3x/accelerations"
)
"""Short campaigns, at least one of each simulated vehicle."""

STUDIES = (
    Study("constants", "constants.py --out {out} --data {data} --page {page}"),
    Study("interval-coverage", "coverage.py --out {out} --data {data} --page {page} --draws 6"),
    Study("benchmark", "benchmark.py --out {out} --jobs 1 --page {page} --campaigns " + SAMPLE),
    Study("measured-logs", "benchmark_measured.py --out {out} --data {data} --page {page}"),
    Study("adequacy", "adequacy.py --out {out} --page {page} --draws 2"),
    Study("consistency", "consistency.py --out {out} --page {page}"),
    Study("predicted-error", "predicted_error.py --out {out} --page {page} --draws 6"),
    Study("interval-coverage", "guesses.py --out {out} --page {page} --draws 10"),
    Study("sensors", "sensors.py --out {out} --data {data} --page {page} --draws 4"),
    Study("cross-check", "cross_check.py --out {out} --data {data} --page {page}"),
    Study("command-response", "command_response.py --page {page}"),
    Study("paper-reenacted", "paper.py --page {page}"),
    Study("export-fidelity", "exports.py --page {page}"),
    Study(
        "performance", "-m pytest {root}/benchmarks -o python_files=bench_*.py --page {page}", True
    ),
)


def source_digest(page: str) -> str:
    """Return the digest of the sources that the numbers of a page depend on."""
    packages = (*ESTIMATOR, "vehicle", *FURTHER.get(page, []))
    root = Path(hydrodamp.__file__).parent
    files = (path for name in packages for path in (root / name).rglob("*"))
    digest = hashlib.sha256()
    for path in sorted(each for each in files if each.suffix in SUFFIXES):
        digest.update(path.relative_to(root).as_posix().encode())
        digest.update(_content(path))
    return digest.hexdigest()[:12]


def _content(path: Path) -> bytes:
    """Return a file, a module as its syntax tree without docstrings."""
    if path.suffix != ".py":
        return path.read_bytes()
    tree = ast.parse(path.read_text("utf-8"))
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            body[:] = [each for each in body if not _is_text(each)]
    return ast.dump(tree).encode()


def _is_text(node: ast.AST) -> bool:
    return (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    )


def provenance(page: str) -> str:
    """Return the sentence on where the numbers of a page come from."""
    call = ["git", "-C", str(ROOT), "rev-parse", "--short", "HEAD"]
    commit = subprocess.run(call, capture_output=True, text=True, check=True).stdout.strip()
    return (
        f"Tables of commit `{commit}`, {date.today().isoformat()}, {os.cpu_count()} cores "
        f"({platform.machine()}), Python {platform.python_version()}; sources "
        f"`{source_digest(page)}`."
    )


def run(study: Study, out: Path, data: Path, deadline: float) -> bool:
    """Run a study and return whether it finished before a deadline; its output is in a file."""
    folder = out / f"{STUDIES.index(study):02}-{study.page}"
    folder.mkdir(parents=True, exist_ok=True)
    fields = {"out": folder, "data": data, "page": PAGES / f"{study.page}.md", "root": ROOT}
    arguments = [each.format(**fields) for each in shlex.split(study.arguments)]
    if not arguments[0].startswith("-"):
        arguments[0] = str(ROOT / "studies" / arguments[0])
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "HYDRODAMP_DATA": str(data)}
    start = time.monotonic()
    with (folder / "output.txt").open("w") as output:
        process = subprocess.Popen(
            [sys.executable, *arguments], stdout=output, stderr=output, env=environment
        )
        try:
            code: int | str = process.wait(max(deadline - start, 1.0))
        except subprocess.TimeoutExpired:
            process.terminate()
            code = f"out of time after {process.wait()}"
    typer.echo(f"{study.arguments}: {(time.monotonic() - start) / 60.0:.1f} min, status {code}")
    return code == 0


def stamp(pages: Iterable[str]) -> None:
    """Write the provenance of pages."""
    for page in pages:
        replace_table(PAGES / f"{page}.md", MARKS, provenance(page))


def main(
    out: Annotated[Path, typer.Option(help="Folder of finished rows and outputs.")],
    budget: Annotated[float, typer.Option(help="Time for all studies [min].")] = 80.0,
    data: Annotated[Path, typer.Option(help="Folder of measured logs.")] = ROOT.parent / "data",
    pages: Annotated[str, typer.Option(help="Names of pages, with commas; all by default.")] = "",
) -> None:
    """Run the studies of the pages, and state the provenance of those that finished."""
    deadline = time.monotonic() + 60.0 * budget
    chosen = [each for each in STUDIES if not pages or each.page in pages.split(",")]
    alone = [each for each in chosen if each.takes_times]
    shared = [each for each in chosen if not each.takes_times]
    with ThreadPoolExecutor(os.cpu_count()) as executor:
        done = [*executor.map(lambda each: run(each, out, data, deadline), shared)]
    done += [run(each, out, data, deadline) for each in alone]
    finished = dict(zip((*shared, *alone), done, strict=True))
    complete = {each.page for each in finished} - {
        key.page for key in finished if not finished[key]
    }
    stamp(sorted(complete))
    if missing := sorted({each.page for each in chosen} - complete):
        typer.echo(f"not finished: {', '.join(missing)}; call again", err=True)
        raise typer.Exit(1)


if __name__ == "__main__":
    typer.run(main)
