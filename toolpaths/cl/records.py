"""Conservation of records: how many a file holds, and what became of each."""

from __future__ import annotations

from collections import Counter
from operator import attrgetter

from toolpaths.cl.build import ToolpathBuilder
from toolpaths.cl.text.statements import COMMENT, DATA_COMMENT
from toolpaths.cl.text.words import NEUTRAL, UNSUPPORTED_MOTION
from toolpaths.diagnostics import REPORT, has_errors
from toolpaths.toolpath import RecordCounts


def counted(b: ToolpathBuilder, known: frozenset[str]) -> RecordCounts:
    """Records (continued lines are one, comments none): executed, neutral by the list in `words`, by the
    rules for text around the program or as --allow-unknown asks, dropped. A file with dropped records has
    errors that name them; where it has none, no handler answered for the record, which is an error here (`cl.dropped`)."""
    majors = Counter(map(attrgetter("major"), b.program.statements))
    comments = sum(n for word, n in majors.items()
                   if word == COMMENT or (word.startswith(DATA_COMMENT) and word not in known))
    total = len(b.points) + sum(majors.values()) - comments
    lines = {word: {line for line, _, _ in found} for word, found in b.unknown.items()}
    unmoved = _unmoved(b, known, frozenset(lines)) if majors.keys() & UNSUPPORTED_MOTION else []
    allowed = sum(word in b.allow_unknown for _, word in unmoved)
    left_out = sum(len(found) for word, found in lines.items() if word in b.allow_unknown)
    unknown = {line for found in lines.values() for line in found}
    neutral = sum(majors[word] for word in NEUTRAL) + b.neutral_texts + left_out + b.uncalled + allowed
    dropped = len(unknown) - left_out + len(unmoved) - allowed
    dropped += len({line for line, _ in b.texts} - unknown) - b.neutral_texts
    if dropped > 0 and not has_errors(b.log.diagnostics()):
        _report(b, dropped, unmoved)
    return RecordCounts(total, total - neutral - dropped, neutral, dropped)


def _unmoved(b: ToolpathBuilder, known: frozenset[str], named: frozenset[str]) -> list[tuple[int, str]]:
    """Line and word of the motion records that no handler answered for; those of `named` are counted by their word."""
    asked = UNSUPPORTED_MOTION - known - named
    return [(line, s.major) for i, (s, line) in enumerate(zip(b.program.statements, b.program.lines, strict=True))
            if s.major in asked and i not in b.taken]


def _report(b: ToolpathBuilder, dropped: int, unmoved: list[tuple[int, str]]) -> None:
    """The error of records that nobody executed and no other error names."""
    found = ([(line, word) for line, word in unmoved if word not in b.allow_unknown]
             or [(line, "(TEXT)") for line, _ in b.texts] or [(0, "WORD")])
    line, word = min(found)
    b.log.error("cl.dropped", f"{dropped:,} records are not executed, the first is {word}", line,
                f"{REPORT}; have the CAM system write the points; --allow-unknown {word} leaves such records out")
