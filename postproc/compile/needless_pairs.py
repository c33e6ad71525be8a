"""Coolant or spindle off and on again at one place, where nothing happens between: no such pair is written."""

from __future__ import annotations

from collections.abc import Mapping

from postproc.compile.program import Command
from postproc.reference.coolant import COMMANDS

_SPINDLE = ("START_SPINDLE_CLOCKWISE", "START_SPINDLE_COUNTERCLOCKWISE")
_OFF = {"STOP_SPINDLE_TURNING": "spindle", "COOLANT_OFF": "coolant"}
_PASSES = frozenset({"COMMENT", "SELECT_TOOL", "OPERATION_START", "SMOOTHING", "USE_TOOL_LENGTH_OFFSET"})
"""commands between that are no reason: the spindle need not stand, nothing must be dry"""


def needless_pairs(groups: Mapping[int, list[Command]], end: int) -> dict[int, list[Command]]:
    """The places whose commands hold such a pair, by block, without it; `end`: the block behind the last one."""
    state: dict[str, Command | None] = {"spindle": None, "coolant": None}
    result: dict[int, list[Command]] = {}
    for block, group in sorted(groups.items()):
        kept = list(group)
        for what in state:
            kept = _without_pair(kept, what, state[what])
        if len(kept) != len(group) and block != end:
            result[block] = kept
        for command in kept:
            if (kind := _kind(command)) is not None:
                state[kind] = None if command.name in _OFF or command.skip else command
            elif not _passes(command):
                state = dict.fromkeys(state)
    return result


def _without_pair(group: list[Command], what: str, running: Command | None) -> list[Command]:
    """Commands of one place without the one that switches `what` off and the one that starts it as it was `running`."""
    off = next((k for k, c in enumerate(group) if _OFF.get(c.name) == what), -1)
    for command in group[:max(off, 0)]:
        if _kind(command) == what:
            running = None if command.skip else command
        elif _kind(command) is None and not _passes(command):
            running = None
    if running is None or off < 0 or group[off].skip:
        return group
    for k in range(off + 1, len(group)):
        command = group[k]
        if _kind(command) == what:
            same = (command.name, command.args, command.skip) == (running.name, running.args, False)
            return [*group[:off], *group[off + 1:k], *group[k + 1:]] if same else group
        if _kind(command) is None and not _passes(command):
            return group
    return group


def _passes(command: Command) -> bool:
    """True where nothing that is switched needs to be stated again behind a command."""
    restart = command.name == "OPERATION_START" and len(command.args) > 1
    return command.name in _PASSES and not restart


def _kind(command: Command) -> str | None:
    """What a command switches."""
    if command.name in _OFF:
        return _OFF[command.name]
    if command.name in _SPINDLE:
        return "spindle"
    return "coolant" if command.name in COMMANDS else None
