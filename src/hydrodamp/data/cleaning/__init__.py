"""Cleaning as visible steps: each a function of a log that counts what it touched.

Read :mod:`~hydrodamp.data.cleaning.touched` (what a step returns), then
:mod:`~hydrodamp.data.cleaning.clean` (the steps in their order). The steps are
:mod:`~hydrodamp.data.cleaning.bottom_lock`, :mod:`~hydrodamp.data.cleaning.frozen`,
:mod:`~hydrodamp.data.cleaning.attitude_jumps`, :mod:`~hydrodamp.data.cleaning.spikes` and
:mod:`~hydrodamp.data.cleaning.suspicions`, which only speaks. Underneath lie
:mod:`~hydrodamp.data.cleaning.channels` (the columns of a log by name) and
:mod:`~hydrodamp.data.cleaning.missing` (what becomes of a sample that is taken out).
"""
