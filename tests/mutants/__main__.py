"""`make mutants`: plants every fault, changes written programs, and writes the table.

    python -m tests.mutants [--room TEXT] [--only TEXT] [--jobs N] [--no-tests] [--no-programs] [--json FILE] [--page FILE]
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(_name, "1")


def main() -> int:
    from tests.mutants.programs import all_programs
    from tests.mutants.report import as_dict, page, programs_page, summary
    from tests.mutants.rooms import FAULTS
    from tests.mutants.run import Bench, outcomes

    wanted = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    wanted.add_argument("--room", default="", help="faults of the rooms whose name holds this")
    wanted.add_argument("--only", default="", help="faults whose name holds this")
    wanted.add_argument("--jobs", type=int, default=1)
    wanted.add_argument("--no-tests", action="store_true",
                        help="do not ask the tests about what the proof lets pass")
    wanted.add_argument("--no-programs", action="store_true", help="leave the faults in written programs out")
    wanted.add_argument("--programs", default=None, metavar="NAME",
                        help="no faults in functions: written programs alone, those whose name holds this")
    wanted.add_argument("--json", type=Path)
    wanted.add_argument("--page", type=Path, help="write the published table")
    a = wanted.parse_args()
    faults = [f for f in FAULTS if a.room in f.room and a.only.lower() in f.name.lower()]
    if not faults:
        wanted.error(f"no fault of room {a.room!r} with {a.only!r} in its name")
    if a.programs is not None:
        programs = all_programs(a.programs)
        print(programs_page(programs))
        return 1 if any(p.survivors for p in programs) else 0
    found = outcomes(faults, Bench(), not a.no_tests, a.jobs)
    programs = [] if a.no_programs or a.room or a.only else all_programs()
    if a.json:
        a.json.write_text(json.dumps(as_dict(found, programs), indent=1) + "\n", "utf-8")
    if a.page:
        a.page.write_text(page(found, programs), "utf-8")
    print(summary(found, programs))
    return 1 if any(o.survives for o in found) or any(p.survivors for p in programs) else 0


if __name__ == "__main__":
    sys.exit(main())
