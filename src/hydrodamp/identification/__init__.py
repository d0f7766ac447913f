"""From a problem to a fit: every method of estimating the coefficients.

Read ``fit`` (what a method returns) and ``methods`` (their keys) first. Then, by subject and
from below: ``rows`` (of a regression), ``uncertainty``, ``regression`` (linear estimators),
``dissipation`` (under a constraint), ``replays`` (output error), ``smoothing``, ``online``
(sample by sample), ``trust`` (what the data determine) and ``selection`` (of terms).
``recommended`` puts the best of them together.
"""
