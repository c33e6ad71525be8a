"""The command `postproc schema`: JSON schemas of the files that users write, and of what commands write with --json."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from postproc.cli.shared.console import print_json

EXAMPLES = "Examples: postproc schema setup-file; postproc schema machine check"


def schema(what: Annotated[list[str] | None, typer.Argument(metavar="NAME", help="a file that users write, or the words of "
                                                            "a command; left out: the list of both")] = None) -> None:
    """Print the JSON schema of a file that users write, or of what a command writes with --json."""
    from postproc.cli.shared.schemas import FILES, RESULTS, file_schema, result_schema

    name = " ".join(what or ())
    if not name:
        typer.echo("\n".join(["files:", *(f"  {one}" for one in FILES), "results of commands (--json):",
                              *(f"  {one}" for one in RESULTS)]))
    elif name in FILES or name in RESULTS:
        found: dict[str, Any] = file_schema(name) if name in FILES else result_schema(name)
        print_json(found)
    else:
        from machines.user_file import nearest

        raise typer.BadParameter(f"no file and no command {name!r}{nearest(name, [*FILES, *RESULTS])}", param_hint="NAME")
