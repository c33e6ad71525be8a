"""What a control takes for a program, as the choices of a conversion ask for it."""

from __future__ import annotations

from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays


@dataclass(frozen=True)
@arrays(moves="M")
class ProgramTime:
    """Time of a written program on the model of its control.

    Attributes:
        seconds: all together; band: in which 95 % of machines lie, both `seconds` where it was not asked for
        bound: s that no control beats
        model: in words
        moves (M,): s of the blocks of each row of the job's moves
    """

    seconds: float
    band: tuple[float, float]
    bound: float
    model: str
    moves: Floats

    @property
    def uncertainty(self) -> float:
        """Half the width of the band, s."""
        return 0.5 * (self.band[1] - self.band[0])


@dataclass(frozen=True)
@arrays(needed="K")
class ControlPlan:
    """What a control can do of planned passes, by its own rules at corners and in bends.

    Attributes:
        needed (K,): least s of each block of the path, 0 where nothing is planned
        seconds: of all passes
    """

    needed: Floats
    seconds: float


@dataclass(frozen=True)
class FeedTimes:
    """What planned feeds do on the control, all s.

    Attributes:
        programmed, planned: the program with feeds as programmed, and as planned
        words_programmed, words: sums of the times that the F words state, of both
        plan: time of all passes as planned under the control's own rules; where these are not known, as `ideal`
        ideal: the same on a control that uses the axes' limits to the full and rounds corners off within the tolerance
        kept: the feeds are as programmed, as planned ones take longer on this control
    """

    programmed: ProgramTime
    planned: ProgramTime
    words_programmed: float
    words: float
    plan: float
    ideal: float
    kept: bool

    @property
    def unchanged(self) -> bool:
        """Whether planning changes nothing that counts: less than a thousandth of the time."""
        return self.kept or abs(self.planned.seconds - self.programmed.seconds) <= 1e-3 * self.programmed.seconds

    def as_dict(self) -> dict[str, object]:
        """As JSON."""
        return {"programmed_s": self.programmed.seconds, "planned_s": self.planned.seconds, "plan_s": self.plan,
                "ideal_plan_s": self.ideal,
                "words_programmed_s": self.words_programmed, "words_planned_s": self.words,
                "programmed_band_s": list(self.programmed.band), "planned_band_s": list(self.planned.band),
                "model": self.planned.model, "kept": self.kept, "unchanged": self.unchanged}

    def lines(self) -> list[str]:
        """For people."""
        now, before = self.planned, self.programmed
        said = (f"feeds as planned: {now.seconds:.2f} s on this control ({now.model}, 95 % between {now.band[0]:.2f} and "
                f"{now.band[1]:.2f} s), as programmed {before.seconds:.2f} s; the F words alone state {self.words:.2f} and "
                f"{self.words_programmed:.2f} s, the plan of the passes {self.plan:.2f} s"
                + ("" if self.plan == self.ideal else f" by the control's rules, {self.ideal:.2f} s by the axes' alone"))
        if self.kept:
            return [said, "planned feeds take longer on this control, which makes its ramps itself: feeds are as programmed"]
        return [said, *(["planning changes nothing that counts here"] if self.unchanged else [])]


@dataclass(frozen=True)
class OptimisedStep:
    """A choice that was taken, with the time of the program before and with it, s."""

    what: str
    before: float
    after: float


@dataclass(frozen=True)
class Optimised:
    """What `--optimise` came to: choices taken in order, time without it and with it, number of choices tried; s that no sharing
    of the tolerance beats (a control and the program's points with all of it each), 0 where that is not known."""

    steps: tuple[OptimisedStep, ...]
    before: ProgramTime
    after: ProgramTime
    tried: int
    least: float = 0.0

    @property
    def bound(self) -> float:
        """s below which no choice here comes: the program's lower bound, or what no sharing of the tolerance beats."""
        return max(self.before.bound, self.least)

    @property
    def closed(self) -> float | None:
        """Percent of the time above the bound that is saved; None where it is at the bound."""
        gap = self.before.seconds - self.bound
        return 100.0 * (self.before.seconds - self.after.seconds) / gap if gap > 0.0 else None

    def as_dict(self) -> dict[str, object]:
        """As JSON."""
        return {"before_s": self.before.seconds, "after_s": self.after.seconds, "lower_bound_s": self.before.bound,
                "least_s": self.least, "closed_percent": self.closed, "model": self.after.model, "tried": self.tried,
                "steps": [{"choice": one.what, "before_s": one.before, "after_s": one.after} for one in self.steps]}

    def lines(self) -> list[str]:
        """For people."""
        if not self.steps:
            return [f"optimised: none of {self.tried} other choices is faster on this control ({self.after.model})"]
        gained = "; ".join(f"{one.what} {one.before - one.after:.2f} s" for one in self.steps)
        part = "" if self.closed is None else f", {self.closed:.0f} % of what lay above its lower bound"
        if self.least > self.before.bound:
            part += f" ({self.least:.2f} s: its points and the control each with the whole tolerance)"
        return [f"optimised on this control ({self.after.model}): {self.before.seconds:.2f} s to {self.after.seconds:.2f} s"
                f"{part}; gained by {gained}; {self.tried} choices tried"]
