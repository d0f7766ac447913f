"""The six axes and velocities of SNAME (1950), in their one order."""

from __future__ import annotations

AXES = ("X", "Y", "Z", "K", "M", "N")
"""Rows of every wrench: force X Y Z [N] and moment K M N [N m], body frame."""

VELOCITIES = ("u", "v", "w", "p", "q", "r")
"""Surge, sway, heave [m/s] and roll, pitch, yaw rate [rad/s], body frame."""

VELOCITY_OF = dict(zip(AXES, VELOCITIES, strict=True))
"""The velocity of each axis: ``VELOCITY_OF["N"] == "r"``."""
