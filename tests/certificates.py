"""Certificates of all built-in machines, as the package has them: `python tests/certificates.py` writes and checks them.

With names of machines it prints their rows of the table alone: boxes, seconds, margins proved, seconds of the check, and how
many boxes the proof of III.7 and that of annex D of Company 2000 need.
"""

from __future__ import annotations

import json
import resource
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

import machines
from machines.analysis.certify import Wanted, certify
from machines.analysis.certify_chain import WantedOfChain, certify_chain
from machines.certificate.lookup import SHIPPED
from machines.loader import builtin
from postproc.certificate_check.chains import chain_confirmed
from postproc.certificate_check.check import confirmed as checked

MARGINS = {"hexapod": 0.1, "hexaslide-cone": 0.1, "h4-rotary": 0.05}
"""where half of the least would make a large file"""

LARGE_FILES = ("linuxcnc-pentapod",)
"""of which a proof takes more than 100 000 boxes: `machine certify --margin 0.01` has it in a minute and a half"""


def of_chains() -> list[str]:
    """Built-in machines that are one chain of axes."""
    return [name for name in builtin() if machines.load(name).kinematics.chain]


def on_legs() -> list[str]:
    """Built-in machines whose platform hangs on legs, but for those whose certificate is too large to ship."""
    return [name for name in builtin()
            if name not in LARGE_FILES and machines.load(name).kinematics.leg_geometry is not None]


def seconds() -> float:
    """Of this process."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_utime


def made(name: str) -> tuple[str, dict[str, Any]]:
    """(certificate, its figures) of a built-in machine."""
    machine = machines.load(name)
    if machine.kinematics.chain:
        chain = certify_chain(machine, WantedOfChain())
        return chain.text, chain.figures
    found = certify(machine, Wanted(margin=MARGINS.get(name)))
    return found.text, found.figures


def row(name: str) -> tuple[str, dict[str, Any]]:
    """(certificate, its row of the table): boxes, seconds, margins proved, seconds of the check, boxes of older proofs."""
    before = seconds()
    text, figures = made(name)
    after, content = seconds(), json.loads(text)
    confirmed = (chain_confirmed if "chain" in content else checked)(content)
    keys = ("margin", "proved_direct", "proved_inverse", "proved_held", "travel_proved", "travel_left_mm", "parts_apart_mm",
            "stops_apart_deg", "lipschitz_squares_of_a_slice", "lipschitz_squares_halved", "annex_d_boxes_of_a_grid",
            "annex_d_boxes_halved_about")
    return text, {"key": figures["key"], "boxes": figures["boxes"], "seconds": round(after - before, 2),
                  "check_seconds": round(seconds() - after, 2), "check_boxes": confirmed["looked_at"]} | {
                      key: figures[key] for key in keys if figures.get(key) is not None}


def main(names: list[str]) -> None:
    """Print the table, of machines named or of all; of all they are written, and those that were there removed."""
    if not names:
        for old in SHIPPED.glob("*.json"):
            old.unlink()
    for name in names or [*of_chains(), *on_legs()]:
        text, figures = row(name)
        if not names:
            (SHIPPED / f"{figures['key']}.json").write_text(text, encoding="utf-8")
        print(f"{name}: " + ", ".join(f"{key} {value}" for key, value in figures.items() if key != "key"), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
