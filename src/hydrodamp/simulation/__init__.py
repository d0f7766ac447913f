"""Equation 1: where a vehicle, a log and the terms of a model meet.

Read ``columns`` (equation 1 as one table), ``fitness`` (whether a log will do),
``problem`` (a log turned into arrays once), ``replay`` (open-loop simulation)
and ``score`` (equation 24). ``campaign`` re-enacts the measurement campaign of
the paper.
"""
