"""The report of a comparison: one HTML file that needs nothing else.

Read ``write`` (what it is made from and where it goes), then what stands in it, top to
bottom: ``summary`` (the verdict), ``score_table``, ``plots`` with ``stage``, ``levels``
and ``packing`` (the time series), ``front_chart``, ``coefficient_tables``, ``origin``.
``page`` puts it together from the files in ``assets``: a template, styles, scripts, and
uPlot by Leon Sorokin under its MIT licence.
"""
