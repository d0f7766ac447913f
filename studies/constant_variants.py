"""Measure what one constant of the package decides: halve or double it, and identify cases.

    python studies/constant_variants.py FOLDER CASES [MODULE NAME FACTOR]

Prints the results as JSON. The constant is changed in the source of its module while the package
is imported, so that values that derive from it follow.
"""

from __future__ import annotations

import ast
import builtins
import json
import pickle
import re
import sys
import warnings
from collections.abc import Iterator
from dataclasses import is_dataclass, replace
from functools import partial
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import CodeType
from typing import Any
from unittest.mock import patch

import numpy as np

SHARE = 0.75
"""Value from which a number below one is a share whose distance from one is scaled."""

NUMBER = r"[-+]?[0-9][0-9.]*(?:e[-+]?[0-9]+)?"
"""A number in a remark."""

SCALE = "__scale__"
"""Name by which the changed source calls :func:`scale`."""


def scale(value: Any, factor: float) -> Any:
    """Return a number times a factor, at least 1 if whole; of a sequence, each number."""
    if isinstance(value, tuple | list):
        scaled = [_times(each, factor) for each in value]
        if all(isinstance(each, int) for each in value):
            is_odd = all(each % 2 for each in value)
            scaled = sorted({each // 2 * 2 + 1 if is_odd else each for each in scaled})
        return type(value)(scaled)
    if isinstance(value, float) and SHARE <= value < 1.0:
        return 1.0 - (1.0 - value) * factor
    return _times(value, factor)


def _times(value: Any, factor: float) -> Any:
    if isinstance(value, tuple | list):
        return scale(value, factor)
    return max(1, round(value * factor)) if isinstance(value, int) else value * factor


def assignments(tree: ast.Module) -> Iterator[tuple[str, ast.stmt, ast.expr]]:
    """Yield name, statement and value of the assignments of a module and of its classes."""
    bodies = [("", tree.body)]
    bodies += [(f"{node.name}.", node.body) for node in tree.body if isinstance(node, ast.ClassDef)]
    for owner, body in bodies:
        for node in body:
            if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
                continue
            target = node.targets[0] if isinstance(node, ast.Assign) else node.target
            pairs = [(target, node.value)]
            if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
                pairs = [*zip(target.elts, node.value.elts, strict=True)]
            for name, value in pairs:
                if isinstance(name, ast.Name):
                    yield f"{owner}{name.id}", node, value


class _Replacement(ast.NodeTransformer):
    def __init__(self, value: ast.expr) -> None:
        self.value = value

    def visit(self, node: ast.AST) -> ast.AST:
        if node is not self.value:
            return self.generic_visit(node)
        call = ast.Call(ast.Name(SCALE, ast.Load()), [self.value], [])
        return ast.copy_location(call, node)


def change_constant(module: str, name: str, factor: float) -> None:
    """Scale a constant of a module that is imported later."""
    load = SourceFileLoader.get_code

    def get_code(loader: SourceFileLoader, fullname: str) -> CodeType | None:
        if fullname != module:
            return load(loader, fullname)
        tree = ast.parse(loader.get_data(loader.path))
        value = next(value for label, _, value in assignments(tree) if label == name)
        _Replacement(value).visit(tree)
        return compile(ast.fix_missing_locations(tree), loader.path, "exec")

    setattr(builtins, SCALE, partial(scale, factor=factor))
    patch.object(SourceFileLoader, "get_code", get_code).start()


def measure(path: Path) -> Iterator[dict[str, Any]]:
    """Yield the results of a case: of each method, and of the comparison of several."""
    import hydrodamp as hd  # after the change of a constant
    from hydrodamp.identification.grades import count_determined
    from hydrodamp.identification.identifiability import add_grades

    warnings.simplefilter("ignore", hd.HydrodampWarning)
    vehicle, train, test, model, methods, options = pickle.loads(path.read_bytes())
    model = model or hd.StepwiseSelection().select(vehicle, train)
    problem = hd.prepare(vehicle, train, model)
    fits = []
    for key in methods:
        method = hd.find_method(key)
        if options:
            assert is_dataclass(method)
            method = replace(method, **options)
        fits.append(add_grades(problem, method.identify(problem, model))[0])
    comparison = hd.compare(fits, vehicle, test)
    for fit, row in zip(fits, comparison.rows, strict=True):
        width = None
        if fit.uncertainty is not None:
            half = fit.uncertainty.critical_value() * fit.uncertainty.standard_errors
            width = float(np.mean(np.log(half[np.isfinite(half) & (half > 0.0)])))
        form = fit.adequacy.form.word if fit.adequacy else ""
        remarks = [re.sub(NUMBER, "#", each) for each in fit.remarks]
        determined = count_determined(fit.grades)
        yield {
            "case": f"{path.stem}, {fit.method}",
            "error": row.rms,
            "width": width,
            "decisions": [fit.status.word, form, determined, *fit.model.labels, *remarks],
            "values": fit.damping.coefficients.tolist(),
        }
    if len(fits) > 1:
        best = comparison.select().row.method
        yield {"case": path.stem, "error": None, "width": None, "decisions": [best], "values": []}


def main(folder: Path, names: str, *change: str) -> None:
    """Print the results of the cases with some names."""
    if change:
        module, name, factor = change
        change_constant(module, name, float(factor))
    paths = [folder / f"{name}.pickle" for name in names.split(",")]
    print(json.dumps([each for path in paths for each in measure(path)]))


if __name__ == "__main__":
    main(Path(sys.argv[1]), *sys.argv[2:])
