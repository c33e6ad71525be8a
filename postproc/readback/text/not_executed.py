"""Words of controls that are refused on purpose, by name and with what to do: contours that a control works out itself, and
frames that the reader has not. Looked for where a row is at fault, so that programs that are read pay nothing.

Names: SINUMERIK 840D Programming Manual Fundamentals (ANG, CHF, CHR, RND, RNDM) and Job Planning (FRAME, $P_UIFR, PROC);
Fanuc B-63534EN (G51 scaling, G51.1 mirror image, optional angle chamfering, corner rounding); Haas Mill Operator's Manual
96-8210 (G12, G13, G47, G51, G100, G101, G112, G150); TNC 640 Conversational Programming (cycle 26, APPR, DEP,
RND, CHF, FK).
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from toolpaths.diagnostics import Diagnostic, Severity, error
from toolpaths.pattern import pattern

CONTOUR = "write the contour with the end points of its lines and arcs, as a CAM system does"
POINTS = "write the points as they are meant, without the frame"
SMOOTHING = 'name it with the mm that it may take in [smoothing_words] of the controller file: "G61.1,K3" = 0.003'
FIGURES = ("put the figures into the program: what the control's tables hold is not known here; the datum stands in the "
           "set-up")
FRAME = "write TRANS, ROT, SCALE or MIRROR in the place of the frame variable"
OWN_FILE = "put the subprogram into a file of its own, NAME.SPF next to the program"
_CONTOUR_RULES = ((r"APPR\b|DEP\b", "APPR or DEP", CONTOUR), (r"RND\b", "RND", CONTOUR), (r"CHF\b", "CHF", CONTOUR),
                  (r"F(?:L|C|LT|CT|POL|SELECT)\b", "FK programming", CONTOUR), (r"CT\b", "CT", CONTOUR))
_RULES: dict[str, tuple[tuple[str, str, str], ...]] = {
    "siemens": ((r"(?<![A-Z0-9_$])ANG\d?[ \t]*=", "ANG", CONTOUR),
                (r"(?<![A-Z0-9_$])(?:CHF|CHR)[ \t]*=", "CHF or CHR", CONTOUR),
                (r"(?<![A-Z0-9_$])RNDM?[ \t]*=", "RND or RNDM", CONTOUR), (r"\$P_UIFR", "$P_UIFR", FIGURES),
                (r"\bFRAME\b|(?<![A-Z0-9_$])C(?:TRANS|ROT|SCALE|MIRROR|FINE)[ \t]*\(|\$P_[A-Z]*FRAME",
                 "a frame variable", FRAME)),
    "fanuc": ((r"G0*61\.\d[ \t]*,", "G61.1 or G61.2 with a word behind a comma", SMOOTHING),
              (r",[ \t]*[CRA]", "a chamfer, a rounded corner or an angle behind a comma", CONTOUR)),
    "klartext": (*((rf"^[ \t]*\d*[ \t]*(?:{words})", name, hint) for words, name, hint in _CONTOUR_RULES),
                 (r"CYCL DEF 26\b", "cycle 26 (axis-specific scaling)", POINTS)),
}
_RULES["haas"] = (*_RULES["fanuc"], (r"G0*10[01](?![.\d])", "G100 or G101 (mirror image)", POINTS),
                  (r"G0*1[23](?![.\d])", "G12 or G13 (circular pocket)", CONTOUR),
                  (r"G0*47(?![.\d])", "G47 (engraving)", CONTOUR),
                  (r"G0*11[23](?![.\d])", "G112 (polar interpolation)", CONTOUR),
                  (r"G0*150(?![.\d])", "G150 (pocket)", CONTOUR))
_UNREAD = frozenset({"gcode.syntax", "gcode.unknown_code", "gcode.unknown_word", "gcode.cycle", "gcode.expression",
                     "gcode.variable", "gcode.mode"})
_PROC = pattern(r"^[ \t]*(?:N\d+[ \t]*)?PROC[ \t]+([A-Z_][A-Z0-9_]*)", re.MULTILINE)
_COMMENT = {"siemens": r";.*", "klartext": r";.*", "fanuc": r"\([^)]*\)", "haas": r"\([^)]*\)"}


def named(found: Sequence[Diagnostic], data: bytes, language: str, file: str) -> list[Diagnostic]:
    """The diagnostics of a file, those of rows with a word that is refused on purpose in its own terms, once for each.

    Args:
        language: of the dialect ("siemens"); others than those above stay as they are
    """
    if language not in _RULES or not any(d.code in _UNREAD and d.severity is Severity.ERROR for d in found):
        return list(found)
    text = data.decode("latin-1").upper()
    rows, made = text.splitlines(), dict[str, Diagnostic]()
    inside = set(_PROC.findall(text)) if language == "siemens" else set[str]()
    for k, one in enumerate(found):
        row = rows[one.lines[0] - 1] if one.lines and one.file == file and 0 < one.lines[0] <= len(rows) else ""
        why = _why(re.sub(_COMMENT[language], "", row), language, inside)
        if one.severity is not Severity.ERROR or one.code not in _UNREAD or why is None:
            made[str(k)] = one
            continue
        name, hint = why
        before = made.get(name)
        lines = sorted({*one.lines, *(before.lines if before else ())})
        made[name] = error("gcode.not_executed", f"{name} is not executed", file=file, lines=lines[:6],
                           count=one.count + (before.count if before else 0), hint=hint)
    return list(made.values())


def _why(row: str, language: str, inside: set[str]) -> tuple[str, str] | None:
    """(name, what to do) of a word in a row; None where it has none."""
    for words, name, hint in _RULES[language]:
        if re.search(words, row):
            return name, hint
    called = next((name for name in sorted(inside) if re.search(rf"\b{name}\b", row)), None)
    return None if called is None else (f"PROC {called} behind another program in one file", OWN_FILE)
