"""Codes with a remedy that is not under the law of hints, and why: the table only shrinks."""

from __future__ import annotations

_WHY = {
    "nothing is to be done: it says what was taken, or what a look at the machine decides": (
        "collision.bound compensation.range cutcom.own_register error-table.kind orient.unproved tool.length_twice"),
    "only by a fault of the program itself, or of a library call: no file leads there": (
        "arc.no_start axis.spin calibrate.converged file.not_recovered geometric_errors.bound "
        "output.smoothing_mode plan.reach rollover.standing rollover.turn"),
    "the remedy is at the machine or in the CAM system: measured anew, exported anew": (
        "calibrate.few calibrate.place calibrate.rank calibrate.silent calibrate.unchecked cl.index-axis "
        "log.fit"),
    "followed by a test of its own room, which has the files that it takes": (
        "extra.missing collision.point compensation.reach file.twice file.unfinished "
        "proof.comment proof.input_changed verify.clamp verify.no_bound"),
    "no small file has been found that leads there: random programs of the tests alone do": (
        "link.blocked path.jump"),
}
OPEN = {code: why for why, codes in _WHY.items() for code in codes.split()}
