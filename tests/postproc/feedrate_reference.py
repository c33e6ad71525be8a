"""Converged optima by other people's solvers, for the same discretised problems."""

from __future__ import annotations

from fractions import Fraction

import clarabel
import numpy as np
from scipy import sparse
from scipy.optimize import linprog

from postproc.feedrate.problem import SpeedProblem
from toolpaths.arrays import Floats


def least_jerk_time(problem: SpeedProblem, c: Floats, rounds: int = 60, close: float = 1e-6) -> float:
    """Sequence of convex problems from the feasible c (K + 2,): x^-1/2 of the jerk rows by its tangent, the objective exact.

    Each is min sum w t with t >= x^-1/2, a power cone per knot. Unknowns are relative to the last solution.
    """
    best, idle = np.inf, 0
    for _ in range(rounds):
        better, time = _convex(problem, c)
        if better is None:  # numerical trouble of the solver; a little slower is feasible, too
            c = 0.99 * c
            continue
        idle = idle + 1 if time > (1.0 - close) * best else 0
        c, best = better, min(best, time)
        if idle == 3:
            return best
    raise ArithmeticError("the reference did not converge")


def _convex(problem: SpeedProblem, c: Floats) -> tuple[Floats | None, float]:
    basis, knots = problem.basis, problem.basis.knots
    order = [_operator(basis.stencil[i]) @ sparse.diags(c) @ _tie(knots + 2, basis.tied) for i in range(3)]
    x = basis.values(c)[0]
    joints, n = len(problem.dq), order[0].shape[1]
    a, j = problem.acceleration_rows(), problem.jerk_rows()
    root = sparse.diags(x**-0.5)
    rows, right = [sparse.diags(1.0 / problem.cap) @ order[0], -sparse.eye(n)], [np.ones(knots), np.zeros(n)]
    for i in range(joints):
        use = sum(sparse.diags(a[k, i]) @ order[k] for k in range(2))
        rows += [use, -use]
        right += [np.ones(knots)] * 2
        # Divided by x^-1/2 at the last solution, so that all rows are of order one.
        use = sparse.diags(x**0.5) @ sum(sparse.diags(j[k, i]) @ order[k] for k in range(3))
        tangent = 0.5 * sparse.diags(1.0 / x) @ order[0]
        rows += [use + tangent, tangent - use]
        right += [np.full(knots, 1.5)] * 2
    linear = sparse.vstack(rows)
    count = linear.shape[0]
    cone = sparse.lil_matrix((3 * knots, n + knots))
    cone[0::3, :n] = -(sparse.diags(1.0 / x) @ order[0])
    cone[1::3, n:] = -sparse.eye(knots)
    fixed = np.zeros(3 * knots)
    fixed[2::3] = 1.0
    matrix = sparse.vstack((sparse.hstack((linear, sparse.csc_matrix((count, knots)))), cone)).tocsc()
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_rel = settings.tol_gap_abs = settings.tol_feas = 1e-8
    goal = np.concatenate((np.zeros(n), problem.weight * root.diagonal()))
    solver = clarabel.DefaultSolver(sparse.csc_matrix((n + knots,) * 2), goal / goal.sum(), matrix,
                                    np.concatenate((*right, fixed)),
                                    [clarabel.NonnegativeConeT(count)] + [clarabel.PowerConeT(1.0 / 3.0)] * knots, settings)
    found = solver.solve()
    if found.status not in (clarabel.SolverStatus.Solved, clarabel.SolverStatus.AlmostSolved):
        return None, np.inf
    answer = np.asarray(found.x)[:n]
    c = c * (_tie(knots + 2, basis.tied) @ answer)
    return c, float(np.sum(problem.weight * basis.values(c)[0] ** -0.5))


def relaxed_time(problem: SpeedProblem, scale: Floats) -> float:
    """A certified lower bound of the time on these knots, from the dual of one convex relaxation.

    min sum w t with t >= x^-1/2 free to be larger, and |row of jerk| <= J t in the place of J x^-1/2: each motion within the
    limits is one of its points, and none of its points costs less than the dual value. `scale` (K + 2,) > 0 are
    coefficients of about the size of the optimum.
    """
    basis, knots = problem.basis, problem.basis.knots
    order = [_operator(basis.stencil[i]) @ sparse.diags(scale) @ _tie(knots + 2, basis.tied) for i in range(3)]
    x = basis.values(scale)[0]
    n, a, j = order[0].shape[1], problem.acceleration_rows(), problem.jerk_rows()
    none = sparse.csc_matrix((knots, knots))
    linear = [sparse.hstack((sparse.diags(1.0 / problem.cap) @ order[0], none)),
              sparse.hstack((-sparse.eye(n), sparse.csc_matrix((n, knots))))]
    right = [np.ones(knots), np.zeros(n)]
    for i in range(len(problem.dq)):
        use = sum(sparse.diags(a[k, i]) @ order[k] for k in range(2))
        linear += [sparse.hstack((sign * use, none)) for sign in (1.0, -1.0)]
        use = sparse.diags(x**0.5) @ sum(sparse.diags(j[k, i]) @ order[k] for k in range(3))
        linear += [sparse.hstack((sign * use, -sparse.eye(knots))) for sign in (1.0, -1.0)]
        right += [np.ones(knots)] * 2 + [np.zeros(knots)] * 2
    cone = sparse.lil_matrix((3 * knots, n + knots))
    cone[0::3, :n] = -(sparse.diags(1.0 / x) @ order[0])
    cone[1::3, n:] = -sparse.eye(knots)
    fixed = np.zeros(3 * knots)
    fixed[2::3] = 1.0
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    goal = np.concatenate((np.zeros(n), problem.weight * x**-0.5))
    matrix = sparse.vstack((*linear, cone)).tocsc()
    found = clarabel.DefaultSolver(sparse.csc_matrix((n + knots,) * 2), goal / goal.sum(), matrix,
                                   np.concatenate((*right, fixed)), [clarabel.NonnegativeConeT(matrix.shape[0] - 3 * knots)]
                                   + [clarabel.PowerConeT(1.0 / 3.0)] * knots, settings).solve()
    if found.status not in (clarabel.SolverStatus.Solved, clarabel.SolverStatus.AlmostSolved):
        raise ArithmeticError(f"no bound: {found.status}")
    return float(found.obj_val_dual * goal.sum())


def _operator(stencil: Floats) -> sparse.csc_matrix:
    """(K, K + 2) matrix of one order of the stencil (3, K)."""
    knots = stencil.shape[1]
    at = np.arange(knots)
    return sum(sparse.csc_matrix((stencil[i], (at, at + i)), (knots, knots + 2)) for i in range(3))


def _tie(n: int, tied: tuple[int, int]) -> sparse.csc_matrix:
    """(n, unknowns): coefficients from unknowns."""
    which = np.clip(np.arange(n) - tied[0] + 1, 0, n - tied[0] - tied[1] + 1)
    return sparse.csc_matrix((np.ones(n), (np.arange(n), which)), (n, which[-1] + 1))


def largest_second_order(sigma: Floats, dq: Floats, d2q: Floats, acceleration: Floats, cap: Floats) -> Floats:
    """Squared speeds (N,) of the greatest sum under the limits of `second_order`, by HiGHS."""
    h = np.diff(sigma)[:, None]
    n, joints = dq.shape
    p, r = dq / acceleration, d2q / acceleration
    here, there = r[:-1] - p[:-1] / (2 * h), p[:-1] / (2 * h)
    back, front = -p[1:] / (2 * h), r[1:] + p[1:] / (2 * h)
    row = np.arange(2 * joints * (n - 1)).reshape(2, n - 1, joints)
    first = np.broadcast_to(np.arange(n - 1)[:, None], (n - 1, joints))
    values = np.concatenate([part.ravel() for part in (here, there, back, front)])
    rows = np.concatenate([row[0].ravel(), row[0].ravel(), row[1].ravel(), row[1].ravel()])
    columns = np.concatenate([first.ravel(), first.ravel() + 1] * 2)
    matrix = sparse.csr_matrix((values, (rows, columns)), (row.size, n))
    top = np.array(cap)
    top[0] = top[-1] = 0.0
    scale = np.median(top[1:-1])
    found = linprog(-np.ones(n), A_ub=sparse.vstack((matrix, -matrix)) * scale, b_ub=np.ones(2 * row.size),
                    bounds=np.stack((np.zeros(n), top / scale), axis=1), method="highs")
    return np.asarray(found.x) * scale


Row = tuple[Fraction, Fraction]
"""(a, b) of |a x0 + b x1| <= 1, b >= 0."""


def exact_second_order(sigma: Floats, dq: Floats, d2q: Floats, cap: Floats,
                       flat: float = 0.0) -> list[Fraction]:
    """The squared speeds of `second_order` in fractions, nothing rounded; dq, d2q (N, J) over the limits.

    `flat` 0 is the greedy solution itself: it gives all of x1 away for the last bit of x0 where x1 hardly counts in a row.
    """
    x = [Fraction(0), *map(Fraction, cap[1:-1].tolist()), Fraction(0)]
    rows = exact_rows(sigma, dq, d2q)
    for i in range(len(rows) - 1, -1, -1):
        rows[i], most = _exact_alone(rows[i], x[i], x[i + 1], Fraction(flat))
        x[i] = _exact_start(rows[i], most, x[i + 1])
    for i, row in enumerate(rows):
        x[i + 1] = min([x[i + 1]] + [(1 - a * x[i]) / b for a, b in row])
    return x


def exact_rows(sigma: Floats, dq: Floats, d2q: Floats) -> list[list[Row]]:
    """Of each interval, one limit at each end for each joint."""
    s, first, second = (np.vectorize(Fraction, otypes=[object])(values.astype(float)) for values in (sigma, dq, d2q))
    made = []
    for i in range(len(s) - 1):
        half = 1 / (2 * (s[i + 1] - s[i]))
        both = [(second[i, j] - first[i, j] * half, first[i, j] * half) for j in range(dq.shape[1])]
        both += [(-first[i + 1, j] * half, second[i + 1, j] + first[i + 1, j] * half) for j in range(dq.shape[1])]
        made.append([(-a, -b) if b < 0 else (a, b) for a, b in both])
    return made


def _exact_alone(rows: list[Row], x0: Fraction, cap: Fraction, flat: Fraction) -> tuple[list[Row], Fraction]:
    """Rows in which x1 counts, and the largest x0 of the others."""
    x0 = min([x0] + [(1 + b * cap) / abs(a) for a, b in rows if a])
    reach = min([cap] + [(1 + abs(a) * x0) / b for a, b in rows if b])
    x0 = min([x0] + [(1 - b * reach) / abs(a) for a, b in rows if a and b * reach <= flat])
    return [(a, b) for a, b in rows if b * reach > flat], x0


def _exact_start(rows: list[Row], x0: Fraction, cap: Fraction) -> Fraction:
    """Largest x0 from which some x1 in [0, cap] respects all rows: Newton's method, which ends."""
    while True:
        low, rise = max([(Fraction(0), Fraction(0))] + [((-1 - a * x0) / b, -a / b) for a, b in rows])
        high, fall = min([(cap, Fraction(0))] + [((1 - a * x0) / b, -a / b) for a, b in rows])
        if high >= low:
            return x0
        x0 -= (high - low) / (fall - rise)
