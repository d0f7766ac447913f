"""From a problem to a fit: every method of estimating the coefficients.

Read ``fit`` (what a method returns) and ``methods`` (their keys) first. Then, by subject:

Rows of a regression
    ``derivative``, ``held`` and ``triangle`` (what section III of the paper needs),
    ``equations`` (rows however made), ``weak`` with ``weak_functions``, ``steps``,
    ``support`` and ``local_quadratics``.
Linear estimators
    ``least_squares`` on ``rank``; ``generalised`` on ``coupled`` and ``weighting``;
    ``ridge`` on ``shrinkage`` and ``folds``; ``informed`` by a ``prior``; ``dissipative``
    on ``dissipative_set``, ``operating_box``, ``power``, ``power_form``, ``certificate``,
    ``cutting_planes``, ``cone_program`` and ``price``.
Replays
    ``output_error`` on ``climb``, ``refine``, ``shooting`` and ``runaway``; ``smooth`` on
    ``smoothing``, ``step_errors``, ``transition``, ``track`` and ``noise``; ``recommended``.
Sample by sample
    ``adaptive`` and ``gains`` (section IV), ``settling``, ``online``; ``robust`` and
    ``recursive`` with their states and ``limits``.
Trust
    ``covariance`` on ``long_run``, ``tapered_blocks``, ``influence`` and ``reference``;
    ``replay_uncertainty``, ``bootstrap``; ``identifiability`` on ``excitation``,
    ``collinearity`` and ``grades``; ``diagnostics`` on ``residuals`` and ``endogeneity``.
Selection of terms
    ``candidates``, ``error_reduction``, ``stability`` and ``replay_blocks``.
"""
