"""Everything that steps in time, on arrays alone, in one C99 library.

A plant and a model are tables here, so a new model compiles nothing. Read plant
(the arrays), then core and estimators (the functions), then csrc.
"""

from hydrodamp.kernels.core import (
    coriolis as coriolis,
    mass_inverse as mass_inverse,
    regressor as regressor,
    replay as replay,
)
from hydrodamp.kernels.estimators import (
    Adapted as Adapted,
    Estimate as Estimate,
    Gains as Gains,
    Recursion as Recursion,
    absorb as absorb,
    adapt as adapt,
    adapt_step as adapt_step,
    block_step as block_step,
    new_block as new_block,
    recur as recur,
)
