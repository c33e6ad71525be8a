"""Rooms of the table: their faults, the conversions in which they act, and the tests that are asked."""

from __future__ import annotations

from tests.mutants import faults_controls as controls
from tests.mutants import faults_machine as machine
from tests.mutants import faults_reading as reading
from tests.mutants.battery import CASES, SIX
from tests.mutants.plant import Fault

FAULTS: tuple[Fault, ...] = (*reading.FAULTS, *machine.FAULTS, *controls.FAULTS)
BATTERY: dict[str, tuple[str, ...]] = {
    "reader": ("flat linuxcnc", "flat siemens", "contact", "inch", "creo", "five linuxcnc"),
    "frames": ("flat linuxcnc", "laws linuxcnc", "creo", "catia", "solidworks", "system", "cycles fanuc"),
    "placement": ("flat linuxcnc", "leaning", "system", "five linuxcnc", "laws siemens", "faces fanuc"),
    "cycles": (*(f"flat {c}" for c in SIX), "cycles fanuc", "cycles siemens", "cycles heidenhain", "cycles haas", "inch"),
    "arcs": ("milled", "helix linuxcnc", "helix heidenhain", "catia", "inch", "laws siemens", "delta", "tall linuxcnc"),
    "feeds": ("flat linuxcnc", "five linuxcnc", "head-table", "laws fanuc", "inch", "five iso"),
    "kinematics": ("five linuxcnc", "laws siemens", "fork", "nutating", "head-table", "tip fanuc", "leaning"),
    "linearising": ("five linuxcnc", "five iso", "laws linuxcnc", "head-table", "delta", "rods leaning", "rewind"),
    "links": ("faces linuxcnc", "faces fanuc", "flat linuxcnc", "five linuxcnc", "laws siemens", "rewind", "contact"),
    "travel": ("far", "far arc", "far tip", "far rods"),
    "compensation": ("errors", "errors flat", "errors laws"),
    "cutter compensation": ("cycles fanuc", "cycles siemens", "cycles heidenhain", "cycles haas"),
    "states": ("flat linuxcnc", "contact", "helix fanuc", "helix heidenhain", "flat siemens", "restart", "set-up"),
    "joints": ("five linuxcnc", "faces linuxcnc", "rewind", "laws siemens"),
    "planning": ("planned", "smooth", "five linuxcnc"),
    "proof": ("flat linuxcnc", "five linuxcnc", "laws siemens"),
}
TESTS: dict[str, tuple[str, ...]] = {
    "reader": ("toolpaths/test_cl_motion.py", "toolpaths/test_cl_records.py", "toolpaths/test_cl_habits.py",
               "test_samples.py"),
    "frames": ("toolpaths/test_cl_motion.py", "toolpaths/test_cl_records.py", "postproc/test_setup_frames.py",
               "test_samples.py"),
    "placement": ("postproc/test_setup_frames.py", "postproc/test_road.py", "postproc/test_setup_system.py"),
    "cycles": ("postproc/test_writer_cycles.py", "toolpaths/test_cl_records.py", "postproc/test_moves.py",
               "postproc/test_golden.py"),
    "arcs": ("toolpaths/test_cl_motion.py", "postproc/test_writer_arcs.py", "postproc/test_linearise.py",
             "postproc/test_golden.py"),
    "feeds": ("postproc/test_moves.py", "postproc/test_writer.py", "postproc/test_golden.py", "postproc/test_road.py"),
    "kinematics": ("laws/test_kinematics_laws.py", "machines/test_serial_known.py", "machines/test_delta_linear.py"),
    "linearising": ("postproc/test_linearise.py", "postproc/test_road.py", "postproc/test_golden.py"),
    "links": ("postproc/test_links.py", "postproc/test_road.py", "postproc/test_golden.py"),
    "travel": ("postproc/test_travel.py",),
    "compensation": ("machines/test_geometric_error_independent.py", "postproc/test_compensation_points.py"),
    "cutter compensation": ("postproc/test_leftovers_cutcom.py", "postproc/test_golden.py",
                            "postproc/test_compensation_control.py"),
    "states": ("postproc/test_stops.py", "postproc/test_writer.py", "postproc/test_spindle_of_setup.py",
               "postproc/test_golden.py", "postproc/test_leftovers_restart.py"),
    "joints": ("postproc/test_joint_plan.py", "postproc/test_joint_path.py"),
    "planning": ("postproc/test_planned_feed.py", "postproc/test_smoothed_moves.py", "postproc/test_writer.py"),
    "writer": ("postproc/test_golden.py", "postproc/test_writer.py", "postproc/test_writer_cycles.py",
               "postproc/test_controllers_{}.py"),
    "reader of": ("postproc/test_reader_{}.py", "postproc/test_second_reading_controllers.py",
                  "postproc/test_verify_edits.py", "postproc/test_reader_laws.py", "postproc/test_readback.py",
                  "postproc/test_mutation.py"),
    "proof": ("postproc/test_readback.py", "postproc/test_mutation.py"),
}
FILES = {"fanuc": "fanuc", "siemens": "siemens", "heidenhain": "heidenhain", "haas": "haas"}
READERS = {"fanuc": "fanuc", "siemens": "siemens", "heidenhain": "klartext", "haas": "fanuc", "linuxcnc": "twins",
           "iso": "twins"}


def control_of(room: str) -> str:
    """The control of a writer's or a reader's room, "" for others."""
    return room.rpartition(" of ")[2] if " of " in room else ""


def proves(room: str) -> bool:
    """True for rooms whose faults change no program, only what is made of it."""
    return room.startswith("reader of") or room == "proof"


def cases_of(fault: Fault) -> tuple[str, ...]:
    """Conversions in which a fault is tried."""
    control = control_of(fault.room)
    if fault.cases or not control:
        return fault.cases or BATTERY[fault.room]
    return tuple(f"{kind} {control}" for kind in ("flat", "helix", "laws", "axes", "five", "cycles", "tip")
                 if f"{kind} {control}" in CASES)


def files_asked(room: str) -> tuple[str, ...]:
    """Test files that are asked about a room, from the folder `tests`."""
    control = control_of(room)
    if not control:
        return TESTS[room]
    table = READERS if room.startswith("reader") else FILES
    names = TESTS["reader of" if room.startswith("reader") else "writer"]
    return tuple(n.format(table.get(control, "")) for n in names if "{}" not in n or control in table)
