"""The paper's measurement campaign, sailed again by a simulated VT 690.

Read ``plan`` (which runs, which steps), ``sensors`` and ``conditions`` (how noisy), ``autopilot``
(who steers), ``body`` (the known part of the vehicle), ``truth`` and ``crossflow``
(what the water really does), ``motion`` (the equation of motion), ``voyage`` (all
runs at once), and last ``reenact``, which makes logs of it. The simulation shares
no code with the replay of the estimators: it is a second, independent program.
"""
