"""First-try conversions of the practice files, without a set-up and with that of `setup new --yes`, and the questions.

    python tests/benchmarks/bench_setup_new.py [MACHINE CONTROLLER]
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import machines
import postproc
import toolpaths
from postproc.base.options import Options
from postproc.setup_sheet.make import new_setup
from postproc.setup_sheet.questions import GivenAnswers
from tests.practice_files import CASES, SHAPES, practice_file


def main() -> None:
    name, controller = sys.argv[1:3] if len(sys.argv) > 2 else ("mikron-ucp710", "linuxcnc")
    machine = machines.load(name)
    before, after, questions, places = Counter[str](), Counter[str](), Counter[str](), Counter[str]()
    for case, lacks in CASES.items():
        for shape in SHAPES:
            path, found = toolpaths.read_bytes(practice_file(shape, lacks), file=f"part.{shape.ending}")
            before[case] += postproc.convert(path, machine, controller, diagnostics=found).ok
            sheet = new_setup(path, machine, controller, Options(), GivenAnswers(), None, True, found)
            after[case] += bool(sheet.text)
            questions[case] += len(sheet.questions)
            places[case] += sheet.fit.tried if sheet.fit else 0
    print(f"{len(SHAPES)} shapes on {name}, {controller}: first-try conversions before, after; questions; places tried")
    for case in CASES:
        mean = questions[case] / len(SHAPES), places[case] / len(SHAPES)
        print(f"{case:26} {before[case]:3} {after[case]:3} {mean[0]:5.1f} {mean[1]:5.1f}")
    count = len(SHAPES) * len(CASES)
    print(f"{'all':26} {before.total()} of {count}, {after.total()} of {count}; {questions.total()} questions")


if __name__ == "__main__":
    main()
