"""The notebooks of the samples: their cells run in their order; they hold no outputs and no paths of a computer."""

from __future__ import annotations

import ast
import json
import tempfile
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "samples/notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))


def cells(place: Path) -> list[dict[str, object]]:
    """The cells of a notebook of format 4."""
    values = json.loads(place.read_text("utf-8"))
    assert values["nbformat"] == 4 and values["metadata"]["language_info"]["name"] == "python"
    return values["cells"]


def run(place: Path) -> object:
    """All cells in one namespace; what the last expression is worth, which a notebook shows."""
    names: dict[str, object] = {"__name__": place.stem}
    shown = None
    for number, cell in enumerate(cells(place)):
        if cell["cell_type"] == "code":
            tree = ast.parse("".join(cell["source"]), f"{place.name}, cell {number}")
            last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
            exec(compile(tree, tree_name := f"{place.name}, cell {number}", "exec"), names)
            shown = eval(compile(ast.Expression(last.value), tree_name, "eval"), names) if last is not None else None
    return shown


@pytest.mark.parametrize("place", NOTEBOOKS, ids=[place.stem for place in NOTEBOOKS])
def test_a_notebook_runs(place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(FOLDER)  # as Jupyter does
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    assert run(place) is not None


def test_there_are_six_and_they_hold_no_outputs() -> None:
    assert len(NOTEBOOKS) == 6
    for place in NOTEBOOKS:
        found = cells(place)
        assert all(not cell.get("outputs") and cell.get("execution_count") is None for cell in found), place.name
        assert {cell["cell_type"] for cell in found} == {"code", "markdown"}
        assert not any(root in place.read_text("utf-8") for root in ('"/', "'/", "C:\\\\")), place.name


def test_a_cell_that_fails_is_noticed(tmp_path: Path) -> None:
    broken = json.loads(NOTEBOOKS[0].read_text("utf-8"))
    broken["cells"][1]["source"] = ["assert 1 == 2"]
    (tmp_path / "broken.ipynb").write_text(json.dumps(broken))
    with pytest.raises(AssertionError):
        run(tmp_path / "broken.ipynb")
