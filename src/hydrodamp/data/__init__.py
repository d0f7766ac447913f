"""Recorded logs: one clock, SI units, axes forward-starboard-down, split in segments.

Read :mod:`~hydrodamp.data.log` first: the value everything else works on. Then
:mod:`~hydrodamp.data.read` (the door to files), :mod:`~hydrodamp.data.canonical`
(the package's own CSV, both ways) and :mod:`~hydrodamp.data.mapping` (any other
log: names, units, frames, signs). Underneath lie :mod:`~hydrodamp.data.table`
(text to numbers), :mod:`~hydrodamp.data.record` (what was read, not yet checked),
:mod:`~hydrodamp.data.checks`, :mod:`~hydrodamp.data.bounds`, :mod:`~hydrodamp.data.segments`,
:mod:`~hydrodamp.data.attitude` and :mod:`~hydrodamp.data.units`.
"""
