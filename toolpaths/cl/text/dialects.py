"""The systems that write CL files: how to recognise each, and in what their records differ."""

from __future__ import annotations

from enum import Enum

from toolpaths.choices import DialectName, LengthUnit
from toolpaths.cl.text.statements import COMMENT, DATA_COMMENT, Statement, StatementList
from toolpaths.dataclass import dataclass
from toolpaths.units import MM_PER_INCH


class Planes(Enum):
    """How a CYCLE states the planes above a hole: c by CLEAR or by place, r by RAPTO, d the depth.

    Four are those of Autodesk's posts for APT (onCycle and onCyclePoint of "CAMplete APT" and "MANUSnc APT",
    "Common ISO 4343 APT", "MfgSuite APT", "Generative Machining APT"), which take c from the clearance height
    of the operation.
    """

    RELATIVE = "the GOTO is the hole's top; the tool starts r above it, or c where r is not stated"
    HEIGHTS = "the GOTO is the hole's top; the tool starts r above it and goes back to the height c over the origin"
    BOTTOM = "the GOTO is the hole's bottom; the tool starts at the height c - r over the origin and goes back to c"
    DOWN = "the GOTO is the hole's top; the tool starts c - r above it and goes back to c"
    OVER_BOTTOM = "the GOTO is the hole's top, c counts from its bottom; the tool starts c - r above that, goes back to c"


@dataclass(frozen=True)
class Dialect:
    """What a system means where systems differ.

    Attributes:
        arc_sense: +1 the vector of CIRCLE is right-hand, -1 left-hand, 0 the word at its end decides
        full_circles: an arc that ends where it starts is a whole turn
        depth_sign: -1 where depths below the hole's top are written negative
        six_common: points with six numbers are in the common frame, three in the local one, whose z is then their axis
        insert_is_comment: INSERT is for people
        rotabl_radians: angles of ROTABL are rad
        frame_turns: ROTABL turns the frame of the points by its angle, not the table
        tlaxis_upright: each TLAXIS begins with the frame upright, whatever ROTABL has left behind
        table_frames: under ROTATE and TRANS points stand about the rotation axis (`indexing`)
        axis_reset: the axis is the local z again at each operation
        six_sizes: CUTTER may have six numbers
        eleven_clockwise: a CIRCLE of eleven numbers, NX's own form which others have taken over, goes clockwise as there;
            True in systems that write fewer numbers themselves
        cycles_by_table: numbers of cycles without words stand in the order of a table that shops change
        operations_in_comments: comments name the operations
        trntyp_begins: TRNTYP begins an operation, which has no name
        multax_off_keeps: behind MULTAX/OFF points of three numbers keep the last axis
        views_absolute: MCS is taken where it is the absolute system alone: no source says whether points count in it or not
        planes: how cycles state their planes
    """

    name: DialectName
    title: str
    arc_sense: int = 1
    full_circles: bool = True
    depth_sign: int = 1
    six_common: bool = False
    insert_is_comment: bool = False
    rotabl_radians: bool = False
    frame_turns: bool = False
    tlaxis_upright: bool = False
    table_frames: bool = False
    axis_reset: bool = False
    six_sizes: bool = False
    eleven_clockwise: bool = False
    cycles_by_table: bool = False
    operations_in_comments: bool = False
    trntyp_begins: bool = False
    multax_off_keeps: bool = False
    views_absolute: bool = False
    planes: Planes = Planes.RELATIVE


DIALECTS: dict[DialectName, Dialect] = {d.name: d for d in (
    Dialect("generic", "APT text", six_sizes=True, eleven_clockwise=True),
    Dialect("nx", "Siemens NX", arc_sense=-1, full_circles=False, depth_sign=-1, axis_reset=True),
    Dialect("makino", "Makino FF/CAM", arc_sense=-1, full_circles=False),
    Dialect("creo", "PTC Creo", six_common=True, table_frames=True),
    Dialect("solidworks", "SolidWorks CAM .apt", six_common=True, insert_is_comment=True, eleven_clockwise=True,
            trntyp_begins=True),
    Dialect("solidworks-clt", "SolidWorks CAM .clt", arc_sense=0, six_common=True, insert_is_comment=True,
            rotabl_radians=True, frame_turns=True),
    Dialect("tlaxis", "SolidWorks CAM .clt without closing ROTABL", arc_sense=0, six_common=True, insert_is_comment=True,
            rotabl_radians=True, frame_turns=True, tlaxis_upright=True),
    Dialect("catia", "CATIA", cycles_by_table=True, operations_in_comments=True, multax_off_keeps=True),
    Dialect("ncl", "NCL", six_sizes=True),
    Dialect("camplete", "Autodesk APT for CAMplete or MANUSnc", arc_sense=-1, planes=Planes.HEIGHTS),
    Dialect("mfgsuite", "Autodesk APT for MfgSuite", planes=Planes.DOWN),
    Dialect("autodesk-iso", "Autodesk Common ISO 4343 APT", planes=Planes.BOTTOM),
    Dialect("hsmworks", "HSMWorks Generative Machining APT", planes=Planes.OVER_BOTTOM),
    Dialect("surfcam", "SURFCAM (INC2APT)", eleven_clockwise=True, views_absolute=True),
    Dialect("nci", "Mastercam NCI"),
    Dialect("freecad", "FreeCAD"),
    Dialect("step-nc", "STEP-NC of ISO 14649"),
)}

_MAJORS: tuple[tuple[DialectName, tuple[str, ...]], ...] = (
    ("camplete", ("MCS",)),
    ("mfgsuite", ("MCSYS",)),
    ("solidworks-clt", ("MOVE_ATTRIB", "OPFEATSTART", "OPFEATEND", "BOX")),
    ("solidworks", ("CSI_SET_FLUTE_LENGTH", "CSI_SET_EXTENSION_LENGTH", "TRNTYP", "SETUP")),
    ("nx", ("TOOL PATH", "END-OF-PATH", "TLDATA", "MSYS", "PAINT")),
    ("ncl", ("INDIRP",)),
    ("catia", (COMMENT + "*CATIA0", "TLON,GOFWD", "INDIRV", "AUTOPS", "PSIS", "TOOLNO")),
    ("creo", ("CAMERA", "PPWORD")),
)
_TEXTS: tuple[tuple[DialectName, str], ...] = (("makino", "MAKINO-FF"), ("surfcam", "SURFCAM INC"), ("makino", "FF/CAM"),
          ("catia", "CATIA"), ("solidworks", "CAMWORKS"),
          ("catia", "TOOLCHANGEBEGINNING"), ("nx", "CENTERLINE DATA"),
          ("ncl", "NCL"), ("ncl", "NCLCAM"), ("creo", "PRO/NC"), ("creo", "PRO/CLFILE"), ("creo", "CREO"))
_NAMED = ("makino", "surfcam")
"""systems that write words of others, and their own name in each file"""
_OTHERS = ("HYPERMILL", "POWERMILL", "CIMATRON", "TOPSOLID", "SOLIDCAM", "ESPRIT", "GIBBSCAM", "RHINOCAM", "BOBCAD")
"""systems whose APT text is that of a shop's post, with words of ISO 4343"""
_STANDARD = ("TLON,GOFWD", "INDIRV", "AUTOPS", "PSIS", "TOOLNO")
"""words of ISO 4343 that say CATIA where no other system is named"""
OWN = DATA_COMMENT + "TOOLPATH"
"""Mark of the text that `write` makes."""


def detect(program: StatementList) -> tuple[Dialect, str]:
    """(dialect, evidence): by the words that only one system writes, in order of how sure they are."""
    majors: dict[str, int] = {}
    for statement, line in program.first.items():
        majors.setdefault(statement.major, line)
        if statement.major == COMMENT and statement.body.startswith("*CATIA0"):
            majors.setdefault(COMMENT + "*CATIA0", line)
    if OWN in majors:
        return DIALECTS["generic"], f"{OWN} in line {majors[OWN]}"
    text = _by_text(program)
    if text is not None and text[0] in _NAMED:
        return DIALECTS[text[0]], text[1]
    other = None if text is not None else _by_text(program, tuple(("generic", name) for name in _OTHERS))
    named = other is not None or (text is not None and text[0] != "catia")
    sense_word = _clockwise_word(program)
    if sense_word:
        return DIALECTS["solidworks-clt"], f"CIRCLE with a sense word in line {sense_word}"
    for name, words in _MAJORS:
        for word in words:
            if word in majors and not (named and word in _STANDARD):
                return DIALECTS[name], f"{word} in line {majors[word]}"
    for major, line in majors.items():
        if major.startswith(DATA_COMMENT):
            return DIALECTS["creo"], f"{major} in line {line}"
    autodesk = _autodesk(program)
    if autodesk is not None:
        return autodesk
    if text is not None or other is not None:
        name, where = text or other or ("generic", "")
        return DIALECTS[name], where
    return DIALECTS["generic"], "no word that only one system writes"


def _clockwise_word(program: StatementList) -> int:
    for statement, line in program.first.items():
        if statement.major == "CIRCLE" and statement.has("CLOCKWISE", "COUNTERCLOCKWISE"):
            return line
    return 0


_ISO_LOADTL = 4


def _autodesk(program: StatementList) -> tuple[Dialect, str] | None:
    """Posts of Autodesk that write no word of their own: PARTNO in quotes, and the form of LOADTL; MODE in ISO 4343."""
    first = {s.major: s for s in reversed(program.first)}
    load = first.get("LOADTL")
    if load is None or "PARTNO" not in first or not first["PARTNO"].body.startswith("'"):
        return None
    line = program.first[load]
    if load.has("IN") and load.has("LENGTH") and load.has("OSETNO"):
        return DIALECTS["hsmworks"], f"LOADTL with IN, LENGTH and OSETNO in line {line}"
    if "MODE" in first and len(load.numbers) == len(load.words) == _ISO_LOADTL:
        return DIALECTS["autodesk-iso"], f"MODE, PARTNO in quotes and LOADTL of four numbers in line {line}"
    return None


def _by_text(program: StatementList,
             texts: tuple[tuple[DialectName, str], ...] = _TEXTS) -> tuple[DialectName, str] | None:
    """A system named in a comment, PARTNO, MACHIN or PPRINT; the first of `texts` that is there."""
    found: dict[str, tuple[DialectName, str]] = {}
    for statement, line in program.first.items():
        if statement.major in (COMMENT, "PARTNO", "MACHIN", "PPRINT", "REMARK"):
            body = statement.body.upper()
            for name, text in texts:
                if text in body and text not in found and _whole(body, text):
                    found[text] = (name, f'"{text}" in line {line}')
    for _, text in texts:
        if text in found:
            return found[text]
    return None


def _whole(body: str, text: str) -> bool:
    at = body.find(text)
    end = at + len(text)
    return (at == 0 or not body[at - 1].isalnum()) and (end == len(body) or not body[end].isalpha())


UNIT_WORDS: dict[str, LengthUnit] = {
    "MM": "mm", "INCH": "inch", "INCHES": "inch", "IN": "inch", "MILLIMETER": "mm", "MILLIMETERS": "mm", "METRIC": "mm",
    "ENGLISH": "inch"}
_FEED_UNITS: dict[str, LengthUnit] = {
    "MMPM": "mm", "MMPR": "mm", "IPM": "inch", "IPR": "inch", "FPM": "inch", "FPR": "inch"}
SCALE: dict[LengthUnit, float] = {"mm": 1.0, "inch": MM_PER_INCH}


@dataclass(frozen=True)
class FileUnits:
    """What a file says of its units: by the word UNITS, and by the units of its feeds."""

    words: dict[LengthUnit, int]
    feeds: dict[LengthUnit, int]
    wrong: tuple[tuple[str, int], ...] = ()


def units_said(program: StatementList) -> FileUnits:
    """Unit words and feed units with their first lines."""
    words: dict[LengthUnit, int] = {}
    feeds: dict[LengthUnit, int] = {}
    wrong: list[tuple[str, int]] = []
    for statement, line in program.first.items():
        if statement.major in ("UNITS", "UNIT"):
            unit = next((UNIT_WORDS[w] for w in statement.words if isinstance(w, str) and w in UNIT_WORDS), None)
            if unit is None:
                wrong.append((statement.body, line))
            else:
                words.setdefault(unit, line)
        elif statement.major in ("FEDRAT", "CYCLE"):
            _note_feed_unit(statement, line, feeds)
    return FileUnits(words, feeds, tuple(wrong))


def _note_feed_unit(statement: Statement, line: int, feeds: dict[LengthUnit, int]) -> None:
    for word in statement.words:
        if isinstance(word, str) and word in _FEED_UNITS:
            feeds.setdefault(_FEED_UNITS[word], line)
