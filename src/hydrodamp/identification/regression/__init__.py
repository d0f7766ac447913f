"""Linear estimators on rows.

``least_squares`` is the paper's (section III), ``weak`` the same on the weak form.
``generalised`` weighs the axes together, on ``coupled`` and ``weighting``; ``ridge`` shrinks,
on ``shrinkage``; ``informed`` starts from a ``prior``. ``covariance`` says how far to trust
them, by the ``influence`` of each row.
"""
