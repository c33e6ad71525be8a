"""Files that a user writes (machine, controller, set-up, error model): TOML in, a checked model or diagnostics out.

A file may begin with `base = "name"`: the values of that built-in file (or of a .toml file next to it) are
taken first, tables are merged key by key, everything else is replaced. Every problem names the file and line of the value.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from functools import lru_cache
from pathlib import Path as FilePath
from typing import Any, TypeVar, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from machines.toml_lines import KEPT, SHORT, KeyPath, Values, dotted, own_copy, parsed, table_named
from machines.user_model import SCHEMA_KEY, key_texts
from machines.value_words import POINT, advice, allowed, as_in_programs, decimal_comma, in_dots, meant, nearest, nearest_word
from toolpaths.cl.text.kinds_of_file import what_is
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.input_files import advice as remedy
from toolpaths.input_files import place, read_input, reason, shown

M = TypeVar("M", bound=BaseModel)
_HOW = "write key = value, text in quotes, each [table] and each key on a line of its own"


@dataclass(frozen=True)
class ValueSource:
    """The file and 1-based line that a value was written in."""

    file: str
    line: int


@dataclass(frozen=True)
class UserFile:
    """A TOML file with its base files merged in, not yet checked against a model."""

    name: str
    """built-in name or file stem"""
    file: str
    values: Values
    origins: Mapping[KeyPath, ValueSource]
    """by path of keys, e.g. ("axes", "X", "travel")"""
    shipped: Mapping[str, ValueSource] = field(default_factory=dict)
    """built-in files among its bases, and where each is named: what a value of theirs lacks is the doing of what differs"""

    def origin(self, path: Sequence[str | int]) -> ValueSource:
        """Where the value at `path` was written, or the nearest table around it."""
        for n in range(len(path), 0, -1):
            found = self.origins.get(tuple(path[:n]))
            if found:
                return found
        return ValueSource(self.file, 1)

    def problem(self, code: str, path: Sequence[str | int], message: str, hint: str = "") -> Diagnostic:
        """An ERROR at the line where `path` was written; of a value of a built-in base at the line that names the base."""
        origin = self.origin(path)
        if origin.file in self.shipped:
            message += f" ({dotted(path)} is that of base {FilePath(origin.file).stem}, line {origin.line})"
            origin = self.shipped[origin.file]
        return error(code, message, file=origin.file, lines=[origin.line], hint=hint)


def load_toml(source: str | FilePath, model: type[M], builtin: Mapping[str, FilePath] | None = None,
              kind: str = "file") -> tuple[M | None, list[Diagnostic]]:
    """The checked `model` of a built-in name or a path; None and what is wrong where there are errors.

    Args:
        source: a key of `builtin`, or a path
        builtin: built-in files by name; also what `base` may name
        kind: what such a file is called in messages, e.g. "machine"
    """
    file, diagnostics = read_toml(source, builtin, kind)
    if file is None:
        return None, diagnostics
    return validate(file, model)


def read_toml(source: str | FilePath, builtin: Mapping[str, FilePath] | None = None,
              kind: str = "file") -> tuple[UserFile | None, list[Diagnostic]]:
    """The merged values of a file and its bases, with the origin of each, unchecked; arguments as `load_toml`."""
    return _read(str(source), builtin or {}, kind, None, ())


def base_chain(source: str | FilePath, builtin: Mapping[str, FilePath] | None = None) -> list[FilePath]:
    """The file of a built-in name or a path, then its base, and so on; for what `read_toml` reads without faults.

    Raises:
        OSError: where one cannot be read.
    """
    known, found = builtin or {}, list[FilePath]()
    name: object = str(source)
    while isinstance(name, str):
        path = known[name] if name in known else found[-1].parent / name if found else FilePath(name)
        if path in found:
            break
        found.append(path)
        name = values_of(path).get("base")
    return found


def values_of(path: FilePath) -> Values:
    """What a TOML file itself says.

    Raises:
        OSError, UnicodeDecodeError, tomllib.TOMLDecodeError: where it cannot be read.
    """
    return own_copy(parsed(read_input(path).decode("utf-8-sig").replace("\r\n", "\n"))[0])


def validate(file: UserFile, model: type[M]) -> tuple[M | None, list[Diagnostic]]:
    """`file` as a `model`; None and one diagnostic per fault where it does not fit."""
    text = json.dumps(file.values, default=str)
    try:
        return model.model_validate_json(text), []
    except ValidationError as found:
        faults = _faults(file.values, model, found)
        there = [_diagnostic(file, model, fault) for fault in faults if fault.kind != "missing"]
        return None, sorted([*there, *_missing(file, model, faults)], key=lambda d: (d.file != file.file, d.lines))


def wrong_keys(file: UserFile, model: type[BaseModel]) -> list[KeyPath]:
    """Where a file does not fit its model, by path of keys."""
    try:
        model.model_validate_json(json.dumps(file.values, default=str))
    except ValidationError as found:
        return [fault.path for fault in _faults(file.values, model, found) if fault.path]
    return []


# ---- reading and merging -----------------------------------------------------------------------------------

def _read(source: str, builtin: Mapping[str, FilePath], kind: str, wanted_by: UserFile | None,
          above: tuple[str, ...]) -> tuple[UserFile | None, list[Diagnostic]]:
    path = _resolve(source, builtin, wanted_by)
    key = str(place(path))
    if key in above and wanted_by is not None:
        message = f"base = {source!r} leads back to a file that it is the base of"
        return None, [wanted_by.problem("file.base-cycle", ("base",), message, "take one of the base keys out")]
    text, problem = _text(path, source, builtin, kind, wanted_by)
    if text is None:
        return None, [problem] if problem else []
    name = source if source in builtin else path.stem
    try:
        values, _ = parsed(text)
        origins = (_kept_origins if len(text) < SHORT else _origins)(text, str(path))
    except tomllib.TOMLDecodeError as fault:
        return None, [_syntax(fault, str(path), text, kind)]
    except (ValueError, RecursionError) as fault:  # of Python's own: digits of a number, depth of lists
        why = "its lists or tables are nested too deeply" if isinstance(fault, RecursionError) else str(fault).split(";")[0]
        return None, [error("file.syntax", f"not valid TOML: {why}", file=str(path), hint=_HOW)]
    own = own_copy({k: v for k, v in values.items() if k != SCHEMA_KEY or not isinstance(v, str)})
    return _with_base(UserFile(name, str(path), own, origins), builtin, kind, (*above, key))


def _origins(text: str, file: str) -> dict[KeyPath, ValueSource]:
    """Of every value of a TOML text; whoever changes them takes a copy."""
    return {path: ValueSource(file, line) for path, line in parsed(text)[1].items()}


_kept_origins = lru_cache(maxsize=KEPT)(_origins)


def _resolve(source: str, builtin: Mapping[str, FilePath], wanted_by: UserFile | None) -> FilePath:
    if source in builtin:
        return builtin[source]
    return FilePath(wanted_by.file).parent / source if wanted_by else FilePath(source)


def _text(path: FilePath, source: str, builtin: Mapping[str, FilePath], kind: str,
          wanted_by: UserFile | None) -> tuple[str | None, Diagnostic | None]:
    origin = wanted_by.origin(("base",)) if wanted_by else None
    file, lines = (origin.file, [origin.line]) if origin else ("", [])
    try:
        return read_input(path).decode("utf-8-sig").replace("\r\n", "\n"), None
    except FileNotFoundError:
        what = f"no {kind} is called {source!r}" + ("" if source in builtin else " and there is no such file")
        return None, error("file.not-found", what if builtin else f"there is no file {shown(path)}", file=file, lines=lines,
                           hint=meant(path, source, sorted(builtin)) or f"name the file of the {kind}")
    except OSError as fault:
        return None, error("file.unreadable", f"cannot read {shown(path)}: {reason(fault)}", file=file, lines=lines,
                           hint=remedy(fault, f"name a TOML file of a {kind}"))
    except UnicodeDecodeError as fault:
        return None, error("file.encoding", f"byte {fault.start} is not UTF-8", file=str(path),
                           hint="save the file as UTF-8 text")


def _syntax(fault: tomllib.TOMLDecodeError, file: str, text: str, kind: str) -> Diagnostic:
    if other := what_is(text.encode()):
        return error("file.syntax", f"this is {other}, not the TOML file of a {kind}", file=file,
                     hint=f"name the TOML file of the {kind}")
    what, _, place = str(fault).partition(" (at ")
    line = int(place.split()[1].rstrip(",")) if place.startswith("line ") else text.count("\n") + 1
    there = next(iter(text.splitlines()[line - 1:line]), "")
    if number := decimal_comma(there):
        return error("file.syntax", f"{number} is not a number", file=file, lines=[line],
                     hint=f"{POINT}: {number.replace(',', '.')}")
    if wrong := as_in_programs(there):
        return error("file.syntax", f"not a number of TOML: {', '.join(one for one, _ in wrong)}", file=file, lines=[line],
                     hint="write digits before and behind the decimal point, and no zeros in front: "
                     f"{', '.join(meant for _, meant in wrong)}")
    return error("file.syntax", f"not valid TOML: {what}", file=file, lines=[line], hint=_HOW)


def _with_base(file: UserFile, builtin: Mapping[str, FilePath], kind: str,
               above: tuple[str, ...]) -> tuple[UserFile | None, list[Diagnostic]]:
    if "base" not in file.values:
        return file, []
    base = file.values["base"]
    if not isinstance(base, str):
        return None, [file.problem("file.type", ("base",), f"base = {base!r}: expected the name of a {kind} in quotes")]
    under, diagnostics = _read(base, builtin, kind, file, above)
    if under is None:
        return None, diagnostics
    own = {k: v for k, v in file.values.items() if k != "base"}
    values, origins = _merge(under.values, own, under.origins, file.origins, ())
    shipped = {**under.shipped, **({under.file: file.origin(("base",))} if base in builtin else {})}
    return UserFile(file.name, file.file, values, origins, shipped), diagnostics


def _merge(under: Values, over: Values, under_at: Mapping[KeyPath, ValueSource], over_at: Mapping[KeyPath, ValueSource],
           prefix: KeyPath) -> tuple[Values, dict[KeyPath, ValueSource]]:
    """Tables merged key by key, all else replaced, with the origins of what is kept."""
    values = dict(under)
    origins = dict(under_at)
    for key, value in over.items():
        path = (*prefix, key)
        old = values.get(key)
        if isinstance(old, dict) and isinstance(value, dict):
            values[key], origins = _merge(old, value, origins, over_at, path)
            continue
        values[key] = value
        n = len(path)
        origins = {p: o for p, o in origins.items() if p[:n] != path}
        origins |= {p: o for p, o in over_at.items() if p[:n] == path}
    return values, origins


# ---- faults of the values ----------------------------------------------------------------------------------

_CODES = {"value_error": "file.value", "assertion_error": "file.value"}
_RANGE = ("greater_than", "less_than", "elements", "too_short", "too_long", "multiple_of", "finite_number", "literal_error",
          "enum", "pattern_mismatch")


@dataclass(frozen=True)
class _Fault:
    path: KeyPath
    """as it stands in the file"""
    kind: str
    """pydantic's name"""
    message: str
    """"allowed: " and what is, where that can be said in words; else what is wrong"""
    value: object
    hint: str = ""


def _faults(values: Values, model: type[BaseModel], found: ValidationError) -> list[_Fault]:
    """One fault per key: the words of a union's members are joined, a missing key that is only misspelt left out."""
    by_key: dict[KeyPath, _Fault] = {}
    for detail in found.errors(include_url=False):
        path, kind = _in_file(values, detail), detail["type"]
        context = detail.get("ctx", {})
        message = str(context.get("error", detail["msg"]))
        if kind == "missing" and isinstance(path[-1], int):  # the last one that is missing says how many there are
            kind, context, path = "elements", {"count": path[-1] + 1}, path[:-1]
            by_key.pop(path, None)
        words = allowed(kind, context)
        message = f"allowed: {words}" if words else message[:1].lower() + message[1:]
        hint = getattr(context.get("error"), "hint", "") or advice(kind, detail["input"])
        fault, said = _Fault(path, kind, message, detail["input"], hint), by_key.get(path)
        by_key[path] = replace(said, message=f"{said.message}, or {message.removeprefix('allowed: ')}", hint="") if said \
            else fault
    misspelt = {(*f.path[:-1], _nearest_key(f.path, model)) for f in by_key.values() if f.kind == "extra_forbidden"}
    around = {path[:n] for path in by_key for n in range(1, len(path))}  # the fault inside says more
    return [f for f in by_key.values() if f.path not in around and not (f.kind == "missing" and f.path in misspelt)]


def _in_file(values: Values, detail: ErrorDetails) -> KeyPath:
    """The location of a fault without the union members that pydantic names in it."""
    path: list[str | int] = []
    at: Any = values
    for part in detail["loc"]:
        known = part in at if isinstance(at, dict) else isinstance(at, list) and part in range(len(at))
        if known:
            at = at[part]
            path.append(part)
    return (*path, detail["loc"][-1]) if detail["type"] == "missing" else tuple(path)


def _nearest_key(path: KeyPath, model: type[BaseModel]) -> str | None:
    return nearest_word(str(path[-1]), _known_keys(model, path[:-1]))


def _diagnostic(file: UserFile, model: type[BaseModel], fault: _Fault) -> Diagnostic:
    path, key = fault.path, dotted(fault.path)
    code = _CODES.get(fault.kind)
    if fault.kind == "extra_forbidden":
        elsewhere = getattr(model, "ELSEWHERE", {}).get(key)
        return file.problem("file.unknown-key", path, f"unknown key {key!r}",
                            elsewhere or nearest(str(path[-1]), _known_keys(model, path[:-1])))
    if code:
        return file.problem(code, path, f"{key}: {fault.message}" if key else fault.message, fault.hint)
    code = "file.range" if any(word in fault.kind for word in _RANGE) else "file.type"
    hint = _described(model, path) if fault.kind == "string_pattern_mismatch" else fault.hint
    return file.problem(code, path, f"{key} = {_shown(fault.value)}: {fault.message}", hint)


def _missing(file: UserFile, model: type[BaseModel], faults: list[_Fault]) -> list[Diagnostic]:
    """What is missing of each table, as one."""
    tables: dict[KeyPath, list[KeyPath]] = {}
    for path in (fault.path for fault in faults if fault.kind == "missing"):
        tables.setdefault(path[:-1], []).append(path)
    return [file.problem("file.missing-key", paths[0], f"key {dotted(paths[0])!r} is missing" if len(paths) == 1 else
                         f"keys {', '.join(repr(dotted(path)) for path in paths)} are missing",
                         "; ".join(_added(model, path) for path in paths)) for paths in tables.values()]


def _added(model: type[BaseModel], path: KeyPath) -> str:
    """What to write for a missing key: a table, or one of several, with all that it must have, or a key at its place."""
    kinds, name = _kinds(model, path), ".".join(part for part in path if isinstance(part, str))
    for form, inside in ((f"[{name}]", kinds), (f"[[{name}]]", _elements(kinds, (list, tuple))),
                         (f"[{name}.NAME]", _elements(kinds, (dict, Mapping)))):
        models = [one for kind in inside for one in _models(kind)]
        keys = sorted({field.alias or key for one in models for key, field in one.model_fields.items()})
        needed = [f"{key} = {in_dots(_kinds(one, (key,)))}" for key in keys for one in models[:1] if all(
            field.is_required() for m in models for k, field in m.model_fields.items() if key in (k, field.alias))]
        if needed or (models and form != f"[{name}]"):
            return f"add a table {form}" + (f" with {', '.join(needed)}" if needed else "")
    where = f"to {table_named(path[:-1])}" if path[1:] else "at the top"
    return f"add {path[-1]} = {in_dots(kinds)} {where}"


def _elements(kinds: list[Any], of: tuple[Any, ...]) -> list[Any]:
    """What lists, or tables by name, hold."""
    return [inner for kind in kinds if get_origin(kind) in of for inner in _inside(kind, 0)]


def _kinds(model: type[BaseModel], path: Sequence[str | int]) -> list[Any]:
    """Types that the value at the path may have."""
    found: list[Any] = [model]
    for part in path:
        found = [inner for kind in found for inner in _inside(kind, part)]
    return found


def _described(model: type[BaseModel], path: Sequence[str | int]) -> str:
    """What the docstring of the last field on the path along `path` says."""
    found: list[Any] = [model]
    text = ""
    for part in path:
        said = [key_texts(m).get(str(part), "") for kind in found for m in _models(kind)]
        text = next((" ".join(one.split()) for one in said if one), text)
        found = [inner for kind in found for inner in _inside(kind, part)]
    return text


def _shown(value: object) -> str:
    text = json.dumps(value, default=str)
    return text if len(text) <= 60 else text[:57] + "..."


def _known_keys(model: type[BaseModel], path: Sequence[str | int]) -> list[str]:
    """Keys that the tables of `model` at `path` know."""
    models = [m for kind in _kinds(model, path) for m in _models(kind)]
    keys = {field.alias or name for m in models for name, field in m.model_fields.items()}
    return sorted(keys if path else keys | {"base"})


def _models(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    if get_origin(annotation) in (dict, list, tuple):
        return []
    return [m for part in get_args(annotation) for m in _models(part)]


def _inside(annotation: Any, part: str | int) -> list[Any]:
    """Types that the element `part` of a value of this type may have; a union's tag in a location stays where it is."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        fields = {f.alias or n: f for n, f in annotation.model_fields.items()}
        return [fields[str(part)].annotation] if part in fields else [annotation]
    origin, args = get_origin(annotation), get_args(annotation)
    if origin in (dict, Mapping):
        return [args[1]]
    if origin in (list, tuple):
        return [a for a in args if a is not Ellipsis]
    return [inner for a in args for inner in _inside(a, part)]
