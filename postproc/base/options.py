"""What the user asked for."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Literal, get_args

from postproc.base.given import faults_of
from postproc.base.header_words import chosen_axes, feed_line, hooks_line, setup_line, smoothing_line
from postproc.base.length_text import LengthText
from toolpaths.choices import GivenDialect, GivenUnit, ShopName
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import DiagnosticError

FeedModeChoice = Literal["auto", "per-minute", "inverse-time"]
OutputMode = Literal["auto", "axes", "tcp", "tilted"]
FeedSource = Literal["programmed", "planned"]
Orientation = Literal["keep", "per-pass", "whole-part", "auto"]
_WORDS = {"feed_mode": get_args(FeedModeChoice), "output": get_args(OutputMode), "feed": get_args(FeedSource),
          "orient": get_args(Orientation), "units": get_args(GivenUnit), "dialect": get_args(GivenDialect)}


@dataclass(frozen=True)
class Options:
    """Options of convert, verify and trace; mm and degrees as on the command line.

    Raises:
        DiagnosticError: names each value that is no number, or none of the words that there are.
    """

    tolerance: float = 0.01
    axis_tolerance: float = 0.05
    feed_mode: FeedModeChoice = "auto"
    setup: str = ""
    """file of the set-up"""
    units: GivenUnit = ""
    dialect: GivenDialect | ShopName = ""
    """also a name that an installed package registers"""
    allow_unknown: tuple[str, ...] = ()
    output: OutputMode = "auto"
    feed: FeedSource = "programmed"
    merge_feeds: float = 0.0
    """part by which a planned feed may be lowered so that neighbouring blocks share one"""
    smooth: bool = False
    orient: Orientation = "keep"
    """tool axes of positioned passes: those of the CL file, or chosen for the least planned time"""
    max_tilt: float = 60.0
    """of chosen axes, degrees from the surface normals of the file, or from its own axes where it has none"""
    error_model: str = ""
    """file of the machine's geometric errors"""
    error_beyond: bool = False
    """True: errors at the ends of their measured ranges count beyond them too"""

    optimise: bool = False
    """output modes, ends of blocks, shares of the tolerance and feed mode chosen for the least time on the control"""
    off_path: bool = False
    """blocks of cuts may end off the path, within the tolerance, where fewer of them do"""
    filled: bool = False
    """points between may use up what the tolerance leaves for them; default: a part of it stays free"""
    smoothing: float = 0.0
    """mm of the tolerance that the control's own smoothing may take, where its blocks state it; 0: as the controller file"""

    require_proof: bool = False
    """True: programs whose deviation is not bounded in every block, or whose clamps or turns of modulo axes the second
    witness has not compared, are refused"""
    setup_mark: str = ""
    """fingerprint of the set-up that was given, as a file or as a SetupFile; put here by what reads it"""
    hooks: str = ""
    """file whose [hooks] are blocks of the shop, under those of the set-up"""
    name: str = ""
    """of the program and its subprograms' files; default: that of the CL file"""

    def __post_init__(self) -> None:
        found = faults_of({f.name: (getattr(self, f.name), f.default) for f in fields(self)}, self._words())
        if found:
            raise DiagnosticError(found)

    def _words(self) -> dict[str, tuple[str, ...]]:
        """The closed lists; installed packages are asked for a dialect that is none of the project's own."""
        if self.dialect in _WORDS["dialect"]:
            return _WORDS
        from toolpaths.cl.systems.shop_forms import shop_names

        return _WORDS | {"dialect": (*_WORDS["dialect"], *shop_names())}

    def header(self, said: LengthText) -> list[str]:
        """The options as comment lines of an output file; files by their names, wherever they stand."""
        lines = [f"tolerance {said.exactly(self.tolerance)}, axis tolerance {self.axis_tolerance:g} degrees",
                 f"feed mode {self.feed_mode}"]
        if self.output != "auto":
            lines.append(f"output mode {self.output}")
        if self.feed != "programmed":
            lines.append(feed_line(self.feed, self.merge_feeds))
        if self.orient != "keep":
            lines.append(chosen_axes(self.orient, self.max_tilt))
        if self.smooth:
            lines.append("points smoothed")
        if self.optimise:
            lines.append("optimised for the time on the control")
        if self.off_path:
            lines.append("block ends off the path")
        if self.filled:
            lines.append("tolerance used up")
        if self.smoothing:
            lines.append(smoothing_line(self.smoothing, said))
        if self.error_model:
            beyond = ", beyond its range too" if self.error_beyond else ""
            lines.append(f"error model {Path(self.error_model).name}{beyond}")
        if self.setup or self.setup_mark:
            lines.append(setup_line(Path(self.setup).name, self.setup_mark))
        if self.hooks:
            lines.append(hooks_line(Path(self.hooks).name))
        if read := [f"{name} {getattr(self, name)}" for name in ("units", "dialect") if getattr(self, name)]:
            lines.append(f"CL file read with {', '.join(f'--{one}' for one in read)}")
        if self.allow_unknown:
            lines.append("allow unknown " + " ".join(self.allow_unknown))
        return lines
