"""Why candidates of a pass lost, grouped."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from postproc.orientation.candidates.candidate_times import Candidate
from postproc.orientation.candidates.search import PassSearch
from postproc.orientation.passes.reasons import RejectionKind

KINDS: dict[RejectionKind, str] = {
    "limits": "outside the allowed angles", "reach": "out of reach", "travel": "travel of an axis",
    "touches": "touches part, fixture or table", "bound": "cannot be fast enough", "slower": "slower"}
"""What a candidate can lose by, in the order of the report."""


def grouped(every: Iterable[PassSearch]) -> dict[str, int]:
    """How many candidates of passes were rejected, by kind of reason, the CL's own axis not counted."""
    count = Counter(lost.kind for tried in every for lost in tried.rejected if lost.made is not tried.own)
    return {kind: count[kind] for kind in KINDS if count[kind]}


def runner_up(tried: PassSearch) -> Candidate | None:
    """The fastest candidate that was timed and not taken, the own axis among them; None where none was."""
    timed = [lost.made for lost in tried.rejected if lost.kind == "slower"]
    return min(timed, key=lambda made: made.seconds, default=None)


def listed(counts: dict[str, int]) -> str:
    """Counts in words: "5 bound, 12 slower"."""
    return ", ".join(f"{number} {kind}" for kind, number in counts.items())
