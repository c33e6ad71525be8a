"""A file or package of others in the place of one of ours is one line, and nothing of it is run."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import postproc
from postproc.base import neighbours
from postproc.base.neighbours import foreign

ROOT = Path(__file__).parents[3]


def test_our_own_packages_are_found() -> None:
    assert foreign() == ""


@pytest.mark.parametrize(("name", "package"), [("machines", False), ("toolpaths", True)])
def test_another_one_is_named(name: str, package: bool, tmp_path: Path) -> None:
    bomb = tmp_path / (f"{name}/__init__.py" if package else f"{name}.py")
    bomb.parent.mkdir(exist_ok=True)
    bomb.write_text("raise SystemExit('run by mistake')", encoding="utf-8")
    call = f"import sys; sys.path[:0] = [{str(tmp_path)!r}, {str(ROOT)!r}]; from postproc.__main__ import main; main()"
    ran = subprocess.run([sys.executable, "-c", call, "--version"], capture_output=True, text=True, cwd=tmp_path,
                         check=False)
    assert ran.returncode == 1 and str(bomb) in ran.stderr and "environment of its own" in ran.stderr, ran.stderr
    assert "by mistake" not in ran.stderr and len(ran.stderr.splitlines()) == 1


def test_one_that_is_installed_over_ours_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """pip lets a second distribution replace the door of our package: `machine list` ended with a fault."""
    ours = tmp_path / "machines" / "__init__.py"
    ours.parent.mkdir()
    (tmp_path / "machines" / "loader.py").write_text("", encoding="utf-8")
    ours.write_text("WHAT = 'other'\n", encoding="utf-8")
    monkeypatch.setattr(neighbours, "__file__", str(tmp_path / "postproc" / "base" / "neighbours.py"))
    monkeypatch.delitem(sys.modules, "machines", raising=False)
    monkeypatch.syspath_prepend(str(tmp_path))
    assert str(ours) in foreign.__wrapped__()


def test_from_python_it_is_an_import_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(neighbours, "foreign", lambda: "another package")
    with pytest.raises(ImportError, match="another package"):
        _ = postproc.Options
