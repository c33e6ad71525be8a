"""The form of records: which words and how many numbers each takes. A damaged byte shows where a record departs from it.

A word that a form does not list passes (posts have words of their own), unless it is one edit from a listed
one, begins like a number, or holds another record. A number that does not fit, an empty field and a second
slash are refused.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterable
from itertools import pairwise

from toolpaths.cl.cycle_words import CYCLE_WORDS
from toolpaths.cl.feeds import UNITS
from toolpaths.cl.text.dialects import UNIT_WORDS, Dialect
from toolpaths.cl.text.log import DiagnosticLog
from toolpaths.cl.text.near import nearest
from toolpaths.cl.text.statements import COMMENT, DATA_COMMENT, Statement, StatementList, statement_of
from toolpaths.cl.text.subprograms import NAME
from toolpaths.cl.text.words import BARE_WORDS, NEUTRAL, SILENT, TEXT_WORDS
from toolpaths.dataclass import dataclass
from toolpaths.pattern import pattern


@dataclass(frozen=True)
class RecordForm:
    """Words of a record, counts of its numbers (empty: any), whether other words pass, whether fields may be empty."""

    words: frozenset[str] = frozenset()
    counts: frozenset[int] = frozenset()
    open: bool = True
    gaps: bool = False
    lengths: bool = False
    """numbers are lengths: whole ones that begin with 0 are what is left of another"""
    named: bool = False
    """its first field may be a name: what a damaged one leaves has no counterpart in the file, which is an error there"""
    text: bool = False
    """a message for people follows: any words but those of a record"""


def _form(words: str = "", *counts: int, closed: bool = False, gaps: bool = False, lengths: bool = False,
          named: bool = False) -> RecordForm:
    return RecordForm(frozenset(words.split()), frozenset(counts), not closed, gaps, lengths, named)


_TABLE = _form("AAXIS BAXIS CAXIS INCR ABS CLW CCLW TABLE HEAD ATANGL NEXT ROTREF AXIS", 1)
_ALONE = _form("", 0, closed=True)
_MESSAGE = RecordForm(text=True)
_FEED_MODIFIERS = frozenset({"SCALE", "LENGTH", "LOCK", "MAXIPM", "MAXRPM", "OVPLOT"})
FORMS: dict[str, RecordForm] = {
    "FEDRAT": RecordForm(UNITS | _FEED_MODIFIERS | {"INVERS", "AUTO", "ON", "OFF", "PERSEC"}, frozenset({0, 1})),
    "SPINDL": _form("RPM SFM SMM CLW CCLW BOTH ON OFF LOCK UNLOCK MAXRPM ORIENT LOW MEDIUM HIGH RANGE NEUTRL AUTO MILL "
                    "TURN RADIUS DIAMTR", 0, 1),
    "COOLNT": _form("ON OFF FLOOD MIST AIR TAP TAPKUL THRU LOW MEDIUM HIGH ALL NOW NEXT TOOL", 0, 1),
    "CUTCOM": _form("LEFT RIGHT ON OFF SAME XYPLAN YZPLAN ZXPLAN NORMAL NORMDS NORMPS PERPTO MODIFY ADJUST LENGTH OSETNO",
                    0, 1, 2),
    "LOADTL": _form("OSETNO ADJUST OFFSET LENGTH IN TURN MILL SPINDL MANUAL AUTO LARGE SMALL", lengths=False),
    "LOAD": _form("TOOL TURRET WIRE ADJUST OSETNO MANUAL LENGTH HOLDER XOFF YOFF ZOFF NEXTTL", 0, 1, 2, 3),
    "SELECT": _form("TOOL", 1),
    "TURRET": _form("OSETNO SETOOL ADJUST LENGTH CLW CCLW"),
    "CUTTER": _form("DISPLY ON OFF", 0, 1, 2, 3, 4, 5, 6, 7, lengths=True),
    "$$->CUTTER": _form("", 1, closed=True),
    "TLDATA": _form("MILL DRILL TURN GROOVE THREAD BARREL TCUTTER", lengths=True),
    "CSI_SET_FLUTE_LENGTH": _form("", 1),
    "CIRCLE": _form("TIMES SWEEP CLOCKWISE COUNTERCLOCKWISE CLW CCLW", 4, 5, 6, 7, 8, 11, 12, closed=True),
    "MOVARC": _form("CENTER AXIS RADIUS ANGLE TIMES", closed=True),
    "CYCLE": RecordForm(CYCLE_WORDS),
    "FROM": _form("", 3, 6, closed=True), "GOHOME": _form("", 0, 3, 6),
    "TLAXIS": _form("", 3, closed=True), "INDIRV": _form("", 3, closed=True), "INDIRP": _form("", 3, closed=True),
    "RAPID": _form("FEDTO SCALE", closed=True),
    "MSYS": _form("", 9, closed=True), "CSYS": _form("", 12, closed=True), "$$->CSYS": _form("", 12, closed=True),
    "CAMERA": _form("", 12, closed=True), "MCS": _form("", 12, closed=True), "MCS2": _form("", 9, closed=True),
    "TRANS": _form("", 3), "ZERO": _form("", 1), "ORIGIN": _form("", 3, 9), "TRNTYP": _form("WORLD"),
    "ROTATE": _TABLE, "ROTABL": _TABLE, "ROTHED": _TABLE,
    "UNITS": RecordForm(frozenset(UNIT_WORDS), frozenset({0}), False),
    "UNIT": RecordForm(frozenset(UNIT_WORDS), frozenset({0}), False),
    "MULTAX": _form("ON OFF", 0),
    "STOP": _MESSAGE, "OPSTOP": _MESSAGE, "FINI": _ALONE, "END": _ALONE, "END-OF-PATH": _ALONE, "ENDSUB": _form("", 0, 1),
    "NURBS": _ALONE, "KNOT": _form("", closed=True, gaps=True), "CNTRL": _form("", 3, closed=True), "AUTOPS": _ALONE,
    "DELAY": _form("REV SEC TIME NOW NEXT", 1), "DWELL": _form("REV SEC TIME NOW NEXT", 1),
    "CALSUB": _form("", 0, 1, named=True), "DEFSUB": _form("", 0, 1, named=True),
    "OPSKIP": _form("ON OFF", 0, 1), "DELETE": _form("ON OFF", 0, closed=True),
    "SEQNO": _form("INCR ON OFF NEXT AUTO START FREQ", 0, 1, 2, 3), "SELECTL": _form("", 1, closed=True),
    "PREFUN": _form("NOW NEXT", 1, 2, 3, 4),
    "AUXFUN": _form("NOW NEXT", 1, 2, 3, 4), "SET": _form("MODE ABSOL INCR INCRE INCREM LINTOL LINEAR ON OFF"),
    "MODE": _form("MILL TURN INCR INCRE INCREM ON OFF TOOL XYPLAN YZPLAN ZXPLAN ABSOL"),
    "RETRCT": _form("ON OFF TOOL"), "CLEARP": _form("XYPLAN YZPLAN ZXPLAN ON OFF"), "APPLY": _form("MILL TURN"),
    "UNLOAD": _form("TOOL"), "REWIND": _form("", 0, 1), "LEADER": _form("", 1), "CHECK": _form(), "HEAD": _form(),
    "CLAMP": _form("ON OFF AUTO AXIS XAXIS YAXIS ZAXIS AAXIS BAXIS CAXIS"), "AIR": _form("ON OFF"),
    "OFSTNO": _form("ON OFF"),
}
_CLT_CUTTER = 6
"""numbers of CUTTER in `.clt`, which has a comma behind the last"""
_MILL_COUNTS = frozenset({5, 7, 10})
_ANY_NUMBERS = {"FEDRAT": _FEED_MODIFIERS, "SPINDL": frozenset({"MAXRPM", "RANGE", "RADIUS", "DIAMTR", "LOCK", "ORIENT"}),
                "LOAD": frozenset({"XOFF", "YOFF"}), "ROTABL": frozenset({"AXIS"}), "ROTHED": frozenset({"AXIS"})}
"""Words with which a record takes numbers of their own."""
_VALUED, _VALUED_IN = frozenset({"OSETNO", "ADJUST", "OFFSET", "LENGTH"}), frozenset({"LOADTL", "LOAD", "TURRET"})
"""Words that a number must follow, and in which records."""
_SPEEDS = ("RPM", "SFM", "SMM")
_SPEED_ALONE = frozenset({*_SPEEDS, "CLW", "CCLW"})
"""Words of a speed, and with which it has a number."""
_NAMED = frozenset({"TOOL PATH", "OPNAME", "OP_NAME", "CSI_TOOL_PATH", "OPFEATSTART", "TOOLNO", "$$->FEATNO", *TEXT_WORDS})
_EVERYDAY = frozenset({"LOAD", "END", "STOP", "HEAD", "CHECK", "AIR", "SET", "DELETE"})
"""Words that stand in sentences too."""
_ACTING = tuple(word for word in (*FORMS, "GOTO", "GODLTA", "MCSYS", "TOOLNO", "TOOL PATH",
                             "TLON *, *GOFWD") if word not in _EVERYDAY and not word.startswith(DATA_COMMENT))
_RECORD = r"(?:(?<!UN)LOAD|" + "|".join(_ACTING) + r")\s*/"
_GLUED = pattern(r"(?:[A-Za-z0-9.)\]%\"';:!?][^A-Za-z0-9\s]?|[-=*#_]{3})(?P<record>" + _RECORD +
                    r"|(?:RAPID|FINI|END-OF-PATH|GOHOME|OPSTOP|MULTAX|ENDSUB|(?<![A-Za-z])(?<![A-Za-z]-)STOP)\s*$)")
_BEHIND = pattern(r"\S\s+(?P<record>" + _RECORD + r"\s*[^\s/]+(?:\s*,\s*[^\s/]+)*\s*$)")
_BARE_BEHIND = pattern(r"\s(?:RAPID|FINI|END-OF-PATH|GOHOME|OPSTOP|MULTAX|ENDSUB)\s*$|\d\s+STOP\s*$")
_SPOKEN = frozenset({"PPWORD", "PPFUN", "OPERATION", "OPERTN", "SEQUENCE", "TITLES", "MATERL", "BEGIN", "START"})
"""Neutral words whose parameters are words of the language, or of people, which may end in such a word."""
_GEOMETRY = frozenset({"PSIS", "SYN"})
"""Words whose parameters hold slashes."""
_WITHIN = pattern(_RECORD)
_NAMES = frozenset({"$$->FEATNO", "TOOL PATH", "PARTNO", "TPRINT", "OPNAME", "OP_NAME", "CSI_TOOL_PATH", "OPFEATSTART",
                    "MACHIN", "MACHINE", "PROGRAM", "PART_OPE", "CATPROCESS", "CATPRODUCT", "DISPLY"})
"""Words whose parameters are a name or a text, which may hold slashes."""
_NUMBER_LIKE = pattern(r"[-+.]*\d[-+.\d]*|[-+.\d]*[eEdD][-+.\d]*\d[-+.\d]*|[-+.]+")
_PLANE = pattern(r"\(\s*PLANE\s*/(?:\s*[-+.\d]+\s*,){3}\s*[-+.\d]+\s*\)", re.IGNORECASE)
_INNERMOST = pattern(r"\([^()]*\)")
_ON_TO = pattern(r"\s*,\s*(?:ON|TO|PAST|TANTO)\s*,\s*(?:\d+\s*,\s*INTOF\s*,\s*)?", re.IGNORECASE)
"""What is left of TLON,GOFWD without its geometry."""
_QUOTED = pattern(r"'[^'/$]*'")
_ONE_LETTER = pattern(r"[-+.\d]*[^-+.\d][-+.\d]*")
_TWO_NUMBERS = pattern(r"[\d.]\s+[-+.\d]")
_STARTS_NUMBER = frozenset("+-.0123456789")
_LEADING_ZEROS = pattern(r"[+-]?(?:0\d+|\.0*)")
_ONLY_ZEROS, _POINT_FIRST = pattern(r"[+-]?\.0+"), re.compile(rb"[/,\s][+-]?\.\d*[1-9]\d*[,\s]")
_NO_COMMA = "a blank between two numbers"
_CUT_OFF = "a number is cut off at its point"


def check_forms(program: StatementList, log: DiagnosticLog, allowed: Iterable[str], dialect: Dialect, raw: bytes) -> None:
    """An error for each different statement that departs from the form of its word, where its line has none yet.

    Args:
        program: the statements of the file
        log: where errors go
        allowed: words whose form is not looked at
        dialect: which system wrote the file
        raw: the file, for how it writes its numbers
    """
    allow, refused = frozenset(allowed), log.lines_with_errors()
    for statement, line in program.first.items():
        if statement.major in allow or line in refused:
            continue
        fault = fault_of(statement, allow) or ("" if dialect.six_sizes else _six_sizes(statement))
        if fault and not (fault == _CUT_OFF and _writes_points_first(statement, raw)):
            name = statement.major.removeprefix(DATA_COMMENT)
            between = "/" if statement.body and statement.slash else " " if statement.body else ""
            comma = name == "FEDRAT" and len(statement.numbers) == 2 and all(n == int(n) for n in statement.numbers)
            hint = "check the record in the CAM system; if it is right, --allow-unknown " \
                   f"{shlex.quote(statement.major)} takes it as it stands"
            if comma:
                hint = "write a point for a decimal comma: 1.5 for 1,5"
            elif fault == _NO_COMMA:
                hint = "write the comma, or the point, that is missing"
            log.error("cl.form", f"{name}{between}{statement.body[:60]}: {fault}", line, hint, key=f"{name} {fault}")


def fault_of(s: Statement, allow: frozenset[str] = frozenset()) -> str:
    """What is wrong with the form of a statement, "" where nothing is."""
    if s.major == COMMENT or s.major in _NAMED or s.major in NEUTRAL:
        return _joined_fault(s) or (_tdata_fault(s) if s.major == "TDATA" else "")
    if s.major == "TLON,GOFWD":
        return _geometry_fault(s)
    form = FORMS.get(s.major)
    if form is None or (s.major == "CLEARP" and _PLANE.fullmatch(s.body)):
        return ""
    if form.text:
        return _message_fault(s)
    return _words_fault(s, form, allow) or _numbers_fault(s, form)


def _joined_fault(s: Statement) -> str:
    """Another record within text: what is left where the end of a line is lost."""
    if s.major == "TOOL PATH":
        parts = [p.strip().upper() for p in s.body.split(",")]
        if "TOOL" not in parts[1:] and (len(parts) > 1 or parts[0].endswith("TOOL") or "TOOL" in parts[0]):
            return "the name of the tool is not behind TOOL"
    if s.major in SILENT and s.major not in _GEOMETRY | _NAMES and "/" in s.body:
        return "a second slash"
    if s.major in SILENT and s.major not in _GEOMETRY | _NAMES | _SPOKEN and (bare := _BARE_BEHIND.search(s.body.upper())):
        return f"{bare[0].split()[-1]} stands within it: the end of a line is missing"
    pattern = _WITHIN if s.major in _NAMES else _BEHIND
    found = next((m for m in (_GLUED.search(s.body), pattern.search(s.body)) if m and _whole(s.body[_at(m):])), None)
    if found is None:
        return _words_fault(s, FORMS[s.major], frozenset()) or _numbers_fault(s, FORMS[s.major]) if s.major in FORMS else ""
    return f"a record stands within it, {found[0].strip()[:30]!r}: the end of a line is missing"


def _at(found: re.Match[str]) -> int:
    """Where the record begins in a match of `_GLUED`, `_BEHIND` or `_WITHIN`."""
    return found.start("record") if "record" in found.re.groupindex else found.start()


def _whole(text: str) -> bool:
    """True where text is a record in its form and of known words: what a lost line end leaves, not a word of a sentence."""
    s = statement_of(text)
    form = FORMS.get(s.major)
    if form is None:
        return s.major not in ("GOTO", "GODLTA") or all(isinstance(w, float) for w in s.words)
    if form.text:
        return True
    known = all(isinstance(w, float) or w in form.words or form.named for w in s.words)
    return known and not _words_fault(s, form, frozenset()) and not _numbers_fault(s, form)


def _geometry_fault(s: Statement) -> str:
    """TLON,GOFWD: between and behind its geometry in parentheses stand words alone, no record."""
    words, inner = s.body, ""
    while words != inner:
        inner, words = words, _INNERMOST.sub(" ", words)
    return "" if _ON_TO.fullmatch(words) else f"{words.strip()[:30]!r} is not its form: (CIRCLE/...),ON,(LINE/...)"


def _tdata_fault(s: Statement) -> str:
    """TDATA (tables of post-processor words of CATIA) has words that TLDATA has not: without them it may be
    what is left of that."""
    return "" if s.has("DIAM", "TYPE", "QUADRANT") else "it has DIAM, TYPE or QUADRANT; TLDATA?"


def _message_fault(s: Statement) -> str:
    """A message is any text, unless another record begins it or stands in it: the end of the line before that is lost."""
    inner = next((w for w in s.body.upper().split() if w in BARE_WORDS or w.startswith(TEXT_WORDS)), "")
    found = _WITHIN.search(s.body)
    inner = inner or (found[0] if found else "")
    return f"{inner[:30]} stands within it: the end of a line is missing" if inner else ""


def _words_fault(s: Statement, form: RecordForm, allow: frozenset[str]) -> str:
    if "/" in s.body:
        return "a second slash"
    if not s.body.isascii():
        return f"{next(c for c in s.body if ord(c) > 127)!r} is not a character of a record"
    split = _split_word(s, form)
    if split:
        return split
    for word in s.words:
        if isinstance(word, float) or word in form.words or word in allow or _QUOTED.fullmatch(word):
            continue
        if word == "":
            if not form.gaps:
                return "an empty field"
            continue
        fault = "" if form.named and word is s.words[0] and NAME.fullmatch(word) else _word_fault(word, form)
        if fault:
            return fault
    return ""


def _split_word(s: Statement, form: RecordForm) -> str:
    """A word with a comma or a blank in it, a number with a blank: GOTO and CYCLE alone have numbers without any comma, and
    the cycles of `.clt`, with G98 or G99, two planes with a blank between."""
    words = [w for w in s.words if isinstance(w, str) and w and w[0].isalpha()]
    for a, b in pairwise(words):
        if a not in form.words or b not in form.words:
            whole = a + b if a + b in form.words else nearest(a + b, sorted(form.words))
            if whole:
                return f"{a} {b}: {whole} is cut in two"
    free = s.major == "CYCLE" and ("," not in s.body.partition(",")[2] or "G98" in s.words or "G99" in s.words)
    if not free and any(_TWO_NUMBERS.search(part) for part in s.body.split(",")):
        return _NO_COMMA
    return ""


def _word_fault(word: str, form: RecordForm) -> str:
    if word[0] in _STARTS_NUMBER or _NUMBER_LIKE.fullmatch(word) or (len(word) > 1 and _ONE_LETTER.fullmatch(word)):
        return f"{word[:30]} is not a number"
    meant = nearest(word, sorted(form.words))
    if meant:
        return f"{word[:30]} is not a word of it: {meant}?"
    for known in form.words:
        rest = word.removeprefix(known)
        if rest != word and (rest[0] in _STARTS_NUMBER or not rest[0].isalnum() or rest in form.words
                             or rest[1:] in form.words or rest[1:2] in _STARTS_NUMBER):
            return f"{word[:30]}: a comma is missing behind {known}"
    ends = next((bare for bare in BARE_WORDS if word.endswith(bare)), "")
    if ends:
        return f"{ends} stands within it: the end of a line is missing"
    if not form.open or len(word) == 1:
        return f"{word[:30]} is not a word of it"
    return "" if re.fullmatch(r"[A-Z0-9_.-]+", word) else f"{word[:30]} is no word"


def _numbers_fault(s: Statement, form: RecordForm) -> str:
    count = sum(isinstance(w, float) for w in s.words)
    counts = form.counts
    if s.major == "TLDATA" and s.words[:1] == ("MILL",):
        counts = _MILL_COUNTS
    if s.major in _VALUED_IN:
        bare = [w for w, after in zip(s.words, (*s.words, "")[1:], strict=True) if w in _VALUED and isinstance(after, str)]
        if bare:
            return f"no number behind {bare[0]}"
    if s.major == "SPINDL" and not count and s.has(*_SPEEDS) and _SPEED_ALONE.issuperset(s.words):
        return f"no number with {next(w for w in s.words if w in _SPEEDS)}"
    if s.has(*_ANY_NUMBERS.get(s.major, ())):
        counts = frozenset()
    if counts and count not in counts:
        return f"{count} numbers, it takes {' or '.join(map(str, sorted(counts)))}"
    if s.major == "COOLNT" and count and isinstance(s.words[0], float) and len(s.words) > 1:
        return "a number before its word"
    if form.lengths and any(_LEADING_ZEROS.fullmatch(part.strip()) for part in re.split(r"[,\s]+", s.body)):
        return _CUT_OFF
    return ""


def _writes_points_first(s: Statement, raw: bytes) -> bool:
    """True where `.0000` is how the file writes 0, as it writes .5 for 0.5."""
    cut = [part for part in re.split(r"[,\s]+", s.body) if _LEADING_ZEROS.fullmatch(part)]
    return all(_ONLY_ZEROS.fullmatch(part) for part in cut) and _POINT_FIRST.search(raw) is not None


def _six_sizes(s: Statement) -> str:
    """Systems with seven numbers in CUTTER: six are seven but one."""
    if s.major == "CUTTER" and len(s.numbers) == _CLT_CUTTER and not s.body.endswith(","):
        return "6 numbers: one of seven is missing, or the comma behind the last"
    return ""
