"""The NumPy reference in place of the compiled core, with one warning at first use."""

from __future__ import annotations

from hydrodamp.kernels import reference
from hydrodamp.kernels.notice import Notice

NOTICE = Notice()

absorb = NOTICE.before(reference.absorb)
acceleration = NOTICE.before(reference.acceleration)
adapt = NOTICE.before(reference.adapt)
adapt_step = NOTICE.before(reference.adapt_step)
block_step = NOTICE.before(reference.block_step)
coriolis = NOTICE.before(reference.coriolis)
recur = NOTICE.before(reference.recur)
regressor = NOTICE.before(reference.regressor)
replay = NOTICE.before(reference.replay)
robust_run = NOTICE.before(reference.robust_run)
robust_step = NOTICE.before(reference.robust_step)
sensitivities = NOTICE.before(reference.sensitivities)
