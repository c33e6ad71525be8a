"""A machine file in the making: each value with the file and line that states it, what nothing states assumed and listed."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Literal

from machines.loader import assemble, check
from machines.machine import Machine
from machines.toml_lines import Values
from machines.user_file import UserFile, ValueSource
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error, has_errors, info, warning
from toolpaths.input_files import shown

Value = str | bool | float | list[float] | list[str]
KeyNames = tuple[str, ...]
FEED_PER_JERK = 10.0
"""1/s: an assumed jerk is the acceleration times this, as in the built-in machines"""
ASSUMED_LINEAR = {"travel": [-500.0, 500.0], "velocity": 200.0, "acceleration": 2000.0}
"""mm and s, round figures of a mill"""
ASSUMED_ROTARY = {"travel": [-360.0, 360.0], "velocity": 60.0, "acceleration": 300.0}
"""degrees and s"""
ASSUMED_TIMING = {"tool_change": 6.0, "clamp": 0.5, "unclamp": 0.5}
FIRST = ("description", "retract_axis", "kinematics", "axes", "control", "timing", "sources")
FIGURES = ("travel", "velocity", "acceleration", "jerk", "home")
"""of an axis, with a source each"""
STATED_BY_USER = "--set"


@dataclass(frozen=True)
class DraftValue:
    """One value of the machine file, and where it comes from; `line` 0: of no line."""

    value: Value
    source: ValueSource
    said: str = ""
    """how the source states it"""
    origin: Literal["read", "assumed", "user", "made"] = "read"
    """made: by the import itself, such as lists of what is assumed"""


class Draft:
    """Values by path of keys, in mm, degrees and s, as a machine file has them."""

    def __init__(self, file: str, stated: Sequence[str] = ()) -> None:
        self.file = file
        self.values: dict[KeyNames, DraftValue] = {}
        self.assumed: list[KeyNames] = []
        self.found: list[Diagnostic] = []
        self.stated = dict(self._pair(one) for one in stated)
        """--set KEY=VALUE, by KEY"""

    def put(self, path: KeyNames, value: Value, line: int, said: str, file: str = "") -> None:
        """A value that the file states."""
        self.values[path] = DraftValue(_rounded(value), ValueSource(file or self.file, line), said)

    def made(self, path: KeyNames, value: Value, why: str) -> None:
        """A value that follows from the form of the file as a whole."""
        self.values[path] = DraftValue(value, ValueSource(self.file, 1), why, "made")

    def user(self, key: str) -> Value | None:
        """What --set states for a key that is not of the machine file."""
        return self.stated.get(key)

    def assume(self, path: KeyNames, value: Value) -> None:
        """A value that nothing states."""
        if path not in self.values:
            self.values[path] = DraftValue(value, ValueSource(self.file, 1), "assumed", "assumed")
            self.assumed.append(path)

    def error(self, code: str, message: str, line: int = 0, hint: str = "", file: str = "") -> None:
        """What stands against the import."""
        self.found.append(error(code, message, file=file or self.file, lines=[line] if line else (), hint=hint))

    def info(self, code: str, message: str, line: int = 0, file: str = "") -> None:
        """What was taken."""
        self.found.append(info(code, message, file=file or self.file, lines=[line] if line else ()))

    def warning(self, code: str, message: str, line: int = 0, hint: str = "", file: str = "") -> None:
        """What is to be looked at."""
        self.found.append(warning(code, message, file=file or self.file, lines=[line] if line else (), hint=hint))

    def _pair(self, text: str) -> tuple[str, Value]:
        key, _, value = text.partition("=")
        try:
            found: Value = tomllib.loads(f"value = {value.strip()}")["value"]
        except tomllib.TOMLDecodeError:
            found = value.strip()
        return key.strip(), float(found) if type(found) is int else found


def _rounded(value: Value) -> Value:
    """Without the last digit, which a change of units has spoilt."""
    if isinstance(value, list):
        return [float(f"{v:.15g}") for v in value if isinstance(v, float)]
    return float(f"{value:.15g}") if isinstance(value, float) else value


def finish(draft: Draft, rotary: dict[str, bool]) -> tuple[str, Machine | None, list[Diagnostic]]:
    """The text of the machine file and the machine of it; "" and None where there are errors."""
    for key, value in draft.stated.items():
        path = tuple(key.split("."))
        if path[0] in FIRST:
            draft.values[path] = DraftValue(value, ValueSource(STATED_BY_USER, 1), f"{STATED_BY_USER} {key}", "user")
    _assume_rest(draft, rotary)
    file = UserFile(Path(draft.file).stem, draft.file, _tables(draft), {p: v.source for p, v in draft.values.items()})
    found = list(draft.found)
    if has_errors(found):
        return "", None, found
    model, faults = check(file)
    found += faults
    if model is None or has_errors(found):
        return "", None, found
    if draft.assumed:
        names = [".".join(path) for path in draft.assumed]
        found.append(info("import.assumed", f"{len(names)} values stand nowhere in the file and are assumed: "
                          f"{', '.join(names)}", file=draft.file,
                          hint="take them from the machine's papers, or measure them: --set KEY=VALUE states one"))
    return _text(draft), assemble(file, model), found


def _assume_rest(draft: Draft, rotary: dict[str, bool]) -> None:
    """All that a machine file must have and the source does not say."""
    for name, turns in rotary.items():
        table = ASSUMED_ROTARY if turns else ASSUMED_LINEAR
        for key, value in table.items():
            draft.assume(("axes", name, key), value)  # type: ignore[arg-type]  # values of the two tables are Values
        acceleration = draft.values["axes", name, "acceleration"].value
        draft.assume(("axes", name, "jerk"), FEED_PER_JERK * float(acceleration))  # type: ignore[arg-type]  # a number
        _home(draft, name)
    for key, seconds in ASSUMED_TIMING.items():
        draft.assume(("timing", key), seconds)
    draft.assumed = list(dict.fromkeys(draft.assumed))
    _sources(draft)
    for path in draft.assumed:
        table_path = (*path[:-1], "assumed")
        listed = draft.values.get(table_path)
        names = [*listed.value, path[-1]] if listed and isinstance(listed.value, list) else [path[-1]]
        draft.values[table_path] = DraftValue([str(n) for n in names], ValueSource(draft.file, 1), "", "made")


def _home(draft: Draft, name: str) -> None:
    """0 where no home is stated, or the end of the travel next to it."""
    travel = draft.values["axes", name, "travel"].value
    low, high = (float(end) for end in travel) if isinstance(travel, list) else (0.0, 0.0)
    draft.assume(("axes", name, "home"), min(max(0.0, low), high))


def _sources(draft: Draft) -> None:
    """[sources], and the `source` tables: of each figure that a file or the user states."""
    names: dict[str, str] = {}
    for path, found in list(draft.values.items()):
        figure = path[0] == "timing" or path[:2] == ("kinematics", "axes") or (path[0] == "axes" and path[-1] in FIGURES)
        if not figure or path in draft.assumed or found.origin not in ("read", "user"):
            continue
        file = found.source.file
        name = names.setdefault(file, "user" if file == STATED_BY_USER else "file" + str(len(names) or ""))
        line = f"line {found.source.line}, " if found.source.line and found.origin == "read" else ""
        draft.values[*path[:-1], "source", path[-1]] = DraftValue(
            f"{name}: {line}{' '.join(found.said.split())}", found.source, "", "made")
    for file, name in names.items():
        said = "stated at the import" if name == "user" else shown(Path(file).name)
        for key, value in (("document", said), ("by", "others")):
            draft.values["sources", name, key] = DraftValue(value, ValueSource(draft.file, 1), "", "made")


def _tables(draft: Draft) -> Values:
    result: Values = {}
    for path, found in draft.values.items():
        table = result
        for part in path[:-1]:
            table = table.setdefault(part, {})
        table[path[-1]] = found.value
    return result


def _text(draft: Draft) -> str:
    lines = [f"# Imported from {shown(Path(draft.file).name)}."]
    table: KeyNames = ()
    for path, found in sorted(draft.values.items(), key=lambda one: _rank(one[0], list(draft.values))):
        if path[:-1] != table:
            table = path[:-1]
            lines += ["", f"[{'.'.join(table)}]"]
        lines.append(f"{path[-1]} = {json.dumps(found.value, ensure_ascii=False)}" + _comment(
            found, draft.file, (*path[:-1], "source", path[-1]) in draft.values))
    return "\n".join(lines) + "\n"


def _rank(path: KeyNames, order: list[KeyNames]) -> tuple[int, int, KeyNames, int]:
    return (int(len(path) > 1), FIRST.index(path[0]) if path[0] in FIRST else len(FIRST),
            tuple(_places(path[:-1], order)), order.index(path))


def _places(table: KeyNames, order: list[KeyNames]) -> Iterator[str]:
    """Tables where their first key stands, each behind the one that holds it."""
    for n in range(1, len(table) + 1):
        first = min(k for k, path in enumerate(order) if path[:n] == table[:n])
        yield f"{first:06d}"


def _comment(found: DraftValue, file: str, path_has_source: bool) -> str:
    if not found.said or path_has_source:
        return ""
    place = found.source
    if found.origin != "read" or not place.line:
        return f"  # {found.said}"
    where = f"line {place.line}" if place.file == file else f"{Path(place.file).name} line {place.line}"
    return f"  # {where}: {' '.join(found.said.split())}"
