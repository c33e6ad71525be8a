"""The command `postproc machine new`. Heavy packages are imported inside, so that --help is instant."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from postproc.cli.shared.console import Json, refuse_overwriting, report, shown_errors

if TYPE_CHECKING:
    from machines.machine import Machine
    from machines.sheet.make import NewMachine
    from machines.sheet.questions import SheetQuestion
    from postproc.cli.shared.kept_answers import KeptAnswers

EXAMPLES = """Example: postproc machine new shop.sheet.toml -o shop.toml --drawing shop.svg

The sheet holds the figures of a brochure with their units, the pivot numbers of the control by its own names, and what was
seen when each rotary axis was jogged. Where there is no such file, its questions are asked on the terminal, and it is
written; Ctrl-C keeps the answers, and the same command goes on. All faults of a sheet come at once, each with its line;
what the sheet states is not assumed."""


def machine_new(sheet: Annotated[Path, typer.Argument(metavar="SHEET.toml", help="data sheet; where it is not there it is "
                                                      "asked for and written")],
                output: Annotated[Path, typer.Option("-o", "--output", metavar="M.toml", help="machine file to write")],
                drawing: Annotated[str, typer.Option("--drawing", metavar="D.svg", help="draw frames, axes, pivots and "
                                                     "senses")] = "",
                force: Annotated[bool, typer.Option("--force", help="replace a file that there is already")] = False,
                json: Json = "") -> None:
    """Write a machine file from a data sheet, a pivot table and jogs; wrong units and signs are found."""
    from toolpaths.input_files import there_is

    refuse_overwriting({"-o": str(output), "--drawing": drawing, "--json": json}, {"the sheet": str(sheet)})
    for option, path in (("-o", output), ("--drawing", Path(drawing) if drawing else None)):
        if path is not None and there_is(path) and not force:
            raise typer.BadParameter(f"{path} exists; --force replaces it", param_hint=option)
    from machines.sheet.drawing import drawing as picture
    from machines.sheet.make import new_machine

    with shown_errors(json):
        asked = not there_is(sheet) and _asked(sheet)
        made = new_machine(sheet, output.stem)
    outputs: dict[Path, str | bytes] = {}
    if made.machine is not None:
        outputs[output] = made.text
        if drawing:
            outputs[Path(drawing)] = picture(made.machine)
    values = {"output": str(output) if made.machine is not None else None, "sheet_written": asked, "assumed": made.assumed,
              "diagnostics": [d.as_dict() for d in made.diagnostics]}
    report(tuple(made.diagnostics), json, values, _text(made, output, drawing), outputs)


def _asked(sheet: Path) -> bool:
    """The sheet, written from the answers; where they end too soon it is not. What was answered on a terminal is kept."""
    from machines.sheet.questions import sheet_text
    from postproc.cli.shared.kept_answers import kept_answers
    from toolpaths.diagnostics import DiagnosticError, error
    from toolpaths.transaction import write_together

    kept = kept_answers(sheet.with_name(f"{sheet.name}.answers"))
    try:
        write_together({sheet: sheet_text(lambda question: _ask(question, kept))})
    except KeyboardInterrupt:
        kept.keep()
        raise
    except EOFError:
        if sys.stdin is not None and sys.stdin.isatty() and kept.keep():
            raise KeyboardInterrupt from None
        raise DiagnosticError([error("sheet.unanswered", f"the answers ended before {sheet} was whole; nothing was written",
                                     hint=f"answer on a terminal, or write {sheet} and name it again")]) from None
    kept.file.unlink(missing_ok=True)
    return True


def _ask(question: SheetQuestion, kept: KeptAnswers) -> str:
    """Asks until an answer fits.

    Raises:
        EOFError: where standard input has ended.
    """
    again = False
    while True:
        line = kept.line(question.prompt(), again)
        try:
            answer = question.parsed(line)
        except ValueError as wrong:
            typer.echo(str(wrong), err=True)
            again = True
        else:
            kept.given.append(line.strip())
            return answer


def _text(made: NewMachine, output: Path, drawing: str) -> str:
    """What was written, and what is left to do."""
    if made.machine is None:
        return ""
    unproved = [name.split(".")[0] for name in made.assumed if name.endswith(".direction")]
    lines = [f"written: {output}{f', {drawing}' if drawing else ''}",
             f"{made.machine.structure}, {len(made.assumed)} figures assumed", *_understood(made.machine)]
    if unproved:
        lines.append(f"senses of {', '.join(unproved)} are not proved: jog each by +10, write what was seen into the sheet")
    if made.unread:
        jogged = [name for name, turns in zip(made.machine.axis_names, made.machine.rotary, strict=True)
                  if turns and name not in unproved]
        lines += [f"senses of {', '.join(jogged)} are those of the jogs: no other figure of the sheet contradicts a jog "
                  "answered wrongly, [touched] does"] if jogged else []
        lies = "lies" if len(made.unread) == 1 else "lie"
        lines.append(f"where {', '.join(made.unread)} {lies} is not proved: a pivot off by some mm passes every rule; touch "
                     "a ball in several poses and write [touched] into the sheet, or run the check program")
    lines.append(f"next: postproc convert part.cls -m {output} -c CONTROLLER --check-program check.nc proves the pivots")
    return "\n".join(lines)


def _understood(machine: Machine) -> list[str]:
    """Travel and speed of each axis in both units that brochures print: a unit that was mistaken shows."""
    from toolpaths.units import DEG, MM_PER_INCH

    lines, limits = [], machine.limits
    for j, name in enumerate(machine.axis_names):
        low, high, speed = (float(values[j]) for values in (limits.lower, limits.upper, limits.velocity))
        if not machine.rotary[j]:
            ends = f"{low:g} to {high:g} mm ({(high - low) / MM_PER_INCH:.4g} in long)"
            lines.append(f"  {name}: {ends}, {speed * 0.06:.4g} m/min ({speed * 60.0 / MM_PER_INCH:.4g} in/min)")
        else:
            ends = "endless" if machine.endless[j] else f"{low / DEG:g} to {high / DEG:g} degrees"
            lines.append(f"  {name}: {ends}, {speed / DEG / 6.0:.4g} turns/min ({speed / DEG:.4g} degrees/s)")
    return lines
