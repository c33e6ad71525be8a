"""What every command has: help as usage lines are written, and the option that raises the size of the files it reads."""

from __future__ import annotations

import sys
from functools import cache
from shutil import get_terminal_size
from typing import Annotated, Any

import typer
from typer.core import TyperArgument, TyperGroup, TyperOption

MaxFileSize = Annotated[float | None, typer.Option("--max-file-size", metavar="MB", min=0.001, max=1e9, is_eager=True,
                                                   callback=lambda context, value: _hold(context, value),
                                                   help="largest input file that is read (default 1000 MB)")]


PIPE = 120
"""columns of help where it goes to no terminal: stable, and not broken at 80"""


def width() -> int:
    """Columns of the help: those of the terminal."""
    return get_terminal_size((PIPE, 24)).columns if sys.stdout.isatty() else PIPE


ORDER = ("convert", "verify", "inspect", "trace", "time", "orient", "place", "calibrate", "errors", "machine", "controller",
         "setup")
"""commands as the help lists them, the first ones first; others follow"""


class Argument(TyperArgument):
    """A file or name as usage lines have it, FILE, without typer's braces and names of types."""

    def get_usage_pieces(self, ctx: object) -> list[str]:
        """The name; in brackets where it may be left out."""
        return [self.display_name_raw if self.required else f"[{self.display_name_raw}]"]

    def display_type_rich(self, ctx: object) -> None:
        """Nothing: the text says what it is."""


class Option(TyperOption):
    """An option whose range is written as `1 to 300`."""

    def _get_number_range_help_str(self) -> str | None:
        if self.min is None or self.max is None:
            return None if self.min is None else f"at least {self.min:g}"
        return f"{self.min:g} to {self.max:g}"


class Group(TyperGroup):
    """Commands with the option, each of them; help in the width of the terminal."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        self.context_settings = {**self.context_settings, "terminal_width": width()}
        for command in self.commands.values():
            if not isinstance(command, TyperGroup):
                command.params.append(_option())
                for param in command.params:
                    _plainly(param)

    def list_commands(self, ctx: object) -> list[str]:
        """Names in the order of the journey."""
        return sorted(self.commands, key=lambda name: ORDER.index(name) if name in ORDER else len(ORDER))


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


@cache
def _option() -> Any:
    """The option as typer makes it, without a value that commands would have to take."""
    def command(max_file_size: MaxFileSize = None) -> None:
        """Nothing but the option."""

    lone = typer.Typer(add_completion=False)
    lone.command()(command)
    option = next(p for p in typer.main.get_command(lone).params if p.name == "max_file_size")
    option.expose_value = False
    return option
