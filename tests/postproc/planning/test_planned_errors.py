"""Feeds are planned for the joints that correct geometric errors, not for those of the nominal machine."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import toolpaths
from machines.geometric_error import correct, load
from postproc.base.options import Options
from postproc.pipeline.convert import convert
from postproc.pipeline.result import PostResult

LINE = ("UNITS/MM\nLOADTL/1\nSPINDL/3000,RPM,CLW\nFEDRAT/{},MMPM\nRAPID\nGOTO/-160,0,20\nGOTO/-160,0,0\nGOTO/160,0,0\n"
        "FINI\n")
PERIOD, HEIGHT = 8.0, 0.015
MOST = 41
"""lines of a sample"""


def screw(folder: Path) -> str:
    """A model of a screw whose lead errs by a sine, mm."""
    x = PERIOD * np.arange(16) / 16.0
    rows = (f"{v:.6f}, {1e3 * HEIGHT * np.sin(2.0 * np.pi * v / PERIOD):.6f}" for v in x)
    (folder / "t.csv").write_text("\n".join(["X [mm], EXX [um]", *rows, ""]))
    model = folder / "m.toml"
    model.write_text('machine = "mill-3axis"\n[components.EXX]\ntable = "t.csv"\ninterpolation = "spline"\n'
                     f"repeats = {PERIOD}\n")
    return str(model)


def planned(cl: str, machine: str, controller: str, **options: str) -> PostResult:
    path, found = toolpaths.read_bytes(cl)
    result = convert(path, machine, controller, diagnostics=found, options=Options(feed="planned", **options))
    assert result.ok, [str(d) for d in result.diagnostics]
    return result


def test_feeds_keep_the_jerk_of_what_corrects_a_screw(tmp_path: Path) -> None:
    """x - h sin(k x) at v has the jerk h k^3 v^3; LinuxCNC, which limits no jerk, keeps programmed feeds that are faster."""
    result = planned(LINE.format(12000), "mill-3axis", "siemens-840d", error_model=screw(tmp_path))
    feeds = [float(f) for f in re.findall(r"F([\d.]+)", result.text)]
    allowed = 60.0 * (result.machine.limits.jerk[0] / (HEIGHT * (2.0 * np.pi / PERIOD) ** 3)) ** (1.0 / 3.0)
    assert 0.88 * allowed < min(feeds) < allowed < 0.9 * max(feeds)
    assert set(re.findall(r"F([\d.]+)", planned(LINE.format(12000), "mill-3axis", "linuxcnc").text)) == {"12000"}


@pytest.mark.parametrize(("sample", "machine", "setup"), [("blade.cls", "mikron-ucp710", "tools"),
                                                          ("bicubic.cls", "mikron-ucp710", "tools"),
                                                          ("h4a_dome.cls", "h4a-c-table", "h4a"),
                                                          ("pocket.cls", "uranesx", "delta")])
def test_planned_joints_put_the_tool_where_it_belongs(sample: str, machine: str, setup: str) -> None:
    """On the machine with errors, mean of both directions; rotary axes stand where those that are written do."""
    model = f"samples/errors/{machine}.toml"
    lines = Path(f"samples/{sample}").read_text().splitlines()[:MOST]
    result = planned("\n".join([*lines, *["FINI"] * (len(lines) == MOST)]), machine, "linuxcnc", error_model=model,
                     setup=f"samples/{setup}.setup.toml")
    assert result.motion is not None and result.job is not None and result.path is not None
    one = max(result.motion.passes, key=lambda each: len(each.move))
    path = max(one.paths, key=lambda each: len(each.s))
    kin = result.job.kinematics(int(result.job.moves.tool[one.move[0]]))
    joints = len(kin.axis_names)
    q, tip, axis = path.values[:, :joints], path.values[:, joints:-3], path.values[:, -3:]
    actual = load(model, result.machine).on(kin)
    found = actual.aim(actual.coordinates(q, path.values[:, joints:]))
    assert np.abs(found[0] - tip).max() < 1e-6
    assert np.linalg.norm(kin.forward(q, near=path.values[:, joints:])[0] - tip, axis=1).max() > 0.01
    rotary = np.array(kin.rotary)
    if rotary.any() and np.ptp(q[:, rotary], axis=0).max() > 1e-6:
        assert np.abs(found[1] - axis).max() < 5e-8
        assert correct(actual, q, tip, axis).axis_before.max() < 1e-7
    elif rotary.any():
        written = result.path.q[np.isin(result.path.move, one.move)][:, rotary]
        assert (np.abs(written - q[0, rotary]).max(axis=1) < 1e-12).any()
