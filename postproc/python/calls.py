"""What the commands do, as calls: values and numpy arrays in and out, faults as DiagnosticError.

`convert` and `verify` stand in `conversion.py`; these are the others. Each raises
DiagnosticError with all diagnostics where its command would end with exit code 1.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from machines.calibration.outcome import CalibrationOutcome
from machines.loader import load
from machines.machine import Machine
from postproc.base.given import is_number, wrong
from postproc.base.options import Options
from postproc.controllers.model import load_controller
from postproc.cycle_time.conversion import program_clock
from postproc.cycle_time.estimate import Estimate, estimate
from postproc.cycle_time.model import load_model, model_name
from postproc.cycle_time.source import from_conversion, from_gcode, read_file
from postproc.orientation.plans.choice import OrientationChoice
from postproc.pipeline.convert import choose_axes, require_call
from postproc.placement.place import PlacementChoice
from postproc.placement.place import place as place_part
from postproc.python.conversion import convert
from postproc.setup.model import SetupFile, alone, load_setup
from postproc.verification.neighbour_files import NeighbourFiles
from toolpaths.cl.text.kinds_of_file import looks_like_apt
from toolpaths.diagnostics import DiagnosticError, error, read_value, require, value_shown
from toolpaths.toolpath import Toolpath

FileName = str | Path
LEAST_OVERRIDE, MOST_OVERRIDE = 0.01, 3.0
HEAD = 20_000
"""bytes by which a file is recognised"""


def time(source: Toolpath | FileName, machine: Machine | FileName, controller: FileName = "linuxcnc",
         setup: SetupFile | FileName | None = None, options: Options | None = None, *, model: str = "",
         override: float = 1.0) -> Estimate:
    """How long a path (converted first) or a program in a file takes: s, with a band.

    Args:
        source: a Toolpath, or the file of a program
        model: of the control: "ideal", "lookahead", "linuxcnc" or a TOML file; default: the controller's
        override: of programmed feeds, 0.01 to 3, 1.0 as programmed

    Raises:
        DiagnosticError: carries all that was found.
    """
    _require_time(source, options, override)
    m = _machine(machine)
    spec = read_value(load_controller(controller))
    planner = read_value(load_model(model or model_name(str(controller), spec.writer))).of_machine(m)
    times = None
    if isinstance(source, Toolpath):
        result = convert(source, m, controller, setup, options, model=model)
        require(result.diagnostics)
        blocks = from_conversion(result, override)
        if planner.kind == "ideal":
            from postproc.cycle_time.planned import planned_times

            times, _ = planned_times(result, blocks, planner, override)
    else:
        shop = _setup(setup, options)
        others = NeighbourFiles(Path(source))
        data = read_file(source)
        if looks_like_apt(data[:HEAD]):
            raise DiagnosticError([error("file.program", "this is a CL file, not a program of a control", file=str(source),
                                         hint="give the path of it: path, diagnostics = toolpaths.read(FILE)")])
        blocks = read_value(from_gcode(data, m, spec, shop, str(source), others, override))
    return estimate(blocks, m, planner, times=times)


def orient(path: Toolpath, machine: Machine | FileName, controller: FileName = "linuxcnc",
           options: Options | None = None) -> OrientationChoice:
    """The tool axes of 3+2 passes for the least planned time, and along cuts where the set-up has a cone; `options.orient`
    is the plan that is proved.

    `choice.toolpath("auto")` is the path with the axes of a plan, `choice.plans` are the plans with their times.

    Raises:
        DiagnosticError: carries all that was found.
    """
    options = options or Options(orient="auto")
    result = choose_axes(path, _machine(machine), controller, options, [], clock=program_clock())
    return read_value((result.choice, result.diagnostics))


def place(path: Toolpath, machine: Machine | FileName, setup: SetupFile | FileName, controller: FileName = "linuxcnc",
          options: Options | None = None) -> PlacementChoice:
    """The place of the part on the table for the least planned time, inside [placement] of the set-up.

    `choice.part` is the new [part].

    Raises:
        DiagnosticError: carries all that was found.
    """
    require_call(path, options)
    shop = _setup(setup, options)
    require(path.faults)
    return read_value(place_part(path, _machine(machine), shop, options, controller))


def calibrate(measurements: FileName, *, accept_residual: bool = False) -> CalibrationOutcome:
    """The errors of a machine from measurements: `model`, and `figures` with value, sigma and unit of each parameter.

    Raises:
        DiagnosticError: carries all that was found, where the data do not support a model.
    """
    from machines.calibration.calibrate import calibrate as run

    outcome, found = run(measurements, accept_residual)
    if outcome is None or outcome.model is None:
        raise DiagnosticError(found)
    return read_value((outcome, found))


def analyse(machine: Machine | FileName, singular_above: float | None = None) -> dict[str, Any]:
    """What a machine is good for: workspace, transmission, singular positions; the figures of `machine analyse --json`.

    Raises:
        DiagnosticError: where the machine file has errors.
    """
    from machines.analysis.report import analyse as run

    return run(_machine(machine), singular_above)


def _require_time(source: object, options: object, override: object) -> None:
    """Refuse what is neither a path nor a file, options that are none, an override that no control has.

    Raises:
        DiagnosticError: says what was found, and what to give.
    """
    require_call(source, options, FileName)
    if not is_number(override, LEAST_OVERRIDE, MOST_OVERRIDE):
        raise DiagnosticError([wrong(f"override is {value_shown(override)}", "give it as a part of the programmed feed, "
                                     f"{LEAST_OVERRIDE:g} to {MOST_OVERRIDE:g}, 1.0 as programmed")])


def _machine(machine: Machine | FileName) -> Machine:
    return machine if isinstance(machine, Machine) else load(machine)


def _setup(setup: SetupFile | FileName | None, options: Options | None) -> SetupFile:
    """The set-up that is given, or that the options name."""
    if isinstance(setup, SetupFile):
        return alone(setup)
    options = options or Options()
    return read_value(load_setup(setup or options.setup or None, options.hooks))
