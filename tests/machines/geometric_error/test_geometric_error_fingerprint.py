"""The fingerprint of an error model: the same for files that say the same, another one for any other correction."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import machines
from machines.geometric_error import load
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.exchange.write_model import save
from machines.geometric_error.files.fingerprint import fingerprint

MIKRON = machines.load("mikron-ucp710")
SAMPLES = [("mikron-ucp710.toml", "mikron-ucp710"), ("uranesx.toml", "uranesx"), ("h4a-c-table.toml", "h4a-c-table")]
TEXT = """
machine = "mikron-ucp710"
[components.EXX]
table = "x.csv"
[components.EBX]
table = "x.csv"
[components.ECC]
cosine = [5.0, 0.5]
sine = [0.0, -0.5]
[components.EZY]
polynomial = [1.0, -2.0, 3e-5]
scale = 100
range = [-400, 400]
[location]
EC0Y = 6.0
EX0C = -4.5
[reference.C]
point = [1.0, 2.0, 3.0]
"""
TABLE = "X [mm],EXX+ [um],EXX- [um],EBX [arcsec]\n-400,1,2,0.7\n0,3,5.3,0\n400,6,7,-2\n"
MAP = "X [mm],C [deg],dx [um],dy [um],dz [um],rx [arcsec]\n" + "".join(
    f"{x},{c},{x / 7:.4f},{c / 9:.4f},0,{x / 40 + c:.3f}\n" for x in (-100, 0, 50) for c in (0, 90, 200))


def of(folder: Path, text: str = TEXT, table: str = TABLE, name: str = "e.toml") -> str:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "x.csv").write_text(table, encoding="utf-8")
    (folder / name).write_text(text)
    return fingerprint(load(folder / name, MIKRON))


def test_eight_hex_digits(tmp_path: Path) -> None:
    print_ = of(tmp_path)
    assert len(print_) == 8 and print_ == f"{int(print_, 16):08x}"
    assert print_ != fingerprint(ErrorModel())


@pytest.mark.parametrize(("change", "table"), [
    (lambda t: t.replace("= ", " =   ").replace("\n", "\n\n") + "# a comment\n", TABLE),
    (lambda t: "description = 'again'\ncorrected_by = \"control\"" + t, TABLE),
    (lambda t: t.replace('machine = "mikron-ucp710"', ""), TABLE),
    (lambda t: t + "[sigma]\nEXX = 0.5\n", TABLE),
    (lambda t: t.replace("EC0Y = 6.0\nEX0C = -4.5", "EX0C = -4.5\nEC0Y = 6.0\nEA0Y = 0.0"), TABLE),
    (lambda t: 'length_unit = "mm"\n' + t.replace("-4.5", "-45e-4").replace("1.0, -2.0, 3e-5", "1e-3, -2e-3, 3e-8"), TABLE),
    (lambda t: t + '[reference.X]\n', TABLE),
    (lambda t: t.replace('[components.EXX]\ntable = "x.csv"\n', "") + '[components.EXX]\ntable = "x.csv"\n', TABLE),
    (lambda t: t.replace("point", 'frame = "moving"\npoint'), TABLE),  # that of the bed, of a table
    (lambda t: t, TABLE.replace(",", ";").replace("X [mm]", "\ufeffX[mm]")),
    (lambda t: t, "EBX [arcsec],EXX- [mm],EXX+ [um],X [m]\n0.7,2e-3,1,-0.4\n0,0.0053,3,0\n-2,.007,6,.4\n"),
    (lambda t: t.replace("[components.EBX]", "[components.EBX]\nsign = -1"),
     TABLE.replace("0.7", "-0.7").replace("-2\n", "2\n"))])
def test_files_that_say_the_same_have_the_same(change: object, table: str, tmp_path: Path) -> None:
    assert callable(change)
    assert change(TEXT) != TEXT or table != TABLE
    assert of(tmp_path / "b", change(TEXT), table, "other name.toml") == of(tmp_path / "a")


@pytest.mark.parametrize(("text", "table"), [
    (TEXT.replace("EC0Y = 6.0", "EC0Y = 6.001"), TABLE),
    (TEXT.replace("EC0Y", "EA0Y"), TABLE),
    (TEXT.replace("EX0C = -4.5", ""), TABLE),
    (TEXT.replace("5.0, 0.5", "0.5, 5.0"), TABLE),
    (TEXT.replace("3e-5", "3.001e-5"), TABLE),
    (TEXT.replace("[-400, 400]", "[-400, 401]"), TABLE),
    (TEXT.replace("scale = 100", "scale = 101"), TABLE),
    (TEXT.replace("point = [1.0", "point = [1.5"), TABLE),
    (TEXT.replace("point", 'frame = "fixed"\npoint'), TABLE),
    (TEXT.replace("[components.EBX]", "[components.EBX]\nsign = -1"), TABLE),
    (TEXT.replace("[components.EBX]", "[components.EAX]"), TABLE.replace("EBX", "EAX")),
    (TEXT, TABLE.replace("400,6,7", "400,6,7.001")),
    (TEXT, TABLE.replace("400,6,7", "401,6,7")),
    (TEXT, TABLE.replace("EXX+", "E").replace("EXX-", "EXX+").replace("E [um]", "EXX- [um]")),
    (TEXT, TABLE.replace(",EXX- [um]", "").replace("EXX+", "EXX").replace("1,2,", "1,").replace("3,5.3", "3").replace(
        "6,7", "6"))])
def test_whatever_is_corrected_otherwise_has_another(text: str, table: str, tmp_path: Path) -> None:
    assert of(tmp_path / "b", text, table) != of(tmp_path / "a")


@pytest.mark.parametrize("sample", SAMPLES, ids=lambda s: s[1])
def test_a_model_written_and_read_keeps_it_and_any_value_counts(sample: tuple[str, str],
                                                                tmp_path: Path) -> None:
    machine = machines.load(sample[1])
    model = load(Path("samples/errors") / sample[0], machine)
    save(replace(model, name="copy"), tmp_path)
    assert fingerprint(load(tmp_path / "copy.toml", machine)) == fingerprint(model)
    prints = {fingerprint(model)}
    rng = np.random.default_rng(5)
    chosen = rng.choice(len(model.names), 12, replace=False)
    for k in chosen:
        values = model.values.copy()
        values[k] += 1e-6
        prints.add(fingerprint(model.with_values(values)))
    assert len(prints) == 1 + len(chosen)


def test_that_of_a_map_goes_by_its_nodes_and_not_by_its_columns_and_rows(tmp_path: Path) -> None:
    toml = "[map]\ntable = 'x.csv'\n"
    head, *rows = MAP.splitlines()
    swapped = [",".join((c, x, *rest)) for x, c, *rest in (row.split(",") for row in rows)]
    first = of(tmp_path / "a", toml, MAP)
    assert of(tmp_path / "b", toml, "\n".join(["C [deg],X [mm]," + head.split(",", 2)[2], *swapped[::-1]]) + "\n") == first
    others = [of(tmp_path / str(k), toml + more, table) for k, (more, table) in enumerate([
        ("tool_length = 80.0\n", MAP), ('directions = "machine"\n', MAP), ("repeats = { C = 360 }\n", MAP),
        ("sign = -1\n", MAP), ("zero = { X = 50, C = 90 }\n", MAP), ("", MAP.replace("\n50,", "\n51,")),
        ("", MAP.replace("dy", "d").replace("dx", "dy").replace("d [", "dx ["))])]
    assert len({first, *others}) == 8
