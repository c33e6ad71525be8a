"""Write every CL sample and expected_counts.json: python samples/make_samples.py [FOLDER]."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import orientation
import prismatic
import surfaces
import tilting_platform

SAMPLES = {
    "pocket.cls": prismatic.pocket,
    "five_faces.cls": prismatic.five_faces,
    "five_tilted.cls": prismatic.five_tilted,
    "indexed_4axis.cls": prismatic.indexed_4axis,
    "inch_plate.apt": prismatic.inch_plate,
    "blade.cls": surfaces.blade,
    "bicubic.cls": surfaces.bicubic,
    "test_part.cls": orientation.test_part,
    "tool_axis_tour.apt": surfaces.tour,
    "h4a_dome.cls": tilting_platform.h4a_dome,
    "h4a_indexed.cls": tilting_platform.h4a_indexed,
}


def main(folder: Path) -> None:
    """Write the samples and what a reader must find in them into `folder`."""
    expected = {}
    for name, make in SAMPLES.items():
        text, expected[name] = make()
        (folder / name).write_bytes(text.encode("ascii"))
    (folder / "expected_counts.json").write_bytes((json.dumps(expected, indent=1) + "\n").encode("ascii"))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
