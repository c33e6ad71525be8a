"""Rooms: every file stands in one, imports go down only, no circle, no room of more than 25 files; tests stand likewise."""

from __future__ import annotations

import importlib
import re
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

from tests.source import ROOT, product
from tests.test_imports import ROAD, circle, graph, texts

FLOORS = (
    ("toolpaths", "arrays, units, diagnostics, files, the Toolpath"),
    ("toolpaths.smoothing", "smooth curves within a tolerance"),
    ("toolpaths.cl.text", "characters and lines of CL files to statements, dialects, subprograms"),
    ("toolpaths.cl.systems", "files of systems that write no APT text, as statements"),
    ("toolpaths.cl", "statements to a Toolpath, and back to text"),
    ("machines.kinematics", "serial and parallel kinematics"),
    ("machines.kinematics.legs", "any platform on legs, its drives and freedoms as data"),
    ("machines.certificate", "workspaces proved box by box, the files of the proofs"),
    ("machines", "machine files, the Machine, polytopes, reach"),
    ("machines.data", "built-in machine files: models of kinds and classes"),
    ("machines.catalogue", "built-in machine files: machines that people own, with sources"),
    ("machines.exchange", "machine files of others, LinuxCNC's written"),
    ("machines.sheet", "a new machine: its data sheet, pivots, jogs, drawing"),
    ("machines.geometric_error.tables", "curves and tables of errors, their files"),
    ("machines.geometric_error.actual", "the machine with errors, corrected commands"),
    ("machines.geometric_error.files", "error model files: reading, covariance, fingerprint"),
    ("machines.tolerances", "influence of each dimension on the tool, tolerance budgets"),
    ("machines.stiffness", "forces in rods and drives, stiffness of the tip"),
    ("machines.dynamics", "forces of the motors in motion, what their limits allow"),
    ("machines.analysis", "what a machine is good for"),
    ("machines.layouts", "dimensions of a new machine on legs, its file"),
    ("machines.geometric_error.exchange", "to and from other forms, figures, surveys"),
    ("machines.calibration", "error models from measurements"),
    ("postproc.base", "options, version, memory"),
    ("postproc.witness", "second witness: shares no code with the rest"),
    ("postproc.certificate_check", "certificates checked: shares no code with the search"),
    ("postproc.setup", "the set-up file"),
    ("postproc.feedrate.kernels", "compiled loops of the planner"),
    ("postproc.feedrate", "the planner: arrays and limits in, motion out"),
    ("postproc.controllers", "controller files: what a control is, no text"),
    ("postproc.reference", "records expanded: events, moves, holes, tools, coolant"),
    ("postproc.control", "what words mean: interpolation modes, planes, arcs"),
    ("postproc.joints", "branches, windings, rewinds, singular directions"),
    ("postproc.path", "blocks in joints: links, points between, travel, reach"),
    ("postproc.job", "one CL file on one machine, ready to be solved or compared with"),
    ("postproc.correction", "geometric errors corrected"),
    ("postproc.compile", "canonical program: words, feeds, commands, cycles"),
    ("postproc.planning", "passes as smooth joint paths, feeds within the limits"),
    ("postproc.writing", "text in each control's dialect"),
    ("postproc.readback.text", "characters to canonical words, modal state"),
    ("postproc.readback.macros", "macro language executed: variables, jumps, subprograms to plain blocks"),
    ("postproc.readback.dialects", "the reader of each control"),
    ("postproc.readback.execution", "canonical words to motion and poses"),
    ("postproc.readback.alignment", "which blocks run each move of the CL file"),
    ("postproc.readback.comparison", "motion against the CL file, bounds, checks"),
    ("postproc.collision", "tools against part, table and fixtures"),
    ("postproc.verification", "reading a program back, second witness, errors that are left"),
    ("postproc.orientation.passes", "3+2 passes, their limits and poses"),
    ("postproc.orientation.candidates", "tool axes of one pass, timed and ranked"),
    ("postproc.orientation.plans", "plans over all passes, the choice"),
    ("postproc.orientation.turning", "tool axes that turn along cuts, chosen together with the feed"),
    ("postproc.orientation.report", "the choice as figures and text"),
    ("postproc.orientation.figures", "the choice as pictures"),
    ("postproc.pipeline", "the table of stages; convert, verify, choose_axes"),
    ("postproc.proof", "the proof as a file, what has changed since"),
    ("postproc.clock", "a control's motion: its path from commanded points, axis motion by time"),
    ("postproc.cycle_time", "how long a program takes, with a band"),
    ("postproc.time_fit", "the model of a control fitted to measured runs"),
    ("postproc.time_study", "times side by side, what if, tables, a figure"),
    ("postproc.differences", "what two programs do differently"),
    ("postproc.placement", "where the part stands on the table"),
    ("postproc.alignment", "a part that is not where it was meant, measured"),
    ("postproc.report", "summary, trace, residual field"),
    ("postproc.setup_sheet", "a new set-up: facts, questions, a place that fits"),
    ("postproc.page", "the report: a page that opens offline, and the same as JSON"),
    ("postproc.dossier", "a machine described: as text, as JSON, as a page"),
    ("postproc.explain", "a page for each code of a message"),
    ("postproc.python", "the calls of the package: time, orient, place, calibrate, analyse"),
    ("postproc.batch", "many runs of commands: jobs, workers, what is done already"),
    ("postproc.cli.shared", "what all commands share: options, messages, files, the outermost guard"),
    ("postproc.cli", "the command line"),
)
"""(room, what it does): a room imports only rooms before it"""
CALLS = ("toolpaths", "machines", "postproc")
"""packages whose own names (`toolpaths.read`, `postproc.convert`) only later packages may use, and `postproc.__main__`"""
MOST = 25


def room_of(module: str, is_folder: bool) -> str:
    """The room of a module; "" for the names of a package as a whole, which stand above all of its rooms."""
    if module in (*CALLS, "machines.geometric_error", "postproc.__main__"):
        return ""
    return module if is_folder else module.rpartition(".")[0]


def folders() -> set[str]:
    """Dotted names of all packages."""
    return {".".join(path.parent.relative_to(ROOT).parts) for top in ROAD for path in (ROOT / top).rglob("__init__.py")}


def upwards(links: Mapping[str, set[str]], packages: set[str], order: Mapping[str, int]) -> list[str]:
    """Imports of a room above, and of a package's own names from inside it."""
    wrong = []
    for module, others in links.items():
        room = room_of(module, module in packages)
        for other in others if room else ():
            there = room_of(other, other in packages)
            if there == "":
                inside = module.startswith(f"{other}.") or other == "postproc.__main__"
                if inside:
                    wrong.append(f"{module} imports {other}, which stands above its rooms")
            elif there != room and order.get(there, -1) >= order.get(room, -1):
                wrong.append(f"{module} imports {other}")
    return wrong


ORDER = {room: k for k, (room, _) in enumerate(FLOORS)}


def test_every_file_has_a_room() -> None:
    packages, outside = folders(), []
    for module, text in texts().items():
        room = room_of(module, module in packages)
        holds_rooms = module in packages and not text.imports - {"__future__", "__future__.annotations"}
        if room and room not in ORDER and not holds_rooms:
            outside.append(module)
    assert outside == []
    assert [room for room in ORDER if not (ROOT / room.replace(".", "/")).is_dir()] == []


def test_imports_go_down() -> None:
    assert upwards(graph(texts()), folders(), ORDER) == []


def test_no_circle_of_rooms() -> None:
    packages, rooms = folders(), dict[str, set[str]]()
    for module, others in graph(texts()).items():
        if room := room_of(module, module in packages):
            there = {room_of(other, other in packages) for other in others}
            rooms.setdefault(room, set()).update(there - {"", room})
    assert circle(rooms) == []


def test_an_import_upwards_is_noticed() -> None:
    links = {"a.low.x": {"a.high.y"}, "a.high.y": {"a.low.z"}, "a.low.z": {"postproc"}, "postproc.b.c": {"postproc"}}
    order = {"a.low": 0, "a.high": 1, "postproc.b": 2}
    assert upwards(links, set(), order) == ["a.low.x imports a.high.y",
                                            "postproc.b.c imports postproc, which stands above its rooms"]


def test_no_room_hides_a_call_of_its_package() -> None:
    """A folder `verify` would stand in the place of `postproc.verify` once it is imported."""
    for name in (*CALLS, "machines.geometric_error"):
        rooms = {room.removeprefix(f"{name}.").split(".")[0] for room in folders() if room.startswith(f"{name}.")}
        assert set(importlib.import_module(name).__all__) & rooms == set()


def test_no_room_is_large() -> None:
    count = Counter(str(path.parent.relative_to(ROOT)) for top in ROAD for path in (ROOT / top).rglob("*.py"))
    assert {room: n for room, n in count.items() if n > MOST} == {}


def test_tests_stand_as_the_rooms_do() -> None:
    """A folder of tests for each room that is tested, at its first name below the package."""
    for top in ROAD:
        tests = ROOT / "tests" / top
        known = {room.split(".")[1] for room in ORDER if room.startswith(f"{top}.")}
        found = {path.parent.relative_to(tests).as_posix() for path in tests.rglob("test_*.py")}
        assert found - {"."} <= known | {f"{one}/{two}" for one in known for two in ("dialects",)}
        assert top != "postproc" or "." not in found
    history = ("leftovers", "review", "second_reading", "everyday")
    assert [path.name for path in (ROOT / "tests").rglob("test_*.py") if path.stem.startswith(
        tuple(f"test_{word}" for word in history))] == []


def unnamed(path: Path, page: str) -> bool:
    """True where a README does not name a file; packages and their doors need no line."""
    return not path.stem.startswith("__") and not re.search(rf"\b{re.escape(path.stem)}\b", page)


def readme_of(path: Path) -> Path:
    """The README of a room, else that of the one above it."""
    return next(folder / "README.md" for folder in path.parents if (folder / "README.md").exists())


def test_the_readme_of_a_room_names_its_files() -> None:
    assert [path.relative_to(ROOT).as_posix() for path in product()
            if unnamed(path, readme_of(path).read_text("utf-8"))] == []


def test_an_unnamed_file_is_noticed() -> None:
    assert unnamed(Path("walk.py"), "| `walks.py` | paths |") and not unnamed(Path("walk.py"), "| `low/walk.py` | paths |")


def test_the_documents_list_the_rooms() -> None:
    rows = {room: f"| `{room.replace('.', '/')}` | {words} |" for room, words in FLOORS}
    for page, some in ((ROOT / "ARCHITECTURE.md", rows), (Path(ROOT, "postproc", "README.md"), {
            room: row for room, row in rows.items() if room.startswith("postproc.")})):
        assert "\n".join(some.values()) in page.read_text("utf-8"), page.name
