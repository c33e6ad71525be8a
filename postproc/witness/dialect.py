"""Which system wrote a CL file, and what its records mean where systems differ."""

from __future__ import annotations

from dataclasses import dataclass

from postproc.witness.text import Record

INCH = 25.4


@dataclass(frozen=True)
class WitnessDialect:
    """`sense` of the vector of CIRCLE: 1 right-hand, -1 left-hand, 0 by a word; `depth`: -1 where depths are negative;
    `local_three`: points of three numbers are in the local system along its z, of six in the common one."""

    name: str
    sense: int = 1
    depth: int = 1
    whole: bool = True
    local_three: bool = False
    axis_back: bool = False
    unread: bool = False


GENERIC = WitnessDialect("generic")
ALL = {d.name: d for d in (
    GENERIC, WitnessDialect("nx", -1, -1, whole=False, axis_back=True), WitnessDialect("makino", -1, whole=False),
    WitnessDialect("creo", local_three=True), WitnessDialect("solidworks", local_three=True),
    WitnessDialect("solidworks-clt", 0, local_three=True), WitnessDialect("tlaxis", 0, local_three=True),
    *(WitnessDialect(name) for name in ("catia", "ncl", "surfcam", "nci", "freecad", "step-nc")),
    *(WitnessDialect(name, unread=True) for name in ("camplete", "mfgsuite", "autodesk-iso", "hsmworks", "own")))}
_WORDS = {
    "own": ("$$->TOOLPATH",), "camplete": ("MCS",), "mfgsuite": ("MCSYS",),
    "solidworks-clt": ("MOVE_ATTRIB", "OPFEATSTART", "BOX"),
    "solidworks": ("CSI_SET_FLUTE_LENGTH", "CSI_SET_EXTENSION_LENGTH", "TRNTYP", "SETUP"),
    "nx": ("TOOL PATH", "END-OF-PATH", "TLDATA", "MSYS", "PAINT"), "ncl": ("INDIRP",),
    "catia": ("CATIA0", "TLON,GOFWD", "INDIRV", "AUTOPS", "PSIS", "TOOLNO"), "creo": ("CAMERA", "PPWORD"),
}
_OTHERS = ("HYPERMILL", "POWERMILL", "CIMATRON", "TOPSOLID", "SOLIDCAM", "ESPRIT", "GIBBSCAM", "RHINOCAM", "BOBCAD")
_SCALE = {"MM": 1.0, "MILLIMETER": 1.0, "MILLIMETERS": 1.0, "METRIC": 1.0, "INCH": INCH, "INCHES": INCH, "IN": INCH,
          "ENGLISH": INCH}


def dialect_of(records: list[Record], data: bytes) -> WitnessDialect:
    """By the words that only one system writes, then by its name in a text."""
    majors = {r.major for r in records}
    texts = " ".join(r.body.upper() for r in records if r.major in ("PARTNO", "MACHIN", "PPRINT", "REMARK"))
    head = data[:4000].upper().decode("latin-1") + texts
    if "$$->TOOLPATH" in majors:
        return ALL["own"]
    if "MAKINO-FF" in head or "FF/CAM" in head:
        return ALL["makino"]
    if "SURFCAM INC" in head:
        return ALL["surfcam"]
    if any(r.major == "CIRCLE" and r.has("CLOCKWISE", "COUNTERCLOCKWISE") for r in records):
        return ALL["solidworks-clt"]
    for name, words in _WORDS.items():
        if majors.intersection(words) and not (name == "catia" and "CATIA" not in head and any(o in head for o in _OTHERS)):
            return ALL[name]
    if any(m.startswith("$$->") for m in majors):
        return ALL["creo"]
    if any(r.major == "PARTNO" and r.body.startswith("'") for r in records):
        return ALL["autodesk-iso"]
    for name, text in (("catia", "CATIA"), ("catia", "TOOLCHANGEBEGINNING"), ("nx", "CENTERLINE DATA"), ("ncl", "NCL"),
                       ("creo", "PRO/NC"), ("creo", "PRO/CLFILE"), ("creo", "CREO")):
        if text in head:
            return ALL[name]
    return GENERIC


def scale_of(records: list[Record]) -> float:
    """mm per unit: by the word UNITS, else by the units of the feeds, else 1."""
    for record in records:
        if record.major in ("UNITS", "UNIT"):
            for word in record.words:
                if word in _SCALE:
                    return _SCALE[str(word)]
    feeds = {w for r in records if r.major in ("FEDRAT", "CYCLE") for w in r.words if isinstance(w, str)}
    inch, metric = feeds & {"IPM", "IPR", "FPM", "FPR"}, feeds & {"MMPM", "MMPR"}
    return INCH if inch and not metric else 1.0
