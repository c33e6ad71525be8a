"""Where the console script and `python -m postproc` begin: the guard stands before anything is imported."""

from __future__ import annotations

from postproc.cli.shared.guard import guarded


def command() -> None:
    """The command line."""
    from postproc.cli.app import app

    app()


def main() -> None:
    """Entry point of the console script."""
    raise SystemExit(guarded(command))


if __name__ == "__main__":
    main()
