"""The directive ``public-names``: the public names of a layer, and its documented modules."""

from __future__ import annotations

import ast
import inspect
import re
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import Any

from docutils import nodes
from sections import section
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

import hydrodamp as hd

_SECTION = re.compile(r"^(Parameters|Attributes|Returns|Examples)\n---", re.MULTILINE)
STUB = Path(hd.__file__ or "").with_suffix(".pyi")


def homes() -> dict[str, str]:
    """Return the module of every public name, below ``hydrodamp``.

    Returns
    -------
    homes : dict of str to str
        Such as ``{"Log": "data.log"}``, in the order of the stub.
    """
    return {
        alias.asname or alias.name: statement.module or ""
        for statement in ast.parse(STUB.read_text(encoding="utf-8")).body
        if isinstance(statement, ast.ImportFrom)
        for alias in statement.names
    }


def layers() -> dict[str, dict[str, list[str]]]:
    """Return the public names by layer, then by the package they live in.

    Returns
    -------
    layers : dict of str to dict of str to list of str
        Such as ``{"data": {"data": ["Log"], "data.cleaning": ["clean"]}}``; a layer's
        own names first.
    """
    found: dict[str, dict[str, list[str]]] = {}
    for name, module in homes().items():
        path = module.split(".")
        package = ".".join(path[:2] if len(path) > 2 else path[:1])
        found.setdefault(path[0], {path[0]: []}).setdefault(package, []).append(name)
    return found


def module_names(layer: str) -> dict[str, list[str]]:
    """Return the names of a layer whose docstrings have sections, and that are not public.

    Parameters
    ----------
    layer : str
        Such as ``data``.

    Returns
    -------
    names : dict of str to list of str
        By module, such as ``{"data.log": ["Segment"]}``.
    """
    names: dict[str, list[str]] = {}
    root = STUB.parent
    for path in sorted(root.glob(f"{layer}/**/*.py")) or [root / f"{layer}.py"]:
        module = ".".join(path.relative_to(root).with_suffix("").parts)
        for statement in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(statement, (ast.ClassDef, ast.FunctionDef)):
                text = ast.get_docstring(statement) or ""
                is_error = layer == "errors" and isinstance(statement, ast.ClassDef)
                is_shown = is_error or _SECTION.search(text)
                is_private = statement.name.startswith("_") or statement.name in homes()
                if is_shown and not is_private:
                    names.setdefault(module, []).append(statement.name)
    return names


def directive(path: str) -> list[str]:
    """Return the lines that document a name by its docstring.

    Parameters
    ----------
    path : str
        A public name, or a name with its module below ``hydrodamp``.

    Returns
    -------
    lines : list of str
        A directive of autodoc; for a constant, the text that follows it in its module.
    """
    module, _, name = path.rpartition(".")
    value = getattr(import_module(f"hydrodamp.{module}") if module else hd, name)
    if inspect.isclass(value):
        kind = "autoexception" if issubclass(value, BaseException) else "autoclass"
        if kind == "autoexception":
            return [f".. {kind}:: hydrodamp.{path}", ""]
        foreign = [each.__name__ for each in value.__mro__ if "hydrodamp" not in each.__module__]
        inherited = f"   :inherited-members: {', '.join(foreign)}"
        return [f".. {kind}:: hydrodamp.{path}", "   :members:", inherited, ""]
    if inspect.isfunction(value):
        return [f".. autofunction:: hydrodamp.{path}", ""]
    return [f".. py:data:: hydrodamp.{path}", "", *_constant(name), ""]


def _constant(name: str) -> list[str]:
    """Return the string that stands under the assignment of a constant, indented."""
    home = homes()[name]
    body = ast.parse(inspect.getsource(import_module(f"hydrodamp.{home}"))).body
    for statement, after in pairwise(body):
        targets = getattr(statement, "targets", [getattr(statement, "target", None)])
        named = any(getattr(target, "id", None) == name for target in targets)
        if named and isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant):
            return [f"   {line}" for line in inspect.cleandoc(after.value.value).splitlines()]
    return []


def rank(name: str) -> int:
    """Return what names of a package are sorted by: values, then functions, then constants."""
    value = getattr(hd, name)
    return 0 if inspect.isclass(value) else 1 if inspect.isfunction(value) else 2


def heading(package: str) -> str:
    """Return the first sentence of a package's docstring, without its full stop."""
    documented = import_module(f"hydrodamp.{package}").__doc__ or package
    return documented.splitlines()[0].rstrip(".")


class PublicNames(SphinxDirective):
    """A section for each package of a layer and each module with further documented names."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return the sections."""
        self.env.note_dependency(str(STUB))
        layer = self.arguments[0]
        sections = {
            package: sorted(names, key=rank) for package, names in layers().get(layer, {}).items()
        }
        for module, names in module_names(layer).items():
            sections.setdefault(module, []).extend(f"{module}.{name}" for name in names)
        return [
            section(
                self,
                nodes.Text(heading(package)),
                f"names-{package}",
                (line for name in names for line in directive(name)),
            )
            for package, names in sections.items()
            if names
        ]


def resolved(app: Sphinx, env: Any, node: nodes.Element, shown: nodes.Element) -> Any:
    """Return the link of a public name that is called by its full path.

    Parameters
    ----------
    app : Sphinx
        Knows the builder.
    env : BuildEnvironment
        Knows the pages.
    node : Element
        The reference that leads nowhere yet.
    shown : Element
        Its text.

    Returns
    -------
    link : Element or None
        None where it is no public name.
    """
    target = node.get("reftarget", "")
    for name, home in homes().items():
        path = f"hydrodamp.{home}.{name}"
        if target == path or target.startswith(f"{path}."):
            short = f"hydrodamp.{name}{target.removeprefix(path)}"
            page, kind = node.get("refdoc", ""), node["reftype"]
            text = nodes.literal(shown.astext(), shown.astext().replace(path, name))
            domain = env.domains["py"]
            return domain.resolve_xref(env, page, app.builder, kind, short, node, text)
    return None


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive."""
    app.add_directive("public-names", PublicNames)
    app.connect("missing-reference", resolved)
    return {"version": hd.__version__, "parallel_read_safe": True}
