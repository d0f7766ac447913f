"""Logs on one clock in SI units and forward-starboard-down axes, split into segments."""
