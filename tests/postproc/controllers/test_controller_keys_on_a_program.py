"""Keys that LinuxCNC has no use for: each changes the program of the golden piece, or is refused with a reason."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest

import toolpaths
from postproc.pipeline.result import PostResult
from tests.postproc.kit import convert, toolpath
from toolpaths.diagnostics import has_errors
from toolpaths.toolpath import Toolpath

PIECE = Path(__file__).parents[2] / "golden" / "three_laws.cls"
HELIX = ["RAPID", "GOTO/10,0,5,0,0,1", "FEDRAT/MMPM,600", "GOTO/10,0,0", "CIRCLE/0,0,0,0,0,-1,10,0.03,0.5,10,0",
         "GOTO/0,10,-2", "END-OF-PATH"]
HOLES = ["RAPID", "GOTO/10,0,30", "CYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,3", "GOTO/10,0,0", "GOTO/20,0,0", "CYCLE/OFF",
         "RAPID", "GOTO/20,0,30"]
HELIX_HEAD = ["TOOL PATH/A,TOOL,T", "MSYS/0,0,0,1,0,0,0,1,0", "LOAD/TOOL,1", "SPINDL/RPM,1000,CLW"]
KEYS = [
    ("fanuc-30i", "kinematics.rapids", '"straight"', "axes"), ("fanuc-30i", "feed.length", '"xyz-first"', "minute"),
    ("fanuc-30i", "feed.arc_inverse", '"length"', "inverse"), ("fanuc-30i", "feed.arc_inverse", '"refuse"', "inverse"),
    ("fanuc-30i", "kinematics.smoothing_fixed", "0.006", "axes"),
    ("siemens-840d", "kinematics.axis_smoothing_share", "0.1", "auto"),
    ("siemens-840d", "kinematics.smoothing_share", "0.1", "auto"), ("siemens-840d", "feed.length", '"all"', "minute"),
    ("heidenhain-tnc640", "arcs.helix_planes", "[18]", "helix"), ("heidenhain-tnc640", "arcs.largest_radius", "3.0", "auto"),
    ("fanuc-30i", "modes.tcp.arcs", "true", "tcp"), ("siemens-840d", "modes.tcp.arcs", "false", "tcp"),
    ("siemens-840d", "modes.tilted.arcs", "false", "auto"), ("fanuc-30i", "modes.tilted.cycles", "false", "auto"),
    ("siemens-840d", "modes.tcp.cycles", "true", "top holes"), ("fanuc-30i", "modes.tilted.angles", '"XYZ"', "auto"),
    ("fanuc-30i", "modes.tilted.decimals", "0", "nutating"), ("fanuc-30i", "modes.tilted.tables_only", "true", "head"),
    ("fanuc-30i", "modes.tcp.length", '"on"', "auto"), ("fanuc-30i", "modes.tilted.length", '"any"', "auto"),
    ("haas-ngc", "modes.tilted.start", "[]", "auto"), ("fanuc-30i", "modes.tcp.relies_on", '["a licence"]', "auto"),
    ("fanuc-30i", "modes.tilted.lifted", "[]", "auto"), ("fanuc-30i", "tools.length_alone", '"a setting"', "tcp"),
    ("siemens-840d", "tools.home_without_length", "false", "auto"), ("fanuc-30i", "tools.length_with_z", "false", "axes"),
    ("haas-ngc", "cycles.dwell_milliseconds", "false", "axes"), ("heidenhain-tnc640", "format.plus_sign", "false", "axes"),
    ("heidenhain-tnc640", "program.work_offsets.G54", '"CYCL DEF 247 DATUM SETTING ~\\nQ339=+9 ;DATUM NUMBER"', "axes")]


@cache
def path(what: str) -> Toolpath:
    if what == "helix":
        return toolpath(*HELIX, head=HELIX_HEAD)
    if what == "top holes":
        return toolpath(*HOLES)
    made, found = toolpaths.read(PIECE)
    assert not has_errors(found)
    return made


@cache
def made(controller: str | Path, what: str) -> PostResult:
    machine = {"helix": "mill-3axis", "head": "fork-head-ab", "nutating": "nutating-head"}.get(what, "mikron-ucp710")
    options = {"axes": {"output": "axes"}, "tcp": {"output": "tcp"}, "top holes": {"output": "tcp"},
               "minute": {"output": "axes", "feed_mode": "per-minute"},
               "inverse": {"output": "axes", "feed_mode": "inverse-time"}}.get(what, {})
    if "haas" in str(controller):
        machine = "trunnion-bc"
    return convert(path(what), machine, controller, **options)


def outcome(result: PostResult) -> str:
    """The text without its head, or the errors."""
    text = "\n".join(line for line in result.text.splitlines() if "ontroller" not in line.lower())
    return text or " ".join(sorted({d.code for d in result.diagnostics if d.severity.name == "ERROR"}))


def test_helices_by_angle_are_rounded_by_it(tmp_path: Path) -> None:
    """The last decimal of the angle moves the end of a helix: it stands in the bound of the rounding."""
    shop = tmp_path / "shop.toml"
    shop.write_text('base = "heidenhain-tnc640"\narcs.helix_by_angle = false\n')
    by_angle, by_end = (made(name, "helix") for name in ("heidenhain-tnc640", shop))
    assert by_angle.job is not None and by_end.job is not None and by_angle.ok
    assert by_angle.job.rounding.tip - by_end.job.rounding.tip > 5e-6  # 10 mm by half of 0.0001 degrees


@pytest.mark.parametrize(("controller", "key", "value", "what"), KEYS, ids=lambda v: str(v)[:40])
def test_each_key_counts(controller: str, key: str, value: str, what: str, tmp_path: Path) -> None:
    shop, plain = (tmp_path / f"{controller}-{name}.toml" for name in ("shop", "plain"))
    straight = 'kinematics.rapids = "straight"\n' if what in ("head", "nutating") else ""
    plain.write_text(f'base = "{controller}"\n{straight}')
    shop.write_text(f'base = "{controller}"\n{straight}{key} = {value}\n')
    usual = made(plain if straight else controller, what)
    assert usual.ok, [str(d) for d in usual.diagnostics]
    assert outcome(made(shop, what)) != outcome(usual)
