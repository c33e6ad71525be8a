"""Eight hex digits of what a set-up says, so that a program can be compared with the set-up that it was written with."""

from __future__ import annotations

import hashlib
import json
from functools import cache
from pathlib import Path

from postproc.setup.files import file_keys, value_at
from postproc.setup.model import TOOL_LIMITS, SetupFile
from toolpaths.input_files import read_input

DIGITS = 8
_ASIDE = {"description", "placement", "assumed", "machine"}
"""keys that change no word of a program: what `place` may choose from, which values nobody has stated, the machine
that it is for"""
_LATER: tuple[tuple[str, ...], ...] = (
    ("hooks",), ("output", "stop_between_tools"), ("output", "program_number"), ("output", "program_name"),
    ("clearance", "index"), ("output", "units"), ("output", "smoothing"), ("output", "rapids_as_feed"),
    ("places",), ("order",), ("clearance", "between"), ("clearance", "in_plane"), ("joints", "spin"), ("joints", "carriers"),
    ("orientation", "criteria"), ("orientation", "cone"), ("orientation", "operations"))
"""keys that set-ups have not always had: at their defaults they are left out, so that programs keep their fingerprint"""
_LATER_OF_TOOLS = (*TOOL_LIMITS, "compensation", "contour", "called", "keeps_spin", "cutting_force")
"""likewise, of each tool"""


_defaults = cache(lambda: SetupFile().model_dump(mode="json"))
"""of a set-up"""


def fingerprint(setup: SetupFile, file: str) -> str:
    """The same for set-ups that say the same, whatever their names, comments, bases, order and folders.

    Meshes count by what they hold, not by their names. `file` is that of the set-up, whose folder meshes are named from.
    """
    values = setup.model_dump(mode="json", exclude=_ASIDE)
    for path in _LATER:
        if value_at(values, path) == value_at(_defaults(), path):
            del value_at(values, path[:-1])[path[-1]]
    for tool in values["tools"].values():
        for name in _LATER_OF_TOOLS:
            if not tool[name]:
                del tool[name]
    for key in file_keys(values):
        try:
            data = read_input(Path(file).parent / str(value_at(values, key)))
        except OSError:  # said where the mesh is read
            continue
        value_at(values, key[:-1])[key[-1]] = hashlib.sha256(data).hexdigest()
    text = json.dumps(values, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:DIGITS]
