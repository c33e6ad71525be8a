"""`verify --tool-table`: lengths at the machine as each control writes them, and the program verified with them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from postproc.cli.app import app
from postproc.controllers.model import load_controller
from postproc.verification.tool_table_file import ToolTable, table_of
from tests.postproc.kit import SAMPLES
from toolpaths.diagnostics import DiagnosticError

CL = Path(__file__).parents[2] / "golden" / "short_five_axis.apt"
TABLES = {
    "linuxcnc": "; table\nT1 P1 Z+120.031 D6.0 ;T9 Z1 in a remark\nT2 P2 D10 Z95.5\nT3 P3 D1\n",
    "generic-iso": "T1 P1 Z120.031\nT2 P2 Z95.5\n",
    "fanuc-30i": "%\nN1 G90 G10 L10. P1 R120.\nG10 L10 P1 R120.\nG10 L11 P1 R0.031\nG10L10P2R95.5 ;\n"
                 "G10 L11 P2 R0;\nG10 L12 P1 R5.\n%\n",
    "haas-ngc": "%\nO01234\nG10 L10 P1 R120.031 (T9)\nG10 L10 P2 R95.5\nM30\n%\n",
    "siemens-840d": "N10 $TC_DP1[1,1]=120\nN20 $TC_DP3[1,1]=120 $TC_DP12[1,1]=0.031\n$TC_DP3[2,1]=90\n$TC_DP21[2,1]=5.5\n"
                    "$TC_DP3[2,2]=7\n",
    "heidenhain-tnc640": "BEGIN TOOL    .T MM\nT     NAME        L          R       DL\n"
                         "0                 +0         +0      +0\n"
                         "1     D6 L9       +120.0     +3      +0.031\n2                 +95.5      +5\n[END]\n"}


def read(table: str, name: str = "linuxcnc") -> ToolTable:
    controller, _ = load_controller(name)
    assert controller is not None
    return table_of(table, controller, "tools")


@pytest.mark.parametrize("name", TABLES)
def test_tables_are_read_as_the_control_writes_them(name: str) -> None:
    found = read(TABLES[name], name).lengths
    assert {k: found[k] for k in (1, 2)} == pytest.approx({1: 120.031, 2: 95.5})


def test_tables_of_text() -> None:
    assert read("register;length\n1;120.031\n\n2;95.5\n", "siemens-840d") == ToolTable({1: 120.031, 2: 95.5})
    found = read("tool\tlength\twear\n1\t120.0\t0.031\n2\t95.5\t\n")
    assert found.by == "tool" and found.lengths == pytest.approx({1: 120.031, 2: 95.5})
    assert read("tool,register,length\n1,2,95.5\n") == ToolTable({2: 95.5})


OFS = """<OFFSETS>
<TOOL_OFFSET>
  <TOOL1>
    <DESCRIPTION>T9 Z1</DESCRIPTION>
    <LENGTH_GEOMETRY>120.000</LENGTH_GEOMETRY>
    <LENGTH_WEAR>0.031</LENGTH_WEAR><DIAMETER_GEOMETRY>12.720</DIAMETER_GEOMETRY>
  </TOOL1>
  <TOOL2><LENGTH_GEOMETRY>95.5</LENGTH_GEOMETRY><LENGTH_WEAR>0.0</LENGTH_WEAR></TOOL2>
  <TOOL3><LENGTH_GEOMETRY>0.0</LENGTH_GEOMETRY><LENGTH_WEAR>0.0</LENGTH_WEAR></TOOL3>
</TOOL_OFFSET>
"""


def test_the_file_of_offsets_that_haas_saves() -> None:
    """Tools without a length are none; a number that is none has its line."""
    for table in (OFS, OFS.replace("<TOOL_OFFSET>", "").replace("</TOOL_OFFSET>", "")):
        assert read(table, "haas-ngc").lengths == pytest.approx({1: 120.031, 2: 95.5})
    with pytest.raises(DiagnosticError) as caught:
        read(OFS.replace("0.031", "0,031"), "haas-ngc")
    assert list(caught.value.diagnostics[0].lines) == [6]


def test_wear_by_the_older_word() -> None:
    """L1 is L11 (B-63944EN 14.2, Haas G10)."""
    assert read("G10 L10 P1 R120.\nG10 L1 P1 R-0.5\n", "haas-ngc").lengths == {1: 119.5}


def test_inches_are_inches() -> None:
    table = TABLES["heidenhain-tnc640"].replace(".T MM", ".T INCH").replace("+120.0 ", "+4.0   ")
    table = table.replace("+0.031", "+0").replace("+95.5", "+3.75")
    assert read(table, "heidenhain-tnc640").lengths[1] == pytest.approx(101.6)
    assert read("G20\nG10 L10 P1 R4.\nG21\nG10 L10 P2 R4.\n", "haas-ngc").lengths == pytest.approx({1: 101.6, 2: 4.0})


REFUSED = [
    ("fanuc-30i", "G10 L10 P1 R120\n", "point", 1), ("fanuc-30i", "\nG10 L10 R120.\n", "words", 2),
    ("fanuc-30i", "G10 L10 P1 R1.2.3\n", "number", 1), ("fanuc-30i", "G10 L11 P1 R0.01\n", "wear", 1),
    ("fanuc-30i", "G91\nG10 L10 P1 R1.\n", "increments", 1), ("fanuc-30i", "/G10 L10 P1 R1.\n", "number", 1),
    ("fanuc-30i", "G10 L10 P1 R1. G10 L10 P2 R2.\n", "words", 1), ("fanuc-30i", "G10 L10 P1.5 R1.\n", "register", 1),
    ("haas-ngc", "G10 L10 P1 R10.\nG10 L10 P1 R11.\n", "twice", 2), ("haas-ngc", "G10 L10 P1 R-90.\n", "length", 0),
    ("heidenhain-tnc640", TABLES["heidenhain-tnc640"].replace("+120.0", "+12O.0"), "number", 4),
    ("heidenhain-tnc640", TABLES["heidenhain-tnc640"].replace("+120.0", "+120,0"), "number", 4),
    ("linuxcnc", "T1 P1 Z120,03\n", "number", 1), ("linuxcnc", "T1 P1 Z1.2e2\n", "number", 1),
    ("linuxcnc", "T1 P1 Z120\nT1 P2 Z95\n", "twice", 2), ("linuxcnc", "T1 Z120000\n", "length", 0),
    ("linuxcnc", "T1 Z0\n", "length", 0), ("linuxcnc", "tool,length\n1,120,3\n2,5\n", "cells", 2),
    ("linuxcnc", "register;length\n1;90,9\n", "number", 2), ("linuxcnc", "register;length\n1;90+0.9\n", "number", 2),
    ("linuxcnc", "register;length;radius\n1;90;3\n", "columns", 1), ("linuxcnc", "register;length\n-1;90\n", "register", 2),
    ("siemens-840d", "$TC_DP3[1,1]=90,9\n", "number", 1), ("siemens-840d", "$TC_DP3[1,1]=1.2.3\n", "number", 1),
    ("siemens-840d", "$TC_DP3[1,1]=.\n", "number", 1), ("siemens-840d", "$TC_DP12[1,1]=0.03\n", "wear", 1),
    ("siemens-840d", "G70\n$TC_DP3[1,1]=4.0\n", "inches", 1), ("siemens-840d", "T1 P1 Z120\n", "empty", 0)]


@pytest.mark.parametrize(("name", "table", "code", "line"), REFUSED)
def test_what_is_no_table_is_refused(name: str, table: str, code: str, line: int) -> None:
    with pytest.raises(DiagnosticError) as caught:
        read(table, name)
    fault = caught.value.diagnostics[0]
    assert fault.code == f"tool-table.{code}" and fault.hint and list(fault.lines) == ([line] if line else [])


def run(*args: str) -> tuple[int, str]:
    done = CliRunner().invoke(app, [*map(str, args)])
    return done.exit_code, done.output


def test_verify_takes_the_lengths_of_the_table(tmp_path: Path) -> None:
    """A head in machine coordinates: a hundredth too long is inside the tolerance, two are not; a missing tool is named."""
    given = ("-m", "head-table", "-c", "generic-iso", "--setup", str(SAMPLES / "tools.setup.toml"))
    program, table = tmp_path / "part.nc", tmp_path / "tools.tbl"
    assert run("convert", str(CL), *given, "-o", str(program))[0] == 0
    verify = ("verify", str(program), str(CL), *given, "--tool-table", str(table))
    for length, right in (("120", True), ("120.01", True), ("119.99", True), ("120.06", False),
                          ("95.5", False)):
        table.write_text(f"T1 P1 Z{length}\n")
        code, text = run(*verify)
        assert code == (0 if right else 1), text
        assert f"register 1 of the tool table {float(length):.4f} mm" in text
        assert re.search(r"allowed -0\.02\d\d to \+0\.02\d\d", text) and (": tolerance fails)" in text) == (not right)
        assert ("NOT proved" in text) == (not right) and ("second witness agrees" in text) == right
        named = re.search(r"tool-table.outside\] .*T1 is ([\d.]+) mm (longer|shorter) .* 0\.02\d\d mm are allowed", text)
        assert (named is None) == right
        assert named is None or (float(named[1]), named[2]) == (
            pytest.approx(abs(float(length) - 120.0)), "longer" if float(length) > 120.0 else "shorter")
    table.write_text("T7 P1 Z120\n")
    code, text = run(*verify)
    assert code == 1 and "tool-table.missing" in text and "no length of register 1 (T1)" in text
    code, text = run(*verify[:-1], str(tmp_path / "none.tbl"))
    assert code == 1 and "tool-table.open" in text


def test_a_table_turning_machine_takes_any_length_up(tmp_path: Path) -> None:
    given = ("-m", "mikron-ucp710", "-c", "linuxcnc", "--setup", str(SAMPLES / "tools.setup.toml"))
    program, table = tmp_path / "part.ngc", tmp_path / "tools.tbl"
    assert run("convert", str(CL), *given, "-o", str(program))[0] == 0
    table.write_text("T1 P1 Z101.5\n")
    assert run("verify", str(program), str(CL), *given, "--tool-table", str(table))[0] == 0
    table.write_text("T1 P1 Z390\n")
    code, text = run("verify", str(program), str(CL), *given, "--tool-table", str(table))
    assert code == 1 and "verify.travel" in text


def test_a_length_far_off_and_bodies_that_it_does_not_reach_are_noted(tmp_path: Path) -> None:
    setup, table, program = tmp_path / "shop.toml", tmp_path / "tools.csv", tmp_path / "part.ngc"
    setup.write_text('[tools.1]\ngauge_length = 101.6\nflute_length = 20.0\nshank = [{ diameter = 6, length = 30 }]\n'
                     'holder = [{ diameter = 40, length = 51.6 }]\n[[bodies.fixtures]]\nname = "block"\n'
                     'box = {low = [200.0, 200.0, 0.0], high = [220.0, 220.0, 20.0]}\n')
    given = ("-m", "mikron-ucp710", "-c", "linuxcnc", "--setup", str(setup))
    code, text = run("convert", str(CL), *given, "-o", str(program))
    assert code == 0, text
    table.write_text("tool,length\n1,4.0\n")
    _, text = run("verify", str(program), str(CL), *given, "--tool-table", str(table))
    assert "tool-table.far" in text and "tool-table.bodies" in text and "97.6000 mm" in text
    table.write_text("tool,length\n1,101.7\n")
    code, text = run("verify", str(program), str(CL), *given, "--tool-table", str(table))
    assert code == 0 and "tool-table." not in text


HEAD, LOAD, CUT = ["UNITS/MM"], ["LOADTL/1", "SPINDL/RPM,2000,CLW"], ["RAPID", "GOTO/0,0,40", "FEDRAT/MMPM,500",
                                                                      "GOTO/0,0,30", "GOTO/20,8,30", "RAPID", "GOTO/20,8,40"]
TNC = ("BEGIN TOOL    .T       MM\nT    NAME             L          R          DL      DR      TL RT  DOC\n"
       "0                     +0,000     +0,000     +0,000  +0,000         0\n"
       "1    14MM_CRB_4FL_32_ {}   +7,000     +0,031  +0,000         0  K\u00fchlung innen\n"
       "1.1  14MM_CRB_4FL_32_ +88,000    +7,000     +0,000  +0,000         0\n"
       "2                     +0,000     +0,000     +0,000  +0,000         0\n"
       "15   6,0mm_JOBBER     -18,892    +3,000     +0,000  +0,000         0\n[END]\n")
TOA = ("%_N_TO_TOA\n;$PATH=/_N_INITIAL_DIR\nCHANDATA(1)\n{}$TC_DP1[3470,1]=120\n$TC_DP3[3470,1]={}\n$TC_DP6[3470,1]=12.5\n"
       "$TC_TP2[3471]=\"OTHER\"\n$TC_DP3[3471,1]=0\nM17\n")
FS25 = '$TC_TP1[3470]=1\n$TC_TP2[3470]="FS25R2L85"\n'


def verified_with(tmp_path: Path, controller: str, table: str, name: str = "") -> tuple[int, str]:
    cl, setup, program, tools = (tmp_path / n for n in ("p.apt", "s.toml", "p.nc", "tools.txt"))
    cl.write_text("\n".join([*HEAD, *LOAD, *CUT]) + "\n")
    setup.write_text("[tools.1]\ngauge_length = 90.0\n" + (f'called = "{name}"\n' if name else ""))
    tools.write_bytes(table.encode("latin-1"))
    given = (str(cl), "-m", "mill-3axis", "-c", controller, "--setup", str(setup))
    code, text = run("convert", *given, "-o", str(program))
    assert code == 0, text
    return run("verify", str(program), *given, "--tool-table", str(tools))


def test_a_table_with_commas_and_unmeasured_tools(tmp_path: Path) -> None:
    """TOOL.T as a TNC 310 and a TNC 640 write it: rows of 0, an index, a length from another tool; what is called counts."""
    code, text = verified_with(tmp_path, "heidenhain-tnc640", TNC.format("+90,500 "))
    assert code == 0 and "register 1 of the tool table 90.5310 mm (+0.5310" in text
    for length, said in (("+0,000  ", "0.031 mm"), ("-4,686  ", "-4.655 mm")):
        code, text = verified_with(tmp_path, "heidenhain-tnc640", TNC.format(length).replace("-18,892", "+18,892"))
        assert code == 1 and f"number 1 has a length of {said}, and the program calls it" in text
    code, text = verified_with(tmp_path, "heidenhain-tnc640", TNC.format("+90,500 "), "14mm_crb_4fl_32_")
    assert code == 0 and "90.5310" in text


def test_tools_of_an_archive_are_found_by_name(tmp_path: Path) -> None:
    """$TC_TP2: the T number of the archive is the control's own; tools of one name stand in for each other."""
    code, text = verified_with(tmp_path, "siemens-840d", TOA.format(FS25, "90.75"), "fs25r2l85")
    assert code == 0 and "90.7500 mm (+0.7500" in text
    code, text = verified_with(tmp_path, "siemens-840d", TOA.format(FS25, "90.75"))
    assert code == 1 and 'no length of tool "1" (T1)' in text and 'called "FS25R2L85", "OTHER"' in text
    code, text = verified_with(tmp_path, "siemens-840d", TOA.format(FS25.replace("FS25R2L85", "1"), "90.75"))
    assert code == 0
    code, text = verified_with(tmp_path, "siemens-840d", TOA.format(FS25, "90.75"), "OTHER")
    assert code == 1 and "number 3471 has a length of 0 mm, and the program calls it" in text
    sister = TOA.format(FS25, "90.75").replace("M17", '$TC_TP2[7]="FS25R2L85"\n$TC_DP3[7,1]=90.5\nM17')
    code, text = verified_with(tmp_path, "siemens-840d", sister, "FS25R2L85")
    assert code == 1 and "tools of one name hold different lengths: T1" in text


def test_every_register_of_a_punched_table(tmp_path: Path) -> None:
    """Fanuc writes all registers, those of tools that are not there with 0."""
    rows = (f"G10G90L10P{n}R{90.25 if n == 1 else 0.0:.3f}\nG10G90L11P{n}R0.000\n" for n in range(1, 9))
    table = "".join(("%\n", *rows, "%\n"))
    code, text = verified_with(tmp_path, "fanuc-30i", table)
    assert code == 0 and "90.2500 mm (+0.2500" in text
    code, text = verified_with(tmp_path, "fanuc-30i", table.replace("90.250", "0.000"))
    assert code == 1 and "tool-table.length" in text


@pytest.mark.parametrize(("length", "code"), [("0", 0), ("110", 1), ("-3", 1)])
def test_a_length_is_0_where_the_words_hold_it_and_the_control_adds_its_own(length: str, code: int, tmp_path: Path) -> None:
    """A machine on legs under a control that keeps the length of its tool table in force: the words have it already."""
    on = ["-m", "delta-parallel-z", "-c", "heidenhain-tnc640", "--setup", str(tmp_path / "s.toml")]
    (tmp_path / "s.toml").write_text("[tools.1]\ngauge_length = 110.0\n[part]\norigin = [0.0, 0.0, -60.0]\n")
    (tmp_path / "a.apt").write_text("UNITS/MM\nLOADTL/1\nSPINDL/RPM,1000,CLW\nFEDRAT/MMPM,600\nRAPID\nGOTO/0,0,5\n"
                                    "GOTO/0,0,0\nGOTO/9,0,0\nRAPID\nGOTO/9,0,5\nFINI\n")
    (tmp_path / "t.csv").write_text(f"tool,length\n1,{length}\n")
    made = CliRunner().invoke(app, ["convert", str(tmp_path / "a.apt"), *on, "-o", str(tmp_path / "p.h")])
    assert made.exit_code == 0 and "tool.length_twice" in made.stderr
    found = CliRunner().invoke(app, ["verify", str(tmp_path / "p.h"), str(tmp_path / "a.apt"), *on, "--tool-table",
                                     str(tmp_path / "t.csv")])
    assert found.exit_code == code and ("error [tool.length_twice]" in found.stderr) == bool(code)


@pytest.mark.parametrize(("name", "table", "aside"), [
    ("linuxcnc", "T1 P1 X0 Z100 D6\nT2 P2 X5 Z90 C-1.5 I7 D4\n", "X 5, C -1.5"),
    ("siemens-840d", "$TC_DP3[1,1]=100 $TC_DP4[1,1]=0\n$TC_DP3[2,1]=90 $TC_DP4[2,1]=5 $TC_DP6[2,1]=4\n$TC_DP13[2,1]=.1\n"
                     "$TC_DP5[1,2]=9\n", "$TC_DP4 5, $TC_DP13 .1")])
def test_what_the_control_adds_along_other_axes_is_an_error_of_the_tools_called(name: str, table: str, aside: str,
                                                                                 tmp_path: Path) -> None:
    """G43 of LinuxCNC and length 2 and 3 of a Siemens tool set the tool off sideways: the program was called proved."""
    assert read(table, name).aside == {2: aside}
    (tmp_path / "t.tbl").write_text(table)
    setup, program = tmp_path / "s.toml", tmp_path / "p.nc"
    for number, bad in ((1, False), (2, True)):
        cl = tmp_path / "part.apt"
        cl.write_text(f"UNITS/MM\nLOADTL/{number}\nSPINDL/RPM,1000,CLW\nRAPID\nGOTO/0,0,20\nFEDRAT/200\nGOTO/0,0,-1\nFINI\n")
        setup.write_text(f"[tools.{number}]\ngauge_length = {110 - 10 * number}.0\n")
        on = [str(cl), "-m", "mill-3axis", "-c", name, "--setup", str(setup)]
        assert CliRunner().invoke(app, ["convert", *on, "-o", str(program)]).exit_code == 0
        result = CliRunner().invoke(app, ["verify", str(program), *on, "--tool-table", str(tmp_path / "t.tbl")])
        assert (result.exit_code, "tool-table.aside" in result.output) == (int(bad), bad), result.output
