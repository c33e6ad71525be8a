"""Everything runs on numpy where there is no compiler."""

from __future__ import annotations

import subprocess
import sys
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

PROGRAM = """
import sys
sys.modules["numba"] = None
import numpy as np
from postproc.feedrate.plan import PlannerOptions, plan, plan_second_order
from postproc.feedrate.windows import Method
from tests.postproc.feedrate_kit import MIKRON, uniform, zigzag
path = zigzag(160.0)
made = plan(path, MIKRON, knots=uniform(path, 1_600).sigma)
assert made.solved and made.seconds > plan_second_order(path, MIKRON).seconds
small = plan(zigzag(60.0), MIKRON, options=PlannerOptions(strict=True))
assert small.usage().worst <= 1.0
print(f"{made.seconds:.9f} {small.seconds:.9f}")
"""


def test_plans_without_a_compiler_are_the_same() -> None:
    root = Path(__file__).parents[3]
    compiled = PROGRAM.replace('sys.modules["numba"] = None\n', "").replace("=True)", "=True, method=Method(kernel=True))")
    alone = subprocess.run([sys.executable, "-c", PROGRAM], cwd=root, capture_output=True, text=True, check=True).stdout
    with redirect_stdout(StringIO()) as here:
        exec(compiled, {})
    found = alone, here.getvalue()
    assert all(abs(float(a) / float(b) - 1.0) < 1e-6 for a, b in zip(*(text.split() for text in found), strict=True))
