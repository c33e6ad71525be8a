"""The pivots that a proof stands on, as numbers of the control's own names at the head of the program."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from postproc.job.pivot_vectors import pivot_vectors
from tests.postproc.kit import convert, good, machine, setup_of, toolpath

LENGTH = "[tools.1]\ngauge_length = 90\n"
OUTPUT = "[output]\nunits = \"inch\"\n"
BOTH = ["RAPID", "GOTO/0,0,40,0,0,1", "GOTO/10,0,40,0.1,0,0.9949874371", "GOTO/10,0,45,0.1,0,0.9949874371"]


def said(name: str, controller: str, text: str = LENGTH, *lines: str) -> str:
    """The comments at the head in one line, without brackets and capitals."""
    result = good(convert(toolpath(*(lines or BOTH)), name, controller, setup_of(text)))
    head = [line for line in result.text.splitlines() if re.match(r"(\d+ )?[(;]", line)]
    return " ".join(re.sub(r"^\d+ |[();]", "", line).strip() for line in head).lower()


@pytest.mark.parametrize(("controller", "words"), [
    ("fanuc-30i", ["from zero to b: 19700 x-25.0000, 19701 y0.0000, 19702 z-50.0000",
                   "from b to c: 19703 x25.0000, 19704 y0.0000, 19705 z0.0000"]),
    ("haas-ngc", ["from zero to b: settings 255 x-25.0000, 256 y0.0000, 257 z-50.0000",
                  "from b to c: x25.0000 y0.0000 z0.0000, settings 303 to 305 less 300 to 302"]),
    ("siemens-840d", ["i2 $tc_carr4 to 6, md24550 x-25.0000 y0.0000 z-50.0000",
                      "i3 $tc_carr15 to 17 x25.0000 y0.0000 z0.0000",
                      "i4 $tc_carr18 to 20, md24500 x0.0000 y0.0000 z50.0000"]),
    ("heidenhain-tnc640", ["from zero to b: kinematics, trans x-25.0000 y0.0000 z-50.0000",
                           "from b to c: kinematics, trans x25.0000 y0.0000 z0.0000"])])
def test_tables_that_do_not_cross(controller: str, words: list[str]) -> None:
    """B stands 25 mm next to and 50 mm below the line of C; the point of C is that next to B."""
    text = said("trunnion-bc", controller)
    assert all(word in text for word in words), text
    assert "pivots that the control must hold" in text


@pytest.mark.parametrize(("controller", "words"), [
    ("fanuc-30i", ["from zero to c: 19700 x0.0000",
                   "from the gauge point to b: 19709 x0.0000, 19710 y0.0000, 19711 z180.0000"]),
    ("siemens-840d", ["from zero to c: i3 $tc_carr15 to 17, md24558 x0.0000", "i4 $tc_carr18 to 20, md24500 x0.0000",
                      "from the gauge point to b: i2 $tc_carr4 to 6, md24550 x0.0000 y0.0000 z180.0000",
                      "i1 $tc_carr1 to 3, md24560 x0.0000 y0.0000 z-180.0000"])])
def test_a_head_over_a_table(controller: str, words: list[str]) -> None:
    text = said("head-table", controller)
    assert all(word in text for word in words), text


def test_two_axes_in_the_head() -> None:
    text = said("fork-head-ab", "fanuc-30i")
    assert "from the gauge point to a: 19709 x0.0000, 19710 y0.0000, 19711 z250.0000" in text
    assert "from a to b: 19712 x0.0000, 19713 y0.0000, 19714 z30.0000" in text and "19700" not in text


def test_numbers_are_in_the_units_of_the_program() -> None:
    assert "19700 x-0.98425, 19701 y0.00000, 19702 z-1.96850" in said("trunnion-bc", "fanuc-30i", LENGTH + OUTPUT)


def test_machine_coordinates_stand_on_the_machine_file_alone() -> None:
    flat = ["RAPID", "GOTO/0,0,40", "GOTO/10,0,40"]
    assert "pivots" not in said("mill-3axis", "fanuc-30i", LENGTH, *flat)
    assert "pivots that the words are made for" in said("trunnion-bc", "linuxcnc", LENGTH)


def test_the_names_are_data(tmp_path: Path) -> None:
    shop = tmp_path / "shop.toml"
    shop.write_text('base = "fanuc-30i"\npivots.table = "KIN {x} {y} {z}"\n')
    text = good(convert(toolpath(*BOTH), "trunnion-bc", shop, setup_of(LENGTH))).text
    assert "KIN -25.0000 0.0000 -50.0000" in text and "19700" not in text and "19703" in text


@cache
def moved(name: str, letter: str, by: tuple[float, float, float]) -> dict[str, list[float]]:
    one = machine(name)
    points = {j.name: np.array(j.point) for j in one.kinematics.chain if j.rotary}
    points[letter] = points[letter] + by
    kin = one.kinematics.with_pivots(points)
    return {v.kind: v.value.round(9).tolist() for v in pivot_vectors(replace(one, kinematics=kin))}


@pytest.mark.parametrize(("name", "letter", "along"), [("trunnion-bc", "B", (0, 7, 0)), ("trunnion-bc", "C", (0, 0, 7)),
                                                       ("mikron-ucp710", "A", (7, 0, 0)), ("fork-head-ab", "A", (7, 0, 0))])
def test_a_pivot_that_slides_along_its_axis_is_the_same(name: str, letter: str, along: tuple[float, float, float]) -> None:
    """The axes are lines: only where they lie counts, not the point that the file names."""
    assert moved(name, letter, along) == moved(name, letter, (0, 0, 0))
    across = (along[1], along[2], along[0])
    assert moved(name, letter, across) != moved(name, letter, (0, 0, 0))


def test_the_chain_closes() -> None:
    for name in ("trunnion-bc", "fork-head-ab", "head-table", "nutating-head", "linuxcnc-xyzac-trt"):
        vectors = pivot_vectors(machine(name))
        for kinds in ({"table", "table_to_table", "closing_table"}, {"tool_to_head", "head_to_head", "closing_head"}):
            assert np.allclose(sum((v.value for v in vectors if v.kind in kinds), np.zeros(3)), 0.0)


def test_parallel_kinematics_have_none() -> None:
    assert pivot_vectors(machine("h4a-c-table")) == ()
