"""Figures for print: one function each, returning a matplotlib figure."""
