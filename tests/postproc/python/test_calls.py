"""The calls of the package: docs/python.md as it stands, values of the calls against those of the stages, faults raised."""

from __future__ import annotations

import ast
import doctest
import subprocess
import sys
import sysconfig
import tomllib
from pathlib import Path

import numpy as np
import pytest

import machines
import postproc
import toolpaths
from postproc.setup.model import SetupFile
from tests.postproc.orientation.part_choice import PART
from tests.postproc.placement.test_placement import passes, setup_of
from tests.source import ROOT
from toolpaths import read
from toolpaths.diagnostics import DiagnosticError, error

SAMPLES = ROOT / "samples"


def test_every_example_of_the_page_gives_what_it_shows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(SAMPLES)
    done = doctest.testfile(str(ROOT / "docs" / "python.md"), module_relative=False)
    assert done.attempted > 20 and done.failed == 0
    examples = doctest.DocTestParser().get_examples((ROOT / "docs" / "python.md").read_text("utf-8"))
    code = ast.parse("".join(one.source for one in examples))
    named = {ast.unparse(node) for node in ast.walk(code) if isinstance(node, ast.Attribute)}
    public = {f"{package.__name__}.{name}" for package in (postproc, machines, toolpaths) for name in package.__all__}
    assert public - named - {"postproc.Toolpath"} == set()  # imported by its name there


def test_an_editable_install_is_a_line_that_type_checkers_follow() -> None:
    """A module that finds the packages when they are imported is followed by no type checker."""
    lines = [one.read_text("utf-8") for one in Path(sysconfig.get_path("purelib")).glob("__editable__.postproc-*.pth")]
    assert [line for line in lines if line.startswith("import ")] == []
    layout = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["setuptools"]["package-dir"]
    assert layout == {"": "."} and all(Path(package.__file__).with_name("py.typed").exists()
                                       for package in (postproc, machines, toolpaths))


def test_all_names_are_there() -> None:
    assert all(getattr(postproc, name) is not None for name in postproc.__all__)
    with pytest.raises(AttributeError, match="no attribute 'covert'"):
        _ = postproc.covert


def test_time_of_a_program_is_that_of_its_conversion(tmp_path: Path) -> None:
    path = passes((1.0, 0.0), 1)
    setup = setup_of((0.0, 0.0, 50.0))
    program = tmp_path / "a program.ngc"
    program.write_text(postproc.convert(path, "mill-3axis", setup=setup).checked().text)
    from_file = postproc.time(program, "mill-3axis", setup=setup)
    assert from_file.seconds == pytest.approx(postproc.time(path, "mill-3axis", setup=setup).seconds, rel=1e-3)
    assert postproc.verify(program, path, "mill-3axis", setup=setup).checked().ok


def test_what_a_call_cannot_do_it_raises_with_all_diagnostics(tmp_path: Path) -> None:
    path = passes((1.0, 0.0), 1)
    wrong = tmp_path / "shop.toml"
    wrong.write_text("speed = 3\n")
    with pytest.raises(DiagnosticError) as found:
        postproc.time(path, "mill-3axis", setup=wrong)
    assert found.value.diagnostics[0].code == "file.unknown-key" and found.value.diagnostics[0].lines == (1,)
    with pytest.raises(DiagnosticError):
        postproc.place(path, "mill-3axis", SetupFile())
    with pytest.raises(DiagnosticError):
        postproc.calibrate(tmp_path / "none.toml")
    far = passes((1.0, 0.0), 1, 9000.0)
    with pytest.raises(DiagnosticError, match="travel"):
        postproc.time(far, "mill-3axis", setup=setup_of())
    with pytest.raises(DiagnosticError, match="travel"):
        postproc.convert(far, "mill-3axis", setup=setup_of()).checked()
    with pytest.raises(DiagnosticError):
        postproc.orient(far, "mill-3axis")


WRONG_CALLS = {
    "a file": (lambda path: postproc.convert("part.cls", "mill-3axis"), "path is of type str; give a Toolpath"),
    "what read gives": (lambda path: postproc.orient((path, []), "mill-3axis"), "path is of type tuple; give its first"),
    "an array": (lambda path: postproc.time(path.tip, "mill-3axis"), "path is of type ndarray; give a Toolpath"),
    "no part": (lambda path: postproc.place(None, "mill-3axis", "s.toml"), "path is of type NoneType; give a Toolpath"),
    "verify a file": (lambda path: postproc.verify("p.ngc", "p.cls", "mill-3axis"), "path is of type str"),
    "options": (lambda path: postproc.convert(path, "mill-3axis", options={}), "options is of type dict; give"),
    "options of a program": (lambda path: postproc.time("p.ngc", "mill-3axis", options={}), "options is of type dict"),
    "percent": (lambda path: postproc.time(path, "mill-3axis", override=50), "override is 50; give it as a part of"),
    "nan": (lambda path: postproc.time(path, "mill-3axis", override=np.nan), "override is nan; give it as a part of"),
    "a text": (lambda path: postproc.time(path, "mill-3axis", override="1"), "override is '1'; give it as a part of"),
    "no number": (lambda path: postproc.Options(tolerance=np.nan), "tolerance is nan; give a number"),
    "a number as text": (lambda path: postproc.Options(axis_tolerance="1"), "axis_tolerance is '1'; give a number"),
    "a word": (lambda path: postproc.Options(output="rtcp"), "output is 'rtcp'; give one of 'auto', 'axes'"),
    "a list": (lambda path: postproc.Options(units=["mm"]), "units is .'mm'.; give one of"),
    "a flag": (lambda path: postproc.Options(smooth="no"), "smooth is 'no'; give True or False"),
    "words": (lambda path: postproc.Options(allow_unknown="ABC"), "allow_unknown is 'ABC'; give a tuple of texts"),
    "what is kept": (lambda path: postproc.convert(path, "mill-3axis", keep="some"), "keep is 'some'; give one of 'all', '"),
    "an array as number": (lambda path: postproc.Options(tolerance=np.zeros(600)), "tolerance is an array of float64"),
    "speeds": (lambda path: postproc.time(path, "mill-3axis", override=np.ones(3)), "override is an array of float64"),
    "a number as file": (lambda path: postproc.Options(setup=5), "setup is 5; give a text"),
}


@pytest.mark.parametrize("name", WRONG_CALLS)
def test_a_wrong_call_says_what_to_give(name: str) -> None:
    call, message = WRONG_CALLS[name]
    with pytest.raises(DiagnosticError, match=message) as found:
        call(passes((1.0, 0.0), 1))
    assert {d.code for d in found.value.diagnostics} == {"call.value"}


def test_all_wrong_options_are_named_at_once() -> None:
    with pytest.raises(DiagnosticError) as found:
        postproc.Options(tolerance=np.nan, units="furlong", feed="fast")
    assert [d.message.split()[0] for d in found.value.diagnostics] == ["tolerance", "units", "feed"]
    assert postproc.Options(tolerance=np.float32(0.02), setup=Path("s.toml"), max_tilt=30).tolerance > 0.0


def test_a_cl_file_is_no_program_whose_time_is_asked(tmp_path: Path) -> None:
    (tmp_path / "part.cls").write_text("PARTNO/A\nUNITS/MM\nLOADTL/1\nGOTO/0,0,50\nFINI\n")
    with pytest.raises(DiagnosticError, match="this is a CL file") as found:
        postproc.time(tmp_path / "part.cls", "mill-3axis")
    assert [d.code for d in found.value.diagnostics] == ["file.program"] and found.value.diagnostics[0].hint


def test_a_path_that_was_not_read_whole_is_placed_by_nobody() -> None:
    from dataclasses import replace

    path = replace(passes((1.0, 0.0), 1), faults=(error("cl.word", "a fault of the file"),))
    with pytest.raises(DiagnosticError, match="a fault of the file"):
        postproc.place(path, "mill-3axis", setup_of(x=(-10.0, 10.0)))


@pytest.mark.slow
def test_place_gives_what_its_command_writes() -> None:
    choice = postproc.place(passes((1.0, 0.0), 1), "mill-3axis", setup_of((0.0, 0.0, 50.0), x=(-10.0, 10.0)))
    assert -10.0 <= choice.part.origin[0] <= 10.0 and choice.looked > 0


def test_calibrate_gives_what_its_command_writes() -> None:
    outcome = postproc.calibrate(SAMPLES / "calibration" / "reversal.toml")
    assert outcome.model is not None and all(one["sigma"] > 0.0 for one in outcome.figures["parameters"].values())


@pytest.mark.slow
def test_orient_gives_the_plans_of_its_command() -> None:
    choice = postproc.orient(read(PART)[0], "mikron-ucp710", options=postproc.Options(setup="", orient="auto"))
    assert choice.plans["auto"].seconds <= choice.plans["keep"].seconds


def test_convert_imports_nothing_that_it_does_not_need() -> None:
    """In a process of its own, what this one has imported says nothing: no library that a small file does without, few
    modules, few classes whose methods are compiled when they are made (a third of a millisecond each: those that are
    not frozen or have slots); before names are read nothing that works on results."""
    code = ("import sys, postproc.cli.app, postproc.proof.command, toolpaths\n"
            "early = ('rich', 'postproc.pipeline.result', 'postproc.job', 'postproc.readback')\n"
            "print(*[m for m in early if m in sys.modules])\n"
            "p = toolpaths.read('pocket.cls')[0]\n"
            "r = postproc.convert(p, 'mikron-ucp710', setup='tools.setup.toml').checked()\n"
            "from postproc.cycle_time.conversion import estimate_of; estimate_of(r)\n"
            "heavy = ('scipy', 'numba', 'matplotlib', 'trimesh', 'numpy.ma', 'postproc.placement.region')\n"
            "print(*[m for m in heavy if m in sys.modules])\n"
            "own = {n: m for n, m in sys.modules.items() if n.split('.')[0] in ('postproc', 'machines', 'toolpaths')}\n"
            "text = lambda c: getattr(getattr(vars(c).get('__eq__'), '__code__', None), 'co_filename', '') == '<string>'\n"
            "made = {f'{c.__module__}.{c.__name__}' for n, m in own.items() for c in vars(m).values()"
            " if isinstance(c, type) and c.__module__ in own and 'witness' not in n and text(c)}\n"
            "print(len(own), len(made), *made)")
    done = subprocess.run([sys.executable, "-c", code], cwd=SAMPLES, capture_output=True, text=True, check=True, timeout=60,
                          env={"PYTHONPATH": str(ROOT), "PATH": ""})
    early, heavy, (modules, compiled, *which) = (line.split() for line in done.stdout.splitlines())
    assert early == heavy == [] and int(modules) <= 421 and int(compiled) <= 27, (early, heavy, modules, which)
