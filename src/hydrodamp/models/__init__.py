"""Damping models: which terms act on which axis, and the numbers that go with them."""
