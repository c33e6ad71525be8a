"""Rooms of the table: their faults, the conversions in which they act, and the tests that are asked."""

from __future__ import annotations

from tests.mutants import faults_controls as controls
from tests.mutants import faults_machine as machine
from tests.mutants import faults_places as places
from tests.mutants import faults_programs as programs
from tests.mutants import faults_reading as reading
from tests.mutants.battery import CASES, SIX
from tests.mutants.plant import Fault

FAULTS: tuple[Fault, ...] = (*reading.FAULTS, *machine.FAULTS, *controls.FAULTS, *places.FAULTS,
                             *programs.FAULTS)
BESIDE = ("lengths at the machine", "measured part", "check program", programs.ROOM)
"""rooms whose faults change no conversion: tests alone are asked"""
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
    "options": ("bare siemens", "bare haas", "bare fanuc", "bare heidenhain"),
    "places": ("places fanuc", "places siemens", "places haas"),
    **dict.fromkeys(BESIDE, ("flat linuxcnc",)),
}
TESTS: dict[str, tuple[str, ...]] = {
    "reader": ("toolpaths/cl/test_cl_motion.py", "toolpaths/cl/test_cl_records.py",
               "toolpaths/cl/test_cl_records_by_system.py",
               "test_samples.py"),
    "frames": ("toolpaths/cl/test_cl_motion.py", "toolpaths/cl/test_cl_records.py", "postproc/setup/test_setup_frames.py",
               "test_samples.py"),
    "placement": ("postproc/setup/test_setup_frames.py", "postproc/pipeline/test_whole_conversions.py",
                  "postproc/setup/test_setup_system.py"),
    "cycles": ("postproc/writing/test_writer_cycles.py", "toolpaths/cl/test_cl_records.py",
               "postproc/reference/test_moves.py",
               "postproc/writing/test_golden_programs.py"),
    "arcs": ("toolpaths/cl/test_cl_motion.py", "postproc/writing/test_writer_arcs.py", "postproc/path/test_linearise.py",
             "postproc/writing/test_golden_programs.py"),
    "feeds": ("postproc/reference/test_moves.py", "postproc/writing/test_writer.py",
              "postproc/writing/test_golden_programs.py", "postproc/pipeline/test_whole_conversions.py"),
    "kinematics": ("laws/test_kinematics_laws.py", "machines/kinematics/test_serial_known.py",
                   "machines/kinematics/test_delta_linear.py", "machines/kinematics/test_legs.py"),
    "linearising": ("postproc/path/test_linearise.py", "postproc/pipeline/test_whole_conversions.py",
                    "postproc/writing/test_golden_programs.py"),
    "links": ("postproc/path/test_links.py", "postproc/pipeline/test_whole_conversions.py",
              "postproc/writing/test_golden_programs.py"),
    "travel": ("postproc/path/test_travel.py",),
    "compensation": ("machines/geometric_error/test_geometric_error_independent.py",
                     "postproc/correction/test_compensation_points.py"),
    "cutter compensation": ("postproc/compile/test_cutcom_planes.py", "postproc/compile/test_contour_words.py",
                            "postproc/writing/test_golden_programs.py",
                            "postproc/correction/test_compensation_control.py"),
    "states": ("postproc/reference/test_stops.py", "postproc/writing/test_writer.py",
               "postproc/setup/test_spindle_of_setup.py",
               "postproc/writing/test_golden_programs.py", "postproc/writing/test_restart_anywhere.py"),
    "joints": ("postproc/joints/test_joint_plan.py", "postproc/joints/test_joint_path.py"),
    "planning": ("postproc/planning/test_planned_feed.py", "postproc/planning/test_smoothed_moves.py",
                 "postproc/writing/test_writer.py"),
    "writer": ("postproc/writing/test_golden_programs.py", "postproc/writing/test_writer.py",
               "postproc/writing/test_writer_cycles.py",
               "postproc/writing/test_writer_{}.py"),
    "reader of": ("postproc/readback/test_reader_{}.py", "postproc/writing/test_controller_rules.py",
                  "postproc/verification/test_verify_edits.py", "postproc/readback/test_reader_laws.py",
                      "postproc/readback/test_readback.py",
                  "postproc/readback/test_program_mutation.py"),
    "options": ("postproc/control/test_options.py",),
    "places": ("postproc/job/test_places.py",),
    "lengths at the machine": ("postproc/verification/test_length_margins.py",),
    "measured part": ("postproc/alignment/test_align.py",),
    "check program": ("postproc/pipeline/test_check_program.py",),
    programs.ROOM: ("postproc/readback/test_frames_and_patterns.py", "postproc/readback/test_frames_by_matrices.py"),
    "proof": ("postproc/readback/test_readback.py", "postproc/readback/test_program_mutation.py",
              "postproc/readback/test_pecks_dwells_ends.py"),
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
