"""Sample for the choice of orientations: passes of the bicubic test part at a feed that never binds."""

from __future__ import annotations

import numpy as np
from cltext import Cutter, NxFile
from surfaces import Sample, ball_centers

PLANES = np.array([0.0, 10.0, 15.0, 20.0, 30.0, 45.0, 60.0])
FEED = 60000.0
"""mm/min"""


def test_part() -> Sample:
    """Planes Xp of the ball centre, y from 0 to 60, one way; each pass begins and ends in a rapid."""
    nx = NxFile(("Passes Xp = 0, 10, 15, 20, 30, 45, 60 of the test part of Grandguillaume, Lavernhe, Tournier (2017),",
                 "ball cutter 16 mm, no feed that binds: what limits is the machine."), decimals=6)
    nx.operation("PASSES", Cutter(5, "BALL16", 16, 8, rpm=9000))
    x, y = np.meshgrid(PLANES, np.arange(61.0), indexing="ij")
    for tip in ball_centers(x, y, 8.0) - [0.0, 0.0, 8.0]:
        nx.rapid((tip[0, 0], 0, 30))
        nx.rapid(tuple(tip[0]))
        nx.feed(FEED)
        nx.go(tip[1:])
        nx.rapid((tip[-1, 0], 60, 30))
    nx.end()
    return nx.text(), nx.expected()
