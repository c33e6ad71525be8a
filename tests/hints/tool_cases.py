"""Hints on tools, the set-up, spindle and feeds."""

from __future__ import annotations

from tests.hints.case import Edit
from tests.hints.convert_cases import CUT, FAST, LENGTH, OVER, START, TAP, TURNING, convert, nx, option, part, sheet
from tests.hints.machine_cases import machine_text

WEAK = 'base = "mill-3axis"\n[dynamics.axes.Z]\nmass = 40\nforce = 300\n'
TWO = "UNITS/MM\n" + nx("EM12", 0, 12) + nx("EM6", 0, 6)
NAMES = '[tool_numbers]\n"EM12" = 1\n"EM6" = 2\n[tools.1]\ngauge_length = 100.0\n[tools.2]\ngauge_length = 80.0\n'
NUMBERED = START + "TOOLNO/1,MILL,12,0\n" + CUT + "TOOLNO/2,MILL,6,0\n" + CUT
SIDE = START + "RAPID\nGOTO/0,0,5,0,0,1\nGOTO/0,0,0\nRAPID\nGOTO/0,0,50,1,0,0\nGOTO/0,9,50\n"
SAME = "UNITS/MM\n" + nx("EM12", 2, 12) + nx("EM6", 2, 6) + nx("EM8", 2, 8) + nx("EM5", 1, 5)
NUMBERS = r"\[tool_numbers\]\n(?s:(.*))"
_TOOLS = [
    convert(
        "tool.number",
        START.replace("LOADTL/1\n", "TPRINT/EM12\n") + CUT,
        r'(\[tool_numbers\])\n("EM12" = \d+)',
        sheet("", r"\1\n\2\n"),
    ),
    convert("tool.same_number", SAME, r"(?s)(\[tool_numbers\]\n.*)", sheet("", r"\1"), setup=""),
    convert(
        "tool.length",
        START + CUT,
        r"add to the set-up: (\[tools\.1\]) (gauge_length = )\.\.\.",
        sheet("", r"\1\n\g<2>110.0\n"),
        setup="",
    ),
    convert(
        "tool.length",
        SIDE,
        r"add to the set-up: (\[tools\.1\]) (gauge_length = )\.\.\.",
        sheet("", r"\1\n\g<2>110.0\n"),
        setup="",
        machine="head-table",
    ),
    convert(
        "tool.not_loaded",
        NUMBERED,
        r"put LOAD/TOOL or (LOADTL) before it",
        part("MILL,6,0\n", r"MILL,6,0\n\1/2\n"),
        setup=LENGTH + "[tools.2]\ngauge_length = 80.0\n",
    ),
    convert(
        "tool.missing",
        "UNITS/MM\nFEDRAT/MMPM,600\nRAPID\nGOTO/20,0,20\nCUTTER/10\nCUTCOM/LEFT\nGOTO/20,0,2\nGOTO/0,0,2\nCUTCOM/OFF\nRAPID\nGOTO/0,0,20\n",
        "(CUTCOM/LEFT,1)",
        part("CUTCOM/LEFT", r"\1"),
        setup="[output]\ntool_call = false\nspindle = { rpm = 900 }\n[tools.0]\ngauge_length = 100.0\n",
        control="fanuc-30i",
    ),
    convert(
        "tool.register",
        START.replace("LOADTL/1", "LOADTL/10,ADJUST,2") + CUT,
        "state (ADJUST,1) or none in LOADTL",
        part("ADJUST,2", r"\1"),
        setup="[tools.10]\ngauge_length = 70.0\n",
        control="siemens-840d",
        code_left=True,
    ),
    convert(
        "tool.measured",
        "UNITS/MM\nSPINDL/RPM,900,CLW\nFEDRAT/MMPM,600\n" + CUT,
        r"take (tool_call) out of the set-up, number the tool under (\[tool_numbers\]) and state its "
        r"(gauge_length) under (\[tools\.)N(\])",
        sheet(
            "[output]\ntool_call = false\n[tools.0]\ngauge_length = 100.0\n", r'\2\n"unnamed" = 3\n\g<4>3\5\n\3 = 100.0\n'
        ),
        setup="[output]\ntool_call = false\n[tools.0]\ngauge_length = 100.0\n",
        control="heidenhain-tnc640",
    ),
    convert(
        "setup.tool_name_unused",
        TWO,
        "its tools: (EM12), EM6",
        sheet('"BALL8"', r'"\1"'),
        setup=NAMES.replace('"EM12"', '"BALL8"'),
        stops=(),
    ),
    convert(
        "setup.operation",
        "UNITS/MM\n" + nx("A", 1, 5),
        "it has: (OP_A)",
        sheet('"B"', r'"\1"'),
        setup=LENGTH + '[output.operations]\n"B" = "axes"\n',
    ),
    convert(
        "setup.work_offset",
        "UNITS/MM\n" + nx("A", 1, 5),
        "it has: ([^,]+)",
        sheet("MSYS 9", r"\1"),
        setup='work_offset = "MSYS 9"\n' + LENGTH,
    ),
    convert(
        "setup.work_offset_code",
        START + CUT,
        "allowed are .*(G54)[ ,]",
        sheet("G54.1 P3", r"\1"),
        setup='work_offset_code = "G54.1 P3"\n' + LENGTH,
        control="haas-ngc",
    ),
    convert(
        "setup.axes",
        START + CUT,
        "give two directions square to each other.*(part.y_axis)",
        sheet("", "y_axis = [-1.0, 0.0, 0.0]\n"),
        setup=LENGTH + "[part]\nx_axis = [0.0, 1.0, 0.0]\n",
    ),
    convert(
        "setup.axes",
        START + CUT,
        "give two directions square to each other$",
        sheet("0.0, 0.0, 0.0", "1.0, 0.0, 0.0"),
        setup=LENGTH + "[part]\nx_axis = [0.0, 0.0, 0.0]\n",
    ),
    convert(
        "setup.assumed",
        START.replace("FEDRAT/MMPM,600\n", "") + CUT,
        "take its name out of `(assumed)`",
        sheet('assumed = ["output.feed"]\n', ""),
        setup='assumed = ["output.feed"]\n[output]\nfeed = 9.0\n' + LENGTH,
    ),
    convert(
        "setup.joints",
        START + OVER,
        "it has: (A), C",
        sheet("B = 0.0", r"\1 = 0.0"),
        setup=LENGTH + "[joints]\nstart = { B = 0.0 }\n",
        machine="mikron-ucp710",
    ),
    convert(
        "setup.pivot",
        START + TURNING,
        "its rotary axes are .*(C)",
        sheet("[control_pivots.B]", "[control_pivots.A]"),
        setup=LENGTH + "[control_pivots.B]\npoint = [0, 0, 0]\n",
        machine="mikron-ucp710",
    ),
    convert(
        "pivot.mismatch",
        START + TURNING,
        r"correct .* the set-up's \[control_pivots\]",
        sheet("-49.9", "-50"),
        setup=LENGTH + "[control_pivots.B]\npoint = [-25, 0, -49.9]\n",
        machine="trunnion-bc",
    ),
    convert(
        "setup.tool_limits",
        START + CUT,
        "convert with (--feed planned)",
        option(r" \1"),
        setup=LENGTH + "tip_acceleration = 900.0\n",
    ),
    convert(
        "plan.motors",
        START + CUT,
        "convert with (--feed planned)",
        option(r" \1"),
        m=WEAK.replace("300", "3000"),
    ),
    convert(
        "plan.force",
        START + CUT,
        "check masses, (force), balance and friction",
        Edit("m.toml", "force = 300", r"\1 = 3000"),
        m=WEAK,
        more=" --feed planned",
    ),
    convert(
        "setup.program_number",
        "UNITS/MM\n" + nx("A", 1, 5) + nx("B", 1, 5),
        "or above ([0-9]+)",
        sheet("1001", "1100"),
        setup=LENGTH + "[output]\nsubprograms = true\nprogram_number = 1001\n",
        control="fanuc-30i",
    ),
]
UP = "UNITS/MM\nLOADTL/1\nFEDRAT/MMPR,0.2\nRAPID\nGOTO/0,0,0\nGOTO/0,0,9\n"
"""a retract alone, which a standing spindle may make"""
_SPINDLE_FEED = [
    convert(
        "spindle.not_started",
        START.replace("SPINDL/RPM,1000,CLW\n", "") + CUT,
        r'(\[tools\.1\]) (spindle = \{ rpm = )\.\.\.(, direction = "clockwise" \})',
        sheet("[tools.1]\n", r"\1\n\g<2>800\3\n"),
    ),
    convert(
        "spindle.no_speed",
        START.replace("RPM,1000,CLW", "CLW") + CUT,
        r'(\[tools\.1\]) (spindle = \{ rpm = )\.\.\.(, direction = "clockwise" \})',
        sheet("[tools.1]\n", r"\1\n\g<2>800\3\n"),
    ),
    convert(
        "spindle.stopped",
        START + "RAPID\nGOTO/0,0,5\nSPINDL/OFF\nGOTO/0,0,0\nGOTO/9,0,0\n",
        "state (SPINDL/RPM,)n(,CLW) before the cut",
        part("SPINDL/OFF\n", r"\g<1>900\2\n"),
    ),
    convert(
        "feed.missing",
        START.replace("FEDRAT/MMPM,600\n", "") + CUT,
        r"state (\[output\]) (feed) = MM_PER_MIN",
        sheet("", r"\1\n\2 = 300.0\n"),
    ),
    convert(
        "feed.missing",
        START.replace("FEDRAT/MMPM,600\n", "") + CUT,
        "put (FEDRAT) before the first cut",
        part("RAPID\nGOTO/0,0,5\n", r"RAPID\nGOTO/0,0,5\n\1/MMPM,300\n"),
    ),
    convert("feed.no_speed", UP, "state (SPINDL/RPM),", part("LOADTL/1\n", r"LOADTL/1\n\1,900,CLW\n")),
    convert("feed.no_speed", UP, "or a feed per minute", part("MMPR,0.2", "MMPM,200")),
    convert(
        "feed.tap",
        FAST + TAP,
        "state a lower spindle speed",
        part("RPM,9000", "RPM,300"),
        m=machine_text("mill-3axis") + "\n[control]\nlargest_feed = 500\n",
    ),
    convert(
        "feed.no_inverse_time",
        START + TURNING,
        "--feed-mode (auto) or (per-minute)",
        option("--feed-mode per-minute", "--feed-mode inverse-time"),
        c='base = "generic-iso"\n[feed]\ninverse_time = false\n',
        machine="mikron-ucp710",
        more=" --output-mode axes --feed-mode inverse-time",
    ),
    convert(
        "cycle.rigid_tap",
        START + TAP,
        r"state (rigid_tapping = true) under \[control\]",
        Edit("m.toml", "rigid_tapping = false", r"\1"),
        m=machine_text("mill-3axis") + "\n[control]\nrigid_tapping = false\n",
        control="haas-ngc",
    ),
    convert(
        "cycle.rigid_tap",
        START + TAP,
        "take the tap out of the CL file",
        part(TAP, CUT),
        m=machine_text("mill-3axis") + "\n[control]\nrigid_tapping = false\n",
        control="siemens-840d",
    ),
]
BELOW = "RAPID\nGOTO/0,0,-50,0,0,-1\nGOTO/0,0,-5\nGOTO/10,0,-5\nRAPID\nGOTO/10,0,-50\n"
_PART = [
    convert("setup.machine", START + CUT, "or (machine = 'mill-3axis') in it", sheet("machine = 'mill-4axis'", r"\1"),
            setup="machine = 'mill-4axis'\n" + LENGTH),
    convert("setup.upside_down", START + BELOW, r"(\[part\]) (x_axis = .*?), (y_axis = .*?\]) in",
            sheet("", r"\1\n\2\n\3\n"),
            machine="fork-head-ab", stops=("travel.exceeded",)),
]
TOOLS = [*_PART, *_TOOLS, *_SPINDLE_FEED]
