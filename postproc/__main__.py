"""Where the console script and `python -m postproc` begin: the guard stands before anything is imported."""

from __future__ import annotations

import os

from postproc.cli.shared.guard import guarded

ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1"}
"""products of many small matrices take fifty times as long where numpy's library hands them out to threads that wait; and
the bits of larger ones do not depend on how many processors there are"""


def command() -> None:
    """The command line."""
    for name, value in ONE_THREAD.items():
        os.environ.setdefault(name, value)
    from postproc.cli.app import app

    app()


def main() -> None:
    """Entry point of the console script."""
    raise SystemExit(guarded(command))


if __name__ == "__main__":
    main()
