"""Why candidates of a pass lost, grouped."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from postproc.orientation.candidates import Tried
from postproc.orientation.timed import Turned

KINDS = {"limits": "tilt, lead or distance from the ball's centre", "reach": "out of reach", "travel": "travel of an axis",
         "touches": "touches part, fixture or table", "bound": "cannot be fast enough", "slower": "slower"}
"""What a candidate can lose by, in the order of the report."""


def kind_of(made: Turned, why: str) -> str:
    """The kind of a reason, one of KINDS."""
    if why.startswith("takes at least "):
        return "bound"
    if why.startswith("takes "):
        return "slower"
    if made.refused:
        return "travel" if made.refused.startswith("travel") else "reach"
    return "limits" if why.startswith(("inclined", "lead", "tilt")) else "touches"


def grouped(tried: Tried) -> dict[str, int]:
    """How many candidates lost by each kind of reason."""
    return _in_order(lost.kind for lost in tried.rejected if lost.made is not tried.own)


def in_all(every: Iterable[Tried]) -> dict[str, int]:
    """As `grouped`, over passes."""
    total: Counter[str] = Counter()
    for tried in every:
        total.update(grouped(tried))
    return {kind: total[kind] for kind in KINDS if total[kind]}


def _in_order(kinds: Iterable[str]) -> dict[str, int]:
    count = Counter(kinds)
    return {kind: count[kind] for kind in KINDS if count[kind]}


def best_loser(tried: Tried) -> Turned | None:
    """The fastest candidate that was planned and not taken, the own axis among them; None where none was."""
    planned = [lost.made for lost in tried.rejected if lost.kind == "slower"]
    return min(planned, key=lambda made: made.seconds, default=None)


def listed(counts: dict[str, int]) -> str:
    """Counts in words: "5 bound, 12 slower"."""
    return ", ".join(f"{number} {kind}" for kind, number in counts.items())
