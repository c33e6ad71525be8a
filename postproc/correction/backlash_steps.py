"""Words chosen one block after the other, so that axes that lose motion stand where they should, rounding and all.

Every block may end at any words X, Y, Z of the grid of last decimals. What the machine with errors then makes
of them follows from the approach directions of its axes, and these from the words before and the words chosen
(play operator, see `machines.geometric_error.actual.lost_motion`). Words that were planned stay where the tip
is as near as rounding lets it be; else those are taken that bring it nearest: by the approach directions that
the words themselves make, by other approach directions, by last decimals next to. Approach directions by
which the next block does not begin count a little: it would first take up what they are off by. So do, where
words are machine coordinates, steps back by less than an axis loses: who takes the approach direction of an axis
for the sign of its last step sees another machine there. The walk itself is the loop of `backlash_steps_loop`.
"""

from __future__ import annotations

import numpy as np

from postproc.correction.backlash_steps_loop import walk_all
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.compiled import chosen
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

COMPILE_FROM = 10_000
"""blocks from which compiling pays"""
PLAIN, BETWEEN = 0.05, 0.25
"""weight of what the tip is off by on a machine whose approach directions are the signs of the last steps;
between points of the CL file"""
RESTS = 1e-9
"""part of its lost motion that is no step of a joint"""
NEARER = 1e-9
"""mm that words next to must come nearer"""
REACH = 32.0, 8.0, 2.0, 1.0
"""last decimals that are tried next to"""


@dataclass(frozen=True)
@arrays(off="K 3", by_approach="K 3 T", tip_rates="K 3 3", back="K T 3", gap="K T", bend="3 K T", last="K T", later="3 K T",
        goes_on="K T", weight="K", plain="K", near="K", enough="K", free="K 3", like="K")
class BlockEnds:
    """The ends of K blocks at their planned words, and what T joints that lose motion do there; mm and rad.

    Attributes:
        off: (K, 3) tip less wanted by mean approach directions; by_approach: (K, 3, T) more per approach direction
        tip_rates: (K, 3, 3) tip per last decimal of X, Y, Z; back: (K, T, 3) joints per last decimal
        gap: (K, T) what the joints lose
        bend: (3, K, T) shift, low, high: what planned motion does to the approach directions but for the last
            run one direction, which is `last` (K, T); of a straight block all is that run
        later: (3, K, T) what happens to the moves between the end and the place where the tip counts (bottom of a hole)
        goes_on: (K, T) approach direction by which the next block begins, 0 where the joint rests; weight:
            (K,) of what its beginning is off by next to what this end is
        plain: (K,) blocks whose words are machine coordinates
        near: (K,) what rounding may leave; enough: (K,) what is not looked for farther off
        free: (K, 3) 1 for words X, Y, Z that may be changed, else 0
        like: (K,) block before whose steps a block takes, -1 for its own
    """

    off: Floats
    by_approach: Floats
    tip_rates: Floats
    back: Floats
    gap: Floats
    bend: Floats
    last: Floats
    later: Floats
    goes_on: Floats
    weight: Floats
    plain: Bools
    near: Floats
    enough: Floats
    free: Floats
    like: Ints


def walk(ends: BlockEnds) -> tuple[Floats, Floats]:
    """Steps (K, 3) of whole last decimals to add to the words X, Y, Z of blocks, and the approach directions
    (K, T) at their ends then."""
    settings = np.array([PLAIN, BETWEEN]), RESTS, NEARER, np.array(REACH)
    run = chosen(walk_all, len(ends.off), COMPILE_FROM)
    steps, approaches = run(*map(np.ascontiguousarray, vars(ends).values()), *settings)
    return steps, approaches
