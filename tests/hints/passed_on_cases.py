"""Hints that reach a message through a name, a table or a function that is itself given: records of commands, cycles,
programs that were edited, proofs whose inputs have changed."""

from __future__ import annotations

from tests.hints.align_cases import EDGES, HEAD, SPARE, plane, readings
from tests.hints.case import COMMAND, Edit, HintCase
from tests.hints.convert_cases import CUT, LENGTH, START, convert, option, part, sheet
from tests.hints.gcode_cases import of
from tests.hints.own_room_cases import ON
from tests.hints.verify_cases import edited

HOLE = "RAPID\nGOTO/0,0,50\nCYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,3\nGOTO/5,5,0\nCYCLE/OFF\nRAPID\nGOTO/5,5,50\n"
ROUND = "CUTTER/10\nRAPID\nGOTO/20,-30,20\nGOTO/20,-30,2\nCUTCOM/LEFT\nGOTO/20,0,2\nGOTO/20,40,2\nCUTCOM/OFF\n" + (
    "GOTO/40,60,2\nRAPID\nGOTO/40,60,20\n")
ASIDE = "CUTTER/10\nRAPID\nGOTO/20,-30,20,0,0.5,0.866025404\nGOTO/20,-30,2\nCUTCOM/LEFT\nGOTO/20,0,2\nGOTO/20,40,2\n" + (
    "CUTCOM/OFF\nGOTO/40,60,2\nRAPID\nGOTO/40,60,20\n")
LEANS = ROUND.replace("GOTO/20,40,2\n", "GOTO/20,40,2,0,0.1,0.994987437\n")
NONE = Edit("s.toml", "110.0\n", '110.0\ncompensation = "none"\n')
UNCUT = "[location]\nEC0Y = 0.1\n"


def _record(code: str, wrong: str, right: str, says: str, *, control: str = "fanuc-30i") -> HintCase:
    """A record in the place of the cut's first rapid."""
    return convert(code, START + wrong + CUT, says, part(wrong, right), control=control)


def _hole(code: str, old: str, new: str, says: str, *, control: str = "fanuc-30i", stops: tuple[str, ...] = ()) -> HintCase:
    """A hole with `new` in the place of `old`, which the hint asks for."""
    return convert(code, START + HOLE.replace(old, new), says, part(new, old), control=control, stops=stops)


_RECORDS = [
    _record("spindle.word", "SPINDL/LOCK\n", "SPINDL/RPM,900,CLW\n", "allowed: SPINDL/RPM,n,CLW"),
    convert("spindle.speed", START.replace("RPM,1000", "RPM,-5") + CUT, "a speed above 0", part("RPM,-5", "RPM,5")),
    _record("delay.value", "DELAY/-1\n", "DELAY/1\n", "seconds, 0 or more"),
    convert("delay.revolutions", START.replace("SPINDL/RPM,1000,CLW\n", "") + "DELAY/3,REV\nSPINDL/RPM,1000,CLW\n" + CUT,
            r"\((SPINDL/RPM),n,CLW\)", part("DELAY", r"\1,1000,CLW\nDELAY")),
    _record("insert.refused", "INSERT/M30\n", "", "take the record out"),
    _record("retract.motion", "GOTO/0,0,20\nRETRCT\n", "GOTO/0,0,20\nRAPID\nGODLTA/0,0,20\n", r"\(GOTO or GODLTA\)"),
    *(convert(f"coolant.{kind}", START + f"COOLNT/{word}\n" + CUT, r"set codes\.([a-z]+) in the controller file",
              Edit("c.toml", "", f'[codes]\n\\1 = "{code}"\n'), c=f'base = "{base}"\n')
      for kind, word, code, base in (("air", "AIR", "M51", "fanuc-30i"), ("mist", "MIST", "M7", "haas-ngc"),
                                     ("through", "THRU", "M88", "fanuc-30i"))),
    convert("cutcom.plane", START + ROUND.replace("CUTCOM/LEFT", "CUTCOM/LEFT,ZXPLAN"), "(XYPLAN) only",
            part("ZXPLAN", r"\1"), control="fanuc-30i"),
    convert("cutcom.tilted", START + ASIDE, r'compensation = "none" in the set-up', NONE, machine="mikron-ucp710",
            control="fanuc-30i", more=" --output-mode axes"),
    convert("cutcom.turning", START + LEANS, r'compensation = "none" in the set-up', NONE, machine="mikron-ucp710",
            control="fanuc-30i", more=" --output-mode axes"),
    convert("reach.axis", START + "RAPID\nGOTO/0,0,50,1,0,0\nGOTO/0,0,5\nGOTO/0,9,5\nRAPID\nGOTO/50,9,5\n",
            r"turn the part in the set-up \(part\.(x_axis), part\.(y_axis)\)",
            sheet("", "[part]\n\\1 = [0.0, 0.0, 1.0]\n\\2 = [0.0, 1.0, 0.0]\n")),
]
_HOLES = [
    _hole("cycle.depth", "DEPTH,5", "DEPTH,0.000001", "state the depth"),
    _hole("cycle.retract", "CLEAR,3", "CLEAR,3,RTRCTO,-5", "state RTRCTO above the top"),
    _hole("cycle.start_plane", "CLEAR,3", "CLEAR,-5", "state CLEAR or RAPTO above the top"),
    convert("cycle.dwell", START.replace("SPINDL/RPM,1000,CLW\n", "") + HOLE.replace("CLEAR,3", "CLEAR,3,REV,2"),
            "state (SPINDL/RPM),n,CLW before it", part("RAPID\nGOTO/0,0,50", "\\1,1000,CLW\nRAPID\nGOTO/0,0,50"),
            control="fanuc-30i"),
    convert("cycle.not_native", START + "OPSKIP/ON\n" + HOLE.replace("DRILL", "TAP").replace("MMPM,100", "MMPR,1")
            + "OPSKIP/OFF\n", "end OPSKIP before it", part("OPSKIP/ON\n", ""), control="fanuc-30i"),
]
_PROGRAMS = [
    edited("verify.start", CUT, "G0 X0. Y0.\n", "G0 X0.\n", "state Y, absolutely"),
    edited("verify.tool_change", "COOLNT/ON\n" + CUT + "LOADTL/2\n" + CUT, "M9\nT2 M6", "T2 M6", "M9 before it"),
    of("gcode.tool_length", "siemens-840d", "", "G18 G2 X3 Z50 I1 K0 F200\n", "", r"state \$SC_TOOL_LENGTH_CONST=17"),
    of("gcode.units_unstated", "fanuc-30i", "G21 G90", "G90", "G21 G90", "state G20 or G21"),
]
_PROOFS = [HintCase(f"proof.{key}", f"verify p.nc part.apt {ON} --tolerance 0.01",
                    {"part.apt": START + CUT + "FINI\n", "s.toml": LENGTH}, says, (does,),
                    first=(f"convert part.apt {ON} --proof -o p.nc",), harm=harm)
           for key, says, harm, does in (
    ("setup", "give the one of the proof", (Edit("s.toml", "", "# ours\n"),), Edit("s.toml", "# ours\n", "")),
    ("cl_file", "give the one of the proof", (Edit("part.apt", "", "$$ ours\n"),), Edit("part.apt", "$$ ours\n", "")),
    ("program", "as it is", (Edit("p.nc", "T1 M6", "T1 M6 (OURS)"),), Edit("p.nc", " (OURS)", "")),
)] + [HintCase("proof.options", f"verify p.nc part.apt {ON} --tolerance 0.02",
               {"part.apt": START + CUT + "FINI\n", "s.toml": LENGTH}, "verify with those of the proof",
               (option("--tolerance 0.01", "--tolerance 0.02"),), first=(f"convert part.apt {ON} --proof -o p.nc",))]
_OTHERS = [
    HintCase("file.base-cycle", f"convert part.apt {ON} -o p.nc", {"part.apt": START + CUT + "FINI\n",
             "s.toml": 'base = "t.toml"\n', "t.toml": 'base = "s.toml"\n' + LENGTH}, "take one of the base keys out",
             (Edit("t.toml", 'base = "s.toml"\n', ""),)),
    HintCase("file.type", f"convert part.apt {ON} -o p.nc", {"part.apt": START + CUT + "FINI\n",
             "s.toml": LENGTH.replace("110.0", '"110.0"')}, "write the number without quotes",
             (sheet('"110.0"', "110.0"),)),
    HintCase("file.range", f"convert part.apt {ON} -o p.nc", {"part.apt": START + CUT + "FINI\n",
             "s.toml": LENGTH + "[part]\norigin = [0, 5, 10, 0]\n"}, "numbers have decimal points",
             (sheet("[0, 5, 10, 0]", "[0.5, 10, 0]"),)),
    HintCase("file.unreadable", f"convert part.apt {ON} -o p.nc".replace("--setup s.toml", "--setup ."),
             {"part.apt": START + CUT + "FINI\n", "s.toml": LENGTH}, "name a file in it",
             (Edit(COMMAND, "--setup .", "--setup s.toml"),)),
    HintCase("file.write", f"convert part.apt {ON} -o s.toml/p.nc", {"part.apt": START + CUT + "FINI\n", "s.toml": LENGTH},
             "choose another place", (Edit(COMMAND, "s.toml/p.nc", "p.nc"),)),
    HintCase("orient.operation", "orient part.apt -m mikron-ucp710 --setup s.toml",
             {"part.apt": "TOOL PATH/FINISH,TOOL,B10\nTLDATA/MILL,10,5,75,0,0\nLOAD/TOOL,1\nSPINDL/RPM,1000,CLW\n"
              "FEDRAT/MMPM,600\n" + CUT + "END-OF-PATH\nFINI\n",
              "s.toml": LENGTH + '[orientation]\nfixed_operations = ["FINSH"]\n'},
             "did you mean '(FINISH)'", (sheet("FINSH", r"\1"),)),
    HintCase("setup.system", f"convert part.cls {ON} -o p.nc",
             {"part.cls": "TOOL PATH/A,TOOL,E\nTLDATA/MILL,10,0,75,0,0\nMSYS/0,0,0,1,0,0,0,1,0\nLOAD/TOOL,1\n"
              "SPINDL/RPM,1000,CLW\nFEDRAT/MMPM,600\n" + CUT + "END-OF-PATH\nFINI\n",
              "s.toml": LENGTH + '[part]\nsystem = "MSYS 7"\n'},
             "it has: (MSYS 1)", (sheet("MSYS 7", r"\1"),)),
    HintCase("error-map.zero", "errors check e.toml -m mikron-ucp710",
             {"e.toml": '[map]\ntable = "x.csv"\nzero = { X = 900.0 }\n',
              "x.csv": "X [mm],dx [um],dy [um],dz [um]\n-300,1,0,0\n300,3,0,0\n"},
             "X is from (-?[0-9]+) to", (Edit("e.toml", "900.0", r"\1"),)),
    readings("align.large", HEAD + plane(lean=0.07) + "".join(EDGES) + SPARE, "(--large) takes it",
             Edit(COMMAND, "", r" \1"), machine="mikron-ucp710"),
]
PASSED_ON = [*_RECORDS, *_HOLES, *_PROGRAMS, *_PROOFS, *_OTHERS]
