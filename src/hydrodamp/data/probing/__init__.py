"""What an unknown recording holds: guessed, with the evidence.

Read :mod:`~hydrodamp.data.probing.probe` first: everything in a row. Then
:mod:`~hydrodamp.data.probing.topics` (rates, gaps, spans),
:mod:`~hydrodamp.data.probing.clocks` (which column is the time),
:mod:`~hydrodamp.data.probing.names` (what names and units say),
:mod:`~hydrodamp.data.probing.motion` (channels that measure one motion),
:mod:`~hydrodamp.data.probing.planar` (tables without names),
:mod:`~hydrodamp.data.probing.frames` (axes of body and world),
:mod:`~hydrodamp.data.probing.roles` (all of it weighed),
:mod:`~hydrodamp.data.probing.draft` (a mapping file of it),
:mod:`~hydrodamp.data.probing.shipped` (presets that fit) and
:mod:`~hydrodamp.data.probing.delay` (how late a vehicle answers its commands).
"""
