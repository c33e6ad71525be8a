"""Programs of our own for the four controllers, spoilt in one place: the read-back must refuse every one of them."""

from __future__ import annotations

import re
from functools import cache

import numpy as np
import pytest

from postproc.pipeline.result import PostResult
from postproc.readback.dialects.readers import reader_for
from postproc.readback.execution.execute import Motion, run
from postproc.readback.execution.offsets import Offsets
from postproc.verification.read_back import read_back
from tests.postproc.kit import codes, sample
from tests.postproc.reader_kit import FANUC, HAAS, SIEMENS, TNC
from toolpaths.diagnostics import Severity

CASES = [(file, name) for file in ("five_faces.cls", "tool_axis_tour.apt") for name in (FANUC, HAAS, SIEMENS, TNC)]
MODES = {FANUC: r"G68\.2|G53\.1|G43\.4|G69", HAAS: r"G254|G234|G255", SIEMENS: r"CYCLE800\(.|TRAORI",
         TNC: r"PLANE SPATIAL|FUNCTION TCPM|PLANE RESET"}
COUNT = 6


@cache
def result_of(file: str, controller: str) -> PostResult:
    """The pivots of the machine are beside its origin, so that words mean other positions under every law."""
    return sample(file, "trunnion-bc", controller)


def motion_of(result: PostResult) -> Motion:
    """The motion of an unspoilt program."""
    job = result.job
    assert job is not None
    control, machine = job.control, job.machine
    home = control.words(machine.home[None, :], machine.kinematics, 0.0)[0] + control.work_offset
    reader = reader_for(job.controller, machine.axis_names, home)
    code, _ = reader.read(result.text.encode())
    assert code is not None
    offsets = Offsets(control.work_offset, control.xyz, job.register_lengths(), home, control.length_on_z,
                      job.controller.cycles.peck_relief, control, reader.rises_first, reader.arc_slack)
    return run(code, machine.axis_names, offsets)[0]


def refusals(result: PostResult, lines: list[str]) -> set[str]:
    assert result.job is not None
    _, found = read_back(("\n".join(lines) + "\n").encode(), result.job, "f.cls")
    return codes(d for d in found if d.severity is Severity.ERROR)


def survivors(result: PostResult, mutants: list[tuple[str, list[str]]]) -> list[str]:
    assert mutants
    picked = np.unique(np.linspace(0, len(mutants) - 1, COUNT).astype(int))
    return [mutants[k][0] for k in picked if not refusals(result, mutants[k][1])]


def changed(lines: list[str], i: int, block: str | None) -> tuple[str, list[str]]:
    return f"{i + 1}: {lines[i]} -> {block}", [*lines[:i], *([] if block is None else [block]), *lines[i + 1:]]


@pytest.mark.covering
@pytest.mark.parametrize(("file", "controller"), CASES)
def test_every_number_of_a_cut_counts(file: str, controller: str) -> None:
    """0.05 mm or 0.5 degrees beside it, in any word of any cutting block; but not C where the tool stands along it."""
    result = result_of(file, controller)
    motion, lines = motion_of(result), result.text.splitlines()
    upright = np.abs(motion.end[:, 3]) < 12.0
    cuts = np.unique(motion.line[(motion.code > 0) & ~motion.hole]) - 1
    still = set((motion.line[upright] - 1).tolist())
    mutants = []
    for i in cuts.tolist():
        for m in re.finditer(r"(?<![A-Z])([XYZBC])([-+]?[\d.]+)", lines[i]):
            if m[1] == "C" and i in still:
                continue
            value = float(m[2]) + (0.05 if m[1] in "XYZ" else 0.5)
            sign = "+" if m[2][0] in "+-" and controller == TNC else ""
            mutants.append(changed(lines, i, f"{lines[i][:m.start(2)]}{value:{sign}.4f}{lines[i][m.end(2):]}"))
    assert survivors(result, mutants) == []


@pytest.mark.covering
@pytest.mark.parametrize(("file", "controller"), CASES)
def test_every_code_of_a_mode_counts(file: str, controller: str) -> None:
    """Without a code that enters or leaves a mode, or with a plane that is turned by half a degree.

    The first plane of the faces is not tilted: words mean the same without it.
    """
    result = result_of(file, controller)
    lines, first = result.text.splitlines(), int(motion_of(result).line[0])
    rows = [i for i, row in enumerate(lines) if i >= first and re.search(MODES[controller], row)]
    upright = 1 if file == "five_faces.cls" and controller != FANUC else 0
    mutants = [changed(lines, i, None) for i in rows[upright:]]
    for i in rows:
        for m in re.finditer(r"(?<=[IJABC])[-+]?\d[\d.]*|(?<=0,0,0,)-?[\d.]+(?=,-?[\d.]+,-?[\d.]+,0,0,0)", lines[i]):
            if "G68.2" in lines[i] or "SPA" in lines[i] or "CYCLE800" in lines[i]:
                sign = "+" if controller == TNC else ""
                spoilt = f"{lines[i][:m.start()]}{float(m[0]) + 0.5:{sign}.4f}{lines[i][m.end():]}"
                mutants.append(changed(lines, i, spoilt))
    assert survivors(result, mutants) == []


@pytest.mark.parametrize("controller", [FANUC, HAAS, SIEMENS, TNC])
def test_every_word_of_a_cycle_counts(controller: str) -> None:
    """Levels, pecks and places of holes 0.05 mm beside them."""
    result = result_of("five_faces.cls", controller)
    motion, lines = motion_of(result), result.text.splitlines()
    rows = (np.unique(motion.line[motion.hole]) - 1).tolist()
    words = r"(?<=[XYZR])[-+]?[\d.]+"
    if controller == SIEMENS:
        rows += [i for i, row in enumerate(lines) if "MCALL CYCLE" in row]
        words = r"(?<=[XY])-?[\d.]+|(?<=,)-[\d.]+(?=[,)])"
    if controller == TNC:
        rows += [i for i, row in enumerate(lines) if re.search(r"Q(201|202|203)=", row)]
        words = r"(?<=[XY])[-+][\d.]+|(?<=Q20[13]=)[-+][\d.]+"
    mutants = []
    for i in rows:
        for m in re.finditer(words, lines[i]):
            sign = "+" if controller == TNC else ""
            spoilt = f"{lines[i][:m.start()]}{float(m[0]) - 0.05:{sign}.4f}{lines[i][m.end():]}"
            mutants.append(changed(lines, i, spoilt))
    assert survivors(result, mutants) == []
