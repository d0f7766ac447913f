"""Everything that ranks several fits on data they have not seen.

Read ``comparison`` (rows, the best of them), ``compare`` (replay and score
every fit), ``choice`` (which row to take, and why in words), ``front`` (error
against complexity), ``crossvalidation`` (every stretch held out in turn),
``criteria`` (AIC and BIC on effective samples), ``bands`` (how far a replay is to be
trusted), ``vehicle_error`` (what a wrong vehicle does; its ``vehicle_variants``),
``sparse`` (a model selected from a log; its ``rounds``, ``sizing``, ``selection``) and
``paper`` (the printed Table I and the rank correlation).
"""
