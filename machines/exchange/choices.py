"""Forms of machine files of others."""

from __future__ import annotations

from typing import Literal

MachineForm = Literal["linuxcnc-ini"]
"""files that are read"""
GivenForm = Literal["auto", "linuxcnc-ini"]
"""as an option"""
ExportForm = Literal["linuxcnc-ini"]
"""files that are written"""
