"""The command `postproc report`. Heavy packages are imported inside, so that --help is instant."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from postproc.base.options import FeedSource
from postproc.cli.shared.console import (
    Json,
    controller_of,
    machine_of,
    own_files,
    progress_bar,
    read_cl,
    refuse_overwriting,
    report,
    shown_errors,
)
from postproc.cli.shared.options import (
    Allow,
    AxisToleranceOption,
    Beyond,
    ClFile,
    DialectOption,
    HooksFile,
    MaxTilt,
    Orient,
    ToleranceOption,
    UnitsOption,
    only_with_errors,
    word_option,
)

if TYPE_CHECKING:
    from postproc.base.options import Options
    from postproc.base.progress import Progress
    from postproc.cycle_time.estimate import Estimate
    from postproc.page.run import Run
    from postproc.pipeline.result import PostResult
    from postproc.proof.hashes import Hashes, ProofInput
    from toolpaths.diagnostics import Diagnostic
    from toolpaths.toolpath import Toolpath

MOST_RUNS = 12
"""combinations of machine and control in one report"""
EXAMPLE = "Example: postproc report part.cls -m mikron-ucp710 -c linuxcnc -c siemens-840d -o report.html"
Machines = Annotated[list[str], typer.Option("-m", "--machine", metavar="MACHINE", help="name from `postproc machine list`, "
                                             "or a TOML file; may be repeated to compare machines")]
Controllers = Annotated[list[str], typer.Option("-c", "--controller", metavar="CONTROLLER", help="name from `postproc "
                                                "controller list`, or a TOML file; may be repeated")]
NoTexts = Annotated[bool, typer.Option("--no-texts", help="leave the texts of CL file and programs out of the page")]
Figures = Annotated[Path | None, typer.Option("--figures", metavar="DIR", help="write its figures into this folder too, "
                                              "as PNG and SVG")]


def report_command(file: ClFile, machine: Machines, controller: Controllers,
                   output: Annotated[Path, typer.Option("-o", "--output", metavar="R.html", help="page to write")],
                   no_texts: NoTexts = False, figures: Figures = None,
                   feed: Annotated[FeedSource, word_option("--feed", FeedSource, "as of convert")] = "programmed",
                   orient: Orient = "keep", max_tilt: MaxTilt = 60.0,
                   setup: Annotated[str, typer.Option("--setup", metavar="S.toml", help="set-up file: placement, tools, "
                                                      "safe distances")] = "",
                   hooks: HooksFile = "", tolerance: ToleranceOption = 0.01, axis_tolerance: AxisToleranceOption = 0.05,
                   units: UnitsOption = "", dialect: DialectOption = "", allow_unknown: Allow = None,
                   error_model: Annotated[str, typer.Option("--error-model", metavar="E.toml", help="file of the machine's "
                                                            "geometric errors")] = "",
                   beyond: Beyond = False, json: Json = "") -> None:
    """Show what a program does as one page that opens offline: proof, path, time, set-up, messages."""
    _check(output, machine, controller)
    only_with_errors(beyond, error_model)
    inputs = {"the CL file": str(file), "the set-up": setup, "the hooks": hooks, "the error model": error_model}
    for name in machine:
        inputs |= {f"{what} {name}": place for what, place in own_files(name).items()}
    for name in controller:
        inputs |= {f"{what} {name}": place for what, place in own_files("", name).items()}
    if figures is not None:
        from toolpaths.extras import need

        need("matplotlib", "drawings need")
    refuse_overwriting({"-o": str(output), "--json": json, **_figure_files(figures, len(machine) * len(controller))}, inputs)
    from postproc.base.options import Options
    from postproc.page.document import document, report_dict, texts_of
    from postproc.page.tabs import with_tabs

    options = Options(tolerance, axis_tolerance, "auto", setup, units, dialect,
                      tuple(w.upper() for w in allow_unknown or ()), feed=feed, error_model=error_model, hooks=hooks,
                      error_beyond=beyond, orient=orient, max_tilt=max_tilt,
                      name=file.stem)
    values: dict[str, Any] = {}
    outputs: dict[Path, str | bytes] = {}
    text = ""
    found: list[Diagnostic] = []
    with shown_errors(json), progress_bar() as progress:
        path, read = read_cl(file, options, progress, options.tolerance)
        runs = [_run(path, m, c, options, read, progress) for m in machine for c in controller]
        values, tab_faults = with_tabs(report_dict(path, runs))
        outputs[output] = document(values, [] if no_texts else texts_of(runs))
        if figures is not None:
            from postproc.page.drawings import drawings

            outputs = {**{figures / name: data for name, data in drawings(values).items()}, **outputs}
        found = list(dict.fromkeys(d for run in runs for d in run.result.diagnostics)) + tab_faults
        text = "\n".join([*(_line(one) for one in values["runs"]), f"{output}: {len(outputs[output]) / 1e6:.2f} MB"])
    report(tuple(found), json, values | {"diagnostics": [d.as_dict() for d in found]}, text, outputs)


def pages(page: Path | None, path: Toolpath, result: PostResult, known: dict[ProofInput, Hashes] | None, name: str,
          time: Estimate | None) -> tuple[dict[Path, str | bytes], list[Diagnostic]]:
    """The page of `convert --report` by its place, of a conversion that writes the program `name`, and what is wrong with
    packages that add to it; none without one."""
    if page is None:
        return {}, []
    from postproc.page.document import document, report_dict, texts_of
    from postproc.page.run import Run
    from postproc.page.tabs import with_tabs

    runs = [Run(result, time, known or {}, name)]
    values, found = with_tabs(report_dict(path, runs))
    return {page: document(values, texts_of(runs))}, found


def check_page(page: Path, option: str) -> None:
    """Wrong use where a page is no .html file."""
    if page.suffix.lower() not in (".html", ".htm"):
        raise typer.BadParameter(f"{page.name} is no .html file", param_hint=option)


def _check(output: Path, machines: list[str], controllers: list[str]) -> None:
    check_page(output, "-o")
    for option, names in (("-m", machines), ("-c", controllers)):
        twice = [name for k, name in enumerate(names) if name in names[:k]]
        if twice:
            raise typer.BadParameter(f"{twice[0]} is named twice", param_hint=option)
    if len(machines) * len(controllers) > MOST_RUNS:
        raise typer.BadParameter(f"{len(machines)} machines and {len(controllers)} controls are "
                                 f"{len(machines) * len(controllers)} programs; a report holds up to {MOST_RUNS}",
                                 param_hint="-m, -c")


def _figure_files(folder: Path | None, runs: int) -> dict[str, str]:
    if folder is None:
        return {}
    from postproc.page.drawings import names

    return {f"--figures {name}": str(folder / name) for name in names(runs)}


def _run(path: Toolpath, machine: str, controller: str, options: Options, read: list[Diagnostic],
         progress: Progress) -> Run:
    """One combination, converted and timed."""
    from postproc.cycle_time.conversion import estimate_of, program_clock
    from postproc.page.run import Run
    from postproc.pipeline.convert import convert
    from postproc.proof.command import hashed

    known = hashed(machine, controller, options)
    result = convert(path, machine_of(machine), controller_of(controller), options=options, diagnostics=list(read),
                     progress=progress, clock=program_clock())
    if not result.ok:
        from dataclasses import replace

        from postproc.setup_sheet.offers import offers

        result = replace(result, diagnostics=(*result.diagnostics, *offers(result, path, machine, controller)))
    return Run(result, estimate_of(result, executed=True), known or {}, f"{options.name}.nc")


def _line(run: dict[str, Any]) -> str:
    time = run["conversion"]["cycle_time_s"]
    state = run["statement"] or "not converted: see its messages"
    return f"{run['machine']}, {run['controller']}: {state}" + ("" if time is None else f"; {time:.2f} s")
