"""What is seen at the machine when a rotary axis is jogged, and which sense that proves."""

from __future__ import annotations

from machines.sheet.model import Jog
from machines.sheet.quantity import WrongFigureError

QUESTIONS: dict[tuple[str, bool], tuple[str, Jog, Jog]] = {
    ("A", True): ("jog A from 0 to +10: does the front edge of the table (Y-) go up or down?", "front up", "front down"),
    ("B", True): ("jog B from 0 to +10: does the right side of the table (X+) go up or down?", "right up", "right down"),
    ("C", True): ("jog C from 0 to +10, seen from above: does the table turn clockwise or anti-clockwise?", "clockwise",
                  "anti-clockwise"),
    ("A", False): ("jog A from 0 to +10: does the tip of the tool go to the back (Y+) or to the front?", "tip back",
                   "tip front"),
    ("B", False): ("jog B from 0 to +10: does the tip of the tool go to the left (X-) or to the right?", "tip left",
                   "tip right"),
    ("C", False): ("jog C from 0 to +10, seen from above: does the head turn clockwise or anti-clockwise?", "anti-clockwise",
                   "clockwise"),
}
"""(letter, in the table): the question, what is seen where the axis counts as ISO 841 (the tool turns by + relative to the
part, so a table turns against it), and what where it counts against it"""


def sense(letter: str, in_table: bool, seen: Jog) -> int:
    """1 where the axis counts as ISO 841, -1 where against.

    Raises:
        WrongFigureError: where that is no answer for this axis.
    """
    question, along, against = QUESTIONS[letter, in_table]
    if seen not in (along, against):
        raise WrongFigureError(f"{seen!r} is no answer for {letter}: {question}", f"write {along!r} or {against!r}")
    return 1 if seen == along else -1
