"""Names that a control has for the pivots of a machine, so that an operator can compare numbers."""

from __future__ import annotations

from typing import Annotated, Literal

from machines.user_model import UserModel
from postproc.controllers.texts import placeholders

VectorKind = Literal["table", "table_to_table", "tool_to_head", "head_to_head", "closing_table", "closing_head"]
"""which vector of a machine's chain of axes"""
VectorText = Annotated[str, placeholders("x", "y", "z")]


class PivotNames(UserModel):
    """Texts for vectors in machine coordinates, all axes at 0; {x}, {y}, {z} are numbers in the units of the program."""

    table: VectorText = "X{x} Y{y} Z{z}"
    """from the machine's zero to the first rotary axis that carries the part, the one next to the bed"""
    table_to_table: VectorText = "X{x} Y{y} Z{z}"
    """from that to the second one, which carries the part"""
    tool_to_head: VectorText = "X{x} Y{y} Z{z}"
    """from the gauge point of the spindle to the rotary axis of the head next to the tool"""
    head_to_head: VectorText = "X{x} Y{y} Z{z}"
    """from that to the other one"""
    mixed_table: VectorText = ""
    """as `table` on machines with one axis in the table and one in the head; default: the same"""
    mixed_head: VectorText = ""
    """as `tool_to_head` on those; default: the same"""
    mixed_closing_table: VectorText = ""
    """as `closing_table` on those; default: the same"""
    mixed_closing_head: VectorText = ""
    """as `closing_head` on those; default: the same"""
    closing_table: VectorText = ""
    """less the sum of those of the table, where the control asks for it"""
    closing_head: VectorText = ""
    """less the sum of those of the head, where the control asks for it"""

    def named(self, kind: VectorKind, mixed: bool) -> str:
        """The text for a vector; `mixed`: one rotary axis is in the table and one in the head."""
        plain = {"table": self.table, "table_to_table": self.table_to_table, "tool_to_head": self.tool_to_head,
                 "head_to_head": self.head_to_head, "closing_table": self.closing_table, "closing_head": self.closing_head}
        both = {"table": self.mixed_table, "tool_to_head": self.mixed_head, "closing_table": self.mixed_closing_table,
                "closing_head": self.mixed_closing_head}
        return (both.get(kind, "") if mixed else "") or plain[kind]
