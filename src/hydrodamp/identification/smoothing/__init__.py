"""Least squares on states that were smoothed first.

``smooth`` alternates between both; ``smoother`` is the extended Kalman filter with the
backward pass of Rauch, Tung and Striebel, on ``step_errors``, ``transition``, ``track`` and
``noise``.
"""
