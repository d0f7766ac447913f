"""What the directives of this folder share: a section made of text.

Pages that use them are written in reStructuredText, as the docstrings are.
"""

from __future__ import annotations

from collections.abc import Iterable

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.util.docutils import SphinxDirective


def section(
    directive: SphinxDirective, title: nodes.Node, name: str, lines: Iterable[str]
) -> nodes.section:
    """Return a section of the page a directive stands on.

    Parameters
    ----------
    directive : SphinxDirective
        Whose page it becomes a part of.
    title : Node
        The heading: a text, or a literal for code.
    name : str
        Its label, for ``:ref:``.
    lines : iterable of str
        Its content in reStructuredText.

    Returns
    -------
    section : section
        With the content parsed.
    """
    made = nodes.section(ids=[nodes.make_id(name)], names=[nodes.fully_normalize_name(name)])
    made += nodes.title("", "", title)
    directive.state.document.note_explicit_target(made)
    source = directive.get_source_info()[0]
    directive.state.nested_parse(StringList(list(lines), source=source), 0, made)
    return made
