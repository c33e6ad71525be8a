"""Forms of machine files of others."""

from __future__ import annotations

from typing import Literal

MachineForm = Literal["linuxcnc-ini", "siemens", "freecad", "heidenhain", "fusion", "fusion-xml"]
"""files that are known by their text"""
GivenForm = Literal["auto", "linuxcnc-ini", "siemens", "freecad", "heidenhain", "fusion", "fusion-xml"]
"""as an option"""
ExportForm = Literal["linuxcnc-ini"]
"""files that are written"""
