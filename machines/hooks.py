"""The `[hooks]` table of a machine file or a set-up: blocks of the shop round tool calls, indexing, operations, stops."""

from __future__ import annotations

from string import Formatter
from typing import Annotated

from pydantic import AfterValidator, Field

from machines.user_file import UserModel

HOOK_VALUES = ("tool_number", "tool_name", "operation", "work_offset")
"""what a block may name in braces"""
PASSIVE = r"^([GML][0-9]+(\.[0-9]+)?|[A-Z][A-Z0-9_$]+( [A-Z0-9._]+)*)$"
"""a code, or the words that a statement begins with"""


def _one_block(text: str) -> str:
    found = {name for _, name, _, _ in Formatter().parse(text) if name is not None}
    wrong = ", ".join("{" + name + "}" for name in sorted(found - set(HOOK_VALUES)))
    if wrong:
        raise ValueError(f"unknown placeholder {wrong}; allowed is {', '.join('{' + a + '}' for a in HOOK_VALUES)}")
    if not text.strip() or any(not 32 <= ord(c) < 127 for c in text):
        raise ValueError(f"{text!r} is no block; write one block of plain characters for each entry")
    return text


HookBlock = Annotated[str, AfterValidator(_one_block)]
PassiveWord = Annotated[str, Field(pattern=PASSIVE)]


class HooksModel(UserModel):
    """Blocks that the shop wants at certain places; {tool_number}, {tool_name}, {operation} and {work_offset} stand for what
    holds there."""

    before_tool: tuple[HookBlock, ...] = ()
    """before each tool change, spindle and coolant being off; {tool_number} is that of the new tool"""
    after_tool: tuple[HookBlock, ...] = ()
    """behind it"""
    before_index: tuple[HookBlock, ...] = ()
    """before rotary axes are turned between two cuts, clamps still closed"""
    after_index: tuple[HookBlock, ...] = ()
    """behind that, clamps closed again"""
    before_operation: tuple[HookBlock, ...] = ()
    """where an operation begins"""
    after_operation: tuple[HookBlock, ...] = ()
    """where it has ended"""
    before_stop: tuple[HookBlock, ...] = ()
    """before M0 and M1"""
    after_stop: tuple[HookBlock, ...] = ()
    """behind them"""
    passive: tuple[PassiveWord, ...] = ()
    """codes of these blocks, e.g. "M31", "G65", "CYCLE977", "TCH PROBE": they come back to where they began and change no
    state of the control; read back without being executed"""

    @property
    def places(self) -> dict[str, tuple[str, ...]]:
        """The blocks by the name of their place, those that there are."""
        fields: dict[str, tuple[str, ...]] = self.model_dump(exclude={"passive"})
        return {name: blocks for name, blocks in fields.items() if blocks}

    def under(self, other: HooksModel) -> HooksModel:
        """With the keys that `other` states in the place of one's own; passive codes of both."""
        stated = other.model_dump(include=set(other.model_fields_set) - {"passive"})
        return self.model_copy(update={**stated, "passive": tuple(dict.fromkeys((*self.passive, *other.passive)))})
