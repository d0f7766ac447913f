"""From a vehicle's log to a hydrodynamic damping model that can be trusted.

The straight line: ``read_log`` gives a ``Log``; with a ``Vehicle`` and models
from ``catalog``, ``identify`` gives a ``Fit``, and ``compare`` ranks fits on
data they have not seen. The public names stand in the stub beside this file;
each is loaded when it is first used, so that importing the package costs next
to nothing.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

__version__ = "0.1.0"
