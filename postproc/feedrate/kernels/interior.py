"""Plain loops of `interior.py`, compiled for long motions; `NumpySteps` there is the reference.

Values of LANES neighbouring knots stand together in flat arrays: block b of w starts at b COMMON LANES, joint
j of block b of v at (b J + j) PER_JOINT LANES, and field f follows at f LANES. What lives only while a block is worked
on stands in h, one block that stays in the nearest cache: memory is what long motions wait for. Constant distances and
unsigned indices let the compiler prove that nothing overlaps, so that it turns the loops over lanes into
vector instructions; the loop over joints stays outside them.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from toolpaths.compiled import loop

_N = np.uint64
LANES = 32
COMMON, PER_JOINT, HERE = 21, 11, 21
L = _N(LANES)
_ONE, _TWO, _THREE = _N(1), _N(2), _N(3)
# Fields of w: stencil (0 to 8), then these. Fields of v: q', q'', q''', four z, four dz/z.
ICAP, WEIGHT, TIGHT_A, TIGHT_J, PAD = _N(9 * LANES), _N(10 * LANES), _N(11 * LANES), _N(12 * LANES), _N(13 * LANES)
ZV, RV = _N(14 * LANES), _N(15 * LANES)
X0, X1, X2, ROOT, HALF = _N(16 * LANES), _N(17 * LANES), _N(18 * LANES), _N(19 * LANES), _N(20 * LANES)
BLOCK = _N(COMMON * LANES)
F1, F2, F3, F4, F5, F6, F7, F8 = (_N(i * LANES) for i in range(1, 9))
F9, F10, F11 = _N(9 * LANES), _N(10 * LANES), _N(11 * LANES)
# Fields of h: x, x', x'', roots and tightening again, sums over the joints; changes of x, x', x''.
Y0, Y1, Y2, YROOT, YHALF, YA, YJ = (_N(i * LANES) for i in range(7))
G0, G1, G2 = _N(7 * LANES), _N(8 * LANES), _N(9 * LANES)
H00, H01, H02, H11, H12, H22 = (_N(i * LANES) for i in range(10, 16))
SUM_Z, GAP = _N(16 * LANES), _N(17 * LANES)
B0, B1, B2 = _N(18 * LANES), _N(19 * LANES), _N(20 * LANES)


@loop
def _knots(w: Any, h: Any, c: Any, b: Any, k: Any, mu: Any, dual: Any) -> None:
    """Block b of w from coefficients c[k:]: x and derivatives, roots, the velocity row; sums of the others begun in h."""
    for i in range(L):
        p = b + i
        c0, c1, c2 = c[k + i], c[k + i + _ONE], c[k + i + _TWO]
        x = w[p] * c0 + w[p + F1] * c1 + w[p + F2] * c2 + w[p + PAD]
        x1 = w[p + F3] * c0 + w[p + F4] * c1 + w[p + F5] * c2
        x2 = w[p + F6] * c0 + w[p + F7] * c1 + w[p + F8] * c2
        root = 1.0 / np.sqrt(x)
        half = 0.5 * root * root * root
        w[p + X0], w[p + X1], w[p + X2], w[p + ROOT], w[p + HALF] = x, x1, x2, root, half
        h[i], h[i + Y1], h[i + Y2], h[i + YROOT], h[i + YHALF] = x, x1, x2, root, half
        h[i + YA], h[i + YJ] = w[p + TIGHT_A], w[p + TIGHT_J]
        icap = w[p + ICAP]
        slack = 1.0 - x * icap
        over = 1.0 / slack
        z = w[p + ZV] * (1.0 + dual * w[p + RV])
        w[p + ZV] = z
        h[i + GAP] = z * slack
        h[i + G0], h[i + G1], h[i + G2] = w[p + WEIGHT] * half - mu * over * icap, 0.0, 0.0
        h[i + H00], h[i + H01], h[i + H02] = z * over * icap * icap, 0.0, 0.0
        h[i + H11], h[i + H12], h[i + H22] = 0.0, 0.0, 0.0
        h[i + SUM_Z] = 0.0


@loop
def _joint(h: Any, v: Any, m: Any, q: Any, r: Any, ia: Any, ij: Any, mu: Any, dual: Any) -> None:
    """Add the rows of one joint, block q of v and r of m, to h; ia, ij one over its limits of acceleration and jerk."""
    for i in range(L):
        o = q + i
        x, x1, half = h[i], h[i + Y1], h[i + YHALF]
        scale = ia * h[i + YA]
        a0, a1 = v[o + F1] * scale, 0.5 * v[o] * scale
        use = a0 * x + a1 * x1 + m[r + i]
        s0, s1 = 1.0 - use, 1.0 + use
        z0, z1 = v[o + F3] * (1.0 + dual * v[o + F7]), v[o + F4] * (1.0 + dual * v[o + F8])
        v[o + F3], v[o + F4] = z0, z1
        over = 1.0 / (s0 * s1)
        i0, i1 = s1 * over, s0 * over
        ratio, pull = z0 * i0 + z1 * i1, mu * (i1 - i0)
        gap = z0 * s0 + z1 * s1
        g0, g1 = a0 * pull, a1 * pull
        h00, h01, h11 = ratio * a0 * a0, ratio * a0 * a1, ratio * a1 * a1
        scale = ij * h[i + YJ]
        j0, j1, j2 = v[o + F2] * scale, 1.5 * v[o + F1] * scale, 0.5 * v[o] * scale
        use = j0 * x + j1 * x1 + j2 * h[i + Y2]
        s0, s1 = h[i + YROOT] - use, h[i + YROOT] + use
        z0, z1 = v[o + F5] * (1.0 + dual * v[o + F9]), v[o + F6] * (1.0 + dual * v[o + F10])
        v[o + F5], v[o + F6] = z0, z1
        over = 1.0 / (s0 * s1)
        i0, i1 = s1 * over, s0 * over
        r0, r1 = z0 * i0, z1 * i1
        ratio, mixed, pull = r0 + r1, half * (r0 - r1), mu * (i1 - i0)
        h[i + GAP] += gap + z0 * s0 + z1 * s1
        h[i + SUM_Z] += z0 + z1
        h[i + G0] += g0 + j0 * pull - half * mu * (i0 + i1)
        h[i + G1] += g1 + j1 * pull
        h[i + G2] += j2 * pull
        h[i + H00] += h00 + ratio * (j0 * j0 + half * half) + 2.0 * mixed * j0
        h[i + H01] += h01 + (ratio * j0 + mixed) * j1
        h[i + H02] += (ratio * j0 + mixed) * j2
        h[i + H11] += h11 + ratio * j1 * j1
        h[i + H12] += ratio * j1 * j2
        h[i + H22] += ratio * j2 * j2


@loop
def _mapped(w: Any, h: Any, b: Any) -> None:
    """The Hessian by x, x', x'' in h becomes one by the three coefficients, S' H S with the stencil S; the gradient S' G."""
    for i in range(L):
        p = b + i
        root = h[i + YROOT]
        h00 = h[i + H00] + 1.5 * root * root * h[i + YHALF] * max(w[p + WEIGHT] - h[i + SUM_Z], 0.0)
        h01, h02, h11, h12, h22 = h[i + H01], h[i + H02], h[i + H11], h[i + H12], h[i + H22]
        s, t, u = w[p], w[p + F3], w[p + F6]
        a0, a1, a2 = h00 * s + h01 * t + h02 * u, h01 * s + h11 * t + h12 * u, h02 * s + h12 * t + h22 * u
        h[i + H00] = s * a0 + t * a1 + u * a2
        s, t, u = w[p + F1], w[p + F4], w[p + F7]
        h[i + H01] = s * a0 + t * a1 + u * a2
        b0, b1, b2 = h00 * s + h01 * t + h02 * u, h01 * s + h11 * t + h12 * u, h02 * s + h12 * t + h22 * u
        h[i + H11] = s * b0 + t * b1 + u * b2
        s, t, u = w[p + F2], w[p + F5], w[p + F8]
        h[i + H02] = s * a0 + t * a1 + u * a2
        h[i + H12] = s * b0 + t * b1 + u * b2
        a0, a1, a2 = h00 * s + h01 * t + h02 * u, h01 * s + h11 * t + h12 * u, h02 * s + h12 * t + h22 * u
        h[i + H22] = s * a0 + t * a1 + u * a2
        g0, g1, g2 = h[i + G0], h[i + G1], h[i + G2]
        h[i + G0] = w[p] * g0 + w[p + F3] * g1 + w[p + F6] * g2
        h[i + G1] = w[p + F1] * g0 + w[p + F4] * g1 + w[p + F7] * g2
        h[i + G2] = w[p + F2] * g0 + w[p + F5] * g1 + w[p + F8] * g2


@loop
def assemble(w: Any, v: Any, h: Any, c: Any, inverse: Any, middle: Any, blocks: Any, mu: Any, dual: Any, low: Any,
             force: Any) -> Any:
    """Update z by the dual step; add the knots' parts of the Newton equations. Returns gap and time.

    w, v flat blocks, h room of a block, c coefficients padded to the lanes, inverse (2, J) of the limits of acceleration
    and jerk, middle of the acceleration rows by block and joint, or one block of zeros for all; lower band low (3, n) and right side force (n,) in the coefficients, n padded to the lanes.
    """
    joints = _N(inverse.shape[1])
    own = _N(0 if middle.shape[0] == LANES else LANES)
    gap, time = 0.0, 0.0
    for block in range(blocks):
        b, k = block * BLOCK, block * L
        _knots(w, h, c, b, k, mu, dual)
        for joint in range(joints):
            at = block * joints + joint
            _joint(h, v, middle, at * F11, at * own, inverse[0, joint], inverse[1, joint], mu, dual)
        for i in range(L):
            gap += (1.0 - w[b + i + PAD]) * h[i + GAP]
            time += w[b + i + WEIGHT] * h[i + YROOT]
        _mapped(w, h, b)
        for i in range(L):
            n = k + i
            low[0, n] += h[i + H00]
            low[1, n] += h[i + H01]
            low[2, n] += h[i + H02]
            force[n] += h[i + G0]
            low[0, n + _ONE] += h[i + H11]
            low[1, n + _ONE] += h[i + H12]
            force[n + _ONE] += h[i + G1]
            low[0, n + _TWO] += h[i + H22]
            force[n + _TWO] += h[i + G2]
    return gap, time


@loop
def pentadiagonal(low: Any, x: Any, inverse: Any, below: Any) -> Any:
    """Solve by LDL': lower band (3, n), x (n,) right side, then answer; room inverse (n,), below (2, n).

    False where the matrix is not positive definite.
    """
    n = x.shape[0]
    # l: rows of L; d: entries below before they are divided by their pivot; y: right sides of the two rows before.
    l1, l2, second, a1, d2, d22, y1, y2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(n):
        pivot = low[0, i] - l1 * a1 - second * d22
        if not pivot > 0.0:
            return False
        y = x[i] - l1 * y1 - second * y2
        a1 = low[1, i] - d2 * l1
        over = 1.0 / pivot
        second, d22, d2 = l2, d2, low[2, i]
        l1, l2 = a1 * over, d2 * over
        inverse[i], below[0, i], below[1, i] = over, l1, l2
        y2, y1, x[i] = y1, y, y
    y1, y2 = 0.0, 0.0
    for back in range(n):
        i = n - 1 - back
        y = x[i] * inverse[i] - below[0, i] * y1 - below[1, i] * y2
        y2, y1, x[i] = y1, y, y
    return True


@loop
def _changes(w: Any, h: Any, dc: Any, b: Any, k: Any, mu: Any) -> None:
    """Changes of x, x', x'' of block b for the step dc, in h; the velocity row and its falls."""
    for i in range(L):
        p = b + i
        c0, c1, c2 = dc[k + i], dc[k + i + _ONE], dc[k + i + _TWO]
        dx = w[p] * c0 + w[p + F1] * c1 + w[p + F2] * c2
        h[i + B0] = dx
        h[i + B1] = w[p + F3] * c0 + w[p + F4] * c1 + w[p + F5] * c2
        h[i + B2] = w[p + F6] * c0 + w[p + F7] * c1 + w[p + F8] * c2
        h[i], h[i + Y1], h[i + Y2] = w[p + X0], w[p + X1], w[p + X2]
        h[i + YROOT], h[i + YHALF], h[i + YA], h[i + YJ] = w[p + ROOT], w[p + HALF], w[p + TIGHT_A], w[p + TIGHT_J]
        slack = 1.0 - w[p + X0] * w[p + ICAP]
        z = w[p + ZV]
        over = 1.0 / (slack * z)
        fall = dx * w[p + ICAP] * z * over
        rate = mu * over - 1.0 + fall
        w[p + RV] = rate
        h[i + G0], h[i + G1] = fall, -rate


@loop
def _joint_changes(h: Any, v: Any, m: Any, q: Any, r: Any, ia: Any, ij: Any, mu: Any) -> None:
    """Relative changes of z of one joint, block q of v and r of m; one division serves a pair: 1 / (slack z) times z or slack."""
    for i in range(L):
        o = q + i
        x, x1, dx, dx1 = h[i], h[i + Y1], h[i + B0], h[i + B1]
        scale = ia * h[i + YA]
        a0, a1 = v[o + F1] * scale, 0.5 * v[o] * scale
        use, change = a0 * x + a1 * x1 + m[r + i], a0 * dx + a1 * dx1
        s0, s1, z0, z1 = 1.0 - use, 1.0 + use, v[o + F3], v[o + F4]
        o0, o1 = 1.0 / (s0 * z0), 1.0 / (s1 * z1)
        f0, f1 = change * z0 * o0, -change * z1 * o1
        r0, r1 = mu * o0 - 1.0 + f0, mu * o1 - 1.0 + f1
        v[o + F7], v[o + F8] = r0, r1
        scale = ij * h[i + YJ]
        j0, j1, j2 = v[o + F2] * scale, 1.5 * v[o + F1] * scale, 0.5 * v[o] * scale
        use = j0 * x + j1 * x1 + j2 * h[i + Y2]
        change = j0 * dx + j1 * dx1 + j2 * h[i + B2]
        bend = h[i + YHALF] * dx
        s0, s1, z0, z1 = h[i + YROOT] - use, h[i + YROOT] + use, v[o + F5], v[o + F6]
        o0, o1 = 1.0 / (s0 * z0), 1.0 / (s1 * z1)
        f2, f3 = (bend + change) * z0 * o0, (bend - change) * z1 * o1
        r2, r3 = mu * o0 - 1.0 + f2, mu * o1 - 1.0 + f3
        v[o + F9], v[o + F10] = r2, r3
        h[i + G0] = max(h[i + G0], max(max(f0, f1), max(f2, f3)))
        h[i + G1] = max(h[i + G1], -min(min(r0, r1), min(r2, r3)))


@loop
def direction(w: Any, v: Any, h: Any, dc: Any, inverse: Any, middle: Any, blocks: Any, mu: Any) -> Any:
    """Relative changes of z for the step dc; returns the largest relative decrease of a slack and of a z.

    One over them are the steps to the nearest bound. Arguments as of `assemble`.
    """
    joints = _N(inverse.shape[1])
    own = _N(0 if middle.shape[0] == LANES else LANES)
    primal, dual = 0.0, 0.0
    for block in range(blocks):
        b = block * BLOCK
        _changes(w, h, dc, b, block * L, mu)
        for joint in range(joints):
            at = block * joints + joint
            _joint_changes(h, v, middle, at * F11, at * own, inverse[0, joint], inverse[1, joint], mu)
        for i in range(L):
            primal, dual = max(primal, h[i + G0]), max(dual, h[i + G1])
    return primal, dual
