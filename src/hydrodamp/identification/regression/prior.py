"""What was known of the coefficients before the log: a mean and how sure of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import MethodError
from hydrodamp.models.damping import Damping
from hydrodamp.models.labels import read_label

_NO_VARIANCE = 1e-12
"""Eigenvalues of a correlation matrix below this share of the largest are zero: directions
that a fit could not determine, or surer ones than its covariance can hold."""


@dataclass(frozen=True, eq=False)
class Prior:
    """A published coefficient set, or an earlier fit, as a normal prior.

    Parameters
    ----------
    damping : Damping
        Its coefficients are the mean. One that is zero or not finite counts as lacking.
    relative : float, optional
        Standard deviation as a share of each coefficient, such as 0.05. By default the
        covariance of the set is taken; directions it gives no variance, as those a fit
        could not determine, are left free.
    rotary : float, optional
        The same for terms with an angular velocity in them, ``relative`` by default.
        Roddy (1990, DTRC/SHD-1298-08, appendix C) states 4 to 5 % for the static and
        10 % for the rotary coefficients of a captive model test.
    wide : float
        Standard deviation of a coefficient that the set lacks, around zero: how large
        its part of the wrench may be, as a share of the root mean square on its axis.

    Raises
    ------
    MethodError
        If a share is not positive, or there are neither shares nor a covariance.

    Examples
    --------
    >>> known = Damping.from_dict(None, {"Y_v": -20.0, "N_r": -4.0})
    >>> Prior(known, relative=0.05, rotary=0.1).deviations()
    {'Y_v': 1.0, 'N_r': 0.4}
    """

    damping: Damping
    relative: float | None = None
    rotary: float | None = None
    wide: float = 1.0

    def __post_init__(self) -> None:
        """Refuse a prior that says nothing or is absurdly sure."""
        shares = {"relative": self.relative, "rotary": self.rotary, "wide": self.wide}
        for name, share in shares.items():
            if share is not None and not (np.isfinite(share) and share > 0.0):
                raise MethodError(f"`{name}` must be a positive share, such as 0.1; got {share}")
        if self.relative is None and self.damping.covariance is None:
            raise MethodError(
                f"the coefficients of '{self.damping.model.key}' have no covariance: state how "
                "sure they are, such as `relative=0.1`"
            )
        if self.relative is None and self.rotary is not None:
            raise MethodError("`rotary` goes with `relative`: give both, or none")

    @property
    def known(self) -> dict[str, float]:
        """The coefficients that the set has, by label."""
        values = self.damping.as_dict()
        return {k: value for k, value in values.items() if value != 0.0 and np.isfinite(value)}

    def deviations(self) -> dict[str, float]:
        """Return the standard deviation of each coefficient that the set has, by label."""
        if self.relative is None:
            variance = dict(
                zip(self.damping.model.labels, np.diag(self._covariance()), strict=True)
            )
            return {label: float(np.sqrt(max(variance[label], 0.0))) for label in self.known}
        return {
            label: self._share(label, self.relative) * abs(value)
            for label, value in self.known.items()
        }

    def rows(self, labels: tuple[str, ...], wide: Mapping[str, float]) -> Belief:
        """Return the prior as rows of a regression.

        Parameters
        ----------
        labels : tuple of n str
            Of the model to be identified.
        wide : mapping of str to float
            For each label the size of a coefficient that alone would make the axis's
            wrench; not finite where its column is zero.

        Returns
        -------
        belief : Belief
            Mean and root on those labels.
        """
        place = {label: i for i, label in enumerate(labels)}
        shared = [label for label in self.known if label in place]
        mean = np.zeros(len(labels))
        mean[[place[label] for label in shared]] = [self.known[label] for label in shared]
        spread = np.array([self.wide * wide[label] for label in labels])
        loose = np.array([label not in self.known and np.isfinite(wide[label]) for label in labels])
        free = np.diag(1.0 / np.where(loose, spread, 1.0))[loose]
        sure = np.zeros((0, len(labels)))
        if shared:
            part = self._root(shared)
            sure = np.zeros((len(part), len(labels)))
            sure[:, [place[label] for label in shared]] = part
        return Belief(mean, np.vstack([sure, free]), len(shared))

    def _share(self, label: str, relative: float) -> float:
        _, term = read_label(label)
        turns = any(factor.strip("|") in ("p", "q", "r") for factor in term.factors)
        return self.rotary if turns and self.rotary is not None else relative

    def _covariance(self) -> FloatArray:
        n = self.damping.model.n_coefficients
        return np.zeros((n, n)) if self.damping.covariance is None else self.damping.covariance

    def _root(self, shared: list[str]) -> FloatArray:
        """Return R with RᵀR the inverse covariance of some coefficients."""
        deviation = self.deviations()
        scale = np.array([deviation[label] for label in shared])
        scale[scale == 0.0] = 1.0
        if self.relative is not None:
            return np.diag(1.0 / scale)
        places = [self.damping.model.index(label) for label in shared]
        covariance = self._covariance()[np.ix_(places, places)]
        values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
        kept = values > _NO_VARIANCE * max(values[-1], 0.0)
        root: FloatArray = vectors[:, kept].T / np.sqrt(values[kept])[:, None] / scale
        return root


@dataclass(frozen=True)
class Belief:
    """A normal prior on the coefficients of a model, as rows ``root κ = root mean``."""

    mean: FloatArray
    root: FloatArray
    n_known: int

    @property
    def deviation(self) -> FloatArray:
        """Standard deviation of each coefficient, infinite where it is free, shape (n,)."""
        free = np.full(len(self.mean), np.inf)
        if not len(self.root):
            return free
        size = np.linalg.norm(self.root, axis=0)
        size[size == 0.0] = 1.0
        inverse = np.linalg.pinv(self.root / size) / size[:, None]
        held = np.diag(inverse @ self.root) > 1.0 - 1e-6
        return np.where(held, np.sqrt(np.sum(inverse * inverse, axis=1)), free)
