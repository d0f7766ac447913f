"""Least squares on states that were smoothed first."""
