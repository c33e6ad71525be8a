"""Options that a `postproc.toml` next to the job gives to a command that leaves them out."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import typer

from postproc.cli.shared.says import SAYS, readable

ONLY_OF_CL = "dialect"
"""an option that only commands on CL files have: the others take machine and controller"""


def given_defaults(command: Any, arguments: list[str], context: typer.Context) -> None:
    """Hand the job file's values to a command as its defaults, and say on standard error which were taken.

    The file is looked for upwards from the folder of the CL file, for commands without one from the present folder.
    """
    SAYS.job_units = SAYS.job_line = ""
    names = {one.name for one in command.params}
    if "machine" not in names and ONLY_OF_CL not in names:
        return
    given = _given(command, arguments)
    if given is None:
        return
    of_cl = ONLY_OF_CL in names
    file = given.get("file") or given.get("files")
    folder = Path(str(file)).parent if of_cl and file and file != "-" else Path()
    values, where = _values(folder, str(given.get("json") or ""))
    taken = {key: value for key, value in values.items()
             if key in names and key not in given and (of_cl or key in ("machine", "controller"))}
    SAYS.job_units = str(where) if "units" in taken else ""
    if taken:
        several = {one.name for one in command.params if getattr(one, "multiple", False)}
        context.default_map = {command.name: {key: [value] if key in several and not isinstance(value, list) else value
                                              for key, value in taken.items()}}
        line = f"{where}: {', '.join(f'{key} {_shown(value)}' for key, value in taken.items())}"
        if "quiet" in given:
            SAYS.job_line = line  # it stands before warnings and errors
        else:
            typer.echo(readable(line), err=True)


def _shown(value: object) -> str:
    return " ".join(map(str, value)) if isinstance(value, list) else f"{value:g}" if isinstance(value, float) else str(value)


def _given(command: Any, arguments: list[str]) -> dict[str, str] | None:
    """What the command line states, by parameter ("" for what takes no value); None where it asks for help."""
    if {"-h", "--help"} & set(arguments):
        return None
    own = [one for one in command.params if one.param_type_name == "option"]
    options = {opt: one for one in own for opt in (*one.opts, *one.secondary_opts)}
    places = [one.name for one in command.params if one.param_type_name == "argument"]
    found, rest = dict[str, str](), list(arguments)
    while rest:
        word = rest.pop(0)
        while len(word) > 2 and word[0] == "-" != word[1] and _is_flag(options.get(word[:2])):
            found[options[word[:2]].name] = ""  # -qmNAME, -qv: short options together
            word = f"-{word[2:]}"
        name, sign, value = word.partition("=")
        if not word.startswith("--") and len(word) > 2 and word[:2] in options:
            name, sign, value = word[:2], "=", word[2:]  # -mNAME
        if word == "--" or not word.startswith("-") or word == "-" or name not in options:
            if places and word != "--":
                found[places.pop(0)] = word
            continue
        one = options[name]
        found[one.name] = value if sign else rest.pop(0) if not _is_flag(one) and rest else ""
    return found


def _is_flag(option: Any) -> bool:
    """True for an option that takes no value."""
    return option is not None and bool(getattr(option, "is_flag", False) or getattr(option, "count", False))


def _values(folder: Path, json: str) -> tuple[dict[str, Any], Path | None]:
    """The values of the job file, {} without one; its faults end the command."""
    from postproc.base.job_place import found_upwards

    where = found_upwards(folder)
    if where is None:
        return {}, None
    from postproc.cli.shared.console import report
    from postproc.setup.job_file import load_job_file

    values, found = load_job_file(where)
    if values is None:
        report(tuple(found), json, {"diagnostics": [d.as_dict() for d in found]}, "")
    return dict(values or {}), where
