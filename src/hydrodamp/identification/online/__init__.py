"""Identifiers that take one sample after the other.

``adaptive`` is the paper's (section IV), with its ``gains``; ``robust`` adds leakage, dead
zone, ``limits``, ``whitening`` and ``projection``; ``recursive`` is least squares with
directional forgetting. ``adaptation`` is what they share, ``sample_by_sample`` runs them
live, ``settling`` says whether they have come to rest.
"""
