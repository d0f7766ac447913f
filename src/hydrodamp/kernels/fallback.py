"""The NumPy reference in place of the compiled core, with one warning at first use."""

from __future__ import annotations

from hydrodamp.kernels import reference
from hydrodamp.kernels.notice import Notice

NOTICE = Notice()

acceleration = NOTICE.before(reference.acceleration)
adapt = NOTICE.before(reference.adapt)
adapt_step = NOTICE.before(reference.adapt_step)
coriolis = NOTICE.before(reference.coriolis)
regressor = NOTICE.before(reference.regressor)
replay = NOTICE.before(reference.replay)
sensitivities = NOTICE.before(reference.sensitivities)
