"""What all tests, their workers and the commands that they start run under; imported before numpy is."""

from __future__ import annotations

import os
import sys

# Threads of small matrix products wait for each other by turning round: half of the suite's processor time.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Where bytecode is not kept, every worker and every command compiles the whole project again.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False
