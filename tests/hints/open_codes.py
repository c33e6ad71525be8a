"""Codes with a remedy that is not under the law of hints, and why: the table only shrinks."""

from __future__ import annotations

_WHY = {
    "nothing is to be done: it says what was taken, or what a look at the machine decides": (
        "calibrate.residual calibrate.ways cl.cycle-place collision.bound compensation.range cutcom.none "
        "cutcom.own_register "
        "cutcom.register error-import.unused error-model.no-effect error-model.range error-table.kind feed.largest "
        "file.mixed orient.error_model orient.own_limits orient.own_tilt orient.slower orient.unproved output.next_mode "
        "place.lifted tool-table.bodies tool-table.far tool.length_twice"),
    "only by a fault of the program itself, or of a library call: no file leads there": (
        "arc.no_start axis.spin calibrate.converged cl.dropped cycle.pitch file.not_recovered gcode.open "
        "geometric_errors.bound orient.pass output.smoothing_mode plan.failed plan.limits plan.reach rollover.standing "
        "rollover.turn time.plan time.unsolved verify.option verify.planned"),
    "the remedy is at the machine or in the CAM system: measured anew, exported anew": (
        "calibrate.few calibrate.harmonics calibrate.place calibrate.rank calibrate.setup calibrate.shifts "
        "calibrate.silent calibrate.unchecked cl.index-axis cl.index-cut error-import.near error-import.reading "
        "error-import.rows log.fit tool-table.apart tool-table.missing"),
    "followed by a test of its own room, which has the files that it takes": (
        "calibrate.axis calibrate.kind calibrate.model calibrate.unused cl.cycle-height collision.corner collision.cutter "
        "collision.point compensation.reach error-export.input error-import.axis error-import.column error-import.columns "
        "error-import.directions error-import.map error-import.name error-import.runs error-import.tool_length "
        "error-import.twice error-map.period error-map.scattered error-model.column error-model.rows error-model.series "
        "error-model.travel error-table.unreadable file.input file.own_name file.replaced file.twice file.unfinished "
        "gcode.tool_name orient.contact_radius orient.cutter orient.max_tilt orient.no_motion orient.normals place.found "
        "place.limits "
        "proof.comment proof.input_changed proof.older rapid.off_line setup.unanswered tool.called tool-table.empty "
        "tool-table.open "
        "verify.clamp verify.cutcom_arc verify.error_model_changed verify.hook verify.no_bound verify.orient"),
    "no small file has been found that leads there: random programs of the tests alone do": "link.blocked path.jump",
}
OPEN = {code: why for why, codes in _WHY.items() for code in codes.split()}
