"""Blocks of the shop that would hide motion or a state, or that no control could have: refused before all else."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

import machines
from machines.hooks import PASSIVE, HooksModel, filled
from postproc.controllers.model import builtin_files
from postproc.job.job import Job, with_shop
from postproc.pipeline.hooks import refused_hooks
from postproc.readback.dialects.readers import reader_for
from postproc.readback.text.modal import drop_passive
from postproc.readback.text.words import tokenise
from postproc.setup.model import SetupFile
from tests.postproc.control.test_clamps import CONTROLS
from tests.postproc.control.test_hooks import converted
from toolpaths.diagnostics import Diagnostic, DiagnosticError


@cache
def job_of(controller: str) -> Job:
    job = converted(controller, "axes").job
    assert job is not None
    return job


def with_blocks(controller: str, *blocks: str, passive: tuple[str, ...] = ()) -> list[Diagnostic]:
    """What is found in blocks of the shop, at the start of operations."""
    job = job_of(controller)
    machine = replace(job.machine, hooks=HooksModel(before_operation=blocks, passive=passive))
    spec = job.controller.model_copy(update={"program": job.controller.program.model_copy(update={"passive": ()})})
    return refused_hooks(replace(job, machine=machine, controller=with_shop(spec, machine, job.setup)))


# ---- passive codes -----------------------------------------------------------------------------------------

def texts(values: object) -> Iterator[str]:
    if isinstance(values, str):
        yield from values.splitlines()
    elif isinstance(values, dict):
        for key, value in values.items():
            if key not in ("needs", "relies_on", "relies_on_turns", "description", "sources", "writer", "rules", "default",
                           "carried_out", "angles"):
                yield from texts(value)
    elif isinstance(values, list):
        for value in values:
            yield from texts(value)


def executed(controller: str) -> set[str]:
    """Codes and first words that a control has, by its file and the tables of its reader."""
    job = job_of(controller)
    raw = tomllib.loads(builtin_files()[controller].read_text())
    names = set[str]()
    for line in texts(raw):
        names |= {m[0] for m in re.finditer(r"(?<![\w$.{])[GM]\d+(\.\d+)?(?![\w{])", line)}
        names |= {m[0] for m in [re.match(r"[A-Z][A-Z_]+\d*( [A-Z]{2,})?(?![\w{=])", line)] if m}
    for text in raw["program"]["carried_out"]:
        names |= {end for end in text.split("-") if len(end) > 1}
    reader = reader_for(job.controller, job.machine.axis_names, None, job.machine.stop, job.control.rolls,
                        job.machine.clamp_codes)
    names |= {f"G{v:g}" for group in reader.groups.values() for v in group}
    names |= {f"M{v:g}" for v in (*reader.m_codes, *reader.switches)} | {w for w in reader.statements if len(w) > 1}
    return {name for name in names if re.fullmatch(PASSIVE, name) and not name.startswith("MD")} - {raw.get("axes", "")}


@pytest.mark.parametrize("controller", CONTROLS)
def test_what_a_control_carries_out_is_never_passive(controller: str) -> None:
    names = executed(controller)
    assert len(names) > 40
    found = with_blocks(controller, passive=tuple(sorted(names)))
    refused = {d.message.split(" is named")[0] for d in found if d.code == "hooks.passive" and d.hint.startswith("take ")}
    assert names == refused, sorted(names - refused)


@pytest.mark.parametrize(("controller", "blocks"), [
    ("fanuc-30i", "G92 X0 Y0,G68 R30.,G52 X1.,G51 P2,G51.1 X0.,G16,G50,G31 Z5.,G54.2 P1,"
     "G66 P9,G10 L2 P1 Z5.,M198 P1,L9000,M98 P1"),
    ("linuxcnc", "G10 L2 P1 Z5,G43.1 Z5,M61 Q2,G28,G7,G92.1,G96 D10 S1,G65 P1 X5,M98 P1,M60,M70"),
    ("haas-ngc", "G253,G10 L2 P1 Z5.,G47 P0,G52 X1.,G154 P3,M16,M97 P10,M83,M11,G66 P9"),
    ("generic-iso", "G52 X1,G65 P1,G92 X0,M15,M60,L1"),
    ("siemens-840d", 'CYCLE800(),"TOFFON(3,5)",DIAMON,EXTCALL("X"),TRAFOOF,TRAORI,TRANS,CALL,CYCLE81(1),G58,GOTOF,ORIWKS'),
    ("heidenhain-tnc640", "CYCL DEF 7.1 X+10,STOP M30,TOOL CALL 2 Z,CALL PGM X,PLANE RESET,FUNCTION TCPM,TRANS DATUM,CC X+1,"
     "M89,LX+10,SEL TABLE,FN 17")])
def test_frames_offsets_tools_calls_and_units_are_no_passive_codes(controller: str, blocks: str) -> None:
    for block in re.findall(r'"([^"]*)"(?:,|$)|((?:[^,(]|\([^)]*\))+)', blocks):
        text = block[0] or block[1]
        name = re.match(r"[GM]\d+(?:\.\d+)?|[A-Z]+\d*(?: [A-Z]{3,})?(?: \d+(?:\.\d+)?)?", text)
        assert name is not None
        found = with_blocks(controller, text, passive=(name[0],))
        assert "hooks.passive" in {d.code for d in found} and all(d.hint for d in found), text


@pytest.mark.parametrize("word", ["X10", "T7", "D0", "H2", "S500", "F100", "R1", "X10.", "x"])
def test_single_words_are_no_passive_codes(word: str, tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    file.write_text(f'base = "mikron-ucp710"\n[hooks]\npassive = ["{word}"]\n')
    with pytest.raises(DiagnosticError) as fault:
        machines.load(file)
    assert all("L with one" in d.hint and "passive" in d.message for d in fault.value.diagnostics)


@pytest.mark.parametrize(("controller", "name"), [("fanuc-30i", "TOOL"), ("heidenhain-tnc640", "TOOL"),
                                                  ("heidenhain-tnc640", "CYCL DEF 7"), ("siemens-840d", "MSG")])
def test_a_name_that_is_the_beginning_of_a_statement_hides_it(controller: str, name: str) -> None:
    refused = "hooks.passive" in {d.code for d in with_blocks(controller, passive=(name,))}
    assert refused == (controller != "fanuc-30i")


@pytest.mark.parametrize(("controller", "block", "passive"), [
    ("fanuc-30i", "M31 H5", "M31"), ("fanuc-30i", "M31 D5", "M31"), ("fanuc-30i", "G200 X5.", "G200"),
    ("fanuc-30i", "G200 F5.", "G200"), ("fanuc-30i", "G200 T5", "G200"), ("fanuc-30i", "G200 S5", "G200"),
    ("fanuc-30i", "G65 P9 G91", "G65"), ("fanuc-30i", "M31 G91", "M31"), ("siemens-840d", "L9000 M30", "L9000"),
    ("siemens-840d", "L9000 X5", "L9000"), ("siemens-840d", "CYCLE977(1) M30", "CYCLE977"),
    ("heidenhain-tnc640", "TCH PROBE 412 M30", "TCH PROBE"), ("fanuc-30i", "M31;G0X10.", "M31"),
    ("fanuc-30i", "M31 %", "M31"), ("fanuc-30i", "(" + 120 * "A" + ")", "M31")])
def test_a_passive_code_takes_no_word_with_it_that_means_something(controller: str, block: str,
                                                                   passive: str) -> None:
    found = with_blocks(controller, block, passive=(passive,))
    assert [d.code for d in found] == ["hooks.code"] and found[0].hint


@pytest.mark.parametrize(("text", "passive", "left"), [
    ("M31 P1 Q2 H5 D6", "M31", "MHD"), ("G200 P1 I2 X3 F4 S5 T6 H7 D8", "G200", "GXFSTHD"), ("G65 P1 X2 F3 M5", "G65", "G")])
def test_arguments_of_passive_codes(text: str, passive: str, left: str) -> None:
    words = drop_passive(tokenise(f"{text}\nG0 X5\n".encode())[0], (passive,))
    assert "".join(map(chr, words.letter[words.line == 1])) == left[1:] and np.count_nonzero(words.line == 2) == 2


# ---- texts -------------------------------------------------------------------------------------------------

@pytest.mark.parametrize("block", [
    "({tool_number:3.2f})", "({operation!r})", "({operation!x})", "{tool_number:{operation}}", "({operation:03d})", "({0})",
    "({})", "({tool_number.real})", "({tool}", "{tool_number:03d", "}", "%", "N10 M31", "n10M31", "10 M31", "/M31", "/ M31",
    "M31 ~", "; NOTE ~", "", "M31\nM32", "MÄ"])
def test_a_text_that_is_no_block_is_refused_where_it_is_read(block: str, tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    file.write_text(f'base = "mikron-ucp710"\n[hooks]\nafter_stop = ["M31", """{block}"""]\n')
    with pytest.raises(DiagnosticError) as fault:
        machines.load(file)
    assert all(d.hint and d.message.startswith("hooks.after_stop[1]") and d.lines for d in fault.value.diagnostics)
    with pytest.raises(ValidationError):
        SetupFile(hooks=HooksModel(after_stop=(block,)))


@pytest.mark.parametrize("line", ['after_stop = "M31"', "after_stop = [31]", "after_stop = [[]]", 'afterstop = ["M31"]',
                                  'passive = "M31"'])
def test_every_fault_of_the_table_has_a_hint(line: str, tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    file.write_text(f'base = "mikron-ucp710"\n[hooks]\n{line}\n')
    with pytest.raises(DiagnosticError) as fault:
        machines.load(file)
    assert all(d.hint for d in fault.value.diagnostics), fault.value.diagnostics


def test_numbers_with_zeros_and_names_that_are_cut() -> None:
    values = {"tool_number": "7", "tool_name": "T" * 30, "operation": "O" * 90, "work_offset": "G54.1 P3"}
    assert filled("(T{tool_number:03d} {work_offset:02d})", values) == "(T007 03)"
    short = filled("({operation} {tool_name})", values, 63)
    assert short == f"({'O' * 30} {'T' * 30})"
    assert filled("({operation})", values, 12) == f"({'O' * 10})" and filled("M31 ({operation})", values, 3) == "M31 ()"
    with pytest.raises(ValueError, match="no number"):
        filled("{work_offset:02d}", values | {"work_offset": "G59.1"})
    assert not with_blocks("fanuc-30i", "(T{tool_number:03d} {work_offset:03d})",
                           "({operation} " + "A" * 90 + ")")
    job = job_of("linuxcnc")
    hooks = HooksModel(before_stop=("({work_offset:02d})",))
    found = refused_hooks(replace(job, setup=job.setup.model_copy(update={"work_offset_code": "G59.1", "hooks": hooks})))
    assert [d.code for d in found] == ["hooks.code"] and "{work_offset}" in found[0].hint
