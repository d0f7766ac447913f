"""Least squares under the constraint that damping takes power out of the vehicle."""
