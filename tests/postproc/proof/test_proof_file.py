"""The line that says what is proved, and the file of the proof: complete, of these bytes, and undamaged."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

import machines
import postproc
import toolpaths
from postproc.base.header_words import PENDING
from postproc.cli.app import app
from postproc.controllers.model import builtin_files, load_controller
from postproc.proof import command
from postproc.proof.file import digest, read_proof
from postproc.proof.hashes import ENDING, input_hashes
from postproc.readback.text.words import plain
from postproc.verification import proof_text as text
from postproc.witness.evidence import Testimony as Said
from postproc.writing.state import comment_room
from tests.postproc.kit import HEAD, NX, codes, convert, good, toolpath

CUT = ("RAPID", "GOTO/0,0,5", "GOTO/12.5,0,5", "GOTO/20,1,4", "GOTO/20,9,4")


SUBS = ["P_1001.SPF"]


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, [str(a) for a in arguments])


def options(folder: Path) -> list[str]:
    return ["-m", f"{folder}/mill.toml", "-c", f"{folder}/shop.toml", "--setup", f"{folder}/s.toml", "--error-model",
            f"{folder}/e.toml"]


@pytest.fixture(scope="module")
def shop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with every kind of input, each with what it stands on, and a proved program."""
    folder = tmp_path_factory.mktemp("shop")
    for name, text_of in {
            "part.apt": "\n".join([*HEAD, *CUT, "FINI"]), "mill.toml": 'base = "under.toml"\n',
            "under.toml": 'base = "mill-3axis"\n', "shop.toml": 'base = "siemens-840d"\n[format]\nsequence_step = 5\n',
            "s.toml": 'base = "tools.toml"\n[output]\nsubprograms = true\nfiles = true\n',
            "tools.toml": "[tools.1]\ngauge_length = 80.0\n",
            "e.toml": 'machine = "mill"\n[components.EXX]\ntable = "x.csv"\n',
            "x.csv": "X [mm],EXX [um]\n-300,0\n0,3\n300,8\n"}.items():
        (folder / name).write_text(text_of)
    got = run("convert", folder / "part.apt", *options(folder), "-o", folder / "p.ngc", "--proof")
    assert got.exit_code == 0, got.output
    return folder


def kept(folder: Path) -> dict[str, Any]:
    return json.loads((folder / f"p.ngc{ENDING}").read_text())


def test_every_file_that_the_program_rests_on_is_in_the_proof(shop: Path) -> None:
    proof = kept(shop)
    read = {**proof["inputs"], "program": proof["program"]}
    assert {key: [one["file"] for one in files] for key, files in read.items()} == {
        "cl_file": ["part.apt"], "setup": ["s.toml", "tools.toml"], "error_model": ["e.toml", "x.csv"],
        "machine": ["mill.toml", "under.toml", "mill-3axis.toml"], "controller": ["shop.toml", "siemens-840d.toml"],
        "program": ["p.ngc", *SUBS]}
    for one in (one for files in read.values() for one in files):
        place = next(p for p in (shop / one["file"], Path(machines.__file__).parent / "data" / one["file"],
                                 Path(postproc.__file__).parent / "controllers" / one["file"]) if p.is_file())
        assert hashlib.sha256(place.read_bytes()).hexdigest() == one["sha256"], one["file"]
    assert str(shop) not in json.dumps(proof), "folders are nobody's business"


def test_meshes_of_the_set_up_and_of_its_base_are_in_the_proof(tmp_path: Path) -> None:
    (tmp_path / "under").mkdir()
    (tmp_path / "under" / "base.toml").write_text('[bodies]\npart = "part.stl"\n')
    (tmp_path / "s.toml").write_text('base = "under/base.toml"\n[tools.1]\nholder_mesh = "holder.stl"\n')
    for place in ("under/part.stl", "holder.stl"):
        (tmp_path / place).write_text(place)
    found = input_hashes("mill-3axis", "linuxcnc", postproc.Options(setup=str(tmp_path / "s.toml")))["setup"]
    places = [tmp_path / place for place in ("s.toml", "under/base.toml", "under/part.stl", "holder.stl")]
    assert {one.file: one.sha256 for one in found} == {
        place.name: hashlib.sha256(place.read_bytes()).hexdigest() for place in places}


def test_the_proof_says_what_the_figures_say(shop: Path, tmp_path: Path) -> None:
    got = run("verify", shop / "p.ngc", shop / "part.apt", *options(shop), "--json", tmp_path / "v.json")
    figures, proof = json.loads((tmp_path / "v.json").read_text()), kept(shop)
    assert got.exit_code == 0
    assert figures["proof"] == {"file": str(shop / f"p.ngc{ENDING}"), "unchanged": True, "changed": []}
    assert "are those of the proof" in got.stdout
    back = proof["read_back"]
    assert (back["blocks"], back["blocks_without_bound"]) == (figures["blocks"],
                                                              figures["blocks_without_bound"])
    assert (back["cuts"], back["cuts_bounded"]) == (figures["cuts"], figures["cuts_bounded"])
    assert proof["proved"] == figures["proved"] and back["cuts"] == 3 and proof["statement"] in got.stdout
    assert back["sampled"]["tip_mm"] == pytest.approx(figures["sampled_tip_deviation_mm"], abs=1e-8)
    assert proof["second_reading"]["compared"] == figures["witness"]["compared"]
    assert proof["records"] == {"total": 10, "executed": 10, "neutral": 0, "dropped": 0}


def append(name: str, more: str) -> Callable[[Path], None]:
    def change(folder: Path) -> None:
        with (folder / name).open("a") as file:
            file.write(more)
    return change


CHANGES: list[tuple[str, str, Callable[[Path], None], list[str]]] = [
    ("program", "p.ngc", append("p.ngc", "; edited\n"), []),
    ("program", SUBS[0], append(SUBS[0], "; edited\n"), []),
    ("cl_file", "part.apt", append("part.apt", "\n$$ looked at\n"), []),
    ("setup", "s.toml", append("s.toml", "# ours\n"), []),
    ("setup", "tools.toml", append("tools.toml", "# ours\n"), []),
    ("machine", "under.toml", append("under.toml", "# ours\n"), []),
    ("controller", "shop.toml", append("shop.toml", "# ours\n"), []),
    ("error_model", "e.toml", append("e.toml", "# ours\n"), []),
    ("error_model", "x.csv", append("x.csv", "400,9\n"), []),
    ("options", "tolerance_mm was 0.01, is 0.02", lambda folder: None, ["--tolerance", "0.02"]),
]


@pytest.mark.parametrize(("what", "named", "change", "more"), CHANGES, ids=lambda v: v if isinstance(v, str) else "")
def test_verify_names_the_input_that_changed(shop: Path, tmp_path: Path, what: str, named: str,
                                             change: Callable[[Path], None], more: list[str]) -> None:
    folder = tmp_path / "copy"
    shutil.copytree(shop, folder)
    change(folder)
    got = run("verify", folder / "p.ngc", folder / "part.apt", *options(folder), *more, "--json",
              tmp_path / "v.json")
    figures = json.loads((tmp_path / "v.json").read_text())
    assert got.exit_code == 0, got.output  # the program is right under the input as it is
    assert figures["proof"]["changed"] == [what] and not figures["proof"]["unchanged"]
    (found,) = [d for d in figures["diagnostics"] if d["code"].startswith("proof.")]
    assert (found["code"], found["severity"]) == (f"proof.{what}", "warning") and named in found["message"]


def test_a_proof_of_another_version_is_said_to_be_one(shop: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("postproc.proof.changes.VERSION", "99.0")
    got = run("verify", shop / "p.ngc", shop / "part.apt", *options(shop))
    assert got.exit_code == 0 and "[proof.version]" in got.stderr and "this is 99.0" in got.stderr, got.stderr


def test_the_hint_of_a_changed_input_is_followed(shop: Path, tmp_path: Path) -> None:
    """`give the one of the proof, or convert again with --proof`: after either nothing is named any more."""
    folder = tmp_path / "copy"
    shutil.copytree(shop, folder)
    append("tools.toml", "# ours\n")(folder)
    got = run("verify", folder / "p.ngc", folder / "part.apt", *options(folder))
    assert "give the one of the proof, or convert again with --proof" in got.stderr
    assert run("convert", folder / "part.apt", *options(folder), "-o", folder / "p.ngc", "--proof").exit_code == 0
    assert "proof." not in run("verify", folder / "p.ngc", folder / "part.apt", *options(folder)).stderr
    shutil.copy(folder / "p.ngc", tmp_path / "p.ngc")
    for sub in folder.glob("*.SPF"):
        shutil.copy(sub, tmp_path / sub.name)
    named = run("verify", tmp_path / "p.ngc", folder / "part.apt", *options(folder), "--proof",
                folder / f"p.ngc{ENDING}")
    assert named.exit_code == 0 and "are those of the proof" in named.stdout


def test_the_proof_of_a_program_beyond_the_measured_range_is_repeated(shop: Path, tmp_path: Path) -> None:
    """`verify with those of the proof to repeat it`: with --error-model-beyond as it was converted, not without it."""
    folder = tmp_path / "copy"
    shutil.copytree(shop, folder)
    (folder / "x.csv").write_text("X [mm],EXX [um]\n-300,0\n0,3\n10,8\n")
    beyond = [*options(folder), "--error-model-beyond"]
    assert run("convert", folder / "part.apt", *beyond, "-o", folder / "p.ngc", "--proof").exit_code == 0
    without, again = (run("verify", folder / "p.ngc", folder / "part.apt", *some) for some in (options(folder), beyond))
    assert "error_model_beyond was True, is False" in without.stderr and "[proof.options]" in without.stderr
    assert again.exit_code == 0 and "proof." not in again.stderr and "are those of the proof" in again.stdout


def test_a_program_that_fails_and_whose_input_changed_is_an_error_that_names_it(shop: Path, tmp_path: Path) -> None:
    folder = tmp_path / "copy"
    shutil.copytree(shop, folder)
    (folder / "part.apt").write_text((folder / "part.apt").read_text().replace("20,9,4", "20,9,3"))
    got = run("verify", folder / "p.ngc", folder / "part.apt", *options(folder))
    assert got.exit_code == 1 and "error [proof.cl_file]" in got.stderr


def test_no_damaged_byte_goes_unseen(shop: Path, tmp_path: Path) -> None:
    """Each byte of the file changed in turn: it is refused, or it says what it said before."""
    file, data = tmp_path / "x.json", (shop / f"p.ngc{ENDING}").read_bytes()
    whole, _ = read_proof(shop / f"p.ngc{ENDING}")
    assert whole is not None
    for at in range(0, len(data), 3):
        file.write_bytes(data[:at] + bytes([data[at] ^ 1]) + data[at + 1:])
        proof, found = read_proof(file)
        assert codes(found) == {"proof.damaged"} if proof is None else proof == whole, at


@pytest.mark.parametrize("damage", [b"", b"{}", b"[1]", b"\xff\xfe", b"[" * 3000, b'{"kind": 1, "kind": 2}'])
def test_what_is_no_proof_is_said_so(shop: Path, tmp_path: Path, damage: bytes) -> None:
    folder = tmp_path / "copy"
    shutil.copytree(shop, folder)
    (folder / f"p.ngc{ENDING}").write_bytes(damage)
    by_itself = run("verify", folder / "p.ngc", folder / "part.apt", *options(folder))
    assert by_itself.exit_code == 0 and "warning [proof.damaged]" in by_itself.stderr
    named = run("verify", folder / "p.ngc", folder / "part.apt", *options(folder), "--proof",
                folder / f"p.ngc{ENDING}")
    assert named.exit_code == 1 and "error [proof.damaged]" in named.stderr and "Traceback" not in named.output
    assert "or verify without this file" in named.stderr
    (folder / f"p.ngc{ENDING}").unlink()
    assert "proof." not in run("verify", folder / "p.ngc", folder / "part.apt", *options(folder)).stderr
    missing = run("verify", folder / "p.ngc", folder / "part.apt", *options(folder), "--proof",
                  folder / "none.json")
    assert missing.exit_code == 1 and "proof.open" in missing.stderr


def test_a_proof_that_was_edited_is_damaged(shop: Path, tmp_path: Path) -> None:
    proof = kept(shop)
    proof["read_back"]["sampled"]["tip_mm"] = 0.0
    (tmp_path / "x.json").write_text(json.dumps(proof))
    assert codes(read_proof(tmp_path / "x.json")[1]) == {"proof.damaged"}
    proof["of_this_file"] = digest(proof)
    (tmp_path / "x.json").write_text(json.dumps(proof))
    assert read_proof(tmp_path / "x.json")[0] is not None


def test_an_input_that_changes_while_it_is_converted_is_refused(shop: Path, tmp_path: Path,
                                                                monkeypatch: pytest.MonkeyPatch) -> None:
    seen = command.input_hashes
    monkeypatch.setattr(command, "hashed", lambda *given: dict.fromkeys(seen(*given), ()))
    got = run("convert", shop / "part.apt", *options(shop), "-o", tmp_path / "p.ngc", "--proof")
    assert got.exit_code == 1 and "proof.input_changed" in got.stderr and not list(tmp_path.iterdir())


def test_program_and_proof_are_written_together_or_not_at_all(shop: Path, tmp_path: Path) -> None:
    (tmp_path / f"p.ngc{ENDING}").write_text("old")
    (tmp_path / f"p.ngc{ENDING}").chmod(0o444)
    got = run("convert", shop / "part.apt", *options(shop), "-o", tmp_path / "p.ngc", "--proof")
    assert got.exit_code == 1 and [f.name for f in tmp_path.iterdir()] == [f"p.ngc{ENDING}"]
    without = run("convert", shop / "part.apt", *options(shop), "-o", tmp_path / "p.ngc")
    assert without.exit_code == 0 and "warning [proof.older]" in without.stderr


# ---- the line ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(builtin_files()))
def test_the_line_of_the_head_is_a_comment_and_short_enough(name: str,
                                                            monkeypatch: pytest.MonkeyPatch) -> None:
    path = toolpath(*CUT)
    whole = good(convert(path, "mill-3axis", name))
    monkeypatch.setattr("postproc.pipeline.stages.with_statement", lambda written, *given: (written, []))
    read = good(convert(path, "mill-3axis", name))
    assert plain(whole.text.encode()) == plain(read.text.encode())
    (line,) = [line for line in whole.text.splitlines() if "proved by" in line.lower()]
    assert "all 3 cuts within 0.0001 mm, 0.0001 degrees" in line.lower() and len(line) <= whole.controller.format.line_length
    assert [PENDING in one.lower() for one in read.text.splitlines()] == [
        line == one for one in whole.text.splitlines()]


@pytest.mark.parametrize("name", sorted(builtin_files()))
def test_the_line_is_never_cut_short(name: str) -> None:
    """A million cuts and many things that were not compared: their number instead of their names."""
    controller, _ = load_controller(name)
    comparison = replace(good(convert(toolpath(*CUT), "mill-3axis")).comparison, cuts=1_000_000,
                         bounded_cuts=1_000_000)
    said = Said(("9 arcs",), tuple(f"records of the form {n}" for n in range(12)))
    assert controller is not None
    for one, other in ((comparison, "; 12 not read twice"), (replace(comparison, bounded_cuts=999_999, unbounded=5),
                                                             "; 12 not read twice")):
        line = text.head_line(one, said, min(comment_room(controller), 130))
        assert len(line) <= comment_room(controller) and line.endswith(other)
    short = text.head_line(comparison, Said(("9 arcs",), ("feeds (inverse time)",)), 200)
    assert short.endswith("; not in the second reading: feeds - inverse time")


@pytest.mark.parametrize("length", [40, 48, 72, 80, 100])
def test_short_blocks_hold_the_line_whole_or_none(length: int, tmp_path: Path) -> None:
    """`within 0.)` would be a lie: every figure stands whole, or the line says that none is said."""
    shop = tmp_path / "short.toml"
    shop.write_text(f'base = "linuxcnc"\n[format]\nline_length = {length}\n')
    result = good(convert(toolpath(*CUT), "mill-3axis", shop))
    room = comment_room(result.controller)
    (line,) = [one[1:-1] for one in result.text.splitlines()[:8] if "proof" in one or "proved" in one]
    assert line == text.head_line(result.comparison, result.witness, room) and len(line) <= room
    assert line == text.ELSEWHERE or ("0.0001" in line and line.endswith(("degrees", "read twice")))
    said = Said(("9 arcs",), tuple("abcdefghijkl"))
    many = replace(result.comparison, cuts=1_000_000, bounded_cuts=999_999, unbounded=5)
    line = text.head_line(many, said, room)
    assert line == text.ELSEWHERE or ("not proved" in line and line.endswith("12 not read twice"))


def test_a_bound_is_rounded_up() -> None:
    """What stands on the last decimal goes to the next, so that no processor's last bit changes a program."""
    assert [text._up(value) for value in (0.0, 1e-12, 0.0083, 0.0083 - 1e-13, 0.00831)] == [
        "0.0001", "0.0001", "0.0084", "0.0084", "0.0084"]


def test_what_a_comment_cannot_hold_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shop = tmp_path / "open.toml"
    shop.write_text('base = "linuxcnc"\n[comment]\nforbidden = ""\n')
    monkeypatch.setattr(text, "head_line", lambda *given: "proved) G1 X9 (")
    result = convert(toolpath(*CUT), "mill-3axis", shop)
    assert "proof.comment" in codes(result.diagnostics) and not result.text
    assert "comment.forbidden" in next(d.hint for d in result.diagnostics if d.code == "proof.comment")
    shop.write_text('base = "linuxcnc"\n[comment]\nforbidden = "()"\n')
    assert good(convert(toolpath(*CUT), "mill-3axis", shop)).text


@pytest.mark.parametrize("name", ["proof pending", "PROOF PENDING"])
def test_a_part_of_that_name_keeps_it(name: str) -> None:
    lines = [f"PARTNO {name}", "UNITS/MM", *NX, HEAD[-1], *CUT, "FINI"]
    path, found = toolpaths.read_bytes("\n".join(lines), file="proof pending.cls")
    result = postproc.convert(path, "mill-3axis", diagnostics=found, options=postproc.Options())
    head = good(result).text.splitlines()[:8]
    assert f"(part {name})" in head and "(source proof pending.cls)" in head
    assert sum("proved by" in line for line in head) == 1
