"""Hints on machine files of other systems."""

from __future__ import annotations

from tests.hints.case import COMMAND, Edit, HintCase

IMPORT = "machine import shop.ini -o shop.toml"
HEADER = "[KINS]\nKINEMATICS = {kins}\nJOINTS = 4\n[TRAJ]\nCOORDINATES = XYZA\nLINEAR_UNITS = mm\n"
JOINTS = "".join(f"[JOINT_{k}]\nMIN_LIMIT = -100\nMAX_LIMIT = 100\n" for k in range(4))
XYZ = (HEADER.format(kins="trivkins coordinates=XYZ") + JOINTS).replace("XYZA", "XYZ")
TRT = (HEADER.format(kins="xyzac-trt-kins") + JOINTS).replace("XYZA", "XYZAC")


def _case(code: str, says: str, ini: str, *does: Edit, **files: str) -> HintCase:
    more = {name.replace("_", "."): text for name, text in files.items()}
    return HintCase(code, IMPORT, {"shop.ini": ini, **more}, says, does)


TABLE = "$MC_TRAFO_TYPE_1=40\n$MC_TRAFO5_AXIS1_1[0]=-1\n$MC_TRAFO5_BASE_TOOL_1[2]=-600\n"
RECORD = '$TC_CARR23[1]="P"\n$TC_CARR7[1]=-1\n$TC_CARR6[1]=-600\n$TC_CARR46[1]=0.004\n'
FIVE = (HEADER.format(kins="5axiskins coordinates=XYZBCW").replace("= 4", "= 6").replace("= XYZA", "= XYZBCW")
        + "".join(f"[JOINT_{k}]\nMIN_LIMIT = -100\nMAX_LIMIT = 100\n" for k in range(6)) + "[HAL]\nHALFILE = shop.hal\n")
GAIN = ("loadrt sum2 names=s\nsetp s.gain0 -1\nsetp s.in0 250\nnet tool motion.tooloffset.z => s.in1\n"
        "net pivot s.out => 5axiskins.pivot-length\n")
FREECAD = '{"machine": {"name": "m", "units": "metric", "axes": {' + ", ".join(
    f'"{name}": {{"type": "linear", "role": "head_linear", "limits": {{"min": -100, "max": 100}}, "max_velocity": 9000}}'
    for name in "XYZ") + "}}}"
TABLE_530 = "KEY AXIS COORD\nMachAxis X\nMachAxis Y\nMachAxis Z\nTrans Z -500\nMachAxis C\n[END]\n"

IMPORTS = [
    _case("import.line", r"write (\$NAME\[index\] = value)", TABLE + "$MA_MAX_AX_VELO(X1)=30000\n",
          Edit("shop.ini", "(X1)", "[X1]")),
    _case("import.default", "(lines) that are not 0 there", TABLE, Edit("shop.ini", "", "".join(
        f"$MC_TRAFO5_{name}_1[{k}]=0\n" for name, k in [("AXIS1", 1), ("AXIS1", 2), ("BASE_TOOL", 0), ("BASE_TOOL", 1), *(
            ("JOINT_OFFSET", k) for k in range(3))]))),
    _case("import.fine", "add them to the vectors", RECORD, Edit("shop.ini", "=-600\n$TC_CARR46[1]=0.004", "=-599.996")),
    _case("import.unit", "write one of (mm),", XYZ.replace("UNITS = mm", "UNITS = elle"), Edit("shop.ini", "elle", r"\1")),
    _case("import.geometry", r"STRUCTURE = (w A' b X Y Z \(C1\) t), POINT_A = (0 0 0)",
          HEADER.format(kins="trivkins coordinates=XYZA") + JOINTS,
          Edit("shop.ini", "", "[POSTPROC]\nSTRUCTURE = \\1\nPOINT_A = \\2\n")),
    _case("import.geometry", "state it, and the (gain) on its road, above 0", FIVE,
          Edit("shop.hal", "gain0 -1", r"\g<1>0 1"), shop_hal=GAIN),
    HintCase("import.geometry", "machine import m.fcm -o shop.toml", {"m.fcm": FREECAD.replace("Z", "W")},
             "add it in FreeCAD's machine editor", (Edit("m.fcm", '"W"', '"Z"'),)),
    _case("import.number", "write a number", XYZ.replace("MAX_LIMIT = 100", "MAX_LIMIT = far", 1),
          Edit("shop.ini", "= far", "= 250")),
    _case("import.travel", "write MIN_LIMIT and (MAX_LIMIT)", XYZ.replace("MAX_LIMIT = 100\n", "", 1),
          Edit("shop.ini", "MIN_LIMIT = -100\n[JOINT_1]", "MIN_LIMIT = -100\n\\1 = 100\n[JOINT_1]")),
    _case("import.contradiction", "take out the line", XYZ.replace("UNITS = mm", "UNITS = mm\nLINEAR_UNITS = inch"),
          Edit("shop.ini", "LINEAR_UNITS = inch\n", "")),
    _case("import.contradiction", "see to the signs of all vectors", TABLE + "$MC_TRAFO5_PART_OFFSET_1[2]=-600\n",
          Edit("shop.ini", "OFFSET_1[2]=-600", "OFFSET_1[2]=600")),
    _case("import.pin", r"state it: (--set \S+)=VALUE", TRT + "[HAL]\nHALFILE = shop.hal\n", Edit(COMMAND, "shop.toml",
          r"shop.toml \1=20"), shop_hal="net a gui.y => xyzac-trt-kins.y-offset\n"),
    _case("import.file", "put the file where the INI names it", XYZ + "#INCLUDE more.inc\n", Edit("more.inc", "", "[A]\n")),
    _case("import.format", "name the form with (--format)", "x = 1\n", Edit("shop.ini", "", XYZ), Edit(
        COMMAND, "shop.toml", r"shop.toml \1 linuxcnc-ini")),
    HintCase("import.format", "machine import kin.txt -o shop.toml", {"kin.txt": "CfgKinSimpleAxis(key := A)\n"},
             "rows Trans before each (MachAxis)", (Edit("kin.txt", "", TABLE_530),)),
    HintCase("import.kinematics", "machine import kin.tab -o shop.toml", {"kin.tab": TABLE_530.replace("[END]", "")},
             r"with its last line, (\[END\])", (Edit("kin.tab", "MachAxis C\n", "MachAxis C\n\\1\n"),)),
    _case("import.assumed", "(--set) KEY=VALUE", XYZ, *(Edit(COMMAND, "-o shop.toml", f"-o shop.toml {given}") for given in (
        " ".join(f"--set axes.{axis}.{key}=90" for axis in "XYZ" for key in ("velocity", "acceleration", "jerk", "home")),
        "--set timing.tool_change=5 --set timing.clamp=0 --set timing.unclamp=0"))),
    _case("import.kinematics", "or take (sparm) out", TRT.replace("trt-kins", "trt-kins sparm=identityfirst"),
          Edit("shop.ini", " sparm=identityfirst", "")),
]
