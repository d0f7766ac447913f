"""Equation 1: where a vehicle, a log and the terms of a model meet."""
