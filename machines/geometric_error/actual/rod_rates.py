"""How fast the errors of a machine on six rods change as its slides move: bounds that hold wherever the slides may be.

A platform is held by W (dX, lever turn) = D dq, the rods' fixed lengths differentiated (II-15 of Company
2000, E-15): the rows of W are (r, b x r / lever) with the rods r and the arms b from the platform's point X
to their joints, D holds r along the slides. The columns J of W^-1 D say how each slide moves a platform. From
q to q' on a straight line

    W' (J' - J) = (D' - D) - (W' - W) J,     |W'^-1| <= 1 / (least singular value of W - |W' - W|),

where row k of the right side is (r_k' - r_k) . (u - v - w x b_k) - r_k' . (w x (b_k' - b_k)) with the slide's
direction u, the platform's v and w. What r and b change by follows from J along the line: a bound of J' - J
that comes out smaller than it was assumed holds all along the line, by continuity. The rate of the errors is
the difference of J with errors and without, exact at q, and what both may change by.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from machines.geometric_error.actual.apart_rates import Apart, Closure
from machines.geometric_error.actual.error_rates import LARGEST_TURN, AxisSizes, ErrorRates
from machines.geometric_error.actual.rods import RodErrors, RodFrame, inverted
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

_ROUNDS = 16
_GROWTH = 1.05
UNBOUNDED = 1e30
"""a rate where no bound was found: shorter pieces may have one"""


@dataclass(frozen=True, eq=False)
@arrays(place="N 3", turned="N 3 3", shift="N 3 K", turn="N 3 K", shift_change="N K",
        turn_change="N K", swing="N", about="3")
class PlatformMotion:
    """N platforms and how K slides move them.

    Attributes:
        place: (N, 3) X; turned: (N, 3, 3)
        shift, turn: (N, 3, K) mm and rad of the platform per mm of each slide
        shift_change, turn_change: (N, K) by which those may change while the slides go as far as they may
        swing: (N,) rad that the platform may turn by
        about: (3,) the direction of a platform's only turn, which leaves alone what lies along it; None of others
        closure: of square systems of rods, for what another platform may differ by; None of others
    """

    place: Floats
    turned: Floats
    shift: Floats
    turn: Floats
    shift_change: Floats
    turn_change: Floats
    swing: Floats
    about: Floats | None = None
    closure: Closure | None = None

    def of_point(self, arm: Floats) -> tuple[Floats, Floats]:
        """(mm per mm (N, 3, K), its largest change (N, K)) of the point at `arm` (N, 3) from X, machine frame."""
        rate, change = self.of_vector(arm)
        return self.shift + rate, self.shift_change + change

    def of_vector(self, vector: Floats) -> tuple[Floats, Floats]:
        """The same of a vector (N, 3) of the platform, which its shift does not move; rad per mm of a direction."""
        across = vector if self.about is None else np.cross(self.about, vector)
        size, turn = np.linalg.norm(across, axis=1)[:, None], np.linalg.norm(self.turn, axis=1)
        return (np.cross(self.turn, vector[:, :, None], axis=1),
                size * (self.turn_change + (turn + self.turn_change) * self.swing[:, None]))

    def translating(self) -> PlatformMotion:
        """Of a platform that does not turn, whatever six rods could do."""
        none = np.zeros(self.turn_change.shape)
        closure = None if self.closure is None else replace(self.closure, turn=none)
        return PlatformMotion(self.place, self.turned, self.shift, np.zeros(self.turn.shape), self.shift_change, none,
                              np.zeros(len(none)), closure=closure)


def platform_motion(frame: RodFrame, errors: RodErrors, q: Floats, pose: tuple[Floats, Floats],
                    reach: Floats) -> PlatformMotion:
    """The motion of platforms at `pose` (X (N, 3), R (N, 3, 3)) by slides q (N, K) that go by up to `reach` (N, K)."""
    place, turned = pose
    base, along = frame.carriage_lines(errors)
    joints = frame.joint + errors.platform
    ends = joints @ np.swapaxes(turned, 1, 2)
    rods = place[:, None] + ends - base - q[:, frame.leg, None] * along
    lever = max(float(np.linalg.norm(joints, axis=1).max()), 1.0)
    rows = np.concatenate([rods, np.cross(ends, rods) / lever], axis=2)
    own = frame.leg[:, None] == np.arange(q.shape[1])
    columns = inverted(rows) @ (np.einsum("nri,ri->nr", rods, along)[:, :, None] * own)
    shift, turn = columns[:, :3], columns[:, 3:] / lever
    rates = shift[:, None] + np.cross(turn[:, None], ends[:, :, :, None], axis=2) - (along[:, :, None] * own[:, None])
    loops = HeldLoops(np.linalg.svd(np.nan_to_num(rows), compute_uv=False)[:, -1], np.linalg.norm(rates, axis=2),
                   np.linalg.norm(turn, axis=1), np.linalg.norm(joints, axis=1),
                      np.broadcast_to(frame.length + errors.length, rods.shape[:2]), lever, reach,
                      np.zeros(rods.shape[:2]), np.zeros(rates.shape[:2] + reach.shape[1:]))
    change, swing = loops.held()
    moves = np.stack([along, np.zeros(along.shape)], axis=1)
    closure = loops.closure((place, turned, np.concatenate([shift, turn], axis=1)), (rods, ends), (moves, own), change)
    return PlatformMotion(place, turned, shift, turn, change, change / lever, swing, closure=closure)


@dataclass(frozen=True, eq=False)
@arrays(reach="N H", travels="H", shift="N K", gain="N _ K")
class HoldRates:
    """Rows of what holds a platform besides its rods (`kinematics/holds.py`), as `HeldLoops` needs them.

    Attributes:
        weight: mm, of the rows
        reach: (N, H) mm from X
        travels: (H,) 1 of planes that go with the platform
        shift: (N, K) mm of X per mm of each slide
        gain: (N, H, K) by which D may change in the rows of planes that go through feet
    """

    weight: float
    reach: Floats
    travels: Floats
    shift: Floats
    gain: Floats

    def change(self, swing: Floats, drift: Floats, turn: Floats, lever: float) -> tuple[Floats, Floats]:
        """((N, H) what the rows change by, (N, H, K) of (W' - W) J) while the platform turns by `swing` (N,) and X
        goes by `drift` (N,) at most; `turn` (N, K) rad per mm."""
        arm = self.reach * swing[:, None] + self.travels * drift[:, None]
        aside = self.travels * swing[:, None]
        wrong = self.weight * (aside[:, :, None] * self.shift[:, None] + arm[:, :, None] * turn[:, None])
        return self.weight * np.hypot(aside, arm / lever), wrong + self.gain


@dataclass(frozen=True, eq=False)
@arrays(radius="R", aside="N R", away="N R", shift="N K")
class RingRates:
    """Rods that end on rings round a line of the platform, at the point nearest to their feet, which do not move.

    Attributes:
        radius: (R,) mm, 0 of rods that end on no ring
        aside: (N, R) mm from the line to the foot
        away: (N, R) mm from X to the foot
        shift: (N, K) mm of X per mm of each drive
    """

    radius: Floats
    aside: Floats
    away: Floats
    shift: Floats

    def far(self, reach: Floats, shift: Floats, turn: Floats) -> Floats:
        """(N, R) mm that the feet go past the platform at most, which moves by `shift` and `turn` (N, K) mm and rad at most
        per mm of each drive."""
        drift = (shift * reach).sum(axis=1)[:, None]
        return np.asarray(drift + (turn * reach).sum(axis=1)[:, None] * (self.away + drift))

    def gone_round(self, reach: Floats, assumed: Floats, turn: Floats, lever: float) -> Floats:
        """(N, R) mm that the ends of rods go round on the platform while drives go by `reach` (N, K) and their columns
        change by `assumed` (N, K); `turn` (N, K) rad per mm; NaN where the foot may come to the line."""
        far = self.far(reach, self.shift + assumed, turn + assumed / lever)
        return np.where(self.radius > 0.0, self.radius * far / np.where(far < self.aside, self.aside - far, np.nan), 0.0)


@dataclass(frozen=True, eq=False)
@arrays(least="N", rates="N R K", turn="N K", arm="R", length="N R", reach="N K", bend="N R", gain="N R K")
class HeldLoops:
    """What bounds need of N platforms: least singular value of W (N,), mm that each rod's vector changes by
    per mm of each slide (N, R, K), rad of the platform (N, K), arms (R,) and lengths (N, R) at most, the lever,
    how far the slides go (N, K); what drives that are no slides do besides to rods (N, R) and to D (N, R, K)."""

    least: Floats
    rates: Floats
    turn: Floats
    arm: Floats
    length: Floats
    lever: float
    reach: Floats
    bend: Floats
    gain: Floats
    holds: HoldRates | None = None
    rings: RingRates | None = None

    def held(self) -> tuple[Floats, Floats]:
        """(by how much columns of J change at most (N, K), turns times the lever; rad that the platform turns
        (N,)); UNBOUNDED where W might become singular."""
        change, swing = np.full(self.reach.shape, UNBOUNDED), np.full(len(self.reach), UNBOUNDED)
        open_, guess = np.ones(len(swing), dtype=np.bool_), np.zeros(self.reach.shape)
        for _ in range(_ROUNDS):
            found, turned = self._change(guess)
            good = open_ & (found <= guess).all(axis=1)
            change[good], swing[good] = guess[good], turned[good]
            open_ &= ~good
            if not open_.any():
                break
            guess = found * _GROWTH + 1e-15
        return change, swing

    def closure(self, at: tuple[Floats, Floats, Floats], rods: tuple[Floats, Floats], drives: tuple[Floats, Bools],
                change: Floats, stretch: Floats | None = None) -> Closure:
        """For `Apart`, where columns of J change by `change` (N, K) at most; `at`: place, turn and twists (N, 6, K); `rods`:
        r and b (N, R, 3); `drives`: what A' is made of (R, 2, 3), and whose own a drive is (R, K)."""
        (place, turned, columns), (r, b), (moves, own) = at, rods, drives
        with np.errstate(over="ignore", invalid="ignore"):
            off, _, swing = self.rows_change(change)
            least = self.least - np.linalg.norm(off, axis=1)
            least = np.where(least > 0.0, least, np.nan)
            ends = np.hypot(1.0, self.arm / self.lever)[:, None] * change[:, None]
            away = self.turn[:, None] * (self.arm * swing[:, None])[:, :, None]
            rates = self.rates + ends + away + self.bend[:, :, None]
            turn, shift = self.turn + change / self.lever, np.linalg.norm(columns[:, :3], axis=1) + change
        stretch = np.zeros(len(moves)) if stretch is None else stretch
        return Closure(place, turned, columns, r, b, self.arm, moves, own.astype(np.float64), stretch, self.length, least,
                       rates, shift, turn, self.lever)

    def _change(self, assumed: Floats) -> tuple[Floats, Floats]:
        """The same while columns of J change by up to `assumed`; NaN where there is no bound."""
        with np.errstate(over="ignore", invalid="ignore"):
            off, wrong, swing = self.rows_change(assumed)
            off = np.linalg.norm(off, axis=1)
            grip = 1.0 / np.where(off < self.least, self.least - off, np.nan)
            return grip[:, None] * np.linalg.norm(wrong, axis=1), swing

    def rows_change(self, assumed: Floats) -> tuple[Floats, Floats, Floats]:
        """(mm that rows of W change by (N, R), (D' - D) - (W' - W) J (N, R, K), rad of the platform (N,)) at most."""
        swing = ((self.turn + assumed / self.lever) * self.reach).sum(axis=1)
        drift = (assumed * self.reach).sum(axis=1)[:, None] * np.hypot(1.0, self.arm / self.lever)
        gone_round = 0.0 if self.rings is None else self.rings.gone_round(self.reach, assumed, self.turn, self.lever)
        arm = self.arm * swing[:, None] + gone_round
        away = (self.turn * self.reach).sum(axis=1)[:, None] * arm
        rod = (self.rates * self.reach[:, None]).sum(axis=2) + drift + away + self.bend + gone_round
        off = np.hypot(rod, (self.arm * rod + arm * self.length) / self.lever)
        wrong = rod[:, :, None] * self.rates + (self.length * arm)[:, :, None] * self.turn[:, None] + self.gain
        if self.holds is not None:
            far = ((self.holds.shift + assumed) * self.reach).sum(axis=1)
            more = self.holds.change(swing, far, self.turn, self.lever)
            off, wrong = np.hstack([off, more[0]]), np.concatenate([wrong, more[1]], axis=1)
        return off, wrong, swing


@dataclass(frozen=True, eq=False, kw_only=True)
@arrays(spans="R", stretch="N", loose="N R K", moved="N R K", size="N", shift="N K")
class SharedLoops(HeldLoops):
    """Of rods that are more than the freedoms, of fixed lengths: they share what is too much by least squares, G^T g = 0.

    g (R) are their stretches, G = dg/dx = W / l, B = -dg/dq = D / l, J0 = (G^T G)^-1 G^T B and e = B - G J0, of which G^T e
    is 0. With S the sum of g_r d2g_r/dx2, (G^T G + S) J = G^T B - (dG/dq)^T g anywhere, so that

        (G'^T G' + S') (J' - J0) = G'^T ((B' - B) - (G' - G) J0) + (G' - G)^T e - (dG'/dq)^T g' - S' J0.

    Attributes:
        spans: (R,) mm, l
        stretch: (N,) mm, |g|
        loose: (N, R, K) e; moved: (N, R, K) |dG/dq| at most; size: (N,) |G|; shift: (N, K) mm of X by J0
    """

    spans: Floats
    stretch: Floats
    loose: Floats
    moved: Floats
    size: Floats
    shift: Floats

    def _change(self, assumed: Floats) -> tuple[Floats, Floats]:
        with np.errstate(over="ignore", invalid="ignore"):
            rows, each, swing = self.rows_change(assumed)
            off, wrong = np.linalg.norm(rows / self.spans, axis=1), np.linalg.norm(each / self.spans[:, None], axis=1)
            loose, size = np.linalg.norm(self.loose, axis=1), self.size + off
            more = ((loose + wrong + size[:, None] * assumed) * self.reach).sum(axis=1)
            stretch = self.stretch + more
            share = self.arm / self.lever
            bend = (1.0 + share) ** 2 / self.spans + self.arm / self.lever**2 * (1.0 + stretch[:, None] / self.spans)
            second = stretch * np.linalg.norm(bend, axis=1)
            least = np.where(off < self.least, self.least - off, np.nan)
            ends = self.shift[:, None] + self.arm[:, None] * self.turn[:, None]
            bent = ((1.0 + share) / self.spans)[:, None] * ends + share[:, None] * self.turn[:, None]
            slopes = np.linalg.norm(bent, axis=1) + np.linalg.norm(self.moved, axis=1)
            rest = off[:, None] * loose + stretch[:, None] * slopes
            soft = 1.0 - second / least**2
            found = (wrong / least[:, None] + rest / least[:, None] ** 2) / np.where(soft > 0.0, soft, np.nan)[:, None]
            return found, swing


@dataclass(frozen=True, eq=False)
@arrays(tip="N K", axis="N K", nominal_tip="N K", nominal_axis="N K", apart="N", turned="N")
class ToolRates:
    """N tools on the platform: mm (or rad, of the axis) per mm of each slide with errors less without, and
    how large it is without them at most (N, K) each; how far apart the tips and how many rad the platforms
    are, at most (N,)."""

    tip: Floats
    axis: Floats
    nominal_tip: Floats
    nominal_axis: Floats
    apart: Floats
    turned: Floats


def tool_rates(actual: PlatformMotion, nominal: PlatformMotion, arms: tuple[Floats, Floats], axes: tuple[Floats, Floats],
                reach: Floats, arm_reach: Floats, axis_reach: Floats) -> ToolRates:
    """Tools at `arms` (N, 3) from X with `axes` (N, 3), machine frame, with errors and without, while slides
    go by `reach` (N, K), the arms' ends move on the platform by up to `arm_reach` (N,) mm and the axes turn
    on it by `axis_reach` (N,)."""
    rates, sizes = [], []
    for one, other in ((actual.of_point(arms[0]), nominal.of_point(arms[1])),
                       (actual.of_vector(axes[0]), nominal.of_vector(axes[1]))):
        rates.append(np.linalg.norm(one[0] - other[0], axis=1) + one[1] + other[1])
        sizes.append(np.linalg.norm(other[0], axis=1) + other[1])
    spins = [np.linalg.norm(m.turn, axis=1) + m.turn_change for m in (actual, nominal)]
    for k, moved in enumerate((arm_reach, axis_reach)):
        rates[k] = rates[k] + (spins[0] + spins[1]) * moved[:, None]
        sizes[k] = sizes[k] + spins[1] * moved[:, None]
    turn_rate = np.linalg.norm(actual.turn - nominal.turn, axis=1) + actual.turn_change + nominal.turn_change
    if actual.closure is not None and nominal.closure is not None:
        apart, angles = Apart(actual.closure, nominal.closure, reach).rates()
        own, turns_apart = nominal.closure.turn, apart / actual.closure.lever
        for k, (vectors, moved, shifted) in enumerate(((arms, arm_reach, 1.0), (axes, axis_reach, 0.0))):
            size = np.linalg.norm(vectors[0], axis=1) + moved
            off = _apart(actual.turned, nominal.turned, vectors) + angles * size + 2.0 * moved
            with np.errstate(invalid="ignore"):  # where nothing is known infinity meets zero
                rates[k] = np.fmin(rates[k], shifted * apart + turns_apart * size[:, None] + own * off[:, None])
        turn_rate = np.fmin(turn_rate, turns_apart)
    tips = actual.place + arms[0] - nominal.place - arms[1]
    angle = np.linalg.norm(np.einsum("nji,njk->nik", nominal.turned, actual.turned) - np.eye(3), axis=(1, 2))
    return ToolRates(rates[0], rates[1], sizes[0], sizes[1], np.linalg.norm(tips, axis=1) + (rates[0] * reach).sum(axis=1),
                      angle + (turn_rate * reach).sum(axis=1))


def _apart(one: Floats, other: Floats, vectors: tuple[Floats, Floats]) -> Floats:
    """(N,) between vectors (N, 3) of two bodies, turned (N, 3, 3), as each has it."""
    first, second = (np.einsum("nji,nj->ni", turned, v) for turned, v in zip((one, other), vectors, strict=True))
    return np.asarray(np.linalg.norm(first - second, axis=1))


def with_rotary(tool: ToolRates, size: AxisSizes, spindle: AxisSizes, arm: Floats, length: float,
                at_spindle: bool) -> ErrorRates | None:
    """Rates of K slides and the rotary axis that stands under the part or carries the spindle (the formulas of `error_rates`
    for one turning axis). `arm` (N,): the tip's largest distance from the axis; None where errors are too large."""
    own = size.turn + 2.0 * size.line_turn + size.zero
    if own + spindle.line_turn > LARGEST_TURN:
        return None
    before = np.where(at_spindle, tool.turned, 0.0)
    whole = own + spindle.line_turn + tool.turned
    moved = spindle.line_shift + spindle.line_turn * abs(length) if at_spindle else tool.apart
    moved = (moved + size.shift + own * arm + 2.0 * size.line_shift) / (1.0 - np.minimum(whole, 0.5))
    far = arm + moved
    turning = ((before + size.turn) * (far + size.line_shift) + size.line_turn * arm + moved + size.line_shift
               + size.shift_slope + size.turn_slope * far)
    around = before + size.turn + size.line_turn + whole + size.turn_slope
    turned_by = 0.0 if at_spindle else own
    tip = np.column_stack([tool.tip + turned_by * tool.nominal_tip, turning])
    axis = np.column_stack([tool.axis + turned_by * tool.nominal_axis, around])
    none = np.zeros(tool.tip.shape)
    return ErrorRates(tip, axis, np.column_stack([none, 0.5 * (size.shift_apart + size.turn_apart * far)]),
                      np.column_stack([none, np.full(len(far), 0.5 * size.turn_apart)]))
