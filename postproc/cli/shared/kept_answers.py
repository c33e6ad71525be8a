"""Answers to a long row of questions that an interruption leaves: kept in a file, taken by the same command again."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from pathlib import Path

from postproc.cli.shared.says import SAYS, answer_line


@dataclass
class KeptAnswers:
    """The answers of a run as they come, those of an interrupted run first.

    Attributes:
        file: where they are kept, one a line
        earlier: of the interrupted run, not taken yet
        given: taken or answered in this run
    """

    file: Path
    earlier: list[str] = field(default_factory=list)
    given: list[str] = field(default_factory=list)

    def line(self, question: str, again: bool = False) -> str:
        """The next answer; one that did not fit is asked for, whatever is left of those of the interrupted run.

        Raises:
            EOFError: where standard input has ended.
        """
        if again or not self.earlier:
            return answer_line(question)
        line = self.earlier.pop(0)
        sys.stderr.write(f"{question}{line}\n")
        return line

    def keep(self) -> str:
        """They are in the file; what is said of it, "" where there are none."""
        from toolpaths.transaction import write_together

        answers = [*self.given, *self.earlier]
        if not answers:
            return ""
        write_together({self.file: "".join(f"{one}\n" for one in answers)})
        several = f"{len(answers)} answers are" if len(answers) > 1 else "1 answer is"
        SAYS.interrupted = (f"interrupted; {several} kept in {self.file}, one a line: the same command goes on from "
                            "there; correct a line to answer otherwise, delete the file to begin again")
        return SAYS.interrupted


def kept_answers(file: Path) -> KeptAnswers:
    """Those that an interrupted run has left in a file; none where there is no such file.

    Raises:
        OSError: it is there and cannot be read.
    """
    from toolpaths.input_files import read_input, there_is

    if not there_is(file):
        return KeptAnswers(file)
    earlier = read_input(file).decode("utf-8", "replace").splitlines()
    sys.stderr.write(f"{file}: {len(earlier)} answers of an interrupted run are taken\n")
    return KeptAnswers(file, earlier)
