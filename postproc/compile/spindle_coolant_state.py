"""Spindle, coolant and tool as the commands so far leave them."""

from __future__ import annotations

from dataclasses import replace

from postproc.compile.program import Command, CommandName
from postproc.reference.events import ToolChange

_STOPPED: CommandName = "STOP_SPINDLE_TURNING"
_DRY: CommandName = "COOLANT_OFF"


class SpindleCoolantState:
    """Spindle and coolant as the commands so far leave them: stated only where they change."""

    def __init__(self) -> None:
        self.turning: Command | None = None
        self.cooling: Command | None = None
        self.waiting: dict[str, Command] = {}
        """what a tool change that comes first will switch on"""
        self.unsure = {"spindle": False, "coolant": False}
        """True from a stop on until it is stated again: controls differ in what they switch off there"""

    def spindle(self, wanted: Command, loads: bool = False) -> list[Command]:
        """The command where it changes something; a start waits for the tool change that `loads`."""
        if loads and wanted.name != _STOPPED:
            self.waiting["spindle"] = wanted
            return []
        same = self.turning is not None and (self.turning.name, self.turning.args) == (wanted.name, wanted.args)
        if same and not self.unsure["spindle"]:
            return []
        self.turning, self.unsure["spindle"] = wanted, False
        return [wanted]

    def coolant(self, wanted: Command, loads: bool = False) -> list[Command]:
        """The command where it changes something; a start waits for the tool change that `loads`."""
        if loads and wanted.name != _DRY:
            self.waiting["coolant"] = wanted
            return []
        if self.cooling is not None and self.cooling.name == wanted.name and not self.unsure["coolant"]:
            return []
        self.cooling, self.unsure["coolant"] = wanted, False
        return [wanted]

    def stop(self) -> None:
        """A stop of the program: nobody knows what still turns and flows."""
        self.unsure = {"spindle": True, "coolant": True}

    def again(self, line: int, but: set[str]) -> list[Command]:
        """Spindle and coolant as they were before a stop, but for what the records `but` state by themselves."""
        out: list[Command] = []
        if self.turning is not None and self.turning.name != _STOPPED and "SPINDL" not in but:
            out += self.spindle(replace(self.turning, line=line))
        if self.cooling is not None and self.cooling.name != _DRY and "COOLNT" not in but:
            out += self.coolant(replace(self.cooling, line=line))
        return out

    def change(self, change: ToolChange, follows: set[str], moves_on: bool) -> list[Command]:
        """A tool change with spindle and coolant off, and on again where no record that `follows` says otherwise.

        Nothing is switched on, and no length taken, where no motion follows.
        """
        out: list[Command] = []
        if self.turning is not None and self.turning.name != _STOPPED:
            out.append(Command(_STOPPED))
        if self.cooling is not None and self.cooling.name != _DRY:
            out.append(Command(_DRY))
        before = self.waiting.pop("spindle", self.turning)
        cooled = self.waiting.pop("coolant", self.cooling)
        register = change.register if change.register is not None else change.number
        out.append(Command("CHANGE_TOOL", (float(change.number),), change.line))
        self.unsure = {"spindle": False, "coolant": False}
        if not moves_on:
            self.turning, self.cooling = Command(_STOPPED), Command(_DRY)
            return out
        out.append(Command("USE_TOOL_LENGTH_OFFSET", (float(register),), change.line))
        if before is not None:
            self.turning = Command(_STOPPED)
            out += [] if "SPINDL" in follows else self.spindle(replace(before, line=change.line))
        if cooled is not None:
            self.cooling = Command(_DRY)
            out += [] if "COOLNT" in follows else self.coolant(replace(cooled, line=change.line))
        return out
