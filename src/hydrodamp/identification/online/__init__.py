"""Identifiers that take one sample after the other."""
