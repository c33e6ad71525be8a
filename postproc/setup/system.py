"""A part that stands by a system of its CL file: [part] of the set-up said in the file's absolute frame."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from postproc.setup.model import PartPlacement, Placement, SetupFile, part_placement, system_of, work_frame
from toolpaths.arrays import Floats
from toolpaths.diagnostics import Diagnostic, Severity, info, warning
from toolpaths.toolpath import Frame, Toolpath
from toolpaths.units import DEG

UPRIGHT = 0.1
"""degrees that the z of a system may lean by on the table and still stand upright"""
AWAY = 1e-3
"""mm between two origins that are the same"""
_BELOW = 1e-6
"""cosine of a direction with the upright one, beyond which it comes from below"""
BEYOND = ("travel.exceeded", "reach.axis", "reach.position", "reach.clearance")
"""codes of errors that another place of the part may heal"""


def standing(setup: SetupFile, toolpath: Toolpath, file: str = "") -> tuple[SetupFile, list[Diagnostic]]:
    """The set-up with [part] by the absolute frame, where it is by a system of the CL file; `file` is the set-up's.

    The system F takes its coordinates to the part frame, [part] S takes them to the table: the part stands at S F^-1.
    """
    if not setup.part.system or setup.places:  # each place is looked at by itself
        return setup, []
    frame, found = _system(setup, toolpath, file)
    there, more = part_placement(setup, file)
    found += more
    if frame is None or there is None:
        return setup, found
    back = placed(frame).inverse()
    rotation = there.directions(back.rotation.T).T
    origin = there.points(back.origin[None, :])[0] + 0.0
    x, y = (_vector(rotation[:, k] + 0.0) for k in (0, 1))
    part = PartPlacement(origin=_vector(origin), x_axis=x, y_axis=y)
    if placed(frame).is_identity:
        return setup.model_copy(update={"part": part}), found
    said = info("setup.system", f"{frame.name} of the CL file stands on the table at {_text(setup.part.origin, 4)} mm: the "
                f"file's absolute frame at {_text(part.origin, 4)} mm, x along {_text(x, 6)}, y along {_text(y, 6)}",
                file=file)
    return setup.model_copy(update={"part": part}), [*found, said]


def upside_down(axes: Floats, home: Floats, placement: Placement, file: str) -> list[Diagnostic]:
    """A warning where most tool axes come from below the table: the part may stand on its head.

    Args:
        axes (N, 3): of the cuts, in the table frame
        home (3,): tool axis with all joints at home, in the table frame
        file: of the set-up
    """
    below = float((axes @ home < -_BELOW).mean()) if len(axes) else 0.0
    if below <= 0.5:
        return []
    x, y = _text(placement.rotation[:, 0], 6), _text(-placement.rotation[:, 1], 6)
    return [warning("setup.upside_down", f"the tool comes from below the table in {100.0 * below:.0f} % of the cuts: the "
                    "part may stand upside down", file=file,
                    hint=f"[part] x_axis = [{x.strip('()')}], y_axis = [{y.strip('()')}] in the set-up turns it over; "
                    "postproc setup new turns it by the tool axes to a place that fits")]


def placed(frame: Frame) -> Placement:
    """A system of the CL file as what takes its coordinates to the part frame."""
    return Placement(np.array(frame.rotation), np.array(frame.origin))


def _system(setup: SetupFile, toolpath: Toolpath, file: str) -> tuple[Frame | None, list[Diagnostic]]:
    name = setup.part.system
    if isinstance(name, str):
        return system_of(name, toolpath, file, "part.system", ("part", "system"))
    return work_frame(setup, toolpath, file)


def _vector(values: np.ndarray[tuple[int], np.dtype[np.float64]]) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z


def _text(values: Iterable[float], places: int) -> str:
    return f"({', '.join(f'{round(v, places) + 0.0:g}' for v in values)})"


def with_system(found: list[Diagnostic], frame: Frame, placement: Placement, axes: Floats) -> list[Diagnostic]:
    """Errors of travel and reach, their hints with the system of the CL file that does not stand upright on the table.

    Nothing is said of a system that would turn the tool axes `axes` (N, 3) of the moves, in the table frame, to come
    from below.
    """
    if not any(d.code in BEYOND and d.severity is Severity.ERROR for d in found):
        return found
    said = _stands(frame, placement)
    upright = placement.inverse().directions(axes) @ np.array(frame.rotation)
    if bool((upright[:, 2] < 0.0).mean() > (axes[:, 2] < 0.0).mean()):
        said = ""
    return [replace(d, hint=f"{d.hint}; {said}" if d.hint else said)
            if said and d.code in BEYOND and d.severity is Severity.ERROR else d for d in found]


def _stands(frame: Frame, placement: Placement) -> str:
    """What sets the work system upright, where the part stands as the CAM system has it and that system does
    not; what brings it to the table, where it lies farther from the table's origin than the absolute one does."""
    own = placed(frame)
    if not bool((placement.rotation == np.eye(3)).all()):
        return ""
    lean = float(np.arccos(np.clip(own.rotation[2, 2], -1.0, 1.0))) / DEG
    here, absolute = (float(np.linalg.norm(p)) for p in (placement.points(own.origin[None, :])[0], placement.origin))
    line = f"[part] system = {json.dumps(frame.name, ensure_ascii=False)}"
    if lean > UPRIGHT:
        return f"the file's own system {frame.name} leans by {lean:.4g} degrees on the table: {line} stands it upright there"
    if here > absolute + AWAY:
        return f"the file's own system {frame.name} lies {here:.6g} mm off the table's origin: {line} puts it at part.origin"
    return ""
