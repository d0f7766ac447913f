"""From a problem to a fit: every method of estimating the coefficients.

Read ``fit`` (what a method returns), ``derivative``, ``held`` and ``triangle``
(what least squares needs), ``least_squares`` (section III of the paper),
``adaptive`` and ``gains`` (section IV) and ``methods`` (their keys).
"""
