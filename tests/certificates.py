"""Certificates of all built-in machines on legs, as the package has them: `python tests/certificates.py` writes them."""

from __future__ import annotations

import resource
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import machines
from machines.analysis.certify import Wanted, certify
from machines.analysis.certify_chain import WantedOfChain, certify_chain
from machines.certificate.lookup import SHIPPED
from machines.loader import builtin

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


def main() -> None:
    """Write them all, and print boxes, seconds of processor, what is proved."""
    for old in SHIPPED.glob("*.json"):
        old.unlink()
    for name in of_chains():
        before = resource.getrusage(resource.RUSAGE_SELF).ru_utime
        chain = certify_chain(machines.load(name), WantedOfChain())
        (SHIPPED / f"{chain.figures['key']}.json").write_text(chain.text, encoding="utf-8")
        seconds = resource.getrusage(resource.RUSAGE_SELF).ru_utime - before
        print(f"{name}: {chain.figures['boxes']} boxes, {seconds:.2f} s, travel left {chain.figures['travel_left_mm']} mm, "
              f"{chain.figures['region']}")
    for name in on_legs():
        before = resource.getrusage(resource.RUSAGE_SELF).ru_utime
        found = certify(machines.load(name), Wanted(margin=MARGINS.get(name)))
        (SHIPPED / f"{found.figures['key']}.json").write_text(found.text, encoding="utf-8")
        seconds = resource.getrusage(resource.RUSAGE_SELF).ru_utime - before
        values = ", ".join(f"{key} {found.figures[key]}" for key in (
            "margin", "proved_direct", "proved_inverse", "proved_held", "travel_proved", "parts_apart_mm",
            "stops_apart_deg") if key in found.figures)
        print(f"{name}: {found.figures['boxes']} boxes, {seconds:.2f} s, {values}")


if __name__ == "__main__":
    main()
