"""Presentation, apart from the data: tables, documents and files of results.

Read ``grid`` (a table of words) and ``renderings`` (the same as text, Markdown,
LaTeX, CSV or HTML), then ``comparison_grids``, ``remarks``, ``fit_grid``,
``model_grids`` and ``survey`` (what each result shows), ``screen`` (rich, for a
terminal), ``document`` (strict JSON), ``files`` (the folder of a comparison) and
``html`` (its report).
``figures`` draws, each function one figure.
No statistic is computed here: what a table shows, a result holds.
"""
