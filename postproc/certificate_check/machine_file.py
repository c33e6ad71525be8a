"""Whether a certificate is about a machine file: its hash, and the geometry that is read without the project's loader."""

from __future__ import annotations

import json
import math
from hashlib import sha256
from typing import Any

import numpy as np

from postproc.certificate_check.balls import ball
from postproc.certificate_check.boxes import Rejected
from postproc.certificate_check.chains import about_chain
from postproc.certificate_check.held import held, pose_of
from postproc.certificate_check.legs import carried, legs_in
from postproc.witness.machine import legs_of

NEAR = 1e-9
"""mm, or parts of one"""
LEFT_OUT = {"clearance", "assumed", "source", "family"}


def hash_of(table: dict[str, Any]) -> str:
    """The hash of a machine file's merged values, as certificates have it."""
    kinematics = dict(table.get("kinematics", {}))
    kept = {"kind": kinematics.get("family"), **{k: v for k, v in kinematics.items() if k not in LEFT_OUT}}
    if "structure" in kept:  # a chain of axes: what is proved of a chain is a box inside its travel
        kept["travel"] = {letter: axis.get("travel", "") for letter, axis in table.get("axes", {}).items()}
    return sha256(json.dumps(_numbers(kept), sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def _numbers(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _numbers(v) for key, v in value.items()}
    if isinstance(value, list):
        return [_numbers(v) for v in value]
    return float(value) if type(value) in (int, float) else str(value)


def about(found: dict[str, Any], table: dict[str, Any]) -> None:
    """Compare a certificate with a machine file's merged values.

    Raises:
        Rejected: where it is about another machine.
    """
    if found.get("key") != hash_of(table):
        raise Rejected("its key is not the hash of the machine file: the file has changed, or it is another machine's")
    if "chain" in found:
        about_chain(found, table)
        return
    kinematics, geometry = table["kinematics"], found["geometry"]
    if found["region"]["of"] == "tip" and (kinematics.get("rotary", {}).get("carries") == "spindle"
                                           or kinematics.get("spindle_axes")):
        raise Rejected("an axis between platform and spindle moves the tip about: only the platform's places are proved")
    own, given = legs_of(kinematics), geometry["legs"]
    if list(own) != [leg["letter"] for leg in given]:
        raise Rejected(f"it has legs {[leg['letter'] for leg in given]}, the machine file {list(own)}")
    sides = _sides(kinematics)
    for (letter, leg), one in zip(own.items(), given, strict=True):
        for what, value in _of_file(leg, table["axes"][letter], one["drive"], sides.get(letter, (0.0, 0.0)),
                                    kinematics.get("bars", {})).items():
            proved = what != "travel" or found["travel_proved"] is True
            if proved and not _same(value, one[what]):
                raise Rejected(f"{what} of leg {letter} is {one[what]}, in the machine file {value}")
    for what, value in _of_platform(kinematics).items():
        if not _same(value, geometry[what]):
            raise Rejected(f"{what} is {geometry[what]}, in the machine file {value}")
    if not _same(_held(kinematics, own), {key: geometry.get(key, []) for key in ("bed", "platform")}):
        raise Rejected("what holds the platform besides its legs is another in the machine file")
    carriers = {one["letter"]: one for one in geometry["carriers"]}
    if len(carriers) != len(geometry["carriers"]) or set(carriers) != set(kinematics.get("carriers", {})):
        raise Rejected(f"it has carriers {[one['letter'] for one in geometry['carriers']]}, the machine file "
                       f"{list(kinematics.get('carriers', {}))}")
    for letter, carrier in kinematics.get("carriers", {}).items():
        due = {"direction": _unit(carrier["direction"]), "travel": _travel(table["axes"][letter], "slide")}
        if letter not in carriers or not all(_same(v, carriers[letter][k]) for k, v in due.items()):
            raise Rejected(f"carrier {letter} is another in the machine file")
    if geometry["parts"] is not None:
        _parts(geometry, kinematics)
    _whole(found, kinematics)


def _parts(geometry: dict[str, Any], kinematics: dict[str, Any]) -> None:
    """What is held apart, as the machine file has it; where rods stand in the middle is computed from the geometry."""
    given, legs = kinematics.get("clearance", {}), legs_of(kinematics)
    rails = given.get("rail_radius") is not None and all(leg.get("rail_ends") is not None for leg in legs.values())
    head = kinematics.get("rotary", {}).get("carries") == "spindle" or bool(kinematics.get("spindle_axes"))
    rods = [{"leg": k, "shift": list(shift)} for k, leg in enumerate(legs.values())
            for shift in leg.get("rods") or [(0.0, 0.0, 0.0)]]
    due = {"rod_radius": given.get("rod_radius"), "spindle_radius": None if head else given.get("spindle_radius"),
           "spindle": list(given.get("spindle", (0.0, 1.0))), "rail_radius": given["rail_radius"] if rails else None,
           "rail_offset": [list(leg.get("rail_offset", (0.0, 0.0, 0.0))) for leg in legs.values()] if rails else None,
           "rail_ends": [list(leg["rail_ends"]) for leg in legs.values()] if rails else None,
           **{f"{end}_angle": None if given.get(f"{end}_angle") is None else math.radians(given[f"{end}_angle"])
              for end in ("carriage", "platform")}, **_in_the_middle(geometry, kinematics["workspace"])}
    stated = geometry["parts"]
    if [one["leg"] for one in stated["rods"]] != [one["leg"] for one in rods] or not all(
            _same(a["shift"], b["shift"]) for a, b in zip(rods, stated["rods"], strict=True)):
        raise Rejected("its rods are not those of the machine file")
    for what, value in due.items():
        if not _same(value, stated[what]):
            raise Rejected(f"{what} is {stated[what]}, by the machine file {value}")


def _in_the_middle(geometry: dict[str, Any], space: dict[str, Any]) -> dict[str, Any]:
    """Rods and platform joints in the middle of the workspace, as level as the platform can be."""
    low, high = (math.radians(v) for v in space.get("tilt", (0.0, 0.0)))
    number = [0.5 * sum(space[axis]) for axis in "xyz"] + [min(max(0.0, low), high), 0.0]
    pose = pose_of(geometry, np.zeros(3), [ball(np.array([v])) for v in number])
    at = legs_in(geometry, np.zeros(3), pose)
    turn = np.array([[x.m[0] for x in carried(geometry, np.zeros(3), pose, e, True, False)[0]] for e in np.eye(3)])
    rods = np.array([[x.m[0] for x in rod] for rod in at.rods])
    return {"middle": rods.tolist(), "middle_ends": [[float(x.m[0]) for x in end] for end in at.ends],
            "level": (rods @ turn.T).tolist()}


def _of_file(leg: dict[str, Any], axis: dict[str, Any], drive: str, side: tuple[float, float],
             bars: dict[str, Any]) -> dict[str, Any]:
    """What the certificate says of a leg; `side` is round the ring of a layout."""
    bar: dict[str, Any] = {}
    if bars:
        name = leg.get("bar")
        own = list(leg.get("joint", (0, 0, 0)))
        bar = {"bar": list(bars).index(name) if name else -1, "kept": own if name else [0.0] * 3,
               "joint": list(bars[name]["hinge"]) if name else own}
    rods: list[Any] = leg.get("rods") or []
    apart = float(leg.get("pair") or 0.0)
    pair = np.subtract(rods[0], rods[1]).tolist() if len(rods) == 2 else [apart * side[0], apart * side[1], 0.0]
    return {"drive": leg.get("drive", "slide"), "point": list(leg.get("slide", leg.get("point", (0, 0, 0)))),
            "direction": _unit(leg.get("direction", (0, 0, 1))), "arm": list(leg["arm"]) if drive == "arm" else [0.0] * 3,
            "joint": list(leg.get("joint", (0, 0, 0))), "rod": leg["rod"], "root": leg.get("root", 1), "pair": pair,
            "travel": _travel(axis, drive), **bar, **({"ring": leg["ring"]} if leg.get("ring") else {})}


def _held(kinematics: dict[str, Any], legs: dict[str, dict[str, Any]]) -> dict[str, list[dict[str, Any]]]:
    """Planes of the bed and of the platform by which passive legs, hinges and rings hold it."""
    size = max([1.0, *(math.hypot(*leg.get("joint", (0.0, 0.0, 0.0))) for leg in legs.values())])
    bed, platform = list[dict[str, Any]](), list[dict[str, Any]]()
    for one in kinematics.get("passive", {}).values():
        line, hinge = np.array(_unit(one.get("line", (0.0, 0.0, 1.0)))), np.array(_unit(one["hinge"]))
        inner = np.cross(line, hinge)
        bed.append({"normal": hinge, "point": [0.0] * 3, "joint": size * inner, "moves": 0.0})
        platform += [{"across": u, "through": one["point"], "apart": float(u @ np.array(one.get("joint", (0.0, 0.0, 0.0))))}
                     for u in (inner, np.cross(line, inner))]
    bed += [{"normal": _unit(leg["hinge"]), "point": leg.get("slide", leg.get("point")), "joint": leg["joint"], "moves": 1.0}
            for leg in legs.values() if leg.get("hinge")]
    if any(leg.get("ring") for leg in legs.values()):
        bed.append({"normal": (0.0, 1.0, 0.0), "point": [0.0] * 3, "joint": (size, 0.0, 0.0), "moves": 0.0})
    return {"bed": [_plain(one) for one in bed], "platform": [_plain(one) for one in platform]}


def _plain(table: dict[str, Any]) -> dict[str, Any]:
    return {key: np.asarray(v, np.float64).tolist() for key, v in table.items()}


def _sides(kinematics: dict[str, Any]) -> dict[str, tuple[float, float]]:
    """Unit vectors round the ring of a layout, by letter."""
    layout = kinematics.get("layout", {"letters": ()})
    names = layout["letters"]
    angles = layout.get("angles") or [360.0 * k / len(names) for k in range(len(names))]
    return {name: (-math.sin(math.radians(v)), math.cos(math.radians(v))) for name, v in zip(names, angles, strict=True)}


def _travel(axis: dict[str, Any], drive: str) -> list[float | None]:
    travel = axis.get("travel", "unlimited")
    if isinstance(travel, str):
        return [None, None]
    return [float(v) * (math.pi / 180.0 if drive == "arm" else 1.0) for v in travel]


def _of_platform(kinematics: dict[str, Any]) -> dict[str, Any]:
    if "freedoms" in kinematics:
        return {"freedoms": sorted(kinematics["freedoms"], key="xyzabc".index),
                "gauge": list(kinematics.get("gauge", (0, 0, 0)))}
    tilts = "rotary" in kinematics
    return {"freedoms": list("xyza" if tilts else "xyz"), "gauge": [0.0, 0.0, -float(kinematics.get("gauge", 0.0))]}


def _whole(found: dict[str, Any], kinematics: dict[str, Any]) -> None:
    """A certificate of the whole workspace has the workspace as its region."""
    if found["covers"] != "workspace":
        return
    region, space = found["region"], kinematics["workspace"]
    free = "xyzabc" if held(found["geometry"]) else found["geometry"]["freedoms"]
    moves = {*free, *("z" for one in found["geometry"]["carriers"] if one["direction"][2])}
    low, high = space.get("tilt", (0.0, 0.0))
    heading = [0.0, 2.0 * math.pi] if moves >= set("abc") and high > 0.0 else [0.0, 0.0]
    due = {"x_mm": space["x"], "y_mm": space["y"], "z_mm": space["z"] if "z" in moves else [0.0, 0.0],
           "tilt_rad": [math.radians(low), math.radians(high)], "heading_rad": heading, "of": "platform"}
    if not all(_same(v, region[k]) for k, v in due.items()):
        raise Rejected("it is said to cover the declared workspace, and its region is another")


def _unit(v: Any) -> list[float]:
    size = math.sqrt(sum(float(x) ** 2 for x in v))
    return [float(x) / size for x in v]


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, str) or a is None or isinstance(b, str) or b is None:
        return bool(a == b)
    if isinstance(a, dict):
        return isinstance(b, dict) and set(a) == set(b) and all(_same(v, b[k]) for k, v in a.items())
    if isinstance(a, (list, tuple)):
        return isinstance(b, list) and len(a) == len(b) and all(_same(x, y) for x, y in zip(a, b, strict=True))
    return abs(float(a) - float(b)) <= NEAR * max(1.0, abs(float(a)))
