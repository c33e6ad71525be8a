"""What a key of a user's file may hold, in words, from what pydantic says of a value that is none of that; known words and
files that a wrong one is most like."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

_ALLOWED = {
    "bool_type": "true or false", "float_type": "a number", "int_type": "a whole number", "string_type": "text in quotes",
    "tuple_type": "a list in square brackets", "list_type": "a list in square brackets",
    "dict_type": "a table of keys and values", "model_type": "a table of keys and values",
    "finite_number": "a finite number", "literal_error": "{expected}",
    "greater_than": "more than {gt:g}", "greater_than_equal": "{ge:g} or more",
    "less_than": "less than {lt:g}", "less_than_equal": "{le:g} or less",
    "elements": "{count} elements", "too_short": "{min_length} elements or more",
    "too_long": "{max_length} elements or fewer",
    "string_too_short": "text of length {min_length} or more", "string_too_long": "text of length {max_length} or less",
    "string_pattern_mismatch": "text of the form {pattern}"}
_NUMBER = re.compile(r"\s*[-+]?(\d+[.,]?\d*|[.,]\d+)([eE][-+]?\d+)?\s*$")
_COMMA = re.compile(r"(?:^|[=\[,])\s*([-+]?\d+),(\d+)\s*(?:#.*)?$")
_IN_TABLE = re.compile(r"=\s*([-+]?\d+),(\d+)\s*[,}]")
_TEXT = re.compile(r""""[^"]*"|'[^']*'|#.*""")
_AS_IN_PROGRAMS = re.compile(r"(?<![\w.+-])([-+]?)(?:(\d+)\.|(\d*)\.(\d+)|(0\d+))(?![\w.:-])")
POINT = "write a decimal point"


def allowed(kind: str, context: Mapping[str, Any]) -> str:
    """Of a fault of pydantic's `kind`; "" for one that speaks for itself."""
    return _ALLOWED.get(kind, "").format(**context)


def in_dots(kinds: Sequence[Any]) -> str:
    """What stands for a value of one of these types in a hint: "..." in brackets for a list."""
    wrapped = (Annotated, Union, UnionType)
    parts = [part for kind in kinds for part in (get_args(kind) if get_origin(kind) in wrapped else [kind])]
    return "[...]" if any(get_origin(part) in (list, tuple) for part in parts) else "..."


class AdvisedError(ValueError):
    """A value that a model refuses, with what to do about it."""

    def __init__(self, message: str, hint: str) -> None:
        super().__init__(message)
        self.hint = hint


def advice(kind: str, value: object) -> str:
    """What to do where a value was meant to be what is allowed; "" where the allowed says it."""
    if kind in ("float_type", "int_type") and isinstance(value, str) and _NUMBER.match(value):
        return "write the number without quotes" + (", with a decimal point" if "," in value else "")
    if kind == "string_type" and isinstance(value, int | float):
        return "write it in quotes"
    if kind == "string_type":
        return "write text in quotes"
    if kind == "too_long" and isinstance(value, list) and all(isinstance(v, int) for v in value):
        return "numbers have decimal points: a comma begins the next"
    return ""


def decimal_comma(line: str) -> str:
    """The number with a decimal comma at the end of a line that is no TOML; "" for none."""
    found = _COMMA.search(line) or _IN_TABLE.search(line)
    return f"{found[1]},{found[2]}" if found else ""


def as_in_programs(line: str) -> list[tuple[str, str]]:
    """Numbers of a line as programs for machines have them and TOML has not (`-381.`, `.5`, `007`), each as it is meant."""
    found = []
    for one in _AS_IN_PROGRAMS.finditer(_TEXT.sub("", line)):
        sign, whole, before, behind, padded = one.groups("")
        number = f"{(whole or before or padded).lstrip('0') or '0'}" + ("" if padded else f".{behind or '0'}")
        if sign + number != one[0]:
            found.append((one[0], sign + number))
    return found


LISTED, NEAR = 40, 5
"""most words that a hint lists; of more, so many are named"""


def nearest(word: str, known: Sequence[str]) -> str:
    """A hint: the known word nearest to `word`, else the list of all, of a long one those that are most alike."""
    match = nearest_word(word, known)
    if match is not None:
        return f"did you mean {match!r}?"
    if len(known) > LISTED:
        some = difflib.get_close_matches(word.lower(), known, n=NEAR, cutoff=0.0)
        return f"most alike of {len(known)} are: {', '.join(some)}"
    return "known: " + ", ".join(sorted(known)) if known else ""


def nearest_word(word: str, known: Sequence[str]) -> str | None:
    """The known word that is most like `word`; None where none is."""
    close = difflib.get_close_matches(word.lower(), [k.lower() for k in known], n=1, cutoff=0.6)
    return next((k for k in known if close and k.lower() == close[0]), None)


def meant(path: Path, source: str, builtin: Sequence[str]) -> str:
    """What a name may have meant, or what there is; of the name of a file only what is nearly the same: a file in its
    folder, or one of ours without its ending."""
    name = source.removesuffix(".toml")
    if name == source:
        return nearest(name, builtin)
    near = nearest_word(path.stem, [one.stem for one in path.parent.glob("*.toml")])
    meant = str(Path(source).with_name(f"{near}.toml")) if near else nearest_word(name, builtin)
    return f"did you mean {meant!r}?" if meant else ""
