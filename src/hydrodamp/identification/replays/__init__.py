"""Output error: coefficients whose replay is nearest to the log.

``output_error`` is the estimator: ``climb`` goes through windows of growing length,
``refine`` takes the steps on one length, ``shooting`` replays the windows with their slopes,
``runaway`` drives a little softer. ``replay_uncertainty`` says how far to trust the end, by
searching again without parts of the log (``left_out``); ``replay_blocks`` offers the slopes to
the selection of terms.
"""
