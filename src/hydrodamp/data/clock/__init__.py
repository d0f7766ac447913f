"""Several topics, one clock.

Read :mod:`~hydrodamp.data.clock.stamps` first: the clock of one topic, set right. Then
:mod:`~hydrodamp.data.clock.sampling`: a topic's values at the times of another, never across a
gap. :mod:`~hydrodamp.data.clock.base` chooses whose clock all others follow, and
:mod:`~hydrodamp.data.clock.met` says what was met on the way.
"""
