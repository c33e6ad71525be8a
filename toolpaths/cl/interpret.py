"""Statements to the state of `ToolpathBuilder`: which word goes to which handler, and what becomes of the others."""

from __future__ import annotations

import re
from collections.abc import Callable

from toolpaths.cl import curves, cycles, feeds, frames, indexing, motion, structure, tools
from toolpaths.cl.build import ToolpathBuilder
from toolpaths.cl.text import listing_text
from toolpaths.cl.text.near import nearest
from toolpaths.cl.text.statements import DATA_COMMENT, TEXT, Statement, words_of
from toolpaths.cl.text.subprograms import Subprograms, called, shown, subprograms_of
from toolpaths.cl.text.words import SILENT, UNSUPPORTED_MOTION

Handler = Callable[[ToolpathBuilder, Statement], None]
HANDLERS: dict[str, Handler] = {**dict.fromkeys(SILENT, structure.nothing), **structure.HANDLERS, **feeds.HANDLERS,
                                **motion.HANDLERS, **curves.HANDLERS, **frames.HANDLERS, **tools.HANDLERS,
                                **cycles.HANDLERS}
_MANY = 3
REMARKS = frozenset({"MFGNO", "END", "SETSTART", "SETEND", "FEATURE", "NAME", "STEP"})
"""`$$->` remarks that say nothing to the machine."""
_MOTION = re.compile(r"\W*(?:GOTO|GODLTA|RAPID|CIRCLE|MOVARC|GOHOME)\b|IF\s*\(|.*\b(?:GOTO|GODLTA|CIRCLE|MOVARC)\s*/",
                     re.IGNORECASE)
"""Text that is no record and yet names a motion, or chooses one: dropped, it would leave the tool elsewhere."""
_MOVING = ("CYCLE", "CALL")
"""Beginnings of words that drill or call a program, whatever a system makes of them (CYCLE81, CALLSUB)."""
_DEEPEST = 8
_WITH_COMMAS = frozenset({"GOTO", "GODLTA", "FROM", "CIRCLE", "TLAXIS", "MSYS"})
"""records of numbers: where one comma stands between them all do, and a comma that became a digit is seen"""
_MOST_ROWS = 50_000_000


def known(major: str) -> bool:
    """True for every word the reader has an answer to, be it an error."""
    return major in HANDLERS or major in UNSUPPORTED_MOTION


def run(b: ToolpathBuilder, start: int, stop: int) -> None:
    """Carry out statements `start` to `stop`; plain points between them are only counted."""
    statements, lines, before, handlers = b.program.statements, b.program.lines, b.program.before, HANDLERS
    outer, b.stop = b.stop, stop
    b.index = start
    while b.index < stop:
        i = b.index
        fast = before[i]
        b.row += fast - b.fast
        b.fast = fast
        b.line = lines[i]
        statement = statements[i]
        handler = handlers.get(statement.major)
        if i in b.program.feeds:
            feeds.many(b, statement, b.program.feeds[i][:stop - i])
        elif handler is not None:
            if statement.major in _WITH_COMMAS and "," in statement.body:
                _commas(b, statement)
            handler(b, statement)
        else:
            _other(b, statement)
        b.index += 1
    b.stop = outer


def _commas(b: ToolpathBuilder, s: Statement) -> None:
    """Refuse numbers with a blank alone between them in a record that has commas: a comma may be damaged there."""
    for part in s.body.split(","):
        if len(part.split()) > 1:
            b.log.error("cl.number", f"{s.major}/{s.body[:60]}: a blank without a comma in {' '.join(part.split())}", b.line,
                        "put a comma between the numbers, or take the blank out of the number")
            return


def _subprograms(b: ToolpathBuilder) -> Subprograms:
    """Where the subprograms of the file stand, found once."""
    if b.subprograms is None:
        b.subprograms = subprograms_of(b.program.statements)
    return b.subprograms


def defsub(b: ToolpathBuilder, s: Statement) -> None:
    """Pass over the subprogram; CALSUB carries it out."""
    end = _subprograms(b).ends.get(b.index)
    if end is None or called(s) == "":
        why, hint = ("without ENDSUB", "write ENDSUB after its last record") if end is None else (
            "without the number or name of its subprogram", "write DEFSUB/1 and CALSUB/1")
        b.log.error("cl.subprogram", f"DEFSUB {why}", b.line, hint)
        return
    b.jump(b.program.before[end])
    b.index = end


def _uncallable(b: ToolpathBuilder, name: str, found: tuple[int, int] | None) -> tuple[str, str]:
    """Why a subprogram is not carried out, and what to do."""
    known = [shown(one) for one in _subprograms(b).named if one != ""][:6]
    if found is None:
        own = f"put DEFSUB/{name} and ENDSUB round its records"
        return "is not defined", f"the file defines {', '.join(known)}; else {own}" if known else own
    if found in b.calls or len(b.calls) >= _DEEPEST:
        return ("calls itself" if found in b.calls else f"is called from {_DEEPEST} others, each inside the next"), (
            f"take CALSUB/{name} out of the records between DEFSUB and ENDSUB")
    return "makes too many points", "divide the file: one for each part of the calls"


def calsub(b: ToolpathBuilder, s: Statement) -> None:
    """Carry out the statements and points of a subprogram here, under the frame that holds here."""
    known, name = _subprograms(b), called(s)
    found = known.place(name, b.index) if name != "" else None
    if found is None and known.elsewhere(name):
        b.log.warning("cl.subprogram", f"CALSUB/{s.body}: not defined in the file; left out", b.line,
                      "moves of a program that the machine keeps are not checked", key="named")
        return
    if found is None or len(b.calls) >= _DEEPEST or found in b.calls or b.row > _MOST_ROWS:
        why, hint = _uncallable(b, s.body, found)
        b.log.error("cl.subprogram", f"CALSUB/{s.body}: the subprogram {why}", b.line, hint)
        return
    start, end = found
    index, fast, about_axis = b.index, b.fast, b.about_axis
    b.calls.append(found)
    b.called.add(found)
    b.in_subprogram.set(b.row, True)
    _stand_about_axis(b, about_axis or name in indexing.indexed_subprograms(b))
    indexing.note_call(b, b.caller_row)
    b.caller_row = b.row
    b.jump(b.program.before[start])
    run(b, start + 1, end)
    b.advance(b.program.before[end])
    b.jump(fast)
    b.calls.pop()
    b.in_subprogram.set(b.row, bool(b.calls))
    b.index, b.caller_row = index, b.row
    _stand_about_axis(b, about_axis)


def _stand_about_axis(b: ToolpathBuilder, value: bool) -> None:
    if b.about_axis != value:
        b.about_axis = value
        frames.refresh(b)


HANDLERS.update({"DEFSUB": defsub, "CALSUB": calsub, "ENDSUB": structure.nothing})
_SAYING = {**dict.fromkeys((w.removeprefix(DATA_COMMENT) for w in HANDLERS if w.startswith(DATA_COMMENT)), 0),
           "CSYS": 12, "CUTTER": 1, "FEATNO": 1, "USE": 2, "SPLINE": 1, "CUBIC": 1}
"""`$$->` remarks that say something, with the count of their numbers; 0: lists of our own writer"""
_ARROW = re.compile(r"\s*(?:\S\s*->|-\S>|->\S|-\S?|\S?>)\s*(?=[A-Za-z])")
"""`->` with one sign of it changed, lost or added, and `$$` before it"""
_FIRST = re.compile(r"[^A-Z]*([A-Z]+)(?![A-Z])")
VOCABULARY = frozenset(HANDLERS) | UNSUPPORTED_MOTION
"""Every word the reader has an answer to"""


def _other(b: ToolpathBuilder, s: Statement) -> None:
    word = s.major.rpartition("=")[2].strip()
    if word in UNSUPPORTED_MOTION:
        _unsupported(b, s, word)
    elif s.major == TEXT:
        b.texts.append((b.line, s.body))
    elif s.major.startswith(DATA_COMMENT):
        _remark(b, s)
    elif s.slash or s.major in b.allow_unknown:
        b.note_unknown(s, s.major)
    else:
        b.texts.append((b.line, s.major))


def _comment(b: ToolpathBuilder, s: Statement) -> None:
    """A comment, unless a damaged byte of its arrow makes one of a `$$->` remark that says something."""
    arrow = _ARROW.match(s.body)
    text = s.body[arrow.end():].upper() if arrow else ""
    meant = re.split(r"[^A-Z]", text + " ")[0]
    if meant in _SAYING and (text[len(meant):].lstrip()[:1] or " ") in ("/" if _SAYING[meant] else "[{"):
        b.log.error("cl.data-comment", f"$${s.body[:40]}: not a known remark; did you mean $$-> {meant}?",
                    b.line, "correct the arrow ->, or leave it out before a comment", key=meant)
    else:
        structure.comment(b, s)


HANDLERS["$$"] = _comment


def _remark(b: ToolpathBuilder, s: Statement) -> None:
    """A `$$->` remark that nobody reads is a comment, unless it is what a damaged byte leaves of one that
    says something: its word is one edit from that word, or that word stands with a body in its form and no slash between."""
    word = s.major.removeprefix(DATA_COMMENT)
    if re.split(r"[^A-Z]", word + " ")[0] in REMARKS:
        return
    inner = re.split(r"[^A-Z]", s.body.upper() + " ")[0] if "/" in s.body or not word else ""
    heads = sorted({word, word + inner} - {""})
    meant = next((h if h in _SAYING else nearest(h, _SAYING) for h in heads if h in _SAYING or nearest(h, _SAYING)), "")
    joined = word.replace(" ", "")
    if not meant:
        meant = joined if joined in _SAYING else nearest(joined, _SAYING) if s.body else ""
    meant = meant or _bodied(f"{word} {s.body}".strip())
    if meant:
        b.log.error("cl.data-comment", f"$$-> {word[:40]}: not a known remark; did you mean {meant}?", b.line,
                    "correct the word, or write $$ without -> before a comment", key=meant)


def _bodied(text: str) -> str:
    """The known word that `text` begins with where all behind it, but for one sign in place of the slash, is its body."""
    first = _FIRST.match(text)
    numbers = _SAYING.get(first[1]) if first else None
    if first is None or numbers is None:
        return ""
    rest = text[first.end():].lstrip()
    body = words_of(rest)
    if len(body) > 1 and isinstance(body[0], str) and len(body[0]) <= 1:
        body = body[1:]
    whole = len(body) >= numbers > 0 and all(isinstance(w, float) for w in body)
    return first[1] if whole or (numbers == 0 and rest[:3].lstrip()[:1] in ("{", "[") and rest) else ""


def _unsupported(b: ToolpathBuilder, s: Statement, word: str) -> None:
    if word in b.allow_unknown:
        b.note_unknown(s, word)
        return
    if s.words[-1:] == ("NOMORE",) and len(s.words) == 1 + len(s.numbers):
        b.taken.add(b.index)
        return
    if word == "THREAD":
        b.turns()
    b.log.error("cl.unsupported-motion", f"{word} moves the tool or changes how it moves, and is not supported",
                b.line, f"have the CAM system write out the points it makes; --allow-unknown {word} leaves the record out",
                key=word)


def report_others(b: ToolpathBuilder) -> dict[str, int]:
    """Diagnostics of unknown words and of text that is no record; how often each unknown word stands."""
    if 0 <= b.finished < b.row:
        b.log.warning("cl.after-fini", f"{b.row - b.finished} points stand after FINI, they are read too")
    first, last = _extent(b)
    listing, allowed = [], []
    for line, body in dict.fromkeys(b.texts):
        word = listing_text.word_of(body)
        moves = _MOTION.match(body) is not None and any(c.isdigit() for c in body)
        if not moves and listing_text.is_listing(body, line < first, line > last, VOCABULARY):
            listing.append(line)
        elif listing_text.SINGLE.fullmatch(body) and not known(body):
            b.unknown.setdefault(body, []).append((line, 0, 0))
        elif "(TEXT)" in b.allow_unknown:
            allowed.append(line)
        elif known(word) and word not in SILENT:
            b.log.error("cl.slash", f"{word} is not followed by a slash", line, f"write {word}/...", key=word)
        else:
            b.log.error("cl.text", f"no record: {body[:60]!r}", line, "correct it to WORD/..., or write $$ before a "
                        "comment; --allow-unknown '(TEXT)' leaves such lines out", key="motion" if moves else "")
    b.neutral_texts = len(set(listing)) + len(allowed)
    _report_uncalled(b)
    counts = {word: len(found) for word, found in b.unknown.items()}
    for word, found in b.unknown.items():
        _report_word(b, word, found)
    if listing:
        b.log.info("cl.listing-text", f"{len(listing)} lines of text before or after the program", listing[0])
    return counts


def _report_uncalled(b: ToolpathBuilder) -> None:
    """What stands in a subroutine that no CALSUB runs is not executed."""
    known = _subprograms(b)
    for name, start, end in ((name, *place) for name, places in known.named.items() for place in places):
        if (start, end) in b.called:
            continue
        if "DEFSUB" in b.allow_unknown:
            before = b.program.before
            b.uncalled += end - start + before[end] - before[start]
            b.taken.update(range(start, end + 1))
        else:
            b.log.error("cl.subprogram", f"no CALSUB runs subroutine {shown(name)}: its records are not executed",
                        b.program.lines[start], "--allow-unknown DEFSUB leaves it out", key=f"uncalled {name}")


def _report_word(b: ToolpathBuilder, word: str, found: list[tuple[int, int, int]]) -> None:
    meant = nearest(word, HANDLERS)
    hint = f"{f'write {meant}, or ' if meant else ''}--allow-unknown {word} leaves it out"
    for line, row, numbers in found:
        if word in b.allow_unknown:
            add = b.log.info if word in b.passive else b.log.warning
            add("cl.unknown-word", f"unknown word {word}, left out", line, key=word)
        elif (numbers >= _MANY and 0 < row < b.row) or word.split(" ")[-1] in motion.HANDLERS or (
                numbers > 0 and word.startswith(_MOVING)):
            b.log.error("cl.unknown-motion", f"unknown word {word} with {numbers} numbers, which may move the tool", line,
                        hint, key=word)
        else:
            b.log.error("cl.unknown-word", f"unknown word {word}", line, hint, key=word)


def _extent(b: ToolpathBuilder) -> tuple[int, int]:
    """First and last line of a known record."""
    lines = [line for s, line in _known_ends(b)]
    if len(b.points):
        lines += [int(b.points.line[0]), int(b.points.line[-1])]
    return (min(lines), max(lines)) if lines else (0, 0)


def _known_ends(b: ToolpathBuilder) -> list[tuple[Statement, int]]:
    pairs = list(zip(b.program.statements, b.program.lines, strict=True))
    found = []
    for order in (pairs, reversed(pairs)):
        found += [next((p for p in order if known(p[0].major) and p[0].major != "$$"), None)]
    return [p for p in found if p is not None]
