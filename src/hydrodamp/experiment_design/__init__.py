"""Optimal experiment design: the dive whose log determines a model's coefficients best."""
