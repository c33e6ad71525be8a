"""The vocabulary: which major words the reader knows, and what becomes of each.

Words with a handler of their own are listed where they are handled (`HANDLERS` of motion, feeds, frames,
tools, cycles and structure). Here stand the words that need none.
"""

from __future__ import annotations

TEXT_WORDS = ("PARTNO", "PPRINT", "INSERT", "REMARK", "TPRINT", "LPRINT", "PPLABEL", "LETTER")
"""Free text follows, with or without a slash; it may hold any character."""

EVENTS: dict[str, str] = {
    "SPINDL": "speed and sense as in the file: rev/min with RPM, surface speed with SFM or SMM",
    "COOLNT": "words as in the file",
    "CUTCOM": "words as in the file; a plain number is a register",
    "DELAY": "seconds, or revolutions where REV follows",
    "STOP": "none; its text is a PPRINT before it",
    "OPSTOP": "none; its text is a PPRINT before it",
    "OPSKIP": "ON or OFF",
    "DELETE": "another word for OPSKIP",
    "SEQNO": "numbers as in the file",
    "PREFUN": "number of the G function",
    "AUXFUN": "number of the M function, NOW or NEXT",
    "MODE": "as in the file",
    "SELECT": "tool number to prepare",
    "UNLOAD": "as in the file",
    "SELCTL": "as in the file",
    "SELECTL": "another spelling of SELCTL",
    "OFSTNO": "register",
    "CLAMP": "as in the file",
    "RETRCT": "as in the file; lengths mm",
    "CLEARP": "as in the file; lengths mm",
    "CLRSRF": "as in the file; lengths mm",
    "REWIND": "as in the file",
    "BREAK": "as in the file",
    "CHECK": "as in the file",
    "LEADER": "length mm",
    "HEAD": "as in the file",
    "POD": "as in the file",
    "AIR": "as in the file",
    "SLOWDN": "as in the file",
    "END": "none",
}
"""Records without motion that become an Event, and what its values hold. Also events, from their own
handlers: LOADTL (tool number, then the length register where the file names one), ROTATE, ROTABL and ROTHED
    (as in the file),
PPRINT and INSERT (one text), GOHOME without a point (none), FEDRAT/INVERS,AUTO or OFF (the words)."""

LENGTH_EVENTS = frozenset({"RETRCT", "CLEARP", "CLRSRF", "LEADER"})
"""Events whose numbers are lengths: converted to mm."""

_REASONS = {
    "display": "PAINT DISPLY PLOT PPLOT OVPLOT DRAFT CLPRNT BOX",
    "listing and punching of APT systems": "PRINT PUNCH TITLES EJECT RESERV NOPOST PLABEL LPRINT PPLABEL LETTER REMARK "
                                           "PARTNO PROGRM MDWRIT MDEND MAGTAP INTCOD TMARK LIBRY REDEF "
                                           "CANON VERIFY",
    "vocabulary and settings of another post-processor": "PPWORD PPFUN SYN MACHIN ISN ARCSLP OPERATION BEGIN START "
                                                         "TOOLPATH_TYPE OPTYPE DMIS MAXDPM MAXVEL POSMAP REGBRK PIVOTZ",
    "bookkeeping of the CAM system": "OPFEATEND MOVE_ATTRIB SETUP START_OP END_OP MATERL MATLNO CSI_SET_PATH_PARAM "
                                     "CSI_SET_EXTENSION_LENGTH OPERTN SEQUENCE PART_OPE PROGRAM MACHINE CATPROCESS "
                                     "CATPRODUCT",
    "sizes of the tool by the user's table; CUTTER has them": "TDATA",
    "tolerances of a path that is computed already": "INTOL OUTTOL OUTOL TOLER TOLTBL LINTOL MCHTOL PPTOL MCHFIN THICK "
                                                     "CSI_PATH_TOLERANCE NUMPTS MAXDP MAXANG",
    "part surface of arcs that state their plane": "AUTOPS PSIS",
    "which point of the tool the lathe drives; said by the operation": "SWITCH",
    "how the control runs the axes; chosen by the set-up": "ALIGN TCP RTCP CUT",
    "the same work plane again, for another post-processor": "MCS2",
}
NEUTRAL: dict[str, str] = {word: reason for reason, words in _REASONS.items() for word in words.split()}
"""Words that neither move the tool nor say anything to the machine, and why."""
SILENT = frozenset(NEUTRAL) - {"PARTNO", "MACHIN", "LPRINT", "PPLABEL", "LETTER", "REMARK"}
"""Those of them that need no handler."""

UNSUPPORTED_MOTION = frozenset({
    "DNTCUT", "COPY", "TRACUT", "GOFWD", "GOLFT", "GORGT", "GOBACK", "GOUP", "GODOWN", "GO",
    "MOVNRB", "THREAD", "POCKET", "SCURV", "RMILL", "SMILL", "FMILL", "CALL", "INDEX",
    "MACRO", "LOOPST", "LOOPND", "JUMPTO", "TLLFT", "TLRGT", "TLON", "MOVETO", "KNOT", "CNTRL",
    "ARCDAT", "ARC", "CONT", "MOVE", "MIRROR", "XFORM", "MATRIX", "BSPLINE", "SPLINE", "ELLIPS",
})
"""Words that move the tool or change how it moves, and that this reader does not carry out: an error."""

BARE_STARTS = frozenset({"RAPID", "FINI", "END-OF-PATH", "GOHOME", "STOP", "OPSTOP", "END"})
"""Words that begin a new statement even without a slash."""

BARE_WORDS = BARE_STARTS | {"MULTAX", "ENDSUB", "AUTOPS", "NURBS"}
"""Words that stand alone in a line; a line that continues another is none of them."""
