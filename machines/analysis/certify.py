"""A machine's workspace, or a box of tips in it, proved to be reached and free of singular positions."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from machines.analysis.singularity import annex_d_boxes, lipschitz_halved, lipschitz_points
from machines.certificate.certificate_file import SHARE, RegionOfPoses, certificate
from machines.certificate.clearances import PartsOfLegs, pair_names
from machines.certificate.enclosure import columns
from machines.certificate.poses import PosesOfBoxes
from machines.certificate.search import FARTHEST, GAPS, MOST, AskedProof, ProvedBoxes, Shortfall, look, prove
from machines.certificate.spans import spanned
from machines.kinematics.leg_geometry import LegGeometry
from machines.loader import values_of_machine
from machines.machine import Machine
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, DiagnosticError, error
from toolpaths.shapes import arrays
from toolpaths.units import DEG

LOOKS, HALF, LAST = 4000, 0.5, 1e4
"""random poses, of whose least value half is the margin where none is asked for; 1 / its last place"""
_WORDS: Mapping[Shortfall, str] = {
    "reach": "a leg does not reach", "travel": "a drive is outside its travel",
    "direct": "the platform yields with the drives held (distance from a direct singularity)",
    "inverse": "a rod is nearly square to the motion of its drive (distance from an inverse singularity)",
    "held": "legs and pairs of rods hardly hold the platform (least singular value of what they hold, V-4)",
    "": "", "parts": "two parts touch", "stops": "a joint is beyond its stop", "undecided": "not decided"}
FEW = 40_000
"""boxes looked at for clearances that were not asked for"""


@dataclass(frozen=True)
@arrays(box="*3")
class Wanted:
    """What is to be certified.

    Attributes:
        box: (lower, upper) of the tip at the tool's length, mm, or None for the declared workspace of the platform
        tool: mm
        margin: least distance from singular positions, free of units; None: half of the least that random poses have
        travel: whether the drives have to be inside their travel; None: where they are
        clearance: whether rods, spindle and slides have to clear each other, and joints their stops; None: where they do
    """

    box: tuple[Floats, Floats] | None = None
    tool: float = 0.0
    margin: float | None = None
    travel: bool | None = None
    clearance: bool | None = None


@dataclass(frozen=True)
class Certified:
    """A proof of a workspace: what was asked, what was found, and what stands against the travel of a drive, or
    clearances."""

    machine: Machine
    region: RegionOfPoses
    asked: AskedProof
    proved: ProvedBoxes
    outside: ProvedBoxes | None
    touching: ProvedBoxes | None = None
    held_apart: PartsOfLegs | None = None

    @property
    def wanted_parts(self) -> AskedProof:
        """What was asked before clearances were left out."""
        return replace(self.asked, parts=self.held_apart)

    @property
    def content(self) -> dict[str, Any]:
        """Of the certificate's file."""
        return certificate(self.machine.name, values_of_machine(self.machine), self.region, self.asked, self.proved)

    @property
    def text(self) -> str:
        """The certificate's file."""
        return json.dumps(self.content, indent=1) + "\n"

    @property
    def figures(self) -> dict[str, Any]:
        """Region, margins, bounds, number of boxes."""
        return _figures(self)


def certify(machine: Machine, wanted: Wanted) -> Certified:
    """The certificate.

    Raises:
        DiagnosticError: where it cannot be had, with the place and what stands against it.
    """
    legs = machine.kinematics.leg_geometry
    if legs is None:
        raise DiagnosticError([error("certificate.legs", f"no workspace of {machine.name} is proved: it is neither a chain "
                                     "of axes nor a platform that legs with joints of their own hold alone",
                                     file=machine.file)])
    if wanted.box is not None and legs.head:
        raise DiagnosticError([error("certificate.head", f"no box of tips of {machine.name} is proved: an axis between "
                                     "platform and spindle moves the tip about", file=machine.file,
                                     hint="leave --box out: the declared workspace of the platform is proved")])
    asked, region = _asked(machine, legs, wanted)
    proved = prove(asked)
    outside, touching, parts = None, None, asked.parts
    while proved.lack:
        what = proved.open or proved.lack
        if what == "travel" and wanted.travel is None and outside is None:
            outside, asked = proved, _without_travel(asked)
        elif what in GAPS and wanted.clearance is None and touching is None:
            touching, asked = proved, replace(asked, parts=None, most=MOST)
        else:
            raise DiagnosticError([_refusal(machine, asked, proved)])
        proved = prove(asked)
    return Certified(machine, region, asked, proved, outside, touching, parts)


def _without_travel(asked: AskedProof) -> AskedProof:
    legs, carriers = (np.tile([-np.inf, np.inf], (len(one), 1)) for one in (asked.travel, asked.carrier_travel))
    return replace(asked, travel=legs, carrier_travel=carriers)


def _parts(machine: Machine, legs: LegGeometry, wanted: Wanted) -> PartsOfLegs | None:
    """What is to be held apart; None where nothing is, and of a spindle that an axis between it and the platform turns."""
    placed = machine.kinematics.clearance_parts
    if wanted.clearance is False or placed is None or placed.clearance is None:
        return None
    sizes = replace(placed.clearance, spindle_radius=None) if legs.head else placed.clearance
    found = PartsOfLegs.of(sizes, placed.middle_rig())
    return found if found.any else None


def _asked(machine: Machine, legs: LegGeometry, wanted: Wanted) -> tuple[AskedProof, RegionOfPoses]:
    space = legs.workspace
    box = wanted.box or (space.lower, space.upper)
    shift = np.zeros(3) if wanted.box is None else np.array([0.0, 0.0, wanted.tool]) - legs.gauge
    high = 2.0 * np.pi if legs.tilts_everywhere and space.tilt[1] > 0.0 else 0.0
    lower, upper = np.array([*box[0], space.tilt[0], 0.0]), np.array([*box[1], space.tilt[1], high])
    endless = np.array(legs.arm)
    kept, free = _travel(machine, legs.names), np.tile([-np.inf, np.inf], (len(legs.names), 1))
    own, none = _travel(machine, legs.carrier_names), np.tile([-np.inf, np.inf], (len(legs.carrier_names), 1))
    keep = wanted.travel is not False
    asked = AskedProof(PosesOfBoxes(legs, shift), lower, upper, kept if keep else free, own if keep else none, endless, 0.0)
    margin = _margin(asked) if wanted.margin is None else wanted.margin
    whole, parts = wanted.box is None, _parts(machine, legs, wanted)
    most = FEW if parts is not None and wanted.clearance is None else MOST
    return replace(asked, margin=margin, parts=parts, most=most), RegionOfPoses(
        "platform" if whole else "tip", 0.0 if whole else wanted.tool, whole)


def _travel(machine: Machine, letters: tuple[str, ...]) -> Floats:
    at = [machine.axis_names.index(letter) for letter in letters]
    return np.stack([machine.limits.lower[at], machine.limits.upper[at]], axis=1)


def _margin(asked: AskedProof) -> float:
    """Half of the least of random poses, rounded down; at least its last place, so that a singular position is found."""
    pose = np.random.default_rng(0).uniform(asked.lower, asked.upper, (LOOKS, 5))
    at = np.nan_to_num(look(asked, spanned(pose)).at, nan=0.0)
    return max(float(np.floor(HALF * at.min() * LAST) / LAST), 1.0 / LAST)


def _refusal(machine: Machine, asked: AskedProof, proved: ProvedBoxes) -> Diagnostic:
    where = pose_words(proved.place, asked.poses.legs)
    of = "tip" if asked.poses.from_point.any() else "platform"
    if proved.lack == "undecided":
        return error("certificate.undecided", f"{proved.tried} boxes and no end, the last round {where} of the {of}: "
                     f"nothing keeps clear of the margin {asked.margin:g} by enough to prove it", file=machine.file,
                     hint="ask for a smaller --margin or a smaller --box, or leave the travel out with --no-travel, "
                     "clearances with --no-clearance")
    return error("certificate.short", f"{_short_words(asked, proved)} at {where} of the {of}", file=machine.file,
                 hint="make the workspace or --box smaller, move the drives, or ask for a smaller --margin")


def _short_words(asked: AskedProof, proved: ProvedBoxes) -> str:
    """What falls short, with its value."""
    if proved.lack == "parts" and asked.parts is not None:
        return f"{pair_names(asked.poses.legs, asked.parts)[proved.pair]}: {-proved.value:.4g} mm into each other"
    if proved.lack == "stops":
        return f"a rod is {-proved.value / DEG:.4g} degrees beyond the stop of its joint"
    due = asked.travel_margin if proved.lack == "travel" else asked.margin
    return _WORDS[proved.lack] + ("" if np.isnan(proved.value) else f" ({proved.value:.4g}, asked for {due:g})")


def _clearance_figures(of: Certified) -> dict[str, Any]:
    """What is proved of parts and stops, or the place that stands against it; {} of machines that state no parts."""
    least = of.content["proved"]
    found: dict[str, Any] = {}
    if of.asked.parts is not None:
        found["clearance_proved"] = True
        if least["parts"] < FARTHEST * SHARE:
            found["parts_apart_mm"] = least["parts"]
        if least["stops"] < FARTHEST * SHARE:
            found["stops_apart_deg"] = least["stops"] / DEG
    elif of.touching is not None:
        words = _short_words(of.wanted_parts, of.touching) if of.touching.lack in GAPS else "nothing proves them apart"
        found["clearance_proved"] = False
        found["parts_meet"] = f"{words} at {pose_words(of.touching.place, of.asked.poses.legs)}"
    return found


def pose_words(pose: Floats, legs: LegGeometry) -> str:
    """A pose (5,) mm and rad in words."""
    x, y, z, tilt, heading = pose
    words = f"x {x:.4g}, y {y:.4g}, z {z:.4g} mm"
    if legs.turns:
        words += f", tilt {tilt / DEG:.4g} degrees"
    return words + (f" towards {round(heading / DEG, 2) % 360.0:.4g}" if legs.tilts_everywhere else "")


def _figures(of: Certified) -> dict[str, Any]:
    machine, asked, content, proved = of.machine, of.asked, of.content, of.proved
    region = {key: [v / DEG for v in value] if key.endswith("_rad") else value
              for key, value in content["region"].items()}
    found: dict[str, Any] = {
        "machine": machine.name, "key": content["key"], "covers": content["covers"],
        "region": {key.replace("_rad", "_deg"): value for key, value in region.items()},
        "margin": asked.margin, "proved_direct": content["proved"]["direct"], "proved_inverse": content["proved"]["inverse"],
        "proved_held": content["proved"]["held"] if columns(asked.poses.legs)[0] != columns(asked.poses.legs)[1] else None,
        "travel_proved": content["travel_proved"], "boxes": len(proved.paths),
        "boxes_looked_at": proved.tried}
    if of.outside is not None:
        key = "outside_travel_at" if of.outside.lack == "travel" else "at_end_of_travel_at"
        found[key] = pose_words(of.outside.place, asked.poses.legs)
    found |= _clearance_figures(of)
    points = lipschitz_points(machine.kinematics, asked.margin)
    if points is not None:
        found |= {"lipschitz_squares_of_a_slice": points,
                  "lipschitz_squares_halved": lipschitz_halved(machine.kinematics, asked.margin)}
    if (annex_d := annex_d_boxes(asked.poses.legs, asked.margin)) is not None:
        found |= {"annex_d_boxes_of_a_grid": annex_d[0], "annex_d_boxes_halved_about": annex_d[1]}
    return found
