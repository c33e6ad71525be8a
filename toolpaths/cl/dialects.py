"""The systems that write CL files: how to recognise each, and in what their records differ."""

from __future__ import annotations

from dataclasses import dataclass

from toolpaths.cl.statements import COMMENT, DATA_COMMENT, Program, Statement
from toolpaths.units import MM_PER_INCH


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
        axis_reset: the axis is the local z again at each operation
    """

    name: str
    title: str
    arc_sense: int = 1
    full_circles: bool = True
    depth_sign: int = 1
    six_common: bool = False
    insert_is_comment: bool = False
    rotabl_radians: bool = False
    axis_reset: bool = False


DIALECTS = {d.name: d for d in (
    Dialect("generic", "APT text"),
    Dialect("nx", "Siemens NX", arc_sense=-1, full_circles=False, depth_sign=-1, axis_reset=True),
    Dialect("makino", "Makino FF/CAM", arc_sense=-1, full_circles=False),
    Dialect("creo", "PTC Creo", six_common=True),
    Dialect("solidworks", "SolidWorks CAM .apt", six_common=True, insert_is_comment=True),
    Dialect("solidworks-clt", "SolidWorks CAM .clt", arc_sense=0, six_common=True, insert_is_comment=True,
            rotabl_radians=True),
    Dialect("catia", "CATIA"),
    Dialect("ncl", "NCL"),
)}

_MAJORS = (
    ("solidworks-clt", ("MOVE_ATTRIB", "OPFEATSTART", "OPFEATEND", "BOX")),
    ("solidworks", ("CSI_SET_FLUTE_LENGTH", "CSI_SET_EXTENSION_LENGTH", "TRNTYP", "SETUP")),
    ("nx", ("TOOL PATH", "END-OF-PATH", "TLDATA", "MSYS", "PAINT")),
    ("ncl", ("INDIRP",)),
    ("catia", (COMMENT + "*CATIA0", "TLON,GOFWD", "INDIRV", "AUTOPS", "PSIS", "TOOLNO")),
    ("creo", ("CAMERA", "PPWORD")),
)
_TEXTS = (("makino", "MAKINO-FF"), ("makino", "FF/CAM"),
          ("catia", "CATIA"), ("catia", "TOOLCHANGEBEGINNING"), ("nx", "CENTERLINE DATA"),
          ("ncl", "NCL"), ("creo", "PRO/NC"), ("creo", "PRO/CLFILE"), ("creo", "CREO"))
OWN = DATA_COMMENT + "TOOLPATH"
"""Mark of the text that `write` makes."""


def detect(program: Program) -> tuple[Dialect, str]:
    """(dialect, evidence): by the words that only one system writes, in order of how sure they are."""
    majors: dict[str, int] = {}
    for statement, line in program.first.items():
        majors.setdefault(statement.major, line)
        if statement.major == COMMENT and statement.body.startswith("*CATIA0"):
            majors.setdefault(COMMENT + "*CATIA0", line)
    if OWN in majors:
        return DIALECTS["generic"], f"{OWN} in line {majors[OWN]}"
    text = _by_text(program)
    if text is not None and text[0] == "makino":
        return DIALECTS["makino"], text[1]
    sense_word = _clockwise_word(program)
    if sense_word:
        return DIALECTS["solidworks-clt"], f"CIRCLE with a sense word in line {sense_word}"
    for name, words in _MAJORS:
        for word in words:
            if word in majors:
                return DIALECTS[name], f"{word} in line {majors[word]}"
    for major, line in majors.items():
        if major.startswith(DATA_COMMENT):
            return DIALECTS["creo"], f"{major} in line {line}"
    if text is not None:
        return DIALECTS[text[0]], text[1]
    return DIALECTS["generic"], "no word that only one system writes"


def _clockwise_word(program: Program) -> int:
    for statement, line in program.first.items():
        if statement.major == "CIRCLE" and statement.has("CLOCKWISE", "COUNTERCLOCKWISE"):
            return line
    return 0


def _by_text(program: Program) -> tuple[str, str] | None:
    """A system named in a comment, PARTNO, MACHIN or PPRINT; the first of `_TEXTS` that is there."""
    found: dict[str, tuple[str, str]] = {}
    for statement, line in program.first.items():
        if statement.major in (COMMENT, "PARTNO", "MACHIN", "PPRINT", "REMARK"):
            body = statement.body.upper()
            for name, text in _TEXTS:
                if text in body and text not in found and _whole(body, text):
                    found[text] = (name, f'"{text}" in line {line}')
    for _, text in _TEXTS:
        if text in found:
            return found[text]
    return None


def _whole(body: str, text: str) -> bool:
    at = body.find(text)
    end = at + len(text)
    return (at == 0 or not body[at - 1].isalnum()) and (end == len(body) or not body[end].isalpha())


UNIT_WORDS = {"MM": "mm", "INCH": "inch", "INCHES": "inch", "IN": "inch", "MILLIMETER": "mm", "MILLIMETERS": "mm",
              "METRIC": "mm", "ENGLISH": "inch"}
_FEED_UNITS = {"MMPM": "mm", "MMPR": "mm", "IPM": "inch", "IPR": "inch", "FPM": "inch", "FPR": "inch"}
SCALE = {"mm": 1.0, "inch": MM_PER_INCH}


@dataclass(frozen=True)
class Units:
    """What a file says of its units: by the word UNITS, and by the units of its feeds."""

    words: dict[str, int]
    feeds: dict[str, int]
    wrong: tuple[tuple[str, int], ...] = ()


def units_said(program: Program) -> Units:
    """Unit words and feed units with their first lines."""
    words: dict[str, int] = {}
    feeds: dict[str, int] = {}
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
    return Units(words, feeds, tuple(wrong))


def _note_feed_unit(statement: Statement, line: int, feeds: dict[str, int]) -> None:
    for word in statement.words:
        if isinstance(word, str) and word in _FEED_UNITS:
            feeds.setdefault(_FEED_UNITS[word], line)
