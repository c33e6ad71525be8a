"""Programs as people and broken cables change them, through `time` and `verify`: whatever is found, nothing is raised."""

from __future__ import annotations

import json
import random
import re
from collections.abc import Iterator

import machines.machine
from postproc.base.json_values import rounded
from postproc.controllers.model import ControllerFile
from postproc.cycle_time import report
from postproc.cycle_time.estimate import estimate
from postproc.cycle_time.model import load_model, model_name
from postproc.cycle_time.source import from_gcode
from postproc.pipeline.result import PostResult, VerifyResult
from postproc.report.summary import verify_dict, verify_text
from postproc.verification.read_back import read_back
from toolpaths.diagnostics import DiagnosticError, has_errors

_WORD = re.compile(r"[A-Z]+=?[-+]?\d[\d.]*")
VALUES = ("0", "-1", "99999999")


def edits(text: str, most: int | None = None, seed: int = 1) -> Iterator[tuple[str, str]]:
    """(what was done, program): each block, or `most` of them, deleted, doubled, swapped with the next, each
    of its words left out and given other values; the text cut off at as many places."""
    chance, lines = random.Random(seed), text.splitlines()
    count = len(lines) if most is None else min(most, len(lines))
    for i in sorted(chance.sample(range(len(lines)), count)):
        for what, block in _blocks(lines, i, chance):
            yield f"line {i + 1}, {what}", "\n".join([*lines[:i], *block, *lines[i + 1:]]) + "\n"
    for at in sorted(chance.sample(range(len(text)), min(count, len(text)))):
        yield f"cut off at {at}", text[:at]


def deletions(text: str, alike: int | None = None) -> Iterator[tuple[str, str]]:
    """(what was done, program) with each block deleted in turn. With `alike` only so many, evenly spread, of
    blocks that have the same words as each other and as the blocks before and after them."""
    lines = text.splitlines()
    shapes = ["", *(re.sub(r"[-+]?\d[\d.]*", "", n.split("(")[0].split(";")[0]) + _codes(n) for n in lines), ""]
    classes: dict[tuple[str, ...], list[int]] = {}
    for i in range(len(lines)):
        classes.setdefault(tuple(shapes[i:i + 3]), []).append(i)
    for members in classes.values():
        step = 1 if alike is None else max(1, -(-len(members) // alike))
        for i in members[::step]:
            yield f"line {i + 1}, deleted", "\n".join([*lines[:i], *lines[i + 1:]]) + "\n"


def _codes(block: str) -> str:
    """The preparatory and miscellaneous functions of a block, whose numbers are names."""
    return " ".join(re.findall(r"\b[GM]\d+(?:\.\d+)?", block))


def _blocks(lines: list[str], i: int, chance: random.Random) -> Iterator[tuple[str, list[str]]]:
    """(what was done, blocks in the place of block i); of its words one is changed."""
    yield "deleted", []
    yield "doubled", [lines[i], lines[i]]
    if i > 0:
        yield "before the one before", [lines[i], lines[i - 1]]
    words = list(_WORD.finditer(lines[i]))
    if words:
        word = chance.choice(words)
        letter = re.match(r"[A-Z]+=?", word[0])
        assert letter is not None
        for new in ("", *(letter[0] + value for value in VALUES)):
            yield f"{word[0]} -> {new}", [lines[i][:word.start()] + new + lines[i][word.end():]]


def timed(program: str, result: PostResult, machine: machines.machine.Machine, controller: ControllerFile,
          name: str) -> bool:
    """`time` of a program: True where it gives figures, False where it says why not; anything else is raised."""
    planner, _ = load_model(model_name(name, controller.writer))
    assert planner is not None
    others = {file: text.encode() for file, text in (result.files or {}).items()}
    try:
        blocks, found = from_gcode(program.encode(), machine, controller, result.setup, "edited.nc", others)
    except DiagnosticError:
        return False
    if blocks is None:
        assert has_errors(found), "refused without a reason"
        return False
    figures = estimate(blocks, machine, planner)
    json.dumps(rounded(report.as_dict(figures)), allow_nan=False, default=str)
    report.as_text(figures, "edited.nc")
    return True


def verified(program: str, result: PostResult) -> bool:
    """`verify` of a program: True where it is proved."""
    assert result.job is not None
    others = {file: text.encode() for file, text in (result.files or {}).items()}
    comparison, found = read_back(program.encode(), result.job, "part.cls", None, "edited.nc", others)
    checked = VerifyResult("edited.nc", comparison, tuple(found))
    json.dumps(rounded(verify_dict(checked)), allow_nan=False, default=str)
    verify_text(checked)
    return checked.ok
