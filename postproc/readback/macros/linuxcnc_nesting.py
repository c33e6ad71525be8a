"""O words of LinuxCNC that do not belong together: ends without a begin, blocks that cross one another."""

from __future__ import annotations

from collections.abc import Iterable

_OPENS = ("SUB", "IF", "DO", "REPEAT")
_ENDS = {"ENDSUB": ("SUB",), "ELSEIF": ("IF",), "ELSE": ("IF",), "ENDIF": ("IF",), "ENDREPEAT": ("REPEAT",),
         "ENDWHILE": ("WHILE",)}


def misplaced(rows: Iterable[tuple[int, str, str]]) -> dict[int, tuple[str, str]]:
    """(what is wrong, remedy) by row; rows: (row, label, word) of those with O words, in order."""
    open_: list[tuple[str, str]] = []
    found: dict[int, tuple[str, str]] = {}
    for k, label, word in rows:
        if word in _OPENS or (word == "WHILE" and (label, "DO") not in open_):
            open_.append((label, word))
        elif word in _ENDS or word == "WHILE":
            begins = [(label, begin) for begin in _ENDS.get(word, ("DO",))]
            where = next((n for n in range(len(open_) - 1, -1, -1) if open_[n] in begins), -1)
            if where < 0:
                begin = begins[0][1].lower()
                found[k] = f"o{label.lower()} {word.lower()} without {begin}", f"begin it with {begin}, or take it out"
                continue
            if where < len(open_) - 1:
                inner = open_[-1]
                found[k] = (f"o{label.lower()} {word.lower()} before the end of o{inner[0].lower()} {inner[1].lower()}, "
                            "which began within it", f"end o{inner[0].lower()} first")
            if word not in ("ELSEIF", "ELSE"):
                del open_[where]
    return found
