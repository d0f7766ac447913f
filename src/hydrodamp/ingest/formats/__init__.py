"""Readers of log formats: each module returns a recording with the numbers of the file."""
