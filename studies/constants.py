"""Halve and double every constant that decides something, and state what changes.

    python studies/constants.py --out FOLDER --data DATA [--only PATTERN] [--page PAGE]

Constants are the numbers that modules and their classes name. ``constants.toml`` states origins,
and which numbers are not tuned. Each variant identifies a small family of logs, simulated and
measured, in a process of its own. Finished rows stand in ``FOLDER/rows.jsonl``.
"""

from __future__ import annotations

import ast
import json
import math
import os
import pickle
import re
import subprocess
import sys
import tomllib
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatch
from functools import partial
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import typer

import hydrodamp as hd
from benchmark_campaign import Logs
from benchmark_campaigns import SEEN
from benchmark_tables import table
from constant_variants import assignments
from hydrodamp.files import save_text
from measured_splits import measured
from sensors import Mask, make_cases
from tables import finish_jobs, replace_table

MARKS = "<!-- constants -->", "<!-- end of constants -->"

STATED = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))
"""Modules, origins by name, and names without a tuned number by reason."""

FACTORS = 0.5, 2.0
MAX_SECONDS = 300.0
"""Time after which a variant counts as failed [s]."""

FAMILY = "adequate", "crossflow", "tank", "ship"
"""Cases of most constants."""

SPECIAL = {
    "sparse": ("stepwise", "backward_elimination", "general_model"),
    "fixes": ("sensor_outputs", "velocity_smoother"),
    "ship": ("command_*", "parameters", "parameter_estimates", "vehicle_values", "wrench_gains"),
    "fixes ship": ("rebuilt_outputs",),
    "crossflow": (
        "dissipati*", "adaptive", "composite", "recursive", "validation.*", "simulation.*",
    ),
    "crossflow tank": (
        "held_out_replay", "grades", "identifiability", "har_covariance", "weak_form", "fit",
        "regression", "least_squares", "differentiation", "derivatives", "record",
    ),
    "adequate crossflow": ("prediction_error", "score_test", "adequacy"),
}  # fmt: skip
"""Cases that run the code of some modules."""

METHODS = "recommended", "weak", "ls", "ridge", "dissipative", "rls", "ai", "ai-composite"
"""Methods of the case that compares them."""

NEUTRAL = "0", "0.0", "1", "1.0"
"""Defaults of fields that add nothing, or multiply by one."""


class Constant(NamedTuple):
    """A number with a name, its source text, and what the comment beside it says."""

    module: str
    name: str
    value: str
    meaning: str

    @property
    def key(self) -> str:
        """Module and name."""
        return f"{self.module}.{self.name}"


NONE = Constant("", "", "", "")
"""No constant: the package as it is."""


class Row(NamedTuple):
    """Results of a variant: of each case error, log width, decisions and coefficients."""

    constant: str
    factor: float
    failure: str
    results: Sequence[Mapping[str, Any]]


def is_number(node: ast.expr) -> bool:
    """Return whether an expression consists of numbers."""
    match node:
        case ast.Constant(value=int() | float()) if not isinstance(node.value, bool):
            return True
        case ast.Attribute(value=ast.Name(id="np" | "math"), attr="pi"):
            return True
        case ast.UnaryOp(operand=operand):
            return is_number(operand)
        case ast.BinOp(left=left, right=right):
            return is_number(left) and is_number(right)
        case ast.Tuple(elts=parts) | ast.List(elts=parts):
            return bool(parts) and all(map(is_number, parts))
        case ast.Call(func=ast.Attribute(value=ast.Name(id="np" | "math")), args=parts):
            return bool(parts) and all(map(is_number, parts))
        case ast.Call(func=ast.Name(id="float"), args=[part]):
            return is_number(part)
    return False


def read_constants(module: str, text: str) -> Iterator[Constant]:
    """Yield the constants of the source of a module."""
    lines, tree = text.splitlines(), ast.parse(text)
    documented = {
        node.end_lineno: after.value.value
        for node, after in zip(tree.body, tree.body[1:], strict=False)
        if isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
    }
    for name, node, value in assignments(tree):
        if is_number(value) and not ("." in name and ast.unparse(value) in NEUTRAL):
            before = node.lineno - 1
            while lines[before - 1].lstrip().startswith("#"):
                before -= 1
            comment = " ".join(line.lstrip("#: ") for line in lines[before : node.lineno - 1])
            beside = lines[(node.end_lineno or node.lineno) - 1].partition("  # ")[2]
            owner, _, field = name.rpartition(".")
            described = re.compile(rf"\n {{4}}(?:\w+, )*{field}(?:, \w+)* : .*\n +(.+)")
            found = described.search(text, text.index(f"class {owner}")) if owner else None
            parameter = found[1] if found else ""
            meaning = beside or documented.get(node.end_lineno, "") or comment or parameter
            yield Constant(module, name, ast.unparse(value), " ".join(str(meaning).split()))


def find_constants() -> dict[str, Constant]:
    """Return the constants of the modules of the study that are tuned."""
    root, found = Path(hd.__file__).parent, {}
    paths = (path for pattern in STATED["modules"] for path in sorted(root.glob(pattern)))
    for path in paths:
        module = ".".join(path.relative_to(root).with_suffix("").parts)
        for constant in read_constants(module, path.read_text("utf-8")):
            if not not_tuned(constant):
                found[constant.key] = constant
    return found


def not_tuned(constant: Constant) -> str:
    """Return why a constant is no tuned number; empty for one that is."""
    reasons: dict[str, list[str]] = STATED["not_tuned"]
    for reason, names in reasons.items():
        if any(fnmatch(constant.key, f"*.{name}") for name in names):
            return reason
    return ""


def write_cases(folder: Path, data: Path) -> None:
    """Write the logs of all cases."""
    folder.mkdir(parents=True, exist_ok=True)

    def save(name: str, logs: Any, model: Any, *methods: str, **options: Any) -> None:
        train = replace(logs.train, acceleration=None)
        content = logs.vehicle, train, logs.test, model, methods or ("recommended",), options
        (folder / f"{name}.pickle").write_bytes(pickle.dumps(content))

    exact = make_cases(0)
    for name, hull, sensors, method in (
        ("adequate", "sname", "all velocities", "recommended"),
        ("fixes", "rov", "USBL 1 Hz, depth, gyro", "oe"),
    ):
        case, test = exact[hull]
        names = [segment.name for segment in case.log.segments][:2]
        train = dict(Mask(case.log.select(*names), 0).logs())[sensors]
        save(name, Logs(case.vehicle, train, test), case.damping.model, method)
    crossflow = SEEN["crossflow/60s/3x"]()
    save("crossflow", crossflow, hd.catalog["fossen"], *METHODS)
    measured_logs = {each.name: each for each in measured(data)}
    tank, ship = (measured_logs[f"measured/{name}"] for name in ("bluerov2", "kvlcc2-20_05"))
    save("tank", tank.logs, tank.models[0])
    save("sparse", tank.logs, None, "weak")
    names = [segment.name for segment in ship.train.segments][:3]
    part = ship.logs._replace(train=ship.train.select(*names))
    save("ship", part, ship.models[0], estimate=("added-mass",))


def cases_of(module: str) -> Sequence[str]:
    """Return the cases of a module."""
    names = (module, module.rpartition(".")[2])
    for cases, patterns in SPECIAL.items():
        if any(fnmatch(name, each) for name in names for each in patterns):
            return cases.split()
    return FAMILY


def run_variant(
    folder: Path, names: Sequence[str], constant: Constant = NONE, factor: float = 1.0
) -> Row:
    """Return the results of a variant of a constant."""
    call = [sys.executable, str(Path(__file__).with_name("constant_variants.py"))]
    call += [str(folder), ",".join(names)]
    if constant is not NONE:
        call += [f"hydrodamp.{constant.module}", constant.name, str(factor)]
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1"}
    limit = None if constant is NONE else MAX_SECONDS
    try:
        done = subprocess.run(call, capture_output=True, text=True, env=environment, timeout=limit)
    except subprocess.TimeoutExpired:
        return Row(constant.key, factor, "out of time", [])
    if done.returncode and constant is NONE:
        raise RuntimeError(done.stderr)
    if done.returncode:
        return Row(constant.key, factor, done.stderr.strip().splitlines()[-1], [])
    return Row(constant.key, factor, "", json.loads(done.stdout))


def effect(row: Row, nominal: Mapping[str, Mapping[str, Any]]) -> tuple[float, float, int, bool]:
    """Return largest log-ratios of error and width, changed decisions, and whether all is equal."""
    errors, widths, n_changed, is_equal = [0.0], [0.0], 0, True
    for result in row.results:
        before = nominal[result["case"]]
        error, width = ((before[key], result[key]) for key in ("error", "width"))
        if all(error):
            errors.append(math.log(error[1] / error[0]))
        if None not in width and np.isfinite(width).all():
            widths.append(width[1] - width[0])
        diverges = bool(error[0]) != bool(error[1])
        n_changed += diverges or result["decisions"] != before["decisions"]
        is_equal &= json.dumps(result) == json.dumps(before)  # nan equals nan
    return max(errors, key=abs), max(widths, key=abs), n_changed, is_equal


def summarise(rows: Sequence[Row], constants: Mapping[str, Constant]) -> str:
    """Return the table."""
    by_key = {(row.constant, row.factor): row for row in rows}
    nominal = {each["case"]: each for each in by_key.pop((NONE.key, 1.0)).results}
    lines, origins = [], STATED["origin"]
    for key, constant in constants.items():
        variants = [by_key[key, factor] for factor in FACTORS if (key, factor) in by_key]
        if len(variants) < len(FACTORS):
            continue
        effects = [effect(row, nominal) for row in variants]
        cells = [row.failure or cell(*each) for row, each in zip(variants, effects, strict=True)]
        origin = origins.get(key.partition(".")[2]) or origins.get(constant.name, "choice")
        meaning = re.split(r"(?<=[.:;]) ", constant.meaning)[0].rstrip(".:;")
        text = [f"`{key}`", f"`{constant.value}`", meaning, origin, *cells]
        lines.append([each.replace("|", r"\|") for each in text])
    head = ["constant", "value", "decides", "origin", *(f"x {each:g}" for each in FACTORS)]
    return table(head, lines)


def cell(error: float, width: float, n_changed: int, is_equal: bool) -> str:
    """Return the changes of a variant."""
    if is_equal:
        return "none"
    shares = (f"{100.0 * np.expm1(each):+.0f} %" for each in (error, width))
    return ", ".join([*shares, str(n_changed)])


def main(
    out: Annotated[Path, typer.Option(help="Folder of cases and rows.")],
    data: Annotated[Path, typer.Option(help="Folder of measured logs.")],
    only: Annotated[str, typer.Option(help="Pattern of constants.")] = "*",
    page: Annotated[Path | None, typer.Option(help="Page to insert the table into.")] = None,
) -> None:
    """Run what is missing and print the table."""
    warnings.simplefilter("ignore", hd.HydrodampWarning)
    cases = out / "cases"
    if not cases.is_dir():
        write_cases(cases, data)
    constants = {key: each for key, each in find_constants().items() if fnmatch(key, only)}
    jobs = {NONE.key: lambda: [run_variant(cases, [*FAMILY, "sparse", "fixes"])]}
    jobs |= {key: partial(run_both, cases, constant) for key, constant in constants.items()}
    text = summarise(finish_jobs(out / "rows.jsonl", jobs, Row), constants)
    save_text(text, out / "constants.md")
    if page is not None:
        replace_table(page, MARKS, text)
    typer.echo(text)


def run_both(folder: Path, constant: Constant) -> list[Row]:
    """Return the results of half and twice a constant."""
    names = cases_of(constant.module)
    return [run_variant(folder, names, constant, factor) for factor in FACTORS]


if __name__ == "__main__":
    typer.run(main)
