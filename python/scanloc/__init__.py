"""Where a LiDAR scan was taken, from one scan and nothing else.

Points are N x 3 or N x 4 arrays of float32 in the sensor frame: x forward, y left, z up [m].
Poses are 4 x 4 arrays of float64; T_a_b maps points of frame b into frame a [m].
What fails raises an Error of its kind: InvalidArgument (a ValueError), NotFound, Unavailable, ...
"""

from . import _scanloc
from ._scanloc import *  # noqa: F401,F403
from .errors import *  # noqa: F401,F403

__version__: str = _scanloc.__version__  # type: ignore[attr-defined]
