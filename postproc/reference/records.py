"""Records without motion before anything is planned: refused where they cannot be carried out, put into plain words.

INSERT and AUXFUN that switch spindle or coolant become SPINDL and COOLNT, so that one place knows the states.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from postproc.controllers.model import ControllerFile
from postproc.reference.coolant import COMMANDS, LABELS, asked, coolant_words, written
from postproc.reference.events import (
    RANGES,
    Spindle,
    cutting_speed_said,
    largest_said,
    numbers,
    speed_said,
    spindle_after,
    spindle_states,
    words,
)
from postproc.reference.tool_numbers import Report, check_numbers
from toolpaths.diagnostics import Diagnostic, Severity
from toolpaths.toolpath import Event, Toolpath
from toolpaths.units import PER_MINUTE

_SPINDLE = frozenset({"RPM", "CLW", "CCLW", "ON", "OFF", "SFM", "SMM", "MAXRPM", "NEUTRL", "NEUTRAL"})
_COOLANT = frozenset({"ON", "OFF", "FLOOD", "MIST", "THRU", "AIR"})
_SIDES = frozenset({"LEFT", "RIGHT", "OFF"})
_PLAIN_CUTCOM = frozenset({*_SIDES, "XYPLAN", "DIAMET", "RADIUS", "TOOL", "OSETNO", "LENGTH", "ADJUST"})
_BLOCK = re.compile(r"(?:[A-Z]\s*[-+]?(?:\d+(?:\.\d*)?|\.\d+)\s*)+")
_WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))")
Switches = dict[tuple[str, float], tuple[str, tuple[str, ...]]]
_SWITCHES: Switches = {
    ("M", 5): ("SPINDL", ("OFF",)), ("M", 7): ("COOLNT", ("MIST",)), ("M", 8): ("COOLNT", ("FLOOD",)),
    ("M", 9): ("COOLNT", ("OFF",)), ("M", 0): ("STOP", ()), ("M", 1): ("OPSTOP", ())}
_OWN: dict[str, str] = {"G": "motion, planes, offsets and modes", "F": "feeds (FEDRAT)", "H": "length offsets (LOADTL)",
                        "T": "tools (LOADTL)", "M2": "the end", "M30": "the end", "M6": "tool changes (LOADTL)"}
_INSTEAD: dict[str, str] = {
    "G4": "write DELAY/seconds in its place",
    **dict.fromkeys(("G28", "G30", "G53"), "write GOHOME in its place"),
    **dict.fromkeys(("G9", "G60", "G61", "G61.1", "G64"), "the post writes the control's smoothing itself, from --tolerance "
                    "and the controller file: take the record out"),
    **dict.fromkeys(("G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3"), "the post writes the work offset "
                    "itself: state it as work_offset_code in the set-up, and take the record out")}
"""what to do where a code has a record, or a key, of its own"""


class _Found:
    """Diagnostics of equal text as one."""

    def __init__(self, file: str) -> None:
        self.file = file
        self.lines: dict[tuple[Severity, str, str, str], list[int]] = {}

    def add(self, severity: Severity, code: str, message: str, line: int, hint: str = "") -> None:
        self.lines.setdefault((severity, code, message, hint), []).append(line)

    def diagnostics(self) -> list[Diagnostic]:
        return [Diagnostic(s, code, text, self.file, tuple(n for n in lines if n)[:6], len(lines), hint)
                for (s, code, text, hint), lines in self.lines.items()]


def plain_records(toolpath: Toolpath, controller: ControllerFile) -> tuple[Toolpath, list[Diagnostic]]:
    """The path with its records in plain words, and what cannot be carried out."""
    found = _Found(toolpath.file)
    events: list[Event] = []
    spindle = Spindle()
    for event in _without_limits(toolpath.events, found.add):
        for plain in _plain(event, spindle, controller, found.add):
            spindle = spindle_after(plain, spindle) if plain.word == "SPINDL" else spindle
            events.append(plain)
    return replace(toolpath, events=tuple(events)), found.diagnostics()


def checked_records(toolpath: Toolpath, controller: ControllerFile) -> tuple[Toolpath, list[Diagnostic]]:
    """The path of plain records with its dwells in seconds, and what cannot be carried out."""
    found = _Found(toolpath.file)
    spindle = Spindle()
    away = {e.index: e.line for e in toolpath.events if e.word in ("LOADTL", "GOHOME")}
    for plain in toolpath.events:
        if plain.word == "SPINDL":
            _check_spindle(plain, found.add)
            spindle = spindle_after(plain, spindle)
        elif plain.word == "DELAY":
            _check_delay(plain, spindle, found.add)
        elif plain.word == "COOLNT":
            _check_coolant(plain, controller, found.add)
        elif plain.word == "CUTCOM":
            _check_compensation(plain, found.add)
        elif plain.word == "RETRCT":
            _check_retract(plain, away.get(plain.index, -1), len(toolpath), found.add)
    check_numbers(toolpath, found.add)
    plain_path = _dwells_in_seconds(toolpath, found.add)
    return plain_path, found.diagnostics()


def _plain(event: Event, spindle: Spindle, controller: ControllerFile, report: Report) -> list[Event]:
    """INSERT, AUXFUN and PREFUN as the records that they stand for; others as they are."""
    if event.word == "INSERT":
        text = " ".join(str(v) for v in event.values).strip()
    elif event.word in ("AUXFUN", "PREFUN") and numbers(event):
        text = f"{'G' if event.word == 'PREFUN' else 'M'}{numbers(event)[0]:g}"
    else:
        return [event]
    bare = re.sub(r"\([^()]*\)|;.*", "", text).strip().upper()
    if not bare:
        return [Event(event.index, "PPRINT", (text.strip("(); "),), event.line)] if text else []
    if any(name[1:2].isalpha() and bare.startswith(name) for name in controller.program.passive):
        return [Event(event.index, "INSERT", (bare,), event.line)]
    if not _BLOCK.fullmatch(bare):
        report(Severity.ERROR, "insert.refused", f"{event.word}/{text[:60]} is not a block of G-code", event.line,
               "write text for people with PPRINT")
        return []
    said = [(letter, float(value)) for letter, value in _WORD.findall(bare)]
    codes = {f"{letter}{value:g}" for letter, value in said}
    if codes & set(controller.program.passive):
        return [Event(event.index, "INSERT", (bare,), event.line)]
    switches = _SWITCHES | coolant_words(controller.codes)
    result = _switches(event, said, spindle, switches)
    if result is None:
        wrong = next(f"{letter}{value:g}" for letter, value in said if not _is_switch(letter, value, switches))
        report(Severity.ERROR, "insert.refused", f"{event.word}/{text[:60]}: {wrong} cannot be put in", event.line,
               _instead(wrong))
        return []
    if not result:
        report(Severity.ERROR, "insert.refused", f"{event.word}/{text[:60]}: a speed while the spindle stands", event.line,
               "state SPINDL/RPM,n,CLW in the CAM system")
    return result


def _instead(code: str) -> str:
    """What to do about a code that cannot be put in."""
    own = _OWN.get(code) or _OWN.get(code[0])
    return _INSTEAD.get(code) or (f"the post writes {own} itself: take the record out" if own else "where the code moves "
                                  "nothing, name it in the controller's program.passive; else take the record out")


def _is_switch(letter: str, value: float, switches: Switches) -> bool:
    return letter == "S" or (letter, value) in (("M", 3.0), ("M", 4.0)) or (letter, value) in switches


def _switches(event: Event, said: list[tuple[str, float]], spindle: Spindle,
              switches: Switches) -> list[Event] | None:
    """Records for the words of a block that only switches; None where it does more, none for S alone at a standstill."""
    if not all(_is_switch(letter, value, switches) for letter, value in said):
        return None
    speed = [("RPM", value) for letter, value in said if letter == "S"]
    result = []
    turning = False
    for letter, value in said:
        if letter == "M" and value in (3, 4):
            turning = True
            result.append(Event(event.index, "SPINDL", (*(speed[0] if speed else ()), "CLW" if value == 3 else "CCLW"),
                                event.line))
        elif letter == "M":
            word, values = switches[letter, value]
            result.append(Event(event.index, word, values, event.line))
    if speed and not turning and spindle.direction:
        side = "CLW" if spindle.direction > 0 else "CCLW"
        result.insert(0, Event(event.index, "SPINDL", (*speed[0], side), event.line))
    elif speed and not turning:
        return []
    return result


def _without_limits(events: tuple[Event, ...], report: Report) -> Iterator[Event]:
    """The records without MAXRPM, which limits what a cutting speed (SFM, SMM) asks for; left out where it stands alone."""
    for event in events:
        if event.word != "SPINDL" or "MAXRPM" not in words(event):
            yield event
            continue
        at = next(k for k, v in enumerate(event.values) if str(v).upper() == "MAXRPM")
        limit = largest_said(event)
        if cutting_speed_said(event) is not None:  # kept, for the speed that the set-up puts in
            yield event
            continue
        rest = event.values[:at] + event.values[at + (1 if limit is None else 2):]
        bare = replace(event, values=rest)
        _check_limit(speed_said(bare), limit, event.line, report)
        report(Severity.WARNING, "spindle.limit", "SPINDL: MAXRPM is not carried out, it limits cutting speeds, and speeds "
               "are in rev/min here", event.line, "")
        if rest:
            yield bare


def _check_limit(speed: float | None, limit: float | None, line: int, report: Report) -> None:
    if speed is not None and limit is not None and speed > limit:
        report(Severity.ERROR, "spindle.limit", f"SPINDL: {speed:g} rev/min, but MAXRPM is {limit:g}", line,
               "state a speed below it")


def _check_spindle(event: Event, report: Report) -> None:
    said = set(words(event))
    for word in words(event):
        if word in RANGES:
            report(Severity.WARNING, "spindle.range", f"SPINDL: {word} is not carried out", event.line, "")
        elif word not in _SPINDLE:
            report(Severity.ERROR, "spindle.word", f"SPINDL: {word} cannot be carried out", event.line,
                   "allowed: SPINDL/RPM,n,CLW or CCLW, ON, OFF")
    if {"NEUTRL", "NEUTRAL"} & said:
        report(Severity.WARNING, "spindle.neutral", "SPINDL/NEUTRL is written as a stop of the spindle",
               event.line, "")
    speed = speed_said(event)
    _check_limit(speed, largest_said(event), event.line, report)
    if {"SFM", "SMM"} & said:
        report(Severity.ERROR, "spindle.surface_speed", "the spindle speed is given as a cutting speed", event.line,
               "state rev/min (SPINDL/RPM,n,CLW) in the CAM system, or add the speed to the set-up: [tools.N], or for all "
               "tools [output], spindle = { rpm = ..., direction = \"clockwise\" }")
    elif speed is None and numbers(event) and "OFF" not in said and said <= _SPINDLE | RANGES and (
            not said & RANGES or "RPM" in said):
        report(Severity.ERROR, "spindle.speed", "SPINDL: which of the numbers is the speed?", event.line,
               "write SPINDL/RPM,n,CLW")
    elif speed is not None and speed <= 0.0 and "OFF" not in said:
        report(Severity.ERROR, "spindle.speed", f"SPINDL: the speed is {speed:g} rev/min", event.line,
               "a speed above 0, or SPINDL/OFF" if speed < 0.0 else
               "state a speed above 0, or SPINDL/OFF, in the CAM system, or add the speed to the set-up: [tools.N], or "
               "for all tools [output], spindle = { rpm = ..., direction = \"clockwise\" }")


def _check_delay(event: Event, spindle: Spindle, report: Report) -> None:
    value = next(iter(numbers(event)), 0.0)
    if value < 0.0 or not math.isfinite(value):
        report(Severity.ERROR, "delay.value", f"DELAY: the time is {value:g}", event.line,
               "seconds, 0 or more")
    elif "REV" in words(event) and not (spindle.direction and spindle.rpm > 0.0):
        report(Severity.ERROR, "delay.revolutions", "DELAY in revolutions while the spindle stands or its speed is unknown",
               event.line, "state seconds, or the speed before it (SPINDL/RPM,n,CLW)")


def _check_retract(event: Event, away: int, rows: int, report: Report) -> None:
    """RETRCT moves the tool to the clearance plane before the next motion, which would else go straight
    through the part, unless the program ends or the tool goes home at the same place (line `away`). ON and
    OFF move nothing."""
    if not {"ON", "OFF"} & set(words(event)) and event.index < rows and away < event.line:
        report(Severity.ERROR, "retract.motion", "RETRCT moves the tool to a clearance plane before the next point: this "
               "is not carried out", event.line, "have the CAM system write the retract as a point (GOTO or GODLTA)")


def _check_coolant(event: Event, controller: ControllerFile, report: Report) -> None:
    said = words(event)
    wanted, got = asked(said), written(said, controller.codes)
    if wanted != got:
        key = wanted.removesuffix("_ON").lower()
        report(Severity.WARNING, f"coolant.{key}", f"COOLNT/{','.join(said)}: the controller has no code for it, "
               f"{LABELS[COMMANDS[got]]} is written", event.line, f"set codes.{key} in the controller file")
    for word in said if got in COMMANDS else ():
        if word not in _COOLANT:
            report(Severity.WARNING, "coolant.word", f"COOLNT/{word} is written as {LABELS[COMMANDS[got]]}",
                   event.line, "")


def _check_compensation(event: Event, report: Report) -> None:
    said = words(event)
    side = next((w for w in said if w in _SIDES), "")
    planes = [w for w in said if w in ("ZXPLAN", "YZPLAN")]
    if planes and side != "OFF":
        report(Severity.ERROR, "cutcom.plane", f"CUTCOM in {planes[0]} cannot be written", event.line,
               "XYPLAN only; else let the CAM system compensate")
        return
    for word in said:
        if word not in _PLAIN_CUTCOM and word not in planes:
            report(Severity.WARNING, "cutcom.word", f"CUTCOM/{word} is not carried out", event.line, "")


def _dwells_in_seconds(toolpath: Toolpath, report: Report) -> Toolpath:
    """The path with dwells of cycles in seconds at the spindle speed of each hole."""
    index = np.flatnonzero([c.dwell_revolutions > 0.0 for c in toolpath.cycles])
    rows = np.flatnonzero(np.isin(toolpath.cycle, index)) if len(index) else index
    if not len(rows):
        return toolpath
    direction, rpm = (a[rows] for a in spindle_states(toolpath))
    cycle, cycles = toolpath.cycle.copy(), list(toolpath.cycles)
    made: dict[tuple[int, float], int] = {}
    for row, turning, speed in zip(rows.tolist(), direction.tolist(), rpm.tolist(), strict=True):
        before = cycles[int(toolpath.cycle[row])]
        if not turning or not speed > 0.0:
            report(Severity.ERROR, "cycle.dwell", f"CYCLE/{before.kind} dwells in revolutions while the spindle "
                   "stands or its speed is unknown", before.line or int(toolpath.line[row]),
                   "state SPINDL/RPM,n,CLW before it")
            continue
        key = int(toolpath.cycle[row]), speed
        if key not in made:
            made[key] = len(cycles)
            cycles.append(replace(before, dwell=before.dwell_revolutions / (speed * PER_MINUTE), dwell_revolutions=0.0))
        cycle[row] = made[key]
    return replace(toolpath, cycle=cycle, cycles=tuple(cycles))
