"""Files of the quick tier, `make quick`: each part of the road in a minute; whatever converts many samples is left out.

`mark_quick` gives their tests the marker `quick`, but for those that `make test` leaves to `make slow`.
"""

from __future__ import annotations

from collections.abc import Sequence

import pytest

QUICK = (
    "tests/test_imports.py",
    "tests/test_rooms.py",
    "tests/bad/test_bad_files.py",
    "tests/laws/test_acceptance.py",
    "tests/laws/test_serial_structures.py",
    "tests/machines/kinematics/test_delta_linear.py",
    "tests/machines/geometric_error/test_geometric_error_curves.py",
    "tests/machines/geometric_error/test_geometric_error_frames.py",
    "tests/machines/geometric_error/test_geometric_error_bad_files.py",
    "tests/machines/geometric_error/test_geometric_error_lost_motion.py",
    "tests/machines/geometric_error/test_geometric_error_maps_independent.py",
    "tests/machines/geometric_error/test_geometric_error_readings.py",
    "tests/machines/test_loader.py",
    "tests/machines/test_polytope.py",
    "tests/machines/test_reach_margins.py",
    "tests/machines/kinematics/test_serial_known.py",
    "tests/machines/kinematics/test_sliders.py",
    "tests/machines/test_user_file.py",
    "tests/postproc/correction/test_arcs_turning_back.py",
    "tests/postproc/cli/test_catalogue.py",
    "tests/postproc/cli/test_cli.py",
    "tests/postproc/writing/test_writer_fanuc.py",
    "tests/postproc/controllers/test_controller_files.py",
    "tests/postproc/writing/test_writer_haas.py",
    "tests/postproc/writing/test_writer_heidenhain.py",
    "tests/postproc/writing/test_operations_in_the_text.py",
    "tests/postproc/writing/test_writer_siemens.py",
    "tests/postproc/feedrate/test_feedrate_second_order.py",
    "tests/postproc/writing/test_golden_programs.py",
    "tests/postproc/path/test_links.py",
    "tests/postproc/reference/test_moves.py",
    "tests/postproc/readback/test_reader_fanuc.py",
    "tests/postproc/readback/test_reader_klartext.py",
    "tests/postproc/readback/test_reader_siemens.py",
    "tests/postproc/path/test_travel.py",
    "tests/postproc/verification/test_verify_inch.py",
    "tests/postproc/writing/test_writer.py",
    "tests/postproc/writing/test_writer_arcs.py",
    "tests/postproc/writing/test_writer_cycles.py",
    "tests/toolpaths/test_arrays.py",
    "tests/toolpaths/cl/test_cl_catia.py",
    "tests/toolpaths/cl/test_cl_clt.py",
    "tests/toolpaths/cl/test_cl_lexical.py",
    "tests/toolpaths/cl/test_cl_motion.py",
    "tests/toolpaths/cl/test_cl_records.py",
)


def mark_quick(items: Sequence[pytest.Item]) -> None:
    """Tests of those files; whoever asks for them alone (`-m quick`) gets no slow ones with them."""
    for item in items:
        if item.nodeid.partition("::")[0] in QUICK and not item.get_closest_marker("slow"):
            item.add_marker(pytest.mark.quick)
