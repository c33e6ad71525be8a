"""Every key of a controller file is read: another value gives another program, or is refused."""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import cache
from itertools import zip_longest
from pathlib import Path
from typing import Any

import pytest

from postproc.controllers.model import ControllerFile, load_controller
from tests.linuxcnc import outputs
from tests.postproc.kit import convert, good, toolpath
from toolpaths.diagnostics import DiagnosticError

TEXTS = {"description", "sources"}
"""for people"""
ONE_VALUE = {"kinematics.linear"}
"""statements of the file that have one allowed value so far"""
OTHERS = {"kinematics.rapids", "kinematics.blends_unstated", "kinematics.exact_path_rests",
          "feed.kept_by_units", "feed.length", "feed.limited_jerk",
          "feed.arc_inverse", "units.others", "alignment.turns", "alignment.corrects", "alignment.entry",
          "inch.degree", "levels", "smoothing_words", "kinematics.smoothing_in_modes",
          "modes.tcp", "modes.tilted", "arcs.helix_planes",
          "cutter_compensation.begins_on_arc", "cutter_compensation.ends_on_arc", "cutter_compensation.modal_register",
          "cutter_compensation.holds", "cutter_compensation.start", "cutter_compensation.corners",
          "cutter_compensation.states",
          *(f"pivots.{key}" for key in ("table", "table_to_table", "tool_to_head", "head_to_head", "mixed_table",
                                        "mixed_head", "mixed_closing_table", "mixed_closing_head", "closing_table",
                                        "closing_head")),
          "kinematics.smoothing_fixed", "kinematics.axis_smoothing_share", "tools.preload",
          "tools.length_automatic", "tools.length_alone", "tools.cutting_edges", "program.operation",
          "program.carried_out", "program.suffix",
          "splines.word", "splines.decimals", "splines.control_points", "splines.interval", "splines.relies_on",
          "program.relies_on_turns", "program.stock",
          "program.exact_path", "program.smoothing_option", "program.without_smoothing", "arcs.helical_option",
          "cycles.rigid_option", "cycles.floating", "cycles.falling", "cycles.falling_relies_on",
          "codes.tool_by_name", "tools.names",
          "subprograms.call", "subprograms.begin", "subprograms.end",
          "subprograms.place", "subprograms.file", "subprogram_files.call", "subprogram_files.begin", "subprogram_files.end",
          "subprogram_files.place", "subprogram_files.file",
          *(f"rollover.{key}" for key in ("default", "rules", "shortest", "positive", "negative", "zero_negative", "on",
                                          "needs"))}
"""keys of what LinuxCNC, or a machine without modulo axes, has not: test_controllers_*.py,
test_compensated_arcs.py, test_contour_words.py, test_parts.py, test_rollover.py, test_inch_output.py,
test_smoothing_levels.py, test_options.py, test_hooks_refused.py, test_output_quality.py, test_align.py,
test_cycle_time_program.py, test_batch_tasks.py, test_cubic_blocks.py, test_control_points.py,
test_tools_and_feeds_unstated.py
and test_output_modes*.py show what they do"""
READ_BACK = {"cycles.peck_relief", "cycles.plane_at_start", "arcs.helix_by_angle"}
"""how the control moves inside a canned cycle, which the read-back follows and no block states, and what rounding moves"""
OTHER: dict[str, Any] = {
    "writer": "iso", "format.line_length": 40, "program.passive": ["M19"], "program.path_tolerance": [],
    "format.speed_decimals": 0, "format.units": "inch", "inch.feed_parts": 10.0,
    "codes.planes": {"17": "G17", "18": "G18.0", "19": "G19"}, "codes.through": "M88", "codes.through_off": "M89",
    "codes.air": "M83", "codes.air_off": "M84", "codes.tool_select": "T0{number}",
    "codes.tool_change": "M6 T{number}", "codes.length_offset": "G43.0 H{register}", "codes.dwell": "G04 P{seconds}",
    "codes.compensation_left": "G41.0 D{register}", "codes.compensation_right": "G42.0 D{register}",
    "arcs.largest_radius": 5.0, "cycles.planes": [18], "cycles.rigid_only": ["DEEP"], "feed.least_inverse_rate": 1e4,
    "cycles.table": {"DRILL": {"code": "G81.0"}}, "cycles.with_dwell": {"DRILL": {"code": "G82.0", "dwell": "P"}},
    "comment.open": "((", "comment.close": "))", "comment.forbidden": "E", "format.sequence_step": 5,
    "format.sequence_prefix": ":", "program.number": 77, "codes.rigid_tap": "M19",
    "program.work_offsets": {f"G{n}": f"G{n} (SHOP)" for n in ("54", "55", "56", "57", "58", "59", "59.1", "59.2", "59.3")},
    "kinematics.smoothing_share": 0.1, "format.trim_zeros": False, "format.decimal_point": True}
WITH: dict[str, list[str]] = {
    "format.sequence_prefix": ["format.sequence_step = 5"], "program.number": ['program.begin = ["%", "O{number}"]'],
    "codes.rigid_tap": ['program.passive = ["M19"]'], "codes.through_off": ['codes.through = "M88"'],
    "codes.air_off": ['codes.air = "M83"'], "units.inch": ['format.units = "inch"'],
    **{f"inch.{key}": ['format.units = "inch"'] for key in ("linear_decimals", "feed_decimals", "feed_parts", "relies_on")}}
"""values of other keys besides which a key counts"""
HEAD = ["UNITS/MM", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,600"]
FLAT = ["PPRINT/NOTE A LONG TEXT FOR PEOPLE", "COOLNT/FLOOD", "RAPID", "GOTO/0,0,50", "GOTO/10,0,5", "CUTCOM/LEFT,1",
        "GOTO/20.125,0,5",
        "CUTCOM/OFF", "CUTCOM/RIGHT,1", "GOTO/30,0,5", "CUTCOM/OFF", "COOLNT/MIST", "STOP", "OPSTOP", "DELAY/2",
        "SELECT/TOOL,2",
        "COOLNT/THRU", "SPINDL/RPM,900.123456,CCLW", "GOTO/40,0,5", "COOLNT/AIR", "GOTO/41,0,5",
        "SPINDL/OFF", "COOLNT/OFF", "SPINDL/RPM,700,CLW",
        "CYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,3", "GOTO/40,0,0", "CYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,3,DWELL,1", "GOTO/50,0,0",
        "CYCLE/OFF", "RAPID", "GOTO/60,0,5", "CYCLE/DRILL,DEPTH,5,MMPM,100,RAPTO,3,RTRCTO,AUTO", "GOTO/60,0,0",
        "CYCLE/TAP,DEPTH,5,MMPM,700,CLEAR,3", "GOTO/70,0,0",
        "CYCLE/OFF", "RAPID", "GOTO/60,0,50", "LOADTL/2",
        "RAPID", "GOTO/0,0,5", "GOTO/1,0,5"]
PECK = ["RAPID", "GOTO/0,0,50", "CYCLE/DEEP,DEPTH,5,STEP,2,MMPM,100,RAPTO,3,RTRCTO,60", "GOTO/40,0,0", "CYCLE/OFF"]
SLOW = ["RAPID", "GOTO/0,0,5", "FEDRAT/MMPM,0.1234567", "GOTO/0.001,0,5"]
LEVELS = ["RAPID", "GOTO/0,0,50", "CYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,3", "GOTO/40,0,0",
          "CYCLE/DRILL,DEPTH,5,MMPM,100,RAPTO,3,RTRCTO,50", "GOTO/50,0,0", "CYCLE/OFF"]
"""the second hole begins at the plane of the first and ends at the level of before"""
NX = ["TOOL PATH/A,TOOL,T", "MSYS/0,0,0,1,0,0,0,1,0", "LOAD/TOOL,1", "SPINDL/RPM,1000,CLW"]
ARCS = ["RAPID", "GOTO/10,0,5,0,0,1", "FEDRAT/MMPM,600", "GOTO/10,0,0", "CIRCLE/0,0,0,0,0,-1,10,0.03,0.5,10,0",
        "GOTO/0,10,0",
        "CIRCLE/0,0,0,0,0,1,10,0.03,0.5,10,0", "GOTO/10,0,0", "CIRCLE/0,0,0,0,1,0,10,0.03,0.5,10,0", "GOTO/0,0,10",
        "END-OF-PATH"]
FIRST, THEN = "0,0.17513,0.9845447", "0.05,0.3420201433257,0.9383616"
TURN = ["RAPID", f"GOTO/0,0,5,{FIRST}", "FEDRAT/MMPM,500", f"GOTO/0.0312,0,5,{FIRST}", f"GOTO/9.0312,0,5,{THEN}",
        f"GOTO/10.0312,0,5,{THEN}", f"GOTO/11.0312,0,5,{THEN}",
        "RAPID", f"GOTO/10,0,50,{THEN}", f"GOTO/20,0,50,{THEN}", "RAPID", f"GOTO/9,0,50,{THEN}",
        "CYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,3", f"GOTO/9,0,0,{THEN}", "CYCLE/OFF", "RAPID", f"GOTO/9,0,50,{THEN}",
        f"GOTO/12,0,50,{THEN}"]
"""the last two blocks before the rapids take 1/500 min each: F500 as an inverse time and as a feed"""
INSERTED = ["RAPID", "GOTO/0,0,5", "INSERT/M19", "GOTO/1,0,5"]


def keys(model: Any = ControllerFile, prefix: str = "") -> list[str]:
    result = []
    for name, field in model.model_fields.items():
        inner = field.annotation
        result += keys(inner, f"{prefix}{name}.") if hasattr(inner, "model_fields") else [prefix + name]
    return result


def other(key: str, value: Any) -> Any:
    if key in OTHER:
        return OTHER[key]
    if isinstance(value, bool):
        return not value
    if isinstance(value, int):
        return value - 1
    if isinstance(value, str):
        return value[0] + "0" + value[1:]
    return [*value, "M9"]


def inline(value: Any) -> str:
    """TOML of a value."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f'"{k}" = {inline(v)}' for k, v in value.items()) + " }"
    return json.dumps(value)


PATHS = ((FLAT, HEAD, "mill-3axis", "auto"), (ARCS, NX, "mill-3axis", "auto"), (TURN, HEAD, "mikron-ucp710", "auto"),
         (INSERTED, HEAD, "mill-3axis", "auto"), (PECK, HEAD, "mill-3axis", "auto"), (SLOW, HEAD, "mill-3axis", "auto"),
         (LEVELS, HEAD, "mill-3axis", "auto"), (TURN, HEAD, "linuxcnc-xyzac-trt", "auto"),
         (TURN, HEAD, "mikron-ucp710", "inverse-time"))
SHOWN = {"arcs": 1, "codes.arc_cw": 1, "codes.arc_ccw": 1, "codes.planes": 1, "program.path_tolerance_off": 1,
         "program.ending": 1, "feed": 2, "codes.per_minute": 2, "codes.inverse_time": 2, "format.rotary_decimals": 2,
         "format.feed_decimals": 2, "program.passive": 3, "cycles.rigid_only": 4, "format.small_feed_decimals": 5,
         "cycles.rises_first": 6, "kinematics.modules": 7}
"""paths that show a key or its table soonest: they are looked at first"""


def texts(controller: str | Path, first: int = 0) -> Iterator[str]:
    """What becomes of each path, one after the other from one on: its program, or the errors."""
    for lines, head, name, mode in (*PATHS[first:], *PATHS[:first]):
        try:
            made = convert(toolpath(*lines, head=head), name, controller, feed_mode=mode)
        except DiagnosticError as fault:
            yield str(fault)
            return
        header = f"(controller {made.controller_name})\n"
        yield made.text.replace(header, "") or " ".join(sorted(d.code for d in made.diagnostics if d.severity == 2))


@cache
def usual() -> tuple[str, ...]:
    return tuple(texts("linuxcnc"))


def test_the_paths_use_everything() -> None:
    assert [t.startswith("%") for t in usual()] == [True, True, True, False, True, True, True, True, True], usual()


def test_the_read_back_follows_the_controls_pecks(tmp_path: Path) -> None:
    """Three pecks of 2 mm: the return down ends 0.254 or 1 mm above the last depth."""
    shop = tmp_path / "shop.toml"
    shop.write_text('base = "linuxcnc"\n[cycles]\npeck_relief = 1.0\n')
    heights = []
    for controller in ("linuxcnc", shop):
        cycle = "CYCLE/DEEP,DEPTH,5,STEP,2,MMPM,100,CLEAR,1"
        made = good(convert(toolpath("RAPID", "GOTO/0,0,50", cycle, "GOTO/40,0,0", head=HEAD), "mill-3axis", controller))
        motion = outputs.read(made)[1]
        heights.append(sorted(set((motion.end[motion.hole, 2] - 120.0).round(6).tolist())))
    assert set(heights[0]) - set(heights[1]) == {-0.746, -2.746} and {0.0, -2.0} <= set(heights[1])


@pytest.mark.parametrize("key", [k for k in keys() if k not in TEXTS | ONE_VALUE | OTHERS | READ_BACK])
def test_each_key_counts(key: str, tmp_path: Path) -> None:
    spec, _ = load_controller("linuxcnc")
    value: Any = spec
    for part in key.split("."):
        value = getattr(value, part)
    changed = other(key, value)
    assert changed != value
    plain, shop = tmp_path / "plain" / "shop.toml", tmp_path / "shop.toml"
    plain.parent.mkdir()
    plain.write_text("\n".join(['base = "linuxcnc"', *WITH.get(key, [])]))
    shop.write_text("\n".join(['base = "linuxcnc"', *WITH.get(key, []), f"{key} = {inline(changed)}"]))
    first = SHOWN.get(key, SHOWN.get(key.split(".")[0], 0))
    usually = texts(plain, first) if key in WITH else iter(usual()[first:] + usual()[:first])
    assert any(made != plain for made, plain in zip_longest(texts(shop, first), usually))
