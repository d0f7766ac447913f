"""Recorded logs: one clock, SI units, axes forward-starboard-down, split in segments.

Read :mod:`~hydrodamp.data.log` first: the value everything else works on. Then
:mod:`~hydrodamp.data.read` (the door to files). Behind it, in the order data pass:
:mod:`~hydrodamp.data.formats` (a file becomes a :mod:`~hydrodamp.data.recording`),
:mod:`~hydrodamp.data.mapping` (names, units, frames, signs), :mod:`~hydrodamp.data.clock`
(one for all topics), :mod:`~hydrodamp.data.record` (not yet checked) and the log. From log to
log lead :mod:`~hydrodamp.data.cleaning` and :mod:`~hydrodamp.data.completing`. The package's
own CSV, both ways, is :mod:`~hydrodamp.data.canonical`.

Underneath lie :mod:`~hydrodamp.data.table` (text to numbers), :mod:`~hydrodamp.data.checks`,
:mod:`~hydrodamp.data.bounds`, :mod:`~hydrodamp.data.segments`,
:mod:`~hydrodamp.data.attitude` and :mod:`~hydrodamp.data.units`.
"""
