"""The pictures of a run, each with what to see in it, and what the log determines.

Words of this package: a *figure* is matplotlib's; a *sketch* is a picture still to be drawn, and
*drawn* a figure with its caption; a *picture* is an SVG with its words; the *gallery* has the
pictures of a run, and why others are missing; *grades* say how well the training log determines
each coefficient; a *band* is where a replay would run if the coefficients erred as they may;
*findings* are grades, band and gallery, which a report shows beside a comparison.

Read ``picture`` and ``findings``, then ``examine`` (how they are made from the training log),
with ``of_the_data``, ``of_the_fit``, ``of_the_replays`` (with ``bands_of_rows``) and
``of_the_adaptation`` (which pictures, with which words), and ``folder`` with ``band_file`` (the
files, both ways).
"""
