"""A file that ends in a cut: the retract behind it is a rapid on every control, also where it is written as a feed move."""

from __future__ import annotations

import pytest

import toolpaths
from tests.postproc.kit import convert, good

CONTROLS = ("fanuc-30i", "haas-ngc", "heidenhain-tnc640", "siemens-840d", "linuxcnc", "generic-iso")
CUT = ("PARTNO RIM\nUNITS/MM\nLOADTL/1\nSPINDL/RPM,18000,CLW\nFEDRAT/MMPM,600\nRAPID\nGOTO/10,0,50,0,.5,.8660254\n"
       "GOTO/10,0,5,0,.5,.8660254\nGOTO/30,0,5,0,.5,.8660254\n")


@pytest.mark.covering(count=3)
@pytest.mark.parametrize("control", CONTROLS)
def test_the_retract_is_no_cut(control: str) -> None:
    good(convert(toolpaths.read_bytes(CUT + "FINI\n")[0], "fork-head-ab", control))
    good(convert(toolpaths.read_bytes(f"{CUT}LOADTL/2\n{CUT[CUT.index('RAPID'):]}FINI\n")[0], "fork-head-ab", control))
