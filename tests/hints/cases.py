"""All cases of the law of hints."""

from __future__ import annotations

from tests.hints.align_cases import ALIGN
from tests.hints.batch_cases import BATCH
from tests.hints.calibration_cases import CALIBRATION
from tests.hints.cl_cases import CL
from tests.hints.cl_word_cases import CL_WORDS
from tests.hints.convert_cases import CONVERT
from tests.hints.design_cases import DESIGN
from tests.hints.error_cases import ERRORS
from tests.hints.exchange_cases import EXCHANGE
from tests.hints.file_cases import FILE
from tests.hints.gcode_cases import GCODE
from tests.hints.import_cases import IMPORTS
from tests.hints.machine_cases import MACHINE
from tests.hints.macro_cases import MACROS
from tests.hints.orient_cases import ORIENT
from tests.hints.own_room_cases import OWN_ROOMS
from tests.hints.package_cases import PACKAGES
from tests.hints.passed_late_cases import PASSED_LATE
from tests.hints.passed_on_cases import PASSED_ON
from tests.hints.place_cases import PLACE
from tests.hints.rare_cases import RARE
from tests.hints.tool_cases import TOOLS
from tests.hints.verify_cases import VERIFY

CASES = [*CL, *IMPORTS, *CL_WORDS, *MACHINE, *TOOLS, *CONVERT, *GCODE, *ERRORS, *FILE, *ALIGN, *PLACE, *VERIFY, *EXCHANGE,
         *OWN_ROOMS, *MACROS, *BATCH, *DESIGN, *PACKAGES, *CALIBRATION, *RARE, *PASSED_ON, *PASSED_LATE, *ORIENT]
_NUMBERED = {f"{case.code}-{k}": case for k, case in enumerate(CASES)}
OF_MACHINES = {name: case for name, case in _NUMBERED.items()
               if case.command.split()[0] in ("machine", "errors", "calibrate", "orient", "time")}
OF_PROGRAMS = {name: case for name, case in _NUMBERED.items() if name not in OF_MACHINES}
"""by their names"""
