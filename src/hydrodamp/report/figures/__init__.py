"""Figures for print: one function each, returning a matplotlib figure.

Every function is free of matplotlib's global state: it returns a
``matplotlib.figure.Figure`` made to stand in one column of a journal, or over a page where
it must. matplotlib comes with ``pip install "hydrodamp[report]"`` and is imported when a
figure is drawn.
"""
