"""A machine from LinuxCNC's INI and the HAL files that it names.

Lengths are in the units of [TRAJ] LINEAR_UNITS, angles in degrees, times in s: velocities are per second, not per minute.
Source: "INI Configuration", LinuxCNC 2.9 (sections KINS, TRAJ, AXIS, JOINT).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

from machines.exchange.draft import Draft
from machines.exchange.ini_file import HalFiles, IniEntry, IniFile, read_ini
from machines.exchange.linuxcnc_kins import COORDINATES, NOT_OURS, ON_LEGS, UNREAD_PINS, PinReader, put_geometry
from machines.kinematics.chain import ROTARY
from toolpaths.units import MM_PER_INCH

LINEAR_UNITS = {"mm": 1.0, "metric": 1.0, "in": MM_PER_INCH, "inch": MM_PER_INCH, "imperial": MM_PER_INCH}
ANGULAR_UNITS = ("deg", "degree")
OWN = "POSTPROC"
"""section of an INI with what LinuxCNC has no key for; it passes over sections that it does not know"""
_STRUCTURE_HINT = ("state it: section [POSTPROC] with STRUCTURE = w A' b X Y Z (C1) t, POINT_A = 0 0 0 and so on, or --set "
                   "\"kinematics.structure=w A' b X Y Z (C1) t\" --set kinematics.axes.A.point=[0,0,0]")
_KEYS = {"velocity": "MAX_VELOCITY", "acceleration": "MAX_ACCELERATION", "jerk": "MAX_JERK"}


def read_linuxcnc(path: Path, text: str, stated: Sequence[str]) -> tuple[Draft, dict[str, bool]]:
    """The draft of a machine file, and its axes: True for rotary ones."""
    ini = read_ini(path, text)
    return _IniMachine(ini, Draft(str(path), stated)).read()


class _IniMachine:
    def __init__(self, ini: IniFile, draft: Draft) -> None:
        self.ini, self.draft = ini, draft
        words = self._words("KINS", "KINEMATICS")
        self.module = words[0] if words else ""
        given = [word.partition("=")[2] for word in words if word.lower().startswith("coordinates=")]
        self.order = (given[0] if given else COORDINATES.get(self.module, "")).upper()
        self.hal = HalFiles(ini)
        self.unset: dict[str, float] = {}
        """pins that nothing sets in what was read, and what LinuxCNC has for them"""
        draft.found += ini.found
        self.scale = 1.0

    def _words(self, section: str, key: str) -> list[str]:
        entry = self.ini.first(section, key)
        return entry.value.split() if entry else []

    def read(self) -> tuple[Draft, dict[str, bool]]:
        """Everything, or the first thing that makes it no machine of ours."""
        if not (self._is_ours() and self._units()):
            return self.draft, {}
        letters = self._letters()
        if len(linear := [letter for letter in letters if letter not in ROTARY]) != 3:
            self.draft.error("import.geometry", f"the linear axes are {', '.join(linear) or 'none'}: machines of three are "
                             "read, no lathes, cutters of sheets or foam", self._line("TRAJ", "COORDINATES")[0])
            return self.draft, {}
        name = self.ini.first("EMC", "MACHINE")
        if name:
            self.draft.put(("description",), name.value, name.line, name.said, name.file)
        else:
            self.draft.made(("description",), f"from {self.ini.path.name}", "")
        self._geometry(letters)
        caps = {"velocity": self._cap("VELOCITY"), "acceleration": self._cap("ACCELERATION")}
        for letter in letters:
            self._axis(letter, caps)
        self._largest_feed(letters, caps["velocity"])
        self._own(letters)
        return self.draft, {letter: letter in ROTARY for letter in letters}

    def _is_ours(self) -> bool:
        entry = self.ini.first("KINS", "KINEMATICS")
        if entry is None:
            self.draft.error("import.kinematics", "no [KINS] KINEMATICS: this is no INI of LinuxCNC 2.8 or later",
                             hint="let LinuxCNC's update_ini convert an older one")
            return False
        why = NOT_OURS.get(self.module, "" if self.module in COORDINATES else
                           f"it is not among those known here: {', '.join(COORDINATES)}")
        if why:
            self.draft.error("import.kinematics", f"{entry.said}: {why}", entry.line, file=entry.file,
                             hint='write a machine file of kind = "legs" with its struts or arms, as hexapod is, and run '
                             "trivkins: programs hold the positions of the drives then" if self.module in ON_LEGS else
                             "postproc machine new asks for the geometry itself")
            return False
        if any(word.lower().startswith("sparm=identityfirst") for word in entry.value.split()):
            self.draft.warning("import.kinematics", f"{entry.said}: the control begins without {self.module}", entry.line,
                            "switch it on before every program (motion.switchkins-type), or take sparm out", entry.file)
        return True

    def _units(self) -> bool:
        linear, angular = self.ini.first("TRAJ", "LINEAR_UNITS"), self.ini.first("TRAJ", "ANGULAR_UNITS")
        unit = linear.value.split()[0].lower() if linear and linear.value else ""
        per_mm = linear.number if linear is not None else None
        if linear is None or (unit not in LINEAR_UNITS and not (per_mm and per_mm > 0.0)):
            self.draft.error("import.unit", f"{linear.said}: not a unit" if linear else "no [TRAJ] LINEAR_UNITS",
                             linear.line if linear else 0, f"write one of {', '.join(LINEAR_UNITS)}")
            return False
        words = angular.value.lower().split()[:1] if angular is not None else []
        if angular is not None and words and words[0] not in ANGULAR_UNITS and angular.number != 1.0:
            self.draft.error("import.unit", f"{angular.said}: angles are read in degrees only", angular.line,
                             "write ANGULAR_UNITS = degree, and all angles in degrees", angular.file)
            return False
        self.scale = LINEAR_UNITS[unit] if unit in LINEAR_UNITS else 1.0 / float(per_mm or 1.0)
        return True

    def _letters(self) -> list[str]:
        """Axes of the machine: those of [TRAJ] COORDINATES; of the modules' extra letters none that our chains have not."""
        coordinates = "".join(self._words("TRAJ", "COORDINATES")).upper() or self.order
        letters = [letter for letter in "XYZUVWABC" if letter in coordinates and letter in self.order]
        if self.module == "lineardeltakins":
            letters = [letter for letter in letters if letter in "XYZ"]
        if self.module == "5axiskins" and "W" in letters:
            letters.remove("W")
            entry = self.ini.first("TRAJ", "COORDINATES") or self.ini.first("KINS", "KINEMATICS")
            assert entry is not None
            self.draft.warning("import.axis", "W lengthens the tool under 5axiskins: it is left out, no program moves it, "
                               "and it must stand at 0", entry.line, "", entry.file)
        return letters

    def _geometry(self, letters: list[str]) -> None:
        own = self.ini.first(OWN, "STRUCTURE")
        if self.module != "trivkins":
            self.draft.put(("control", "module"), self.module, *self._line("KINS", "KINEMATICS"))
            for name in UNREAD_PINS:
                value, word = self.hal.pin(f"{self.module}.{name}")
                if word is not None and value != 0.0:
                    self.draft.error("import.pin", f"{' '.join(word.words)} is not read: the geometry is that of 0 there",
                                     word.line, "", word.file)
            put_geometry(self.draft, self.module, PinReader(self._pin, self.scale))
            self._say_unset()
            return
        self.draft.made(("kinematics", "kind"), "serial", "")
        if own is not None:
            self.draft.put(("kinematics", "structure"), own.value, own.line, own.said, own.file)
        elif not set(letters) & set(ROTARY) and "kinematics.structure" not in self.draft.stated:
            self.draft.made(("kinematics", "structure"), f"w b {' '.join(letters)} (C1) t", "")
        elif "kinematics.structure" not in self.draft.stated:
            turning = " and ".join(sorted(set(letters) & set(ROTARY)))
            self.draft.error("import.geometry", f"trivkins says which axes there are, not where the lines of {turning} "
                             "are and what they carry", self._line("KINS", "KINEMATICS")[0], _STRUCTURE_HINT)

    def _say_unset(self) -> None:
        """Of all pins at once: a HAL file that was not read is one cause."""
        if self.unset:
            names, files = ", ".join(self.unset), ", ".join(entry.value for entry in self.hal.unread)
            first, values = next(iter(self.unset)), ", ".join(f"{value:g}" for value in self.unset.values())
            some = len(self.unset) > 1
            self.draft.warning("import.pin", f"{names} {'are' if some else 'is'} set nowhere in what was read, so "
                               f"LinuxCNC's {values} {'count' if some else 'counts'}; {files} was not read",
                               self.hal.unread[0].line,
                               f"compare with halcmd getp {first}, and state what differs: --set {first}=VALUE")

    def _line(self, section: str, key: str) -> tuple[int, str, str]:
        entry = self.ini.first(section, key)
        return (entry.line, entry.said, entry.file) if entry else (0, "", "")

    def _pin(self, name: str, default: float) -> tuple[float, int, str, str]:
        """A pin of the module by its last name: set by the user, in HAL, or LinuxCNC's default."""
        pin = f"{self.module}.{name}"
        user = self.draft.user(pin)
        if isinstance(user, float):
            return user, 0, f"{pin} = {user:g}, stated by the user", ""
        value, word = self.hal.pin(pin)
        if word is not None and value is None:
            self.draft.error("import.pin", f"{pin} is driven by {' '.join(word.words)}, whose value does not stand in the "
                             "file", word.line, f"state it: --set {pin}=VALUE", word.file)
        elif word is None and self.hal.unread:
            self.unset[pin] = default
        if word is None or value is None:
            return default, 0, f"LinuxCNC's default of {pin}", ""
        return value, word.line, " ".join(word.words), word.file

    def _entries(self, letter: str, key: str) -> Iterator[IniEntry]:
        """Of all joints of a letter, and of the axis where its values are the joint's."""
        sections = [f"JOINT_{k}" for k, other in enumerate(self.order) if other == letter]
        tips = self.module != "trivkins" and letter in "XYZ"
        for section in [*sections, *([] if tips else [f"AXIS_{letter}"])]:
            if entry := self.ini.first(section, key):
                yield entry

    def _tightest(self, letter: str, key: str, least: bool) -> tuple[float, IniEntry] | None:
        found = [(entry.number, entry) for entry in self._entries(letter, key)]
        for value, entry in found:
            if value is None:
                self.draft.error("import.number", f"{entry.said} is not a number", entry.line, "write a number", entry.file)
        numbers = [(value, entry) for value, entry in found if value is not None]
        if not numbers:
            return None
        best = (min if least else max)(numbers, key=lambda one: one[0])
        other = next((entry for value, entry in numbers if value != best[0]), None)
        if other is not None:
            self.draft.info("import.tighter", f"{other.said} and {best[1].said}: the tighter one counts", other.line,
                            other.file)
        return best

    def _axis(self, letter: str, caps: dict[str, IniEntry | None]) -> None:
        turns = letter in ROTARY
        scale = 1.0 if turns else self.scale
        for name, key in _KEYS.items():
            found = self._tightest(letter, key, least=True)
            cap = None if turns else caps.get(name)
            if cap is not None and cap.number is not None and (found is None or cap.number < found[0]):
                found = (cap.number, cap)
            if found:
                self.draft.put(("axes", letter, name), found[0] * scale, found[1].line, found[1].said, found[1].file)
        self._travel(letter, scale)
        home = next((e for e in self._entries(letter, "HOME") if e.number is not None), None)
        if home is not None:
            self.draft.put(("axes", letter, "home"), (home.number or 0.0) * scale, home.line, home.said, home.file)

    def _travel(self, letter: str, scale: float) -> None:
        low, high = self._tightest(letter, "MIN_LIMIT", least=False), self._tightest(letter, "MAX_LIMIT", least=True)
        wrapped = self.ini.first(f"AXIS_{letter}", "WRAPPED_ROTARY")
        path = ("axes", letter, "travel")
        if wrapped is not None and wrapped.number:
            self.draft.put(path, "unlimited", wrapped.line, wrapped.said, wrapped.file)
            self.draft.put(("axes", letter, "modulo"), True, wrapped.line, wrapped.said, wrapped.file)
        elif low and high:
            self.draft.put(path, [low[0] * scale, high[0] * scale], low[1].line, f"{low[1].said}, {high[1].said}",
                           low[1].file)
        elif letter in ROTARY and not low and not high:
            self.draft.made(path, "unlimited", "no MIN_LIMIT, no MAX_LIMIT")
        elif (low or high) and not self._not_a_number(letter):
            entry = (low or high or (0.0, None))[1]
            self.draft.error("import.travel", f"axis {letter} has {entry.said if entry else ''} and no other end",
                             entry.line if entry else 0, "write MIN_LIMIT and MAX_LIMIT")

    def _not_a_number(self, letter: str) -> bool:
        """True where an end of travel is written and has been said to be no number."""
        return any(entry.number is None for key in ("MIN_LIMIT", "MAX_LIMIT") for entry in self._entries(letter, key))

    def _cap(self, what: str) -> IniEntry | None:
        entry = self.ini.first("TRAJ", f"MAX_LINEAR_{what}")
        return entry if entry is not None and entry.number else None

    def _largest_feed(self, letters: list[str], cap: IniEntry | None) -> None:
        """[TRAJ] MAX_LINEAR_VELOCITY limits the tool's speed: a largest feed where the axes together could exceed it."""
        speeds = [self.draft.values[path].value for letter in letters if letter in "XYZ"
                  if (path := ("axes", letter, "velocity")) in self.draft.values]
        together = math.hypot(*(s for s in speeds if isinstance(s, float)))
        if cap is not None and cap.number and cap.number * self.scale < together * (1 - 1e-9):
            self.draft.put(("control", "largest_feed"), cap.number * self.scale * 60.0, cap.line, cap.said, cap.file)

    def _own(self, letters: list[str]) -> None:
        """[POSTPROC]: what LinuxCNC has no key for, in mm, degrees and s."""
        for letter in letters:
            for key, name in (("POINT", "point"), ("DIRECTION", "direction")):
                self._vector(f"{key}_{letter}", ("kinematics", "axes", letter, name))
        for letter in "xyz":
            self._vector(f"WORKSPACE_{letter.upper()}", ("kinematics", "workspace", letter))
        self._vector("TOOL_AXIS", ("kinematics", "tool_axis"))
        for key in ("tool_change", "clamp", "unclamp"):
            if (entry := self.ini.first(OWN, key.upper())) and entry.number is not None:
                self.draft.put(("timing", key), entry.number, entry.line, entry.said, entry.file)
        if (entry := self.ini.first(OWN, "LARGEST_FEED")) and entry.number:
            self.draft.put(("control", "largest_feed"), entry.number, entry.line, entry.said, entry.file)
        if entry := self.ini.first(OWN, "RETRACT_AXIS"):
            self.draft.put(("retract_axis",), entry.value, entry.line, entry.said, entry.file)
        elif "Z" in letters and self.module != "lineardeltakins":
            self.draft.made(("retract_axis",), "Z", "")
        entry = self.ini.first(OWN, "ASSUMED")
        for name in entry.value.split() if entry else ():
            path = ("timing", name.removeprefix("timing.")) if name.startswith("timing.") else ("axes", *name.split("."))
            if path in self.draft.values:
                self.draft.assumed.append(path)
        if self.module == "lineardeltakins":
            self._workspace()

    def _vector(self, key: str, path: tuple[str, ...]) -> None:
        entry = self.ini.first(OWN, key)
        if entry is None:
            return
        try:
            self.draft.put(path, [float(word) for word in entry.value.split()], entry.line, entry.said, entry.file)
        except ValueError:
            self.draft.error("import.number", f"{entry.said} is not a list of numbers", entry.line, "write x y z with "
                             "blanks between them", entry.file)

    def _workspace(self) -> None:
        """Of a Delta the box of [AXIS_X] ... limits: they are of the tip there."""
        for letter in "XYZ":
            ends = [self.ini.first(f"AXIS_{letter}", key) for key in ("MIN_LIMIT", "MAX_LIMIT")]
            values = [entry.number * self.scale for entry in ends if entry is not None and entry.number is not None]
            path = ("kinematics", "workspace", letter.lower())
            if len(values) == 2 and ends[0] is not None and path not in self.draft.values:
                self.draft.put(path, values, ends[0].line, ends[0].said, ends[0].file)
