"""The published sensor noise of the VT 690.

White, Gaussian, independent from sample to sample and channel to channel. The
variances are those of the vehicle's own simulation nodes (github
ECE-MDE/AUV-Fault-Detection, ``*_sim_node.config``):

=============  =====================  ======================
channel        variance               standard deviation
=============  =====================  ======================
u v w (DVL)    1.764e-4 (m/s)^2       0.0133 m/s
p q r (gyro)   7.615e-7 (rad/s)^2     8.7e-4 rad/s
attitude       5.898e-9 rad^2         7.7e-5 rad
depth          1e-3 m^2               0.0316 m
=============  =====================  ======================

There the DVL and the depth cell answer at 5 Hz; here everything answers at the
10 Hz of the log. The same noisy numbers reach the autopilot and the log.
"""

from __future__ import annotations

CHANNELS = ("u", "v", "w", "p", "q", "r", "roll", "pitch", "yaw", "depth")
"""What is measured, in the order of the noise's last axis."""

VARIANCES = (1.764e-4,) * 3 + (7.615e-7,) * 3 + (5.898e-9,) * 3 + (1e-3,)
"""Noise variance of each channel [(m/s)^2, (rad/s)^2, rad^2, m^2]."""
