"""The witness's reading and kinematics next to the project's own: two paths to one result."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import machines
import postproc
import toolpaths
from machines.loader import builtin
from postproc.report.summary import as_text
from postproc.verification.second_witness import machine_tables
from postproc.witness.clamps import limits_of
from postproc.witness.clfile import commanded
from postproc.witness.commanded import HOLE, LINE, RAPID
from postproc.witness.machine import Chain, Rods, kinematics_of, merged
from toolpaths.diagnostics import has_errors
from toolpaths.toolpath import Kind, Role

ROOT = Path(__file__).parents[3]
FILES = sorted(p for folder in ("samples", "tests/golden") for p in (ROOT / folder).rglob("*")
               if p.suffix in (".cls", ".apt", ".ncl", ".as", ".clt", ".aptsource"))
FILES += sorted((ROOT / "samples" / "other_forms").iterdir())
TEXTS = {
    "arcs of generic files": "GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1,10\nGOTO/0,10,0\nCIRCLE/0,0,0,0,0,-1,10\nGOTO/10,0,0\nFINI\n",
    "MOVARC": "GOTO/10,0,0\nMOVARC/0,0,0,0,0,1,10,ANGLE,90\nGOTO/0,10,0\nFINI\n",
    "GODLTA along the axis": "GOTO/1,2,3,0,0.6,0.8\nGODLTA/5\nGODLTA/1,1,1\nRAPID\nGODLTA/-2\n",
    "GODLTA in a turned system": "TOOL PATH/A,TOOL,B\nMSYS/1,2,3,0,1,0,-1,0,0\nGOTO/1,2,3\nGODLTA/1,0,2\nEND-OF-PATH\n",
    "continued and commented": ("goto / 1, $\n 2, 3 $$ a remark\n$$ alone\nGOTO/1,2,$\n4\n"
                                "PPRINT $$ text / 1,2,3\nGOTO/4,5,6\n"),
    "dollars in texts": ("PPRINT FINISH 5$ PASS\nGOTO/1,2,3\nREMARK PRICE 20$\nGOTO/4,5,6\nPARTNO A $US 120 $$ EACH\nRAPID\n"
                         "TPRINT/D10 $\n 20$ B\nGOTO/7,8,9\nGOTO/1,2,$\n\n$$ alone\n3\n"),
    "carriage returns": "GOTO/1,2,3\r\nRAPID\r\nGOTO/4,5,6\r\n",
    "blanks for commas": "GOTO/1 2 3\nGOTO/4 5 6 0 0 1\n",
    "FROM and GOHOME": "FROM/0,0,100\nGOTO/1,2,3\nGOHOME/0,0,100\nGOHOME\nGOTO/1,2,3\n",
    "subroutine called twice": ("DEFSUB/1\nGOTO/1,2,3\nGOTO/4,5,6\nENDSUB\nGOTO/0,0,9\nCALSUB/1\nGOTO/0,0,9\nCALSUB/1\n"
                                "GOTO/7,8,9\n"),
    "inches by their feeds": "FEDRAT/10,IPM\nGOTO/1,2,3\n",
    "NCI: holes, a dwell, coolant and compensation": (
        "1050\n9 2\n1001\n1 1 1 7 0 0 0 -900. 0. 2\n0\n40 1. 2. 9. -2. 200000\n4\n0.5 -900.\n"
        "2\n42 0 3. 2. 2. 2. 8. 90. 0 0\n1004\n0\n"
        "81\n3 5. 5. -9. 0.3 450. 0 0 0 0 12. 3. 1. 0 5. 5. 12. 0 0\n"
        "100\n0 8. 5. -9. 12. 14. 0.3 450. 8. 5. 12. 0 0\n"
        "1000\n1 1 1 7 0 0 0 0 0. 0\n1\n0 8. 5. 13. 90. 0\n1003\n0\n"),
    "FreeCAD: steps, modal motion, a mixture of retracts": (
        "(Exported by FreeCAD)\n(Post Processor: linuxcnc)\nG20 G90\nT1 M6\nS900 M4\nG0 Z1\nX1 Y1\nG91 G1 X1 F3\nY-.5\nG90\n"
        "G3 X4 Y.5 I1 J0\nG4 P.5\nG99 G82 X4 Y1 Z-1 R.2 P.3 F2\nS800\nX5\nG98 G73 X6 Q.1\nG80\nG1 Z2\nM0\nM1\nM2\n"),
    "points in the common system": ("$$-> FEATNO / 1\n$$-> CSYS / 1,0,0,5, $\n0,0.8,-0.6,6, $\n0,0.6,0.8,7\nGOTO/1,2,3\n"
                                    "GOTO/1,2,3,0,0.6,0.8\nGOTO/4,5,6\nMULTAX/ON\nGOTO/7,8,9,0,0,1\n"),
}


@pytest.mark.parametrize("given", [*FILES, *(pytest.param(text, id=name) for name, text in TEXTS.items())],
                         ids=lambda p: getattr(p, "name", None))
def test_both_read_alike(given: Path | str) -> None:
    text = given.read_bytes() if isinstance(given, Path) else given.encode()
    path, found = toolpaths.read_bytes(text)
    assert not has_errors(found), [str(d) for d in found]
    c = commanded(text)
    assert len(c) == len(path) and (c.line == path.line).all()
    assert c.known.all() or "ROTATE" in c.unread, c.unread
    np.testing.assert_allclose(c.tip[c.known], path.tip[c.known], atol=1e-9)
    np.testing.assert_allclose(c.axis[c.known], path.axis[c.known], atol=1e-12)
    assert ((c.kind == HOLE) == (path.role == Role.HOLE)).all()
    assert ((c.arc >= 0) == (path.kind == Kind.ARC)).all()
    assert ((c.kind == LINE) == ((path.kind == Kind.FEED) & (path.role != Role.START))).all()
    np.testing.assert_allclose(c.normal, path.arcs.normal, atol=1e-12)
    np.testing.assert_allclose(c.centre, path.arcs.center, atol=1e-9)
    np.testing.assert_allclose(c.sweep, path.arcs.sweep, atol=1e-9)


@pytest.mark.parametrize(("text", "what"), [
    ("GOTO/0,0,0\nNURBS/\nKNOT/.5,1\nCNTRL/1,0,0\nCNTRL/2,0,0\nCNTRL/3,0,0\nGOTO/5,0,0\n", "NURBS"),
    ("$$-> FEATNO / 1\nGOTO/1,2,3\nROTATE / AAXIS, INCR, 45, CCLW\nGOTO/1,2,3\n", "ROTATE"),
    ("GOTO/1,2,3\nTRANS/1,0,0\nGOTO/1,2,3\n", "TRANS"), ("CYCLE/DRILL,5,100,2\nGOTO/1,2,3\n", "CYCLE in"),
    ("GOTO/1,2,3\nSPLINEX/1,2,3\nGOTO/4,5,6\n", "SPLINEX"), ("PARTNO 'X'\nLOADTL/1,2,3,4\nGOTO/1,2,3\n", "dialect"),
])
def test_what_is_not_read_is_said(text: str, what: str) -> None:
    c = commanded(text.encode())
    assert any(what in said for said in c.unread)
    assert not c.known.all() or c.gap.any() or not np.isfinite([x.depth for x in c.cycles]).all()


@pytest.mark.parametrize("name", sorted(builtin()))
def test_poses_of_every_machine(name: str) -> None:
    """Serial machines: the same tip and axis. Rods: their lengths where the machine says the tool is, and nowhere else."""
    m = machines.load(name)
    table = merged(machine_tables(m))
    own, length = kinematics_of(table), 83.3
    rng = np.random.default_rng(5)
    travel, speed = limits_of(table, m.axis_names)
    np.testing.assert_allclose(travel, np.stack([m.limits.lower, m.limits.upper], axis=1))
    np.testing.assert_allclose(speed, m.limits.velocity)
    q = m.home + rng.normal(size=(50, len(m.home))) * np.where(m.rotary, np.where(m.kinematics.drives_tip, 0.1, 0.4), 20.0)
    tip, axis = m.kinematics.with_tool(length).forward(q)
    met = np.isfinite(np.hstack([tip, axis])).all(axis=1)  # arms as they come take a platform out of its reach
    q, tip, axis = q[met], tip[met], axis[met]
    cranks = (np.array(m.rotary) & m.kinematics.drives_tip).any()
    assert len(q) == 50 or (cranks and len(q) > 10) or (m.name == "linuxcnc-pentapod" and len(q) > 40)
    if isinstance(own, Chain):
        mine = own.pose(q, m.axis_names, np.full(len(q), length))
        np.testing.assert_allclose(mine[0], tip, atol=1e-9)
        np.testing.assert_allclose(mine[1], axis, atol=1e-12)
    else:
        assert isinstance(own, Rods)
        assert own.misfit(q, m.axis_names, tip, axis, np.full(len(q), length)).max() < 1e-8
        assert own.misfit(q, m.axis_names, tip, axis, np.full(len(q), length + 0.05)).min() > 1e-4
        assert own.misfit(q, m.axis_names, tip + np.array([0.02, 0.0, 0.0]), axis, np.full(len(q), length)).max() > 1e-4


def test_a_path_that_was_changed_after_reading_has_no_second_reading() -> None:
    text = b"UNITS/MM\nLOADTL/1\nSPINDL/RPM,1000,CLW\nFEDRAT/500,MMPM\nRAPID\nGOTO/0,0,50\nGOTO/0,0,1\nGOTO/5,0,1\nFINI\n"
    path, found = toolpaths.read_bytes(text, file="part.apt")
    read = postproc.convert(path, "mill-3axis", diagnostics=found)
    changed = postproc.convert(replace(path, tip=path.tip + 1.0), "mill-3axis", diagnostics=found)
    assert read.witness is not None and read.witness.compared and not read.witness.not_compared
    assert changed.ok and changed.witness is not None and not changed.witness.compared and changed.witness.not_compared
    assert "second witness agrees: 3 positions" in as_text(read, "out.ngc")
    assert "; not compared by the second reading: all" in as_text(changed, "out.ngc")


@pytest.mark.parametrize("after", ["", "FEDRAT/100,MMPM\nGOTO/0,0,0\nGOTO/10,0,0\nRAPID\nGOTO/0,0,50\n"])
def test_holes_that_are_not_read_refuse_no_program_that_comes_back_to_where_it_was(after: str) -> None:
    """The position behind the holes is that before them: what is between is not compared, and is no fault."""
    text = ("UNITS/MM\nLOADTL/1\nSPINDL/RPM,3000,CLW\nRAPID\nGOTO/0,0,50\nCYCLE/DRILL,FEDTO,10,RAPTO,3,FEDRAT,120,MMPM\n"
            f"GOTO/10,10,0\nGOTO/20,10,0\nCYCLE/OFF\nRAPID\nGOTO/0,0,50\n{after}FINI\n")
    path, found = toolpaths.read_bytes(text)
    result = postproc.convert(path, "mill-3axis", diagnostics=found)
    assert result.ok, [str(d) for d in result.diagnostics]
    assert result.witness is not None and [what for what in result.witness.not_compared if "CYCLE" in what.why]


def test_numbers_of_cards_are_no_parameters() -> None:
    """They were the last word of each record, and RAPID no word that it knows: a true program was refused."""
    lines = ["PARTNO A", "UNITS/MM", "RAPID", "GOTO/1,2,3", "FEDRAT/MMPM,100", "GOTO/4,5,6", "FINI"]
    for deck in ([f"{line:<72}{10 * k:08d}" for k, line in enumerate(lines, 1)],
                 [f"{line:<72}ABC{k:05d}" for k, line in enumerate(lines, 1)]):
        seen = commanded("\n".join(deck).encode())
        assert seen.tip[:, :3].tolist() == [[1, 2, 3], [4, 5, 6]] and seen.kind.tolist() == [RAPID, LINE]
        assert not seen.unread and seen.feed[1] == 100.0
    plain = [f"GOTO/{k},0,0,{' ' * 60}{1000 + k}" for k in range(6)]
    assert len(commanded("\n".join(plain).encode()).tip) == 6
