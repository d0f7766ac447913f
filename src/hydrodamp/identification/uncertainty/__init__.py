"""How far to trust numbers made from coloured records.

``intervals`` holds the result; ``long_run`` and ``tapered_blocks`` find the covariance of a
sum whose terms are correlated.
"""
