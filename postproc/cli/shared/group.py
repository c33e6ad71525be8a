"""What every command has: help as usage lines are written, options on the size of input files, on how much is said, on
warnings; defaults of the job file."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from copy import copy
from functools import cache
from shutil import get_terminal_size
from typing import Annotated, Any, Literal

import typer
from typer.core import TyperArgument, TyperGroup, TyperOption

from postproc.cli.shared.job_defaults import given_defaults
from postproc.cli.shared.says import SAYS

MaxFileSize = Annotated[float | None, typer.Option("--max-file-size", metavar="MB", min=0.001, max=1e9, is_eager=True,
                                                   callback=lambda context, value: _hold(context, value),
                                                   help="largest input file that is read (default 1000 MB)")]
Quiet = Annotated[bool, typer.Option("-q", "--quiet", is_eager=True, callback=lambda context, value: _set("quiet", value),
                                     help="say warnings and errors only")]
Verbose = Annotated[bool, typer.Option("-v", "--verbose", is_eager=True,
                                       callback=lambda context, value: _set("verbose", value),
                                       help="say each stage as it begins")]
Strict = Annotated[bool, typer.Option("--strict", is_eager=True, callback=lambda context, value: _set("strict", value),
                                      help="warnings are errors: nothing is written")]


PIPE = 120
"""columns of help where it goes to no terminal: stable, and not broken at 80"""


def width() -> int:
    """Columns of the help: those of the terminal."""
    return get_terminal_size((PIPE, 24)).columns if sys.stdout.isatty() else PIPE


ORDER = ("convert", "verify", "compare", "inspect", "trace", "time", "report", "orient", "place", "calibrate", "errors",
         "machine", "controller", "setup", "batch", "schema")
"""commands as the help lists them, the first ones first; others follow"""
RUN_OTHERS = ("batch",)
"""commands that look at the options of others, and run them"""


class Argument(TyperArgument):
    """A file or name as usage lines have it, FILE, without typer's braces and names of types."""

    def get_usage_pieces(self, ctx: object) -> list[str]:
        """The name; in brackets where it may be left out."""
        return [self.display_name_raw if self.required else f"[{self.display_name_raw}]"]

    def display_type_rich(self, ctx: object) -> None:
        """Nothing: the text says what it is."""


class Option(TyperOption):
    """An option whose default and range are written as `60` and `1 to 300`."""

    def _get_default_string(self, **given: Any) -> str:
        value = given["default_value"]
        return _short(value) if isinstance(value, float) else super()._get_default_string(**given)

    def _get_number_range_help_str(self) -> str | None:
        if self.min is None or self.max is None:
            return None if self.min is None else f"at least {_short(self.min)}"
        return f"{_short(self.min)} to {_short(self.max)}"


def _short(value: float) -> str:
    """A number as people write it: 60, 0.001, 1e9."""
    return f"{value:g}".replace("e+0", "e").replace("e-0", "e-")


class Group(TyperGroup):
    """Commands with the option, each of them; help in the width of the terminal."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        self.context_settings = {**self.context_settings, "terminal_width": width()}
        for command in self.commands.values():
            if not isinstance(command, TyperGroup):
                command.params += _options()
                for param in command.params:
                    _plainly(param)

    def resolve_command(self, ctx: typer.Context, args: list[str]) -> Any:  # type: ignore[override]  # of click's own
        """The command, with the defaults of the job file."""
        name, command, rest = super().resolve_command(ctx, args)
        if command is not None and not isinstance(command, TyperGroup):
            given_defaults(command, rest, ctx)
        return name, command, rest

    def list_commands(self, ctx: object) -> list[str]:
        """Names in the order of the journey."""
        return sorted(self.commands, key=lambda name: ORDER.index(name) if name in ORDER else len(ORDER))


def only_called(app: typer.Typer, arguments: Sequence[str]) -> typer.Typer:
    """The application with the one command that is called, so that the options of no other are built; with all of them where
    the first argument names none, or one that runs others."""
    name = arguments[0] if arguments else ""
    if name in RUN_OTHERS:
        return app
    one = copy(app)
    one.registered_commands = [c for c in app.registered_commands if name == (c.name or getattr(c.callback, "__name__", ""))]
    one.registered_groups = [g for g in app.registered_groups if name == g.name]
    return one if one.registered_commands or one.registered_groups else app


def _plainly(param: object) -> None:
    """Let typer write it as above."""
    if isinstance(param, TyperArgument):
        param.metavar = param.metavar or param.name.upper()
        param.__class__ = Argument
    elif isinstance(param, TyperOption):
        param.__class__ = Option


def _hold(context: typer.Context, value: float | None) -> None:
    """The size that was asked for, while the command runs."""
    from toolpaths.input_files import MEGABYTE, largest_file

    if value is not None:
        context.with_resource(largest_file(value * MEGABYTE))


def _set(name: Literal["quiet", "verbose", "strict"], value: bool) -> None:
    """How much this command says."""
    setattr(SAYS, name, value)


@cache
def _options() -> list[Any]:
    """The options as typer makes them, without values that commands would have to take."""
    def command(max_file_size: MaxFileSize = None, quiet: Quiet = False, verbose: Verbose = False,
                strict: Strict = False) -> None:
        """Nothing but the options."""

    lone = typer.Typer(add_completion=False)
    lone.command()(command)
    names = ("max_file_size", "quiet", "verbose", "strict")
    options = [p for p in typer.main.get_command(lone).params if p.name in names]
    for option in options:
        option.expose_value = False
    return options
