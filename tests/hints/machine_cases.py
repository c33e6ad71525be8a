"""Hints on machine files, and on TOML files of every kind."""

from __future__ import annotations

import re
from functools import cache

from machines.loader import builtin
from tests.hints.case import COMMAND, Edit, HintCase

CHECK = "machine check m.toml"


@cache
def machine_text(name: str) -> str:
    """A built-in machine file."""
    return builtin()[name].read_text("utf-8")


def changed(name: str, old: str, new: str) -> str:
    """A built-in machine file with a text in the place of another."""
    text = machine_text(name)
    assert old in text, old
    return text.replace(old, new, 1)


def _case(code: str, says: str, name: str, old: str, new: str, *does: tuple[str, str]) -> HintCase:
    """A machine file with new for old; what is done to it."""
    return HintCase(
        code, CHECK, {"m.toml": changed(name, old, new)}, says, tuple(Edit("m.toml", wrong, right) for wrong, right in does)
    )


MILL, H4A, DELTA, MIKRON = "mill-3axis", "h4a-c-table", "delta-cone", "mikron-ucp710"
SHEET = "description = 'Our mill'\nsource = 'brochure'\n" + "".join(
    f"[{letter}]\ntravel = \"500 mm\"\nrapid = \"30 m/min\"\n" for letter in "XYZ")
C_TABLE = '[axes.C]\ntravel = "unlimited"\n'
_TIMING = re.search(r"^\[timing\]\n(?:[^\[].*\n?|\n)*", machine_text(MILL), re.MULTILINE)
assert _TIMING is not None
MACHINE = [
    _case(
        "machine.axis-letter",
        "choose from (X) ",
        DELTA,
        "[kinematics.legs.X]",
        "[kinematics.legs.K]",
        ("[kinematics.legs.K]", r"[kinematics.legs.\1]"),
    ),
    HintCase(
        "machine.axis-missing",
        CHECK,
        {
            "m.toml": machine_text(MILL).replace("[axes.Y]", "[axes.Y.x]").split("[axes.Y.x]")[0]
            + "[axes.Z]"
            + machine_text(MILL).split("[axes.Z]")[1]
        },
        r"add (\[axes\.Y\]) with (travel), (velocity), (acceleration), (jerk), (home)",
        (Edit("m.toml", "[axes.Z]", r"\1\n\2 = [-400, 400]\n\3 = 500\n\4 = 3000\n\5 = 30000\n\6 = 0\n\n[axes.Z]"),),
    ),
    _case(
        "machine.axis-unknown",
        "its axes are (X, Y, Z)",
        MILL,
        "[timing]",
        "[axes.B]\ntravel = [-9, 9]\nvelocity = 9\nacceleration = 9\njerk = 9\nhome = 0\n\n[timing]",
        ("[axes.B]\ntravel = [-9, 9]\nvelocity = 9\nacceleration = 9\njerk = 9\nhome = 0\n\n", ""),
    ),
    _case(
        "machine.clamp",
        "take (clamp) out",
        MILL,
        "home = 0\n",
        'home = 0\nclamp = "M10"\nunclamp = "M11"\n',
        ('clamp = "M10"\nunclamp = "M11"\n', ""),
    ),
    _case(
        "machine.clamp",
        r'e\.g\. (clamp = "M10"), (unclamp = "M11")',
        H4A,
        C_TABLE,
        C_TABLE + 'clamp = "M10"\n',
        ('clamp = "M10"\n', r"\1\n\2\n"),
    ),
    _case(
        "machine.cutting-velocity",
        "write one that is not greater",
        MILL,
        "velocity = 500\n",
        "velocity = 500\ncutting_velocity = 600\n",
        ("cutting_velocity = 600", "cutting_velocity = 500"),
    ),
    HintCase("machine.dynamics", CHECK, {"m.toml": 'base = "linuxcnc-pentapod"\n[dynamics.axes.X]\nmass = 3\n'},
             "take .dynamics. out", (Edit("m.toml", "[dynamics.axes.X]\nmass = 3\n", ""),)),
    HintCase("machine.dynamics", CHECK, {"m.toml": 'base = "mill-3axis"\n[dynamics.axes.Q]\nmass = 3\n'},
             "its axes are X, Y, (Z)", (Edit("m.toml", "axes.Q", r"axes.\1"),)),
    HintCase("machine.dynamics", CHECK, {"m.toml": 'base = "mill-3axis"\n[dynamics]\ndown = [0, 0, -2]\n'},
             r"write a unit vector, e\.g\. (\[0, 0, -1\])", (Edit("m.toml", "[0, 0, -2]", r"\1"),)),
    HintCase("machine.dynamics", CHECK, {"m.toml": 'base = "mill-3axis"\n[dynamics.platform]\nmass = 3\n'},
             "take .dynamics.platform. out", (Edit("m.toml", "[dynamics.platform]\nmass = 3\n", ""),)),
    HintCase("machine.dynamics", CHECK, {"m.toml": 'base = "mill-3axis"\n[dynamics.axes.X]\nrods = 3\n'},
             "take (rods) out", (Edit("m.toml", "rods = 3", "mass = 3"),)),
    HintCase("machine.dynamics", CHECK, {"m.toml": 'base = "mill-3axis"\n[dynamics.axes.X]\nforce = 3\n'},
             "write (mass), inertia or rotor", (Edit("m.toml", "force = 3", r"force = 3\n\1 = 3"),)),
    HintCase("machine.stiffness", CHECK, {"m.toml": 'base = "mill-3axis"\n[stiffness]\nrod = 100\n'},
             "take (rod) out", (Edit("m.toml", "rod = 100", "drive = 100"),)),
    HintCase("machine.stiffness", CHECK, {"m.toml": 'base = "uranesx"\n[stiffness]\ndrive = 100\n'},
             r"write (rod) = \.\.\. in N/um", (Edit("m.toml", "drive = 100", r"drive = 100\n\1 = 150"),)),
    _case(
        "machine.geometry",
        "write one .*LETTER. table per leg",
        DELTA,
        "[kinematics.legs.Z]\nslide = [-325, -562.916512459885, 0]\ndirection = [-0.25, -0.4330127018922, "
        "0.866025403784439]\njoint = [0, 0, 0]\nrod = 1550\nroot = 1\n",
        "",
        (
            "[kinematics.workspace]",
            "[kinematics.legs.Z]\nslide = [-325, -562.916512459885, 0]\ndirection = [-0.25, "
            "-0.4330127018922, 0.866025403784439]\njoint = [0, 0, 0]\nrod = 1550\nroot = 1\n\n[kinematics.workspace]",
        ),
    ),
    _case(
        "machine.geometry",
        "write a unit vector",
        DELTA,
        "direction = [0.5, 0, 0.866025403784439]",
        "direction = [0.5, 0, 0.8]",
        ("direction = [0.5, 0, 0.8]", "direction = [0.5, 0, 0.866025403784439]"),
    ),
    _case(
        "machine.geometry",
        r"write (\[[-0-9., ]+\])",
        MIKRON,
        "[kinematics.axes.A]\n",
        "[kinematics.axes.A]\ndirection = [2, 0, 0]\n",
        ("[2, 0, 0]", r"\1"),
    ),
    _case(
        "machine.geometry",
        r"add (\[kinematics\.axes\.A\]) (point) = \[x, y, z\]",
        MIKRON,
        "[kinematics.axes.A]\npoint = [0, 0, 0]\n",
        "",
        ("[kinematics.axes.C]", r"\1\n\2 = [0, 0, 0]\n\n[kinematics.axes.C]"),
    ),
    _case(
        "machine.geometry",
        "from the workpiece to the tool",
        MIKRON,
        "w C' A' b X Y Z (C1) t",
        "w A' C' b X Y Z (C1) t",
        ("w A' C' b", "w C' A' b"),
    ),
    _case(
        "machine.geometry",
        "take it out",
        MIKRON,
        "[kinematics.axes.A]\n",
        "[kinematics.axes.X]\npoint = [0, 1, 0]\n\n[kinematics.axes.A]\n",
        ("[kinematics.axes.X]\npoint = [0, 1, 0]\n\n", ""),
    ),
    _case(
        "machine.geometry",
        "write tilt = .lower, upper.",
        H4A,
        "tilt = [-45, 45]",
        "tilt = [10, 45]",
        ("tilt = [10, 45]", "tilt = [-45, 45]"),
    ),
    _case(
        "machine.geometry",
        "take (pivot) out",
        H4A,
        'carries = "part"\n',
        'carries = "part"\npivot = [1, 0, 0]\n',
        ("pivot = [1, 0, 0]\n", ""),
    ),
    _case(
        "machine.geometry",
        r"(\[\[x, 0, 0\]\]) for a single rod",
        H4A,
        "rods = [[20, 0, 0]]",
        "rods = [[20, 0, 0], [-20, 0, 0]]",
        ("rods = [[20, 0, 0], [-20, 0, 0]]", "rods = [[20, 0, 0]]"),
    ),
    _case("machine.home", r"write home = ([-0-9.]+)", MILL, "home = 400", "home = 401", ("home = 401", r"home = \1")),
    _case("machine.kind", "did you mean '(serial)'", MILL, 'kind = "serial"', 'kind = "seriall"', ("seriall", r"\1")),
    _case(
        "machine.mobility",
        r"write (rods = \[\[)s(, 0, 0\], \[-)s(, 0, 0\]\])",
        H4A,
        "rods = [[180, 0, 0], [-180, 0, 0]]",
        "rods = [[0, 180, 0], [0, -180, 0]]",
        ("rods = [[0, 180, 0], [0, -180, 0]]", r"\g<1>180\g<2>180\3"),
    ),
    _case("machine.modulo", "take modulo out", MILL, "home = 0\n", "home = 0\nmodulo = true\n", ("modulo = true\n", "")),
    _case(
        "machine.modulo",
        r'write (travel = "unlimited")',
        H4A,
        C_TABLE,
        "[axes.C]\ntravel = [-200, 200]\nmodulo = true\n",
        ("travel = [-200, 200]", r"\1"),
    ),
    _case(
        "machine.modulo",
        "add (modulo = true)",
        H4A,
        C_TABLE,
        C_TABLE + 'rollover = "shortest"\n',
        ('rollover = "shortest"\n', r'rollover = "shortest"\n\1\n'),
    ),
    _case(
        "machine.modulo",
        r"(modulo_range = \[0, 360\])",
        H4A,
        C_TABLE,
        C_TABLE + 'modulo = true\nrollover = "sign"\nmodulo_range = [-180, 180]\n',
        ("modulo_range = [-180, 180]", r"\1"),
    ),
    _case(
        "machine.retract-axis",
        "choose from X, Y, (Z)",
        MILL,
        'retract_axis = "Z"',
        'retract_axis = "A"',
        ('retract_axis = "A"', r'retract_axis = "\1"'),
    ),
    _case(
        "machine.travel",
        r"write travel = \[lower, upper\]",
        MILL,
        "travel = [-500, 500]",
        'travel = "unlimited"',
        ('travel = "unlimited"', "travel = [-500, 500]"),
    ),
    _case(
        "machine.workspace",
        "make the workspace smaller",
        DELTA,
        "z = [-200, 200]",
        "z = [-200, 2000]",
        ("z = [-200, 2000]", "z = [-200, 200]"),
    ),
    _case("machine.workspace", "the rod longer", DELTA, "rod = 1550", "rod = 600", ("rod = 600", "rod = 1550")),
    _case(
        "machine.control",
        "write one that is known, or take (module) out",
        MIKRON,
        "[timing]",
        '[control]\nmodule = "trtkins"\n[timing]',
        ('module = "trtkins"\n', ""),
    ),
    _case(
        "file.missing-key",
        r"add a table (\[timing\]) with (.*) = \.\.\., (.*) = \.\.\., (.*) = \.\.\.$",
        MILL,
        _TIMING[0],
        "",
        ("", r"\n\1\n\2 = 0\n\3 = 5\n\4 = 0\n"),
    ),
    _case(
        "file.missing-key",
        r"add (kind|\[kinematics\] kind) = one of .*serial",
        MILL,
        'kind = "serial"\n',
        "",
        ("[kinematics]\n", '[kinematics]\nkind = "serial"\n'),
    ),
    _case("file.unknown-key", "did you mean '(velocity)'", MILL, "velocity = 500", "velocty = 500", ("velocty", r"\1")),
    _case("file.syntax", "text in quotes", MILL, 'retract_axis = "Z"', "retract_axis = Z", ("= Z", '= "Z"')),
    _case("machine.source", r"add (\[sources\.lost\]) with (document) and (by)", "haas-umc-750", 'source.travel = "list: ',
          'source.travel = "lost: ', ("[sources.list]", r'\1\n\2 = "our sheet"\n\3 = "maker"\n\n[sources.list]')),
    _case("machine.source", "take it out of `(assumed)`", "haas-umc-750", 'assumed = ["acceleration", ',
          'assumed = ["travel", "acceleration", ', ('["travel", ', "[")),
    _case("machine.plausible", "mm/min and deg/min are (divided) by 60", MILL, "velocity = 500", "velocity = 30000",
          ("velocity = 30000", "velocity = 500")),
    _case("machine.plausible", r"the middle of the workspace is at X ([\d.]+) mm", "delta-star", "home = 1346.997",
          "home = 800", ("home = 800", r"home = \1")),
    _case("machine.plausible", r"the workspace takes X ([\d.]+) mm to ([\d.]+) mm", "delta-star", "travel = [780, 1620]",
          "travel = [1200, 1400]", ("travel = [1200, 1400]", r"travel = [\1, \2]")),
    HintCase(
        "sheet.figure",
        "machine new s.toml -o m.toml",
        {"s.toml": SHEET.replace("30 m/min", "30")},
        "a speed is in (m/min),",
        (Edit("s.toml", '"30"', r'"30 \1"'),),
    ),
    HintCase(
        "sheet.unanswered",
        "machine new s.toml -o m.toml",
        {},
        "write (s.toml) and name it again",
        (Edit("s.toml", "", SHEET),),
    ),
    HintCase(
        "file.encoding",
        CHECK,
        {"m.toml": machine_text(MILL).replace("3-axis vertical mill", "Fr\udce4smaschine")},
        "save the file as UTF-8",
        (Edit("m.toml", "Fr\udce4s", "Fräs"),),
    ),
    HintCase(
        "file.not-found",
        "machine show mikron-ucp711",
        {},
        "did you mean '?(mikron-ucp710)",
        (Edit(COMMAND, "mikron-ucp711", r"\1"),),
    ),
    HintCase(
        "file.no-code",
        "explain travel.exceded",
        {},
        "did you mean '?(travel.exceeded)",
        (Edit(COMMAND, "travel.exceded", r"\1"),),
    ),
]
