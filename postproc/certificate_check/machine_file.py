"""Whether a certificate is about a machine file: its hash, and the geometry that is read without the project's loader."""

from __future__ import annotations

import json
import math
from hashlib import sha256
from typing import Any

import numpy as np

from postproc.certificate_check.check import Rejected
from postproc.witness.machine import legs_of

NEAR = 1e-9
"""mm, or parts of one"""
LEFT_OUT = {"clearance", "assumed", "source", "family"}


def hash_of(table: dict[str, Any]) -> str:
    """The hash of a machine file's merged values, as certificates have it."""
    kinematics = dict(table.get("kinematics", {}))
    kept = {"kind": kinematics.get("family"), **{k: v for k, v in kinematics.items() if k not in LEFT_OUT}}
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
    kinematics, geometry = table["kinematics"], found["geometry"]
    _plain(kinematics)
    if found["region"]["of"] == "tip" and kinematics.get("rotary", {}).get("carries") == "spindle":
        raise Rejected("an axis between platform and spindle moves the tip about: only the platform's places are proved")
    own, given = legs_of(kinematics), geometry["legs"]
    if list(own) != [leg["letter"] for leg in given]:
        raise Rejected(f"it has legs {[leg['letter'] for leg in given]}, the machine file {list(own)}")
    sides = _sides(kinematics)
    for (letter, leg), one in zip(own.items(), given, strict=True):
        for what, value in _of_file(leg, table["axes"][letter], one["drive"], sides.get(letter, (0.0, 0.0))).items():
            proved = what != "travel" or found["travel_proved"] is True
            if proved and not _same(value, one[what]):
                raise Rejected(f"{what} of leg {letter} is {one[what]}, in the machine file {value}")
    for what, value in _of_platform(kinematics).items():
        if not _same(value, geometry[what]):
            raise Rejected(f"{what} is {geometry[what]}, in the machine file {value}")
    carriers = {one["letter"]: one for one in geometry["carriers"]}
    if len(carriers) != len(geometry["carriers"]) or set(carriers) != set(kinematics.get("carriers", {})):
        raise Rejected(f"it has carriers {[one['letter'] for one in geometry['carriers']]}, the machine file "
                       f"{list(kinematics.get('carriers', {}))}")
    for letter, carrier in kinematics.get("carriers", {}).items():
        due = {"direction": _unit(carrier["direction"]), "travel": _travel(table["axes"][letter], "slide")}
        if letter not in carriers or not all(_same(v, carriers[letter][k]) for k, v in due.items()):
            raise Rejected(f"carrier {letter} is another in the machine file")
    _whole(found, kinematics)


def _plain(kinematics: dict[str, Any]) -> None:
    """Machines that the geometry of a certificate cannot describe are proved by none."""
    freedoms = set(kinematics.get("freedoms", "xyz"))
    for what, there in (("a platform with bars", kinematics.get("bars")),
                        ("a platform that turns about z alone", freedoms & set("abc") == {"c"}),
                        ("a platform carried twice", kinematics.get("carriers") and freedoms >= set("xyz"))):
        if there:
            raise Rejected(f"the machine file is of {what}: no certificate of this form describes it")


def _of_file(leg: dict[str, Any], axis: dict[str, Any], drive: str, side: tuple[float, float]) -> dict[str, Any]:
    """What the certificate says of a leg; `side` is round the ring of a layout."""
    rods: list[Any] = leg.get("rods") or []
    apart = float(leg.get("pair") or 0.0)
    pair = np.subtract(rods[0], rods[1]).tolist() if len(rods) == 2 else [apart * side[0], apart * side[1], 0.0]
    return {"drive": leg.get("drive", "slide"), "point": list(leg.get("slide", leg.get("point", (0, 0, 0)))),
            "direction": _unit(leg.get("direction", (0, 0, 1))), "arm": list(leg["arm"]) if drive == "arm" else [0.0] * 3,
            "joint": list(leg.get("joint", (0, 0, 0))), "rod": leg["rod"], "root": leg.get("root", 1), "pair": pair,
            "travel": _travel(axis, drive)}


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
    moves = {*found["geometry"]["freedoms"], *("z" for one in found["geometry"]["carriers"] if one["direction"][2])}
    low, high = space.get("tilt", (0.0, 0.0))
    heading = [0.0, 2.0 * math.pi] if "c" in moves and high > 0.0 else [0.0, 0.0]
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
    if isinstance(a, (list, tuple)):
        return isinstance(b, list) and len(a) == len(b) and all(_same(x, y) for x, y in zip(a, b, strict=True))
    return abs(float(a) - float(b)) <= NEAR * max(1.0, abs(float(a)))
