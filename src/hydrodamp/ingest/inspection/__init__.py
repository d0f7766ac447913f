"""Inspection of unknown recordings: roles of columns, frames, a draft mapping, quality report."""
