"""A controller with the options that the machine file says are bought, confirmed, or missing."""

from __future__ import annotations

from typing import Literal

from machines.machine import ControlOptions
from postproc.controllers.model import ArcRules, ControllerFile, Start
from postproc.controllers.output_modes import Modes
from postproc.controllers.spelling import ProgramBlocks


def fitted(controller: ControllerFile, options: ControlOptions) -> ControllerFile:
    """The controller with what the machine file says of its options: modes, codes and comments of those that it has not are
    left out, and comments of those that are confirmed."""
    codes, cycles, start = controller.codes, controller.cycles, controller.start
    if options.absent("rigid_tapping"):
        codes = codes.model_copy(update={"rigid_tap": ""})
        cycles = cycles.model_copy(update={"rigid_option": cycles.floating})
    elif options.confirmed("rigid_tapping"):
        cycles = cycles.model_copy(update={"rigid_option": ""})
    if options.power_on:
        start = Start(codes=tuple(dict.fromkeys((*start.codes, *options.power_on))))
    inch = controller.inch.model_copy(update={"relies_on": options.unconfirmed(controller.inch.relies_on)})
    rules: dict[Literal["shortest", "sign"], str] = {
        rule: text for rule, text in controller.rollover.needs.items() if options.unconfirmed((text,))}
    alone = "".join(options.unconfirmed((controller.tools.length_alone,)))
    return controller.model_copy(update={
        "tools": controller.tools.model_copy(update={"length_alone": alone}),
        "inch": inch, "rollover": controller.rollover.model_copy(update={"needs": rules}),
        "modes": _fitted_modes(controller.modes, options), "arcs": _fitted_arcs(controller.arcs, options),
        "program": _fitted_program(controller.program, options), "codes": codes, "cycles": cycles, "start": start})


def _fitted_modes(modes: Modes, options: ControlOptions) -> Modes:
    """The modes that the control has; the frame of the tip as the machine file confirms it."""
    tcp, tilted = (mode and mode.model_copy(update={"relies_on": options.unconfirmed(mode.relies_on)})
                   for mode in (modes.tcp, modes.tilted))
    if tcp is not None and options.tip_frame:
        tcp = tcp.model_copy(update={"frame": options.tip_frame})
    if tcp is not None and options.confirmed("tip_control"):
        tcp = tcp.model_copy(update={"option": ""})
    if tilted is not None and options.confirmed("tilted_planes"):
        tilted = tilted.model_copy(update={"option": ""})
    return modes.model_copy(update={"tcp": None if options.absent("tip_control") else tcp,
                                    "tilted": None if options.absent("tilted_planes") else tilted})


def _fitted_arcs(arcs: ArcRules, options: ControlOptions) -> ArcRules:
    """Without helices where the control has none."""
    if options.absent("helical"):
        return arcs.model_copy(update={"helix_planes": (), "helical_option": ""})
    return arcs.model_copy(update={"helical_option": ""}) if options.confirmed("helical") else arcs


def _fitted_program(program: ProgramBlocks, options: ControlOptions) -> ProgramBlocks:
    """Without the blocks of the smoothing where the control has it not."""
    program = program.model_copy(update={
        "relies_on_turns": "".join(options.unconfirmed((program.relies_on_turns,))),
        "more_offsets": {name: more.model_copy(update={"needs": "".join(options.unconfirmed((more.needs,)))})
                         for name, more in program.more_offsets.items()}})
    if options.absent("smoothing"):
        return program.model_copy(update={"path_tolerance": program.exact_path, "path_tolerance_off": (),
                                          "smoothing_option": program.without_smoothing})
    return program.model_copy(update={"smoothing_option": ""}) if options.confirmed("smoothing") else program
