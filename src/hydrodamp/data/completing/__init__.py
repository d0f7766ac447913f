"""Channels that were not measured, derived from those that were; each told in the notes.

Read :mod:`~hydrodamp.data.completing.rates` (body rates from attitude),
:mod:`~hydrodamp.data.completing.ways` (velocity from position),
:mod:`~hydrodamp.data.completing.accelerometer` (accelerations),
:mod:`~hydrodamp.data.completing.mixing` (roll from fins),
:mod:`~hydrodamp.data.completing.current` and :mod:`~hydrodamp.data.completing.through_water`
(the current, and the velocity without it) and :mod:`~hydrodamp.data.completing.response`
(delays and lags of actuators). Underneath lies
:mod:`~hydrodamp.data.completing.local_polynomials`.
"""
