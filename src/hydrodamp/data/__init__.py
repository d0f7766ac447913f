"""Recorded logs: one clock, SI units, axes forward-starboard-down, split in segments."""
