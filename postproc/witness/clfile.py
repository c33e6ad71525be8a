"""Execute the records of a CL file: where the tool is to be, how it gets there, and what is in force."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import takewhile

import numpy as np

import postproc.witness.arcs as arcs
import postproc.witness.cycles as cycles
from postproc.witness.commanded import KINDS, OFF, OWN, SIDES, UNFOLLOWED, Commanded, unit
from postproc.witness.dialect import ALL, dialect_of, scale_of
from postproc.witness.execution import Execution, Z
from postproc.witness.other_forms import other_text
from postproc.witness.rows import assembled
from postproc.witness.text import Array, Record, read, renumbered

_NAN3 = (math.nan,) * 3
FEEDS = {"MMPM": (1.0, False), "IPM": (25.4, False), "FPM": (304.8, False), "MPM": (1000.0, False), "MMPS": (60.0, False),
         "IPS": (1524.0, False), "PERMIN": (None, False), "MMPR": (1.0, True), "IPR": (25.4, True), "FPR": (304.8, True),
         "PERREV": (None, True)}
_SILENT = """
    PARTNO PPRINT INSERT REMARK TPRINT LPRINT PPLABEL LETTER UNITS UNIT MULTAX FINI PAINT PPWORD PPFUN SYN OPFEATSTART
    OPFEATEND MOVE_ATTRIB BOX SETUP SWITCH DISPLY AUTOPS PSIS INTOL OUTTOL TOLER LINTOL MACHIN ALIGN PLABEL CLPRNT NOPOST
    PLOT CSI_SET_EXTENSION_LENGTH CSI_SET_FLUTE_LENGTH MCHTOL TOOLNO TRNTYP SELECT OPSKIP SEQNO MODE REWIND
    CLAMP BREAK CHECK LEADER HEAD POD AIR SLOWDN UNLOAD SELCTL OFSTNO CLEARP CLRSRF RETRCT END-OF-PATH START_OP END_OP
    TOOLPATH_TYPE ISN ARCSLP MCS2 START OPERATION BEGIN MATERL TCP CSI_PATH_TOLERANCE CSI_SET_PATH_PARAM SET ORIGIN SAFPOS
    COMMENT RTCP DELETE OP_NAME SELECTL TDATA OPERTN SEQUENCE PART_OPE PROGRAM MACHINE CATPROCESS CATPRODUCT OPTYPE DMIS
    MAXDPM MAXVEL POSMAP REGBRK PIVOTZ MATLNO HEADER PROGRM MDWRIT MDEND MAGTAP INTCOD TMARK LIBRY REDEF CANON VERIFY
    PPLOT OVPLOT END DRAFT OUTOL TOLTBL PPTOL MCHFIN THICK"""
_NO_MOTION, _ABSOLUTE = frozenset(_SILENT.split()), [1.0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]
_UNREAD_MOTION = frozenset((
    "HELICAL", "TRACUT", "COPY", "MOVNRB", "THREAD", "CALL", "INDEX", "MACRO", "MCS", "MCSYS", "ZERO", "TLON", "PSIS",
    "INDIRP", "ROTHED"))


def commanded(data: bytes, units: str | None = None, dialect: str | None = None,
              lines: tuple[int, ...] | None = None) -> Commanded:
    """What a CL file commands; `units` and `dialect` stand before what the file says, `lines` are those of its records.

    What is not understood is in `unread`, and the positions that it touches are not known.
    """
    other = other_text(data, dialect)
    name, text = other or (dialect or "", read(data) if lines is None else renumbered(read(data), lines))
    spoken = ALL.get(name) or dialect_of(text.records, data)
    scale = {"mm": 1.0, "inch": 25.4}.get(units or "", 0.0) or scale_of(text.records)
    e = Execution(text, spoken, scale)
    if spoken.unread:
        e.lost(f"records of the dialect {spoken.name}", 1)
        e.known.set(0, False)
        e.shifted = True
    done = 0
    for record, before, line in zip(text.records, text.before, text.lines, strict=True):
        if e.spline_line and (before > done or record.major not in ("KNOT", "CNTRL", "$$")):
            _end_spline(e)
        e.row += before - done
        done = before
        _one(e, record, line)
    if e.spline_line:
        _end_spline(e)
    e.row += len(text.points) - done
    return assembled(e)


def _one(e: Execution, r: Record, line: int) -> None:
    handler = HANDLERS.get(r.major)
    if handler is not None:
        handler(e, r, line)
    elif r.major.startswith("$$") or r.major in _NO_MOTION or (r.major == "MCS" and list(r.numbers) == _ABSOLUTE):
        pass
    elif r.major in _UNREAD_MOTION or len(r.numbers) >= 3 or not r.major:
        e.lost(r.major.split(",")[0] or "lines of numbers", line)
        e.gap.add(e.row)


def _goto(e: Execution, r: Record, line: int) -> None:
    n = r.numbers
    if len(n) == 2 and e.height is not None:
        n.append(e.height)
    if len(n) in (4, 7):
        e.feed.set(e.row, (n.pop() * e.scale, False, False))
    if len(n) not in (3, 6, 9):
        e.lost("GOTO of an unusual form", line)
        e.gap.update((e.row, e.row + 1))
        e.point(_NAN3, _NAN3, line)
        return
    if len(n) == 9 and abs(math.hypot(*n[6:]) - 1.0) < 1e-3:
        e.surface[e.row] = tuple(n[6:])
    e.point(tuple(n[:3]), tuple(n[3:6]) if len(n) >= 6 else _NAN3, line)


def _godlta(e: Execution, r: Record, line: int) -> None:
    n = tuple(r.numbers)
    if len(n) not in (1, 3, 6):
        n = _NAN3
    e.deltas.append((e.row, n[:3]))
    e.point(_NAN3, n[3:6] if len(n) == 6 else _NAN3, line)


def _from(e: Execution, r: Record, line: int) -> None:
    waiting = e.row in e.rapid
    e.rapid.discard(e.row)
    e.start.add(e.row)
    _goto(e, r, line)
    if waiting:
        e.rapid.add(e.row)


def _gohome(e: Execution, r: Record, line: int) -> None:
    if len(r.numbers) >= 3:
        e.rapid.add(e.row)
        _goto(e, r, line)


def _tlaxis(e: Execution, r: Record, line: int) -> None:
    if len(r.numbers) == 3:
        e.upright = tuple(r.numbers)
        if e.dialect.name == "tlaxis" and (e.turn != np.eye(3)).any():
            _stand(e, np.eye(3))
        if (e.turn == np.eye(3)).all():
            e.axes[e.row] = e.upright


def _zsurf(e: Execution, r: Record, line: int) -> None:
    e.height = r.numbers[0] if len(r.words) == 1 and r.numbers else None


def _nurbs(e: Execution, r: Record, line: int) -> None:
    e.spline, e.spline_line = ([], []), line


def _end_spline(e: Execution) -> None:
    """A spline goes from where the tool stands to its last CNTRL, two more of them than knots; others are lost."""
    knots, control = e.spline
    if e.row and len(control) == len(knots) + 2 and {len(p) for p in control} == {3} and knots[-1] > 0.0:
        e.splines[e.row] = knots, np.array(control)
        e.point(control[-1], _NAN3, e.spline_line)
    else:
        e.lost("NURBS", e.spline_line)
        e.gap.update((e.row, e.row + 1))
    e.spline_line = 0


def _msys(e: Execution, r: Record, line: int) -> None:
    n = np.array(r.numbers)
    if len(n) == 9:
        x, y = unit(n[3:6]), unit(n[6:9])
        z = unit(np.cross(x, y))
        e.system(np.stack([x, np.cross(z, x), z], axis=1), n[:3] * e.scale, "MSYS", e.row)


def _csys(e: Execution, r: Record, line: int) -> None:
    n = np.array(r.numbers)
    if len(n) == 12:
        rows = n.reshape(3, 4)
        x = unit(rows[:, 0])
        z = unit(np.cross(x, rows[:, 1]))
        e.system(np.stack([x, np.cross(z, x), z], axis=1), rows[:, 3] * e.scale,
                 "CATIA0" if r.major == "CATIA0" else "CSYS", e.row)
    else:
        e.lost(r.major, line)


def _turned(e: Execution, r: Record, line: int) -> None:
    """TRANS, ROTATE, ROTABL that do something: where positions are from here on is not decided by this reader."""
    moving = any(abs(v) > 0.0 for v in r.numbers)
    number = next((k for k, names in enumerate(_ABOUT) if r.has(*names)), -1)
    if r.major == "ROTABL" and e.dialect.name in ("solidworks-clt", "tlaxis") and not r.has("ATANGL") and number >= 0:
        _turn_frame(e, number, r.numbers[0] * (-1.0 if r.has("CLW") else 1.0))
    elif moving and (r.major == "TRANS" or e.dialect.local_three):
        e.lost(r.major, line)
        e.known.set(e.row, False)
        e.shifted = True


_ABOUT = (("AAXIS", "A"), ("BAXIS", "B"), ("CAXIS", "C"))


def _turn_frame(e: Execution, number: int, angle: float) -> None:
    """`.clt`: the frame of the positions turns by radians; it is upright again where the turns cancel."""
    c, s, i, j = math.cos(angle), math.sin(angle), (number + 1) % 3, (number + 2) % 3
    turn = np.eye(3)
    turn[i, i], turn[j, j], turn[i, j], turn[j, i] = c, c, -s, s
    _stand(e, e.turn @ turn)


def _stand(e: Execution, turn: Array) -> None:
    upright = bool(np.abs(turn - np.eye(3)).max() < 1e-5)
    e.turn = np.eye(3) if upright else turn
    e.frames.append((e.turn, np.zeros(3)))
    e.frame.set(e.row, len(e.frames) - 1)
    e.axes[e.row] = e.upright if upright else Z


def _sub(e: Execution, r: Record, line: int) -> None:
    e.inside.set(e.row, e.inside.now + (1 if r.major == "SUB-BEGIN" else -1))


def _sub_unknown(e: Execution, r: Record, line: int) -> None:
    e.lost("CALSUB of a subroutine that the file does not hold", line)
    e.gap.add(e.row)


def _circle(e: Execution, r: Record, line: int) -> None:
    found = arcs.circle(r, e.dialect) if r.major == "CIRCLE" else arcs.movarc(r)
    if found is None:
        e.lost("CIRCLE of an unusual form" if r.major == "CIRCLE" else r.major, line)
        e.gap.add(e.row)
    else:
        e.arcs[e.row] = found


def _indirv(e: Execution, r: Record, line: int) -> None:
    e.toward = tuple(r.numbers) if len(r.numbers) == 3 else None


def _tlon(e: Execution, r: Record, line: int) -> None:
    found = arcs.tlon(r, e.toward)
    if found is None:
        e.lost("TLON,GOFWD of an unusual form", line)
        e.gap.update((e.row, e.row + 1))
        e.known.set(e.row, e.known.now)
        return
    e.arcs[e.row], end = found
    e.point(end, _NAN3, line)


def _fedrat(e: Execution, r: Record, line: int) -> None:
    if r.has("INVERS"):
        value = r.after("INVERS") if not r.has("PERSEC") else None
        e.lost("FEDRAT/INVERS", line) if value is None else None
        e.feed.set(e.row, (math.nan if value is None else value, False, True))
    elif r.numbers:
        if isinstance(r.words[0], str) and r.words[0] not in FEEDS:
            return
        e.feed.set(e.row, (*feed_of(r.words, e.scale), False))


def feed_of(words: tuple[float | str, ...], scale: float) -> tuple[float, bool]:
    """(mm/min or mm per turn, per turn) of a number and its unit in either order; without a unit, the file's per minute."""
    unit_word = next((w for w in words if isinstance(w, str) and w in FEEDS), "")
    numbers = [w for w in words if isinstance(w, float)]
    if unit_word:
        at = words.index(unit_word) + 1
        if at < len(words) and isinstance(words[at], float):
            numbers = [float(words[at])]
    factor, per_turn = FEEDS.get(unit_word, (None, False))
    return numbers[0] * (scale if factor is None else factor), per_turn


def _load(e: Execution, r: Record, line: int) -> None:
    number = r.after("TOOL", "TURRET") if r.major == "LOAD" else next(iter(r.numbers), None)
    if number is None or number != int(number) or not 0 <= number < 1e9:
        return
    named = _register(r)
    if named != OWN or (number != e.tool.now and e.register.rows[-1] == e.row):
        e.register.set(e.row, named)
    if number != e.tool.now and e.end.rows[-1] != e.row:
        e.end.set(e.row, (math.nan, math.nan))
    e.tool.set(e.row, int(number))
    e.side.set(e.row, OFF)


def _cutter(e: Execution, r: Record, line: int) -> None:
    d, corner, aside, above, slope = (*r.numbers[:5 if len(r.numbers) == 7 else 2], 0.0, 0.0, 0.0, 0.0, 0.0)[:5]
    flat, known = (aside, above == corner and not slope) if aside or above else (0.5 * d - corner, True)
    known = known and flat >= 0.0 and (corner > 0.0 or (flat > 0.0 and len(r.numbers) > 1)) and not r.has("DRILL", "TAP")
    e.cutter.set(e.row, 0.5 * d * e.scale)
    e.end.set(e.row, (flat * e.scale, corner * e.scale) if known else (math.nan, math.nan))


def _register(r: Record) -> int:
    """The length register that a record which loads a tool names: behind a word, else second of LOADTL's
    numbers, fourth of four (ISO 4343); OWN without one."""
    named: float | str | None = r.after("OSETNO") if r.major == "TURRET" else r.after("ADJUST", "OSETNO", "OFFSET")
    if named is None and r.major == "LOADTL":
        placed = list(takewhile(lambda w: isinstance(w, float), r.words))
        named = placed[3] if len(placed) > 3 else placed[1] if len(placed) > 1 else None
    return int(named) if isinstance(named, float) and named > 0.0 else OWN


def _cutcom(e: Execution, r: Record, line: int) -> None:
    side = next((SIDES[w] for w in r.words if isinstance(w, str) and w in SIDES), None)
    if side is not None:
        e.side.set(e.row, side)
        e.radius.set(e.row, r.numbers[0] if len(r.numbers) == 1 and len(r.words) == 2 else math.nan)


def _delay(e: Execution, r: Record, line: int) -> None:
    per_second = e.spindle.now[1] / 60.0 if r.has("REV") else 1.0
    e.rests.append((e.row, r.numbers[0] / per_second if r.numbers and per_second else math.nan, line))


def _stop(e: Execution, r: Record, line: int) -> None:
    e.stops.append((e.row, 0.0 if r.major == "STOP" else 1.0, line))


def _named(e: Execution, name: str) -> None:
    if name:
        e.names.append(name.strip().upper())
        e.name.set(e.row, len(e.names) - 1)


def _tool_path(e: Execution, r: Record, line: int) -> None:
    e.armed = -1
    e.cycle.set(e.row, -1)
    if e.dialect.axis_back:
        e.axes[e.row] = Z
    parts = r.body.rsplit(",TOOL,", 1) if ",TOOL," in r.body.upper() else [r.body]
    _named(e, parts[1] if len(parts) == 2 else "")


def _spindl(e: Execution, r: Record, line: int) -> None:
    _, rpm = e.spindle.now
    if r.has("OFF", "NEUTRL", "NEUTRAL"):
        e.spindle.set(e.row, (0, rpm))
        return
    loose = [w for before, w in zip(("", *r.words), r.words, strict=False) if isinstance(w, float)
             and before not in ("RANGE", "LOW", "MEDIUM", "HIGH", "RPM")]
    said = r.after("RPM")
    said = said if said is not None else loose[0] if len(loose) == 1 else None
    if r.has("SFM", "SMM"):
        said = math.nan
    elif r.has("MAXRPM"):
        e.lost("SPINDL with a largest speed", line)
        e.spindle.set(e.row, (UNFOLLOWED, math.nan))
        return
    direction = -1 if r.has("CCLW") else 1 if r.has("CLW") else e.last_direction
    e.last_direction = direction
    e.spindle.set(e.row, (direction, rpm if said is None else said or math.nan))


def _coolnt(e: Execution, r: Record, line: int) -> None:
    kind = next((kind for word, kind in KINDS.items() if r.has(word)), 1)
    e.coolant.set(e.row, 2 if r.words == ("ON",) else kind)


def _by_code(e: Execution, r: Record, line: int) -> None:
    """M codes of the machine switch what this reader does not follow."""
    if r.major == "INSERT" and e.dialect.name.startswith("solidworks"):
        return
    e.lost(f"spindle and coolant after {r.major}", line)
    e.spindle.set(e.row, (UNFOLLOWED, math.nan))
    e.coolant.set(e.row, UNFOLLOWED)


def _cycle(e: Execution, r: Record, line: int) -> None:
    if r.has("OFF") or (r.words and r.words[0] in ("INIT", "CLEAR")) or r.body.upper() in ("INIT", "CLEAR"):
        e.cycle.set(e.row, -1)
    elif r.words[:1] == ("ON",):
        if len(r.words) > 1 and e.armed >= 0:
            e.cycles.append(cycles.stated(e.cycles[e.armed], r, e.dialect, e.scale, line))
            e.armed = len(e.cycles) - 1
        e.cycle.set(e.row, e.armed)
    else:
        found = cycles.cycle(r, e.dialect, e.scale, e.feed.now, line)
        if math.isnan(found.depth):
            e.lost("CYCLE in this form", line)
        e.cycles.append(found)
        e.armed = len(e.cycles) - 1
        e.cycle.set(e.row, e.armed)


HANDLERS: dict[str, Callable[[Execution, Record, int], None]] = {
    "GOTO": _goto, "GODLTA": _godlta, "FROM": _from, "GOHOME": _gohome, "TLAXIS": _tlaxis, "ZSURF": _zsurf, "NURBS": _nurbs,
    "CNTRL": lambda e, r, line: e.spline[1].append(tuple(r.numbers)), "TRANS": _turned,
    "KNOT": lambda e, r, line: e.spline[0].extend(r.numbers), "MSYS": _msys, "CSYS": _csys, "$$->CSYS": _csys,
    "CAMERA": _csys, "CATIA0": _csys, "ROTATE": _turned, "ROTABL": _turned, "SUB-BEGIN": _sub, "SUB-END": _sub,
    "SUB-UNKNOWN": _sub_unknown, "CIRCLE": _circle, "MOVARC": _circle, "INDIRV": _indirv, "TLON,GOFWD": _tlon,
    "RAPID": lambda e, r, line: e.rapid.add(e.row), "FEDRAT": _fedrat, "LOAD": _load, "LOADTL": _load, "TURRET": _load,
    "TOOL PATH": _tool_path, "TPRINT": lambda e, r, line: _named(e, r.body.split(",")[0]), "SPINDL": _spindl,
    "COOLNT": _coolnt, "AUXFUN": _by_code, "PREFUN": _by_code, "INSERT": _by_code, "CUTTER": _cutter, "TLDATA": _cutter,
    "$$->CUTTER": _cutter, "CYCLE": _cycle, "CUTCOM": _cutcom, "DELAY": _delay, "DWELL": _delay, "STOP": _stop,
    "OPSTOP": _stop,
}
