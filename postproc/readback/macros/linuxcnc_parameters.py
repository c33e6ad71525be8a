"""Parameters of LinuxCNC: numbered and named ones, and those of the system that follow from program and set-up."""

from __future__ import annotations

from dataclasses import dataclass, field

from postproc.readback.macros.expressions import MacroFault
from postproc.readback.macros.held import Held
from postproc.readback.macros.sources import SourceFile
from postproc.readback.macros.track import NO_LENGTH
from postproc.readback.macros.word_blocks import Blocks

_AXES = "XYZABCUVW"
_OFFSETS = (54.0, 55.0, 56.0, 57.0, 58.0, 59.0, 59.1, 59.2, 59.3)
_LAST_OF_USER = 5000
_LOCAL = 30
_MODES = {"_METRIC": (6, 21), "_IMPERIAL": (6, 20), "_ABSOLUTE": (3, 90), "_INCREMENTAL": (3, 91), "_INVERSE_TIME": (5, 93),
          "_UNITS_PER_MINUTE": (5, 94), "_UNITS_PER_REV": (5, 95)}


@dataclass
class OLevel:
    """A program or subprogram that runs: its file, the next row, its own parameters, repeats that are left by label."""

    source: SourceFile
    at: int
    local: dict[int, float] = field(default_factory=dict)
    named: dict[str, float] = field(default_factory=dict)
    left: dict[str, int] = field(default_factory=dict)


class Parameters:
    """Values by number or name; numbers to 30 and names without _ belong to the subprogram that runs."""

    def __init__(self, blocks: Blocks, held: Held) -> None:
        self.blocks, self.held = blocks, held
        self.numbered: dict[int, float] = {}
        self.named: dict[str, float] = {}

    def get(self, place: int | str, level: OLevel) -> float:
        """Its value; numbers of the user that were never set are 0."""
        if isinstance(place, str):
            return self._name(place, level)
        if 1 <= place <= _LOCAL:
            return level.local.get(place, 0.0)
        if place <= _LAST_OF_USER or place in self.numbered:
            return self.numbered.get(place, 0.0)
        return self._system(place)

    def put(self, place: int | str, value: float, level: OLevel) -> None:
        """A parameter set."""
        if isinstance(place, str):
            (self.named if place.startswith("_") else level.named)[place] = value
        elif 1 <= place <= _LOCAL:
            level.local[place] = value
        elif 1 <= place <= _LAST_OF_USER:
            self.numbered[place] = value
        else:
            raise MacroFault("gcode.variable", f"#{place} is the control's own: it is not set here", "write G10, or G92")

    def exists(self, place: int | str, level: OLevel) -> bool:
        """True where a parameter has a value."""
        if isinstance(place, int):
            return 1 <= place <= _LAST_OF_USER
        return place in (self.named if place.startswith("_") else level.named) or place in _MODES

    def returned(self, value: float | None) -> None:
        """What a subprogram gives back."""
        self.named["_VALUE"] = 0.0 if value is None else value
        self.named["_VALUE_RETURNED"] = float(value is not None)

    def _name(self, name: str, level: OLevel) -> float:
        held = (self.named if name.startswith("_") else level.named).get(name)
        if held is not None:
            return held
        track = self.blocks.track
        if len(name) == 2 and name[1] in self.held.axes:
            return track.position(name[1]) / track.scale(name[1])
        if name in ("_VALUE", "_VALUE_RETURNED"):
            return 0.0
        if name in _MODES:
            group, code = _MODES[name]
            if group in self.blocks.state:
                return float(self.blocks.state[group] == code)
        if name in ("_FEED", "_RPM") and name[1].replace("R", "S") in self.blocks.state:
            return self.blocks.state[name[1].replace("R", "S")]
        raise MacroFault("gcode.variable", f"#<{name.lower()}> is read before the program sets it",
                         f"set it first, in a copy of the program: #<{name.lower()}> = ...")

    def _system(self, place: int) -> float:
        track = self.blocks.track
        if 5420 <= place <= 5428 and _AXES[place - 5420] in self.held.axes:
            axis = _AXES[place - 5420]
            return track.position(axis) / track.scale(axis)
        if place == 5220 and track.register in _OFFSETS:
            return float(_OFFSETS.index(track.register) + 1)
        if 5211 <= place <= 5216:
            return track.zero[_AXES[place - 5211]] / track.scale(_AXES[place - 5211])
        if 5221 <= place <= 5386 and (place - 5221) % 20 < 6 and _AXES[(place - 5221) % 20] in self.held.axes:
            register, axis = _OFFSETS[(place - 5221) // 20], _AXES[(place - 5221) % 20]
            return track.offset(register, axis) / track.scale(axis)
        if place == 5400 and "T" in self.blocks.state:
            return self.blocks.state["T"]
        if place == 5403 and track.length is not None:
            drawn = 0.0 if track.length == NO_LENGTH else self.held.lengths.get(track.length,
                                                                                0.0) + track.lengthened[track.length]
            return drawn / track.unit
        raise MacroFault("gcode.variable", f"#{place} is not read: what it holds is not in the program, nor in the set-up",
                         "put the figure that the control would find there in its place, in a copy of the program")
