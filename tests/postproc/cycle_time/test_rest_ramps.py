"""What rests cost at the least: no motion of random jerks is ahead of it, and single moves take just that."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.cycle_time.bound import lower_bound
from postproc.cycle_time.estimate import timed, total
from postproc.cycle_time.rest_ramps import from_rest
from tests.postproc.time_kit import HEAD, blocks, machine, model

STEP = 1e-3


def motions(seed: int, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Limits V, A, J (N,) and places (N, T) each STEP of motions from rest that keep them, their jerks drawn at random."""
    rng = np.random.default_rng(seed)
    most = np.stack([10.0 ** rng.uniform(a, b, count) for a, b in ((0, 2.5), (2, 3.5), (3, 5))])
    v, a, x, places = np.zeros(count), np.zeros(count), np.zeros(count), [np.zeros(count)]
    wanted = np.ones(count)
    for _ in range(600):
        wanted = np.where(rng.uniform(size=count) < 0.02, rng.choice([-1.0, 0.0, 1.0, 1.0], count), wanted)
        j = np.clip(wanted * most[2], (-most[1] - a) / STEP, (most[1] - a) / STEP)
        # Up to V only as fast as the acceleration can still be taken off again, in whole steps.
        next_a = np.maximum(a + j * STEP, 0.0)
        over = v + a * STEP + next_a * STEP + next_a**2 / (2.0 * most[2]) > most[0]
        j = np.where(over, -most[2], j)
        x, v, a = x + v * STEP + a * STEP**2 / 2.0 + j * STEP**3 / 6.0, v + a * STEP + j * STEP**2 / 2.0, a + j * STEP
        back = np.maximum(v, 0.0)
        a, v = np.where(v < 0.0, 0.0, a), back
        places.append(np.maximum(x, 0.0))
    return most, np.array(places).T, np.arange(601) * STEP


@pytest.mark.parametrize("seed", range(3))
def test_no_motion_from_rest_is_ahead(seed: int) -> None:
    (velocity, acceleration, jerk), places, t = motions(seed, 60)
    least = from_rest(places, velocity[:, None], acceleration[:, None], jerk[:, None])
    assert (least <= t + 1e-6).all()
    assert (least[:, -1] > 0.0).all() and (least[:, -1] > 0.8 * t[-1]).any()


def test_ramps_of_full_jerk_take_just_that() -> None:
    """J t^3/6 at first; behind the ramp to V, V (t - half of it), whether A is reached or not."""
    for v, a, j in ((50.0, 2000.0, 5000.0), (300.0, 500.0, 5000.0)):
        ramp = v / a + a / j if v > a * a / j else 2.0 * (v / j) ** 0.5
        early = 0.4 * min(a / j, (v / j) ** 0.5)
        found = from_rest(np.array([j * early**3 / 6.0, v * (0.5 * ramp + 0.3)]), *(np.full(2, one) for one in (v, a, j)))
        assert found == pytest.approx([early, ramp + 0.3], rel=1e-12)


def test_a_line_between_rests_takes_its_bound_on_the_control() -> None:
    """F3000 is not reached in the second line; the bound has each wait for the axes to be in position."""
    b, m = blocks(f"{HEAD}\nF3000\nG1 X40\nG4 P0.5\nG1 X45"), model("control")
    taken, least = total(b, timed(b, m)), lower_bound(b, m)
    assert least <= taken <= least + 3 * m.cycle
    without = lower_bound(b, model("ideal"))
    assert least - without > 0.3 * 2 * (50.0 / float(machine().limits.jerk[0])) ** 0.5
