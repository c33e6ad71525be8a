"""Plain loops of `search.py`, compiled for long paths and fine meshes; the numpy search there is the reference. How they are
rounded: `toolpaths/compiled.py`.

A cell is a row of 21 numbers: the corners of a triangle, two tips, two axes. `out` holds the least distance so far, the
place on the path, the point, the cells looked at since something was too near, and whether a leaf was cut short.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from toolpaths.compiled import loop

_DEPTH = 512
_CORNERS, _TIPS, _AXES = 0, 9, 15


@loop
def _signed(piece: Any, rho: Any, z: Any) -> Any:
    """`revolution.signed` of one point."""
    r0, z0, r1, z1, c = piece[0], piece[1], piece[2], piece[3], piece[4]
    length = math.sqrt((r1 - r0) ** 2 + (z1 - z0) ** 2)
    dr, dz = 0.0, 1.0
    if length > 0.0:
        dr, dz = (r1 - r0) / length, (z1 - z0) / length
    side = (rho - r0) * dz - (z - z0) * dr
    if z >= z0 and z <= z1 and side <= 0.0:
        best, nr, nz = z0 - z, 0.0, -1.0
        if z - z1 > best:
            best, nr, nz = z - z1, 0.0, 1.0
        if side > best:
            best, nr, nz = side, dz, -dr
        return best - c, nr, nz
    ar, az = rho - min(rho, r0), z - z0
    least = ar * ar + az * az
    br, bz = rho - min(rho, r1), z - z1
    if br * br + bz * bz < least:
        ar, az, least = br, bz, br * br + bz * bz
    along = min(max((rho - r0) * dr + (z - z0) * dz, 0.0), length)
    br, bz = rho - r0 - along * dr, z - z0 - along * dz
    if br * br + bz * bz < least:
        ar, az, least = br, bz, br * br + bz * bz
    if least <= 0.0:
        return -c, 0.0, 1.0 if z >= z1 else -1.0
    distance = math.sqrt(least)
    return distance - c, ar / distance, az / distance


@loop
def _around(piece: Any, x: Any, y: Any, z: Any, ax: Any, ay: Any, az: Any) -> Any:
    """`revolution.around` of one point: distance and normal."""
    high = x * ax + y * ay + z * az
    x, y, z = x - high * ax, y - high * ay, z - high * az
    rho = math.sqrt(x * x + y * y + z * z)
    distance, radial, axial = _signed(piece, rho, high)
    over = radial / rho if rho > 0.0 else 0.0
    return distance, over * x + axial * ax, over * y + axial * ay, over * z + axial * az


@loop
def _support(piece: Any, axial: Any) -> Any:
    """`revolution.support` of one direction."""
    radial = math.sqrt(max(1.0 - axial * axial, 0.0))
    return max(radial * piece[0] + axial * piece[1], radial * piece[2] + axial * piece[3]) + piece[4]


@loop
def _apart(piece: Any, cell: Any, nx: Any, ny: Any, nz: Any, turn: Any) -> Any:
    """`search._Cells.apart` of one cell and normal; `turn` is what a turning axis may add."""
    corner, reach = np.inf, -np.inf
    for i in range(_CORNERS, _TIPS, 3):
        corner = min(corner, nx * cell[i] + ny * cell[i + 1] + nz * cell[i + 2])
    for k in range(2):
        t, a = _TIPS + 3 * k, _AXES + 3 * k
        far = nx * cell[t] + ny * cell[t + 1] + nz * cell[t + 2]
        reach = max(reach, far + _support(piece, nx * cell[a] + ny * cell[a + 1] + nz * cell[a + 2]))
    return corner - reach - turn


@loop
def _look(piece: Any, size: Any, cell: Any, normal: Any, place: Any, limit: Any, out: Any) -> Any:
    """Bound of a cell; the distance in its middle counts as found. `size` as in `search`."""
    mx = (cell[0] + cell[3] + cell[6]) / 3.0
    my = (cell[1] + cell[4] + cell[7]) / 3.0
    mz = (cell[2] + cell[5] + cell[8]) / 3.0
    ax, ay, az = cell[15] + cell[18], cell[16] + cell[19], cell[17] + cell[20]
    norm = math.sqrt(ax * ax + ay * ay + az * az)
    distance, nx, ny, nz = _around(piece, mx - 0.5 * (cell[9] + cell[12]), my - 0.5 * (cell[10] + cell[13]),
                                  mz - 0.5 * (cell[11] + cell[14]), ax / norm, ay / norm, az / norm)
    if out[0] < limit:
        out[5] += 1.0
    if distance < out[0]:
        out[0], out[1], out[2], out[3], out[4] = distance, place, mx, my, mz
    chord = (cell[18] - cell[15]) ** 2 + (cell[19] - cell[16]) ** 2 + (cell[20] - cell[17]) ** 2
    turn = 2.5 * size[1] * chord / 8.0
    return max(_apart(piece, cell, nx, ny, nz, turn),
               _apart(piece, cell, -normal[0], -normal[1], -normal[2], turn))


@loop
def _halve(cells: Any, i: Any, reach: Any) -> Any:
    """Cell i in two, the second at i + 1: the triangle by its longest edge, or the path; False where it is too small."""
    cell, other = cells[i], cells[i + 1]
    step = math.sqrt((cell[12] - cell[9]) ** 2 + (cell[13] - cell[10]) ** 2 + (cell[14] - cell[11]) ** 2)
    chord = math.sqrt((cell[18] - cell[15]) ** 2 + (cell[19] - cell[16]) ** 2 + (cell[20] - cell[17]) ** 2)
    longest, edge = 0, -1.0
    for k in range(3):
        a, b = 3 * k, 3 * ((k + 1) % 3)
        length = math.sqrt((cell[b] - cell[a]) ** 2 + (cell[b + 1] - cell[a + 1]) ** 2 + (cell[b + 2] - cell[a + 2]) ** 2)
        if length > edge:
            longest, edge = k, length
    if max(edge, step + reach * chord) <= 1e-5:
        return False
    for k in range(21):  # numba compiles slices for seconds
        other[k] = cell[k]
    if edge >= step + reach * chord:
        a, b = 3 * longest, 3 * ((longest + 1) % 3)
        for k in range(3):
            middle = 0.5 * (cell[a + k] + cell[b + k])
            cell[b + k], other[a + k] = middle, middle
        return True
    for k in range(3):
        middle = 0.5 * (cell[_TIPS + k] + cell[_TIPS + 3 + k])
        cell[_TIPS + 3 + k], other[_TIPS + k] = middle, middle
    x, y, z = cell[15] + cell[18], cell[16] + cell[19], cell[17] + cell[20]
    norm = math.sqrt(x * x + y * y + z * z)
    cell[18], cell[19], cell[20] = x / norm, y / norm, z / norm
    other[15], other[16], other[17] = x / norm, y / norm, z / norm
    return True


@loop
def _enough(out: Any, limit: Any, rule: Any) -> Any:
    """`search._Search.enough`; rule: EXACT, PART, EFFORT, EACH."""
    if out[5] > rule[2]:
        return -np.inf
    return out[0] - max(rule[0], rule[1] * (limit - out[0]))


@loop
def _leaf(piece: Any, size: Any, cells: Any, bounds: Any, normal: Any, place: Any, limit: Any, rule: Any,
          out: Any) -> None:
    """Halves the cell that stands in cells[0] until its least distance is known."""
    bounds[0] = _look(piece, size, cells[0], normal, place, limit, out)
    top, most = 0, out[5] + rule[3]
    while top >= 0 and out[5] <= most:
        if bounds[top] >= _enough(out, limit, rule) or top + 1 >= len(cells) or not _halve(cells, top, size[2]):
            top -= 1
            continue
        first = _look(piece, size, cells[top], normal, place, limit, out)
        second = _look(piece, size, cells[top + 1], normal, place, limit, out)
        if first < second:
            for k in range(21):
                cells[top, k], cells[top + 1, k] = cells[top + 1, k], cells[top, k]
            first, second = second, first
        bounds[top], bounds[top + 1] = first, second
        top += 1
    if top >= 0:
        out[6] = 1.0


@loop
def _bound(piece: Any, size: Any, body: Any, travel: Any, k: Any, m: Any) -> Any:
    """`search._Search._bound` of one pair; rows of body and path as `Solid.packed`, `Swept.packed` have them."""
    b, w = body[k], travel[m]
    distance, nx, ny, nz = _around(piece, b[0] - w[0], b[1] - w[1], b[2] - w[2], w[6], w[7], w[8])
    middle, share = b[0] * b[6] + b[1] * b[7] + b[2] * b[8], nx * b[6] + ny * b[7] + nz * b[8]
    thick = abs(share) * max(b[10] - middle, middle - b[9])
    thick += math.sqrt(max(1.0 - share * share, 0.0)) * math.sqrt(b[3] * b[3] + b[4] * b[4] + b[5] * b[5])
    thick = min(thick, abs(nx) * b[3] + abs(ny) * b[4] + abs(nz) * b[5])
    adjacent = distance - thick - abs(nx) * w[3] - abs(ny) * w[4] - abs(nz) * w[5]
    above = (w[0] * b[6] + w[1] * b[7] + w[2] * b[8] - abs(b[6]) * w[3] - abs(b[7]) * w[4] - abs(b[8]) * w[5] - b[10]
             - _support(piece, -(w[6] * b[6] + w[7] * b[7] + w[8] * b[8])))
    return max(adjacent, above) - size[0] * w[9]


@loop
def search(piece: Any, high: Any, size: Any, body: Any, corners: Any, normals: Any, travel: Any, pieces: Any, limit: Any,
           rule: Any, out: Any) -> None:
    """One piece of a tool against a body; nearer pairs first, `out` is carried on.

    Args:
        high: the piece as seen from its middle, which the boxes of the path are round
        size (3,): its lever, bend and lever from the tip
        body (2 L - 1, 11), path (2 M - 1, 10): the trees
        corners (T, 9), normals (T, 3), pieces (N, 12): their leaves
    """
    # Depth first on a stack: of two children the nearer is on top, so that `out` falls soon and cuts off the
    # rest. Each pair leaves at most one other below it, so that the depth of both trees together bounds the stack.
    pairs, bounds = np.empty((_DEPTH, 2), dtype=np.int64), np.empty(_DEPTH)
    cells, inner = np.empty((_DEPTH, 21)), np.empty(_DEPTH)
    body_first, path_first = (len(body) + 1) // 2 - 1, (len(travel) + 1) // 2 - 1
    pairs[0, 0], pairs[0, 1] = 0, 0
    bounds[0] = _bound(high, size, body, travel, pairs[0, 0], pairs[0, 1])  # a plain 0 is another type to the compiler
    top = 0
    while top >= 0:
        k, m, bound = pairs[top, 0], pairs[top, 1], bounds[top]
        top -= 1
        if bound >= _enough(out, limit, rule):
            continue
        if k >= body_first and m >= path_first:
            for n in range(9):
                cells[0, n] = corners[k - body_first, n]
            for n in range(12):
                cells[0, 9 + n] = pieces[m - path_first, n]
            _leaf(piece, size, cells, inner, normals[k - body_first], m - path_first, limit, rule, out)
            continue
        spread = travel[m, 3] + travel[m, 4] + travel[m, 5] + size[0] * travel[m, 9]
        by_body = m >= path_first or (k < body_first and body[k, 3] + body[k, 4] + body[k, 5] >= spread)
        i, j, other_i, other_j = (2 * k + 1, m, 2 * k + 2, m) if by_body else (k, 2 * m + 1, k, 2 * m + 2)
        first, other = _bound(high, size, body, travel, i, j), np.inf
        if body[other_i, 3] >= 0.0 and travel[other_j, 3] >= 0.0:
            other = _bound(high, size, body, travel, other_i, other_j)
        if other < first:
            i, j, first, other_i, other_j, other = other_i, other_j, other, i, j, first
        if other < np.inf:
            top += 1
            pairs[top, 0], pairs[top, 1], bounds[top] = other_i, other_j, other
        top += 1
        pairs[top, 0], pairs[top, 1], bounds[top] = i, j, first
