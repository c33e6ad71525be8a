"""Where the console script and `python -m postproc` begin: the guard stands before anything is imported."""

from __future__ import annotations

import gc
import os
import sys

from postproc.cli.shared.guard import guarded

COLLECTED_FROM = 500_000
"""objects made since the last look for garbage at which there is one; Python's 700 takes 40 ms of a small conversion and
50,000 takes 20 ms, where nearly all that is made is imported and stays"""
SET_UNLESS_GIVEN = {"OPENBLAS_NUM_THREADS": "1", "PYDANTIC_DISABLE_PLUGINS": "__all__"}
"""products of many small matrices take fifty times as long where numpy's library hands them out to threads that wait; and
the bits of larger ones do not depend on how many processors there are. What may watch pydantic's checks is of no use to
a command, and looking for it reads the metadata of every installed package"""


def command() -> None:
    """The command line."""
    gc.set_threshold(COLLECTED_FROM, *gc.get_threshold()[1:])
    for name, value in SET_UNLESS_GIVEN.items():
        os.environ.setdefault(name, value)
    from postproc.cli.app import app
    from postproc.cli.shared.group import only_called

    only_called(app, sys.argv[1:])()


def main() -> None:
    """Entry point of the console script."""
    code = guarded(command)
    gc.freeze()  # or Python looks twice for garbage among all that it is about to give up: 80 ms of a small conversion
    raise SystemExit(code)


if __name__ == "__main__":
    main()
