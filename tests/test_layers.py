"""Imports only go down: the contract in pyproject.toml."""

from __future__ import annotations

import ast
import io
import tokenize
from pathlib import Path

ROOT = Path(__file__).parents[1]
NO_CODE = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE}
NO_CODE |= {tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}


def test_imports_only_go_down(monkeypatch):
    from importlinter.cli import lint_imports

    monkeypatch.chdir(ROOT)
    assert lint_imports(config_filename="pyproject.toml", no_cache=True) == 0


def code_lines(source):
    """Count lines that hold code: neither blank, nor comment, nor docstring."""
    held: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type not in NO_CODE:
            held.update(range(token.start[0], token.end[0] + 1))
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.Module() | ast.ClassDef() | ast.FunctionDef() if ast.get_docstring(node):
                held.difference_update(range(node.body[0].lineno, node.body[0].end_lineno + 1))
    return len(held)


def test_no_module_holds_more_than_250_lines_of_code():
    sources = {path: path.read_text("utf-8") for path in (ROOT / "src").rglob("*.py")}
    long = {path for path, text in sources.items() if text.count("\n") > 250}
    assert not [path for path in long if code_lines(sources[path]) > 250]
