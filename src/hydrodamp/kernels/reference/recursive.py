"""Recursive least squares with directional forgetting.

A row says y = kappa . phi. In units in which the prior's information is the identity
and that of the data S, a row first takes the share r of S in its own direction, then
brings its own (the decomposition of Cao and Schwartz, Automatica 36 (2000) 1725)::

    S <- S - r S phi phi'S / (phi'S phi) + phi phi'
    kappa <- kappa + (I + S)^-1 phi (y - kappa . phi)

with r = min(forgetting, 2 phi'(I + S)^-1 phi): what a row takes must not be worth much
more than what it brings. Whatever the rows, 0 <= S <= c I with
c = max(1, max |phi|^2 / forgetting). For let S = c I - E with E >= 0; for any x,
c x.phi = x'S phi + x'E phi, and by Cauchy's inequality twice
(c x.phi)^2 <= (r (x'S phi)^2 / phi'S phi + x'E x) (phi'S phi / r + phi'E phi), whose last
factor is at most c |phi|^2 / r <= c^2. So the covariance (I + S)^-1 never exceeds the
prior's, and no row moves kappa, measured by the prior, by more than its surprise.
"""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.kernels.arguments import at_least, floats, matching, spans
from hydrodamp.kernels.fitting import fitting, steps_in
from hydrodamp.kernels.inputs import Inputs
from hydrodamp.kernels.plant import Plant
from hydrodamp.kernels.recursion import Estimate, Recurred, Recursion, block_size
from hydrodamp.kernels.reference.blocks import added
from hydrodamp.kernels.reference.identifier import part_of, steps_between
from hydrodamp.kernels.track import Track


def absorb(recursion: Recursion, estimate: Estimate, row: FloatArray) -> Estimate:
    """Take in one row.

    Parameters
    ----------
    recursion : Recursion
        Units and forgetting.
    estimate : Estimate
        What was known.
    row : ndarray, shape (n_terms + 6,)
        The terms, and what they are to explain on each axis; see :func:`block_step`.

    Returns
    -------
    estimate : Estimate
        What is known now, of new arrays.

    Raises
    ------
    ProblemError
        If a shape is wrong.
    """
    entries = recursion.entries
    row = floats(row, (len(entries.known) + 6,), "row")
    kappa = floats(estimate.coefficients, (entries.n,), "estimate.coefficients").copy()
    information = floats(estimate.information, (entries.n_squares,), "estimate.information")
    information, noise, rows = information.copy(), estimate.noise.copy(), estimate.rows.copy()
    for axis, seen in enumerate(entries.squares(information)):
        part = entries.of(axis)
        if part.start == part.stop:
            continue
        unit, terms = recursion.unit[part], row[entries.rows[part]]
        surprise = row[len(entries.known) + axis] - kappa[part] @ terms
        phi = unit * terms
        seen -= forgotten(seen, phi, recursion.forgetting)  # a view: the packed array moves
        gain = np.linalg.solve(np.eye(len(phi)) + seen, phi)
        seen += np.outer(phi, phi)
        news = phi @ gain
        kappa[part] += unit * gain * (surprise / (1.0 + news))
        rows[axis] += 1.0
        weight = max(3.0 / (rows[axis] + 2.0), recursion.forgetting)
        noise[axis] += weight * (surprise**2 / (1.0 + news) - noise[axis])
    return Estimate(kappa, information, noise, rows)


def forgotten(information: FloatArray, phi: FloatArray, forgetting: float) -> FloatArray:
    """Return the information that a row replaces.

    Parameters
    ----------
    information : ndarray, shape (n, n)
        S, without the prior's.
    phi : ndarray, shape (n,)
        The row.
    forgetting : float
        The greatest share.

    Returns
    -------
    lost : ndarray, shape (n, n)
        r S phi phi'S / (phi'S phi).
    """
    seen = information @ phi
    along = float(phi @ seen)
    news = float(phi @ np.linalg.solve(np.eye(len(phi)) + information, phi))
    share = min(forgetting, 2.0 * news)
    return share / along * np.outer(seen, seen) if along > 0.0 else np.zeros_like(information)


def recur(
    plant: Plant,
    recursion: Recursion,
    estimate: Estimate,
    inputs: Inputs,
    segments: IntArray,
    every: int = 0,
) -> Recurred:
    """Run recursive least squares over a record: the fold of ``block_step`` and ``absorb``.

    No block spans two segments.

    Parameters
    ----------
    plant : Plant
        Mass matrix, free axes, terms.
    recursion : Recursion
        Entries, units, block and forgetting.
    estimate : Estimate
        To start from.
    inputs : Inputs
        The record.
    segments : ndarray of int64, shape (s, 2)
        First sample of each segment and the one after its last.
    every : int, optional
        Store noise and coefficients after every so many steps; 0 stores nothing.

    Returns
    -------
    recurred : Recurred
        Last estimate, and the track asked for with the noise.

    Raises
    ------
    ProblemError
        If shapes do not agree, or ``every`` is negative.
    """
    entries = recursion.entries
    fitting(plant, entries, estimate.coefficients)
    floats(estimate.information, (entries.n_squares,), "estimate.information")
    matching(plant, inputs)
    spanned = spans(segments, inputs.n)
    at_least("every", every, 0)
    track = Track.empty(steps_in(spanned) // every if every else 0, entries.n)
    block, count = np.zeros(block_size(plant.n_terms)), 0
    for start, stop in spanned.tolist():
        block = np.zeros_like(block)
        steps = steps_between(plant, part_of(inputs, start, stop))
        for k in range(stop - start - 1):
            block, row = added(entries, recursion.block, block, steps, k)
            estimate = estimate if row is None else absorb(recursion, estimate, row)
            count += 1
            if every and count % every == 0:
                place = count // every - 1
                track.time[place] = inputs.time[start + k + 1]
                track.by_axis[place] = estimate.noise
                track.coefficients[place] = estimate.coefficients
    return Recurred(estimate, block, track)
