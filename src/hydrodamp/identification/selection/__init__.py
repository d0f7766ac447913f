"""Which terms to take from many.

``candidates`` are offered, ``error_reduction`` orders them, ``stability`` counts how often
each is taken.
"""
