"""Arcs in every plane of a tilted plane whose vectors the CL file writes with 7 digits: they stay arcs."""

from __future__ import annotations

import re
from itertools import pairwise

import numpy as np
import pytest

import toolpaths
from tests.postproc.kit import convert, good, tool_setup
from toolpaths.diagnostics import has_errors
from toolpaths.toolpath import Toolpath

PAIRS = [("fanuc-30i", "mikron-ucp710"), ("haas-ngc", "trunnion-bc"), ("siemens-840d", "mikron-ucp710"),
         ("heidenhain-tnc640", "mikron-ucp710")]
ARCS = 12
AXES = {17: (0, 1), 18: (2, 0), 19: (1, 2)}


def text(values: np.ndarray, digits: int = 4) -> str:
    return ",".join(f"{v:.{digits}f}" for v in values)


def tilted_arcs(seed: int) -> Toolpath:
    """Random arcs in G17, G18 and G19 of a face tilted about X, each from where the one before it ends."""
    rng = np.random.default_rng(seed)
    tilt, at = np.radians(rng.uniform(5, 60)), np.append(rng.uniform(-20, 20, 2), 0.0)
    up = np.array([0.0, 0.0, 40.0])
    lines = ["UNITS/MM", "TOOL PATH/A,TOOL,T", "TLDATA/MILL,10,0,80,0,0",
             f"MSYS/{text(rng.uniform(-20, 20, 3))},{text([1, 0, 0, 0, np.cos(tilt), np.sin(tilt)], 7)}",
             "LOAD/TOOL,1", "SPINDL/RPM,1000,CLW", "RAPID", f"GOTO/{text(at + up)},0.0000000,0.0000000,1.0000000",
             "FEDRAT/MMPM,600", f"GOTO/{text(at)}"]
    for k in range(ARCS):
        i, j = list(AXES.values())[k % 3]
        radius, angle, sweep = rng.uniform(2, 15), rng.uniform(0, 2 * np.pi), rng.uniform(0.5, 3) * rng.choice([-1, 1])
        centre = at.copy()
        centre[[i, j]] -= radius * np.array([np.cos(angle), np.sin(angle)])
        at = centre.copy()
        at[[i, j]] += radius * np.array([np.cos(angle + sweep), np.sin(angle + sweep)])
        normal = -np.sign(sweep) * np.eye(3)[3 - i - j]
        lines += [f"CIRCLE/{text(centre)},{text(normal, 7)},{radius:.4f},0.03,0.5,10,0", f"GOTO/{text(at)}"]
    lines += ["RAPID", f"GOTO/{text([at[0], at[1], 80])}", "END-OF-PATH", "FINI"]
    path, found = toolpaths.read_bytes("\n".join(lines).encode(), file="a.cls")
    assert not has_errors(found), [str(d) for d in found]
    return path


@pytest.mark.covering
@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize(("controller", "machine"), PAIRS)
def test_arcs_stay_arcs(controller: str, machine: str, seed: int) -> None:
    tables_about_y = machine == "trunnion-bc"
    result = good(convert(tilted_arcs(seed), machine, controller, tool_setup(), output="tilted"))
    assert result.program is not None and result.comparison is not None
    assert int((result.program.code == 2).sum()) == ARCS and int((result.program.code == 1).sum()) == 1
    assert result.comparison.worst_tip < (0.002 if tables_about_y else 0.0003)


@pytest.mark.covering(count=3)
@pytest.mark.parametrize("seed", range(6))
def test_a_tnc_climbs_in_the_xy_plane_only(seed: int) -> None:
    """CP with IZ turns about Z: an arc in another plane whose ends rounding parts must not become one."""
    made = good(convert(tilted_arcs(seed), "mikron-ucp710", "heidenhain-tnc640", tool_setup(), output="tilted")).text
    blocks = [re.sub(r"^\d+ ", "", line) for line in made.splitlines()]
    pairs = [(a, b) for a, b in pairwise(blocks) if a.startswith("CC")]
    assert len(pairs) == ARCS
    for centre, arc in pairs:
        plane = set(re.findall("[XYZ]", centre))
        assert set(re.findall("[XYZ]", arc)) == plane if arc.startswith("C ") else plane == {"X", "Y"}
