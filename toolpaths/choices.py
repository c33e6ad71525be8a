"""Closed lists of words about files that are read and drawn. Light: the command line reads it."""

from __future__ import annotations

from typing import Literal, NewType

LengthUnit = Literal["mm", "inch"]
"""what the numbers of a file are"""
GivenUnit = Literal["", "mm", "inch"]
"""asked for; "" as the file says"""
DialectName = Literal["generic", "nx", "makino", "creo", "solidworks", "solidworks-clt", "tlaxis", "catia", "ncl",
                      "camplete", "mfgsuite", "autodesk-iso", "hsmworks", "surfcam", "nci", "freecad", "step-nc"]
GivenDialect = Literal["", DialectName]
"""asked for; "" as the file is recognised"""
ShopName = NewType("ShopName", str)
"""under which an installed package registers a CL dialect or a CL reader"""
CubicPieces = Literal["", "pieces", "uniform"]
"""splines as cubics: not, piece by piece, or as cubics with equal knots"""
FigureEnding = Literal[".png", ".svg"]
FieldEnding = Literal[".csv", FigureEnding]
"""of a table, or of a figure"""
CycleKind = Literal["DRILL", "DEEP", "BRKCHP", "TAP", "BORE", "BORE7", "BORE8", "BORE9", "REAM", "FACE", "CSINK", "THRU",
                    "MILL", "REVERS", "SHIFT", "CIRCUL", "THREAD"]
"""of drilling cycles, by the word of the CL file that says most"""
