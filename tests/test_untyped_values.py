"""Values have types: `dict[str, Any]` stands where JSON and TOML begin and end, each `# type: ignore` has its reason."""

from __future__ import annotations

import ast
import dataclasses
import re
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

import pytest

from postproc.pipeline.result import PostResult
from postproc.pipeline.stage_values import VerifiedStage
from tests.source import ROOT, nodes, product, written
from toolpaths.cl.cycle_words import CycleValues, StatedValues
from toolpaths.cl.tools import ToolFields
from toolpaths.toolpath import Tool

IGNORED = re.compile(r"# type: ignore")
WITH_A_REASON = re.compile(r"# type: ignore\[[a-z-]+\]  # \w")
RULE_WITH_A_REASON = re.compile(r"# noqa: [A-Z]+[0-9]+  # \w")
FIGURES = "figures of --json, and text made of them"
SCHEMA = "a JSON schema"
TABLES = "tables of a TOML file"
RECORDS = "JSON in records of CL files"
CERTIFICATES = "certificates, JSON"
BORDERS = {
    "postproc/controllers/model.py": "keys of a pydantic model that is copied with others",
    "machines/__init__.py": SCHEMA, "machines/loader.py": SCHEMA, "machines/calibration/measurement_file.py": SCHEMA,
    "machines/geometric_error/files/loader.py": SCHEMA,
    "machines/figures.py": TABLES, "machines/toml_lines.py": TABLES, "machines/user_file.py": TABLES,
    "toolpaths/dataclass.py": "what a field of any class holds",
    "postproc/base/given.py": "what a caller gives, before its type is known",
    "machines/user_model.py": SCHEMA, "postproc/cli/shared/schemas.py": SCHEMA,
    "postproc/cli/machines_controllers.py": SCHEMA, "postproc/python/calls.py": FIGURES,
    "machines/exchange/draft.py": TABLES, "machines/sheet/file_text.py": TABLES,
    "machines/value_words.py": "what pydantic says of a fault",
    **{f"machines/{name}.py": FIGURES for name in (
        "analysis/certify", "analysis/certify_chain", "analysis/chain", "analysis/limits_of_box", "analysis/maps",
        "layouts/design",
        "dynamics/report", "dynamics/rods", "stiffness/report", "tolerances/report")},
    **{f"{name}.py": CERTIFICATES for name in (
        "machines/analysis/certificate_figure", "machines/certificate/certificate_file", "machines/certificate/lookup",
        "postproc/certificate_check/check", "postproc/certificate_check/chains", "postproc/certificate_check/legs",
        "postproc/certificate_check/held", "postproc/certificate_check/parts", "postproc/certificate_check/machine_file",
        "postproc/certificate_check/run")},
    **{f"postproc/dossier/{name}.py": FIGURES for name in ("content", "page", "words")},
    "machines/analysis/levers.py": FIGURES, "machines/analysis/sizes.py": FIGURES, "machines/analysis/star.py": FIGURES,
    "machines/layouts/cranks.py": FIGURES, "machines/calibration/repeatability.py": FIGURES,
    "postproc/cli/machine_report.py": FIGURES,
    "postproc/cli/machine_certify.py": FIGURES, "postproc/cli/machine_design.py": FIGURES,
    "machines/analysis/report.py": FIGURES, "machines/geometric_error/exchange/survey.py": FIGURES,
    "postproc/report/loads.py": FIGURES, "postproc/report/places.py": FIGURES, "postproc/cli/report.py": FIGURES,
    **{f"postproc/page/{name}.py": FIGURES for name in (
        "columns", "document", "drawings", "quantity_drawings", "run", "skeleton", "solids", "tabs", "tool_outlines",
        "tools", "what_if")},
    "postproc/base/team.py": "what workers are given and give back",
    "postproc/base/program_time.py": FIGURES, "postproc/cycle_time/toppra_check.py": FIGURES,
    "postproc/report/summary.py": FIGURES, "postproc/report/trace.py": FIGURES, "postproc/report/unwinding.py": FIGURES,
    "postproc/placement/report.py": FIGURES, "postproc/cycle_time/report.py": FIGURES,
    "postproc/cycle_time/conversion.py": FIGURES, "postproc/cycle_time/shares.py": FIGURES,
    "postproc/time_fit/fit_text.py": FIGURES, "postproc/time_fit/plan_text.py": FIGURES,
    "postproc/time_study/side_by_side.py": FIGURES,
    "postproc/orientation/figures/polytope_edges.py": FIGURES,
    "postproc/orientation/report/figures_of_choice.py": FIGURES,
    "postproc/orientation/turning/turning_report.py": FIGURES,
    "postproc/proof/file.py": "the proof file, JSON", "postproc/proof/hashes.py": TABLES,
    "postproc/proof/changes.py": FIGURES,
    "postproc/batch/index.py": FIGURES, "postproc/differences/report.py": FIGURES,
    "postproc/cli/compare.py": FIGURES, "postproc/cli/batch.py": FIGURES,
    "postproc/cli/time.py": FIGURES, "postproc/cli/time_variants.py": FIGURES,
    "postproc/cli/place.py": FIGURES, "postproc/cli/orient.py": FIGURES,
    "postproc/cli/shared/console.py": FIGURES, "postproc/cli/error_text.py": FIGURES, "postproc/cli/error_files.py": FIGURES,
    "postproc/cli/catalogue.py": FIGURES, "postproc/cli/setup_new.py": FIGURES,
    "postproc/cli/setup_align.py": FIGURES, "postproc/alignment/report.py": FIGURES,
    "postproc/cli/shared/job_defaults.py": "defaults of options", "postproc/setup_sheet/text.py": TABLES,
    "postproc/verification/second_witness.py": TABLES, "postproc/witness/states.py": TABLES,
    "postproc/witness/sides.py": TABLES, "postproc/witness/held.py": TABLES,
    "postproc/witness/place.py": TABLES, "postproc/witness/errors.py": TABLES,
    "postproc/witness/machine.py": TABLES, "postproc/witness/clamps.py": TABLES, "postproc/witness/commanded.py": TABLES,
    "postproc/witness/evidence.py": TABLES,
    "postproc/witness/motion.py": TABLES, "postproc/witness/second_reading.py": TABLES, "postproc/setup/files.py": TABLES,
    "toolpaths/diagnostics.py": FIGURES, "toolpaths/cl/inspect.py": FIGURES, "toolpaths/cl/structure.py": RECORDS,
    "toolpaths/interrupted_runs.py": "the journal, JSON",
    "toolpaths/cl/build.py": "what handlers of records keep, each its own class, checked where it is taken out",
    "toolpaths/compiled.py": "keywords of numba", "toolpaths/drawing.py": "keywords of matplotlib",
    "machines/analysis/machine_figure.py": "keywords of matplotlib",
    "toolpaths/shapes.py": "names of a function that is made",
    "postproc/cli/shared/group.py": "keywords of typer", "postproc/placement/figure.py": "keywords of matplotlib",
    "postproc/pipeline/stage_values.py": "what one stage adds to the value before: its fields, by their names",
    "postproc/orientation/passes/parallel_map.py": "objects of a pickle by their numbers"}
"""files with dictionaries or keywords of anything, and what comes in or goes out there"""
LOOP = "arguments of a compiled loop: numba gives them their types"
DRAWN = "axes of matplotlib"
LAZY = "names of a package that are imported when they are first asked for"
ANYTHING = {
    "postproc/base/json_values.py": FIGURES,
    "machines/certificate/spans.py": "an index of numpy", "postproc/certificate_check/balls.py": "an index of numpy",
    "machines/geometric_error/actual/rods_loop.py": LOOP, "postproc/collision/kernel.py": LOOP,
    "postproc/correction/backlash_steps_loop.py": LOOP, "postproc/cycle_time/linuxcnc_kernels.py": LOOP,
    "postproc/feedrate/kernels/coefficients.py": LOOP, "postproc/feedrate/kernels/interior.py": LOOP,
    "postproc/feedrate/kernels/second_order.py": LOOP, "postproc/feedrate/kernels/splines.py": LOOP,
    "postproc/feedrate/kernels/tightening.py": LOOP, "postproc/feedrate/kernels/packing.py": LOOP,
    "postproc/feedrate/kernels/samples.py": LOOP, "postproc/readback/alignment/align.py": LOOP,
    "postproc/witness/loops.py": LOOP, "postproc/report/residual_figure.py": DRAWN,
    "machines/calibration/figures.py": DRAWN, "machines/geometric_error/exchange/figures.py": DRAWN,
    "machines/geometric_error/__init__.py": LAZY, "postproc/__init__.py": LAZY,
    "machines/kinematics/base.py": "kinematics of a kind that only the form knows",
    "machines/models.py": "a value before pydantic checks it",
    "postproc/setup/model.py": "the value of any key",
    "postproc/setup/spindle.py": "a value before pydantic checks it",
    "postproc/cli/shared/options.py": "words of a Literal",
    "postproc/batch/cluster.py": "clients and futures of distributed, which states no types",
    "postproc/batch/run.py": "clients and futures of distributed, which states no types",
    "postproc/feedrate/rest_to_rest.py": "a profile of ruckig, which states no types",
    "postproc/placement/bodies.py": "managers of trimesh, which states no types",
    "postproc/placement/write.py": "a document of tomlkit", "postproc/pipeline/stages.py": "the value of any stage",
    "postproc/readback/comparison/states.py": "a state of any kind, and how it is worded",
    "postproc/witness/other_forms.py": "values of Part 21 text, lists within lists",
    "postproc/witness/execution.py": "a value of any kind, held from a row on"}
"""other files in whose annotations anything stands"""
MAPPINGS = {"dict", "Mapping", "MutableMapping"}
NAMES = (["str"], ["tuple[str, ...]"])
ALIASES = {"Values"}
"""names that stand for such a dictionary (machines/toml_lines.py)"""


def files() -> dict[str, str]:
    return {path.relative_to(ROOT).as_posix(): written(path) for path in product()}


def annotations(found: Iterable[ast.AST]) -> Iterator[tuple[ast.expr, bool]]:
    """Annotations of arguments, results and variables; True for those of `**keywords`."""
    for node in found:
        if isinstance(node, ast.FunctionDef):
            a = node.args
            given = (*a.posonlyargs, *a.args, *a.kwonlyargs, a.vararg, a.kwarg)
            yield from ((arg.annotation, arg is a.kwarg) for arg in given if arg is not None and arg.annotation is not None)
            if node.returns is not None:
                yield node.returns, False
        elif isinstance(node, ast.AnnAssign):
            yield node.annotation, False


def untyped(node: ast.expr, keywords: bool) -> bool:
    """True for dictionaries and pairs by name whose values may be anything, and for keywords of anything."""
    if names_in(node) & ALIASES or (keywords and names_in(node) & {"Any", "object"}):
        return True
    return any(by_name(part) and names_in(part.slice.elts[-1]) & {"Any", "object"} for part in ast.walk(node)
               if isinstance(part, ast.Subscript) and isinstance(part.slice, ast.Tuple))


def names_in(node: ast.AST) -> set[str]:
    return {part.id for part in ast.walk(node) if isinstance(part, ast.Name)}


def by_name(node: ast.Subscript) -> bool:
    """A dictionary, or one of its pairs."""
    assert isinstance(node.slice, ast.Tuple)
    kind = ast.unparse(node.value)
    return kind in MAPPINGS or (kind == "tuple" and [ast.unparse(one) for one in node.slice.elts[:-1]] in NAMES)


@cache
def found_in_files() -> tuple[set[str], set[str]]:
    """Files with dictionaries of anything, and files where anything stands in an annotation."""
    dictionaries, anything = set[str](), set[str]()
    for file in files():
        for node, keywords in annotations(nodes(ROOT / file)):
            if untyped(node, keywords):
                dictionaries.add(file)
            if "Any" in names_in(node):
                anything.add(file)
    return dictionaries, anything


def unreasoned(text: str) -> list[str]:
    return [line.strip() for line in text.splitlines() if IGNORED.search(line) and not WITH_A_REASON.search(line)]


def test_dictionaries_of_anything_stand_at_borders() -> None:
    found, _ = found_in_files()
    assert found - set(BORDERS) == set()
    assert set(BORDERS) - found == set(), "no longer there"


def test_anything_else_has_a_type() -> None:
    dictionaries, anything = found_in_files()
    assert anything - dictionaries - set(ANYTHING) == set()
    assert set(ANYTHING) - (anything - dictionaries) == set(), "no longer there"


def test_no_value_of_a_stage_is_a_dictionary_of_anything() -> None:
    """A field of a class is typed, but for what the second witness has from files and what pydantic checks."""
    found = {file for file in files() for cls in nodes(ROOT / file) if isinstance(cls, ast.ClassDef)
             for field in cls.body if isinstance(field, ast.AnnAssign) and untyped(field.annotation, False)}
    assert found == {"postproc/witness/evidence.py", "machines/user_file.py"}


@pytest.mark.parametrize(("text", "known"), [
    ("x: dict[str, Any]", True), ("x: Mapping[str, Any] | None", True), ("x: list[tuple[str, Any]]", True),
    ("x: dict[str, object]", True), ("x: dict[int, dict[str, Any]]", True), ("x: tuple[Values, int]", True),
    ("def f(**values: Any): ...", True), ("def f() -> tuple[dict[str, Any], int]: ...", True),
    ("x: dict[str, float]", False), ("x: Any", False), ("def f(values: Any): ...", False),
    ("x: dict[str, list[str]]", False),
    ("def f(**values: Unpack[Fields]): ...", False), ("x: tuple[Floats, Floats]", False)])
def test_a_dictionary_of_anything_is_noticed(text: str, known: bool) -> None:
    assert any(untyped(*one) for one in annotations(ast.walk(ast.parse(text)))) == known


def test_fields_by_name_are_those_of_their_class() -> None:
    """Typed dictionaries that a class is made of or changed by name the class's own fields, with its types."""
    for stated, cls, but in ((ToolFields, Tool, {"number"}), (StatedValues, CycleValues, None)):
        types = {field.name: str(field.type).removesuffix(" | None") for field in dataclasses.fields(cls)}
        given = {name: kind.__forward_arg__.removesuffix(" | None") for name, kind in stated.__annotations__.items()}
        assert {name: types[name] for name in given} == given
        assert but is None or set(types) - set(given) == but


def test_stages_hand_on_what_the_result_holds() -> None:
    """A result takes over by name what stages hand on: each name has one type in both, in the result perhaps None."""
    held = {field.name: str(field.type) for field in dataclasses.fields(PostResult)}
    handed = {field.name: str(field.type) for field in dataclasses.fields(VerifiedStage)}
    assert set(handed) - set(held) == {"left", "drawing", "sections"}
    for name in held.keys() & handed.keys():
        assert held[name].removesuffix(" | None") == handed[name].removesuffix(" | None"), name
    assert set(held) - set(handed) == {"reached", "optimised", "feed_times", "keep", "figures"}


def test_a_type_that_is_passed_over_has_its_reason() -> None:
    found = {file: lines for file, text in files().items() if (lines := unreasoned(text))}
    assert found == {}
    assert sum(len(IGNORED.findall(text)) for text in files().values()) <= 30


def test_nothing_is_silenced_where_types_are_not_checked() -> None:
    """Tests and samples are not type-checked, so that they pass nothing over; rules of ruff have their reasons there too."""
    found = {path.relative_to(ROOT).as_posix(): path.read_text("utf-8")
             for top in ("tests", "samples") for path in sorted((ROOT / top).rglob("*.py")) if path != Path(__file__)}
    assert {file for file, text in found.items() if IGNORED.search(text)} == set()
    everywhere = found | files()
    assert {file for file, text in everywhere.items() for line in text.splitlines()
            if "# noqa" in line and not RULE_WITH_A_REASON.search(line)} == set()


@pytest.mark.parametrize(("line", "known"), [
    ("x = 1  # type: ignore", False), ("x = 1  # type: ignore[arg-type]", False),
    ("x = 1  # type: ignore[arg-type]  # by names of fields", True)])
def test_a_reason_is_known(line: str, known: bool) -> None:
    assert (unreasoned(line) == []) == known
