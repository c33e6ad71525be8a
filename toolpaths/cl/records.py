"""Conservation of records: how many a file holds, and what became of each."""

from __future__ import annotations

from collections import Counter
from operator import attrgetter

from toolpaths.cl.build import Builder
from toolpaths.cl.statements import COMMENT, DATA_COMMENT
from toolpaths.cl.words import NEUTRAL, UNSUPPORTED_MOTION
from toolpaths.toolpath import Records


def counted(b: Builder, known: frozenset[str]) -> Records:
    """Records (continued lines are one, comments none): executed, neutral by the list in `words`, by the rules for text
    around the program or as --allow-unknown asks, dropped. A file with dropped records has errors that name them."""
    majors = Counter(map(attrgetter("major"), b.program.statements))
    comments = sum(n for word, n in majors.items()
                   if word == COMMENT or (word.startswith(DATA_COMMENT) and word not in known))
    total = len(b.points) + sum(majors.values()) - comments
    lines = {word: {line for line, _, _ in found} for word, found in b.unknown.items()}
    left_out = sum(len(found) for word, found in lines.items() if word in b.allow_unknown)
    unknown = {line for found in lines.values() for line in found}
    neutral = sum(majors[word] for word in NEUTRAL) + b.neutral_texts + left_out + b.uncalled
    dropped = len(unknown) - left_out + sum(n for word, n in majors.items()
                                            if word in UNSUPPORTED_MOTION and word not in known and word not in lines)
    dropped += len({line for line, _ in b.texts} - unknown) - b.neutral_texts
    return Records(total, total - neutral - dropped, neutral, dropped)
