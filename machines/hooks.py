"""The `[hooks]` table of a machine file or a set-up: blocks of the shop round tool calls, indexing, operations, stops."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping
from string import Formatter
from typing import Annotated

from pydantic import AfterValidator, BeforeValidator, Field

from machines.user_model import UserModel
from machines.value_words import AdvisedError

HOOK_VALUES = ("tool_number", "tool_name", "operation", "work_offset")
"""what a block may name in braces"""
PASSIVE = r"^([GM][0-9]+(\.[0-9]+)?|L[0-9]+|[A-Z][A-Z_$][A-Z0-9_$]*( [A-Z0-9._]+)*)$"
"""a code, the L number of a subprogram, or the words that a statement begins with"""
NAMES = ("tool_name", "operation")
"""values that are cut where the block would be too long"""
_NUMBERED = ("tool_number", "work_offset")
_DIGITS = re.compile(r"0[1-9]d")
_NUMBER = re.compile(r"(?<![.\d])\d+$")
_FRAME = re.compile(r"\s*(%|/|N?\s*\d)|.*~\s*$", re.IGNORECASE)
"""what belongs to the file and not to a block: the tape mark, block numbers, the block switch, blocks that go on"""


def _near(name: str) -> str:
    close = difflib.get_close_matches(name, HOOK_VALUES, n=1)
    return f"did you mean {{{close[0]}}}? " if close else ""


def _one_block(text: str) -> str:
    try:
        parts = list(Formatter().parse(text))
    except ValueError as fault:
        raise AdvisedError(f"{text!r}: {fault}", "write {{ and }} for braces that stand for nothing") from fault
    for _, name, form, conversion in parts:
        if name is not None and name not in HOOK_VALUES:
            raise AdvisedError(f"unknown placeholder {{{name}}}",
                               _near(name) + "allowed is " + ", ".join("{" + a + "}" for a in HOOK_VALUES))
        if conversion or (form and not (name in _NUMBERED and _DIGITS.fullmatch(form))):
            raise AdvisedError(f"{text!r}: {{{name}}} cannot be written in that form",
                               "write the name alone, or a number with zeros: {tool_number:03d}, {work_offset:02d}")
    if not text.strip() or any(not 32 <= ord(c) < 127 for c in text):
        raise AdvisedError(f"{text!r} is no block", "write one block of plain characters for each entry")
    if _FRAME.match(text):
        raise AdvisedError(f"{text!r} is more than a block", "write it without %, / or a block number before it and ~ "
                           "behind it: the post numbers the blocks")
    return text


def filled(block: str, values: Mapping[str, str], room: int = 10_000) -> str:
    """The block with its values; names are cut so that it has no more than `room` characters.

    Raises:
        ValueError: a value has no number where one is asked for: {work_offset:03d} of "G59.1".
    """
    parts = [(text, name, form) for text, name, form, _ in Formatter().parse(block)]
    done = {(name, form): _valued(name, values[name], form or "") for _, name, form in parts if name is not None}
    names = [len(done[name, form]) for _, name, form in parts if name in NAMES and name is not None]
    left = room - sum(len(text) + (len(done[name, form]) if name is not None and name not in NAMES else 0)
                      for text, name, form in parts)
    most = next((n for n in range(max(names, default=0), 0, -1) if sum(min(n, k) for k in names) <= left), 0)
    return "".join(text + ("" if name is None else done[name, form][:most] if name in NAMES else done[name, form])
                   for text, name, form in parts)


def _valued(name: str, value: str, form: str) -> str:
    """A value as the block asks for it."""
    if not form:
        return value
    number = _NUMBER.search(value)
    if number is None:
        raise ValueError(f"{{{name}:{form}}} of {value}, which is no number")
    return format(int(number[0]), form)


def _listed(value: object) -> object:
    if not isinstance(value, list | tuple):
        raise AdvisedError(f"{value!r} is no list", 'write a list in brackets: ["M31", "M32"]')
    return tuple(value)


HookBlock = Annotated[str, AfterValidator(_one_block)]
HookBlocks = Annotated[tuple[HookBlock, ...], BeforeValidator(_listed)]
PassiveWord = Annotated[str, Field(pattern=PASSIVE)]
PassiveWords = Annotated[tuple[PassiveWord, ...], BeforeValidator(_listed)]


class HooksModel(UserModel):
    """Blocks that the shop wants at certain places; {tool_number}, {tool_name}, {operation} and {work_offset}
    stand for what holds there."""

    before_tool: HookBlocks = ()
    """before each tool change, spindle and coolant being off; {tool_number} is that of the new tool"""
    after_tool: HookBlocks = ()
    """behind it"""
    before_index: HookBlocks = ()
    """before rotary axes are turned between two cuts, clamps still closed"""
    after_index: HookBlocks = ()
    """behind that, clamps closed again"""
    before_operation: HookBlocks = ()
    """where an operation begins"""
    after_operation: HookBlocks = ()
    """where it has ended"""
    before_stop: HookBlocks = ()
    """before M0 and M1"""
    after_stop: HookBlocks = ()
    """behind them"""
    passive: PassiveWords = ()
    """codes of these blocks, e.g. "M31", "G65", "CYCLE977", "TCH PROBE", "L9000": G and M with a number, L
    with one (Siemens), or words that a statement begins with. They come back to where they began and change
    no state of the control; read back without being executed"""

    @property
    def places(self) -> dict[str, tuple[str, ...]]:
        """The blocks by the name of their place, those that there are."""
        fields: dict[str, tuple[str, ...]] = self.model_dump(exclude={"passive"})
        return {name: blocks for name, blocks in fields.items() if blocks}

    def under(self, other: HooksModel) -> HooksModel:
        """With the keys that `other` states in the place of one's own; passive codes of both."""
        stated = other.model_dump(include=set(other.model_fields_set) - {"passive"})
        return self.model_copy(update={**stated, "passive": tuple(dict.fromkeys((*self.passive, *other.passive)))})
