"""The outermost guard: an unexpected exception is one line, a report file and exit code 70, and nothing else."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from postproc import __main__
from postproc.base.version import VERSION
from postproc.cli.app import app
from postproc.cli.shared.guard import fingerprint, guarded
from tests.postproc.kit import SAMPLES
from toolpaths.cl import read as reader

POCKET = str(SAMPLES / "pocket.cls")
OWN = str(SAMPLES / "casting" / "trunnion_over.toml")


@pytest.fixture
def broken(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """The command line with a fault in the reader, in an empty folder."""
    def fail(*args: object) -> None:
        raise ZeroDivisionError("float division by zero")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(reader, "detect", fail)
    monkeypatch.setattr("sys.argv", ["postproc", "convert", POCKET, "-m", "mill-3axis", "-c", "linuxcnc", "-o", "a.ngc"])
    return tmp_path


def ended() -> int:
    with pytest.raises(SystemExit) as end:
        __main__.main()
    return int(str(end.value.code))


def test_a_fault_of_our_own(broken: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert ended() == 70
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and "Traceback" not in err
    code, name = re.match(r"internal error \[([0-9a-f]{8})\].* please send (\S+) ", err).groups()
    assert [p.name for p in broken.iterdir()] == [name] == [f"postproc-error-{code}.txt"]
    text = (broken / name).read_text()
    for part in (f"postproc {VERSION}", "Python 3", "numpy ", "convert", POCKET, "ZeroDivisionError: float division by zero",
                 f"{Path(POCKET).stat().st_size} bytes, sha256 "):
        assert part in text
    assert "TOOL PATH" not in text
    assert ended() == 70 and f"[{code}]" in capsys.readouterr().err


def test_the_code_is_that_of_kind_and_place() -> None:
    def fault(kind: type[Exception], data: object) -> Exception:
        with pytest.raises(kind) as raised:
            reader.read_bytes(data)
        return raised.value

    first, again, other = fault(TypeError, None), fault(TypeError, 1.5), fault(ValueError, [999])
    assert fingerprint(first) == fingerprint(again) != fingerprint(other)
    assert fingerprint(ValueError()) != fingerprint(KeyError())


def test_the_report_goes_to_the_folder_for_temporary_files(broken: Path, tmp_path_factory: pytest.TempPathFactory,
                                                           monkeypatch: pytest.MonkeyPatch,
                                                           capsys: pytest.CaptureFixture[str]) -> None:
    other = tmp_path_factory.mktemp("other")
    monkeypatch.setattr("tempfile.gettempdir", lambda: str(other))
    open_ = os.open
    monkeypatch.setattr(os, "open", lambda path, *rest: _full() if str(path).startswith("postproc-") else open_(path, *rest))
    assert ended() == 70
    assert str(next(other.iterdir())) in capsys.readouterr().err


def _full() -> int:
    raise PermissionError(13, "Permission denied")


@pytest.mark.parametrize("fault", [RecursionError("deep"), AssertionError(), OSError(2, "gone", "x.txt")])
def test_every_kind_of_exception(fault: Exception, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                 capsys: pytest.CaptureFixture[str]) -> None:
    def command() -> None:
        raise fault

    monkeypatch.chdir(tmp_path)
    assert guarded(command) == 70
    assert capsys.readouterr().err.startswith("internal error [") and len(list(tmp_path.iterdir())) == 1


def test_faults_before_the_command_are_guarded_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                                   capsys: pytest.CaptureFixture[str]) -> None:
    def fail(*args: object, **more: object) -> None:
        raise KeyError("option")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("postproc.cli.shared.group.only_called", fail)
    assert ended() == 70 and "KeyError" in capsys.readouterr().err


@pytest.mark.parametrize(("end", "code", "said"), [
    (KeyboardInterrupt(), 130, "interrupted; nothing was written\n"), (SystemExit(130), 130, "interrupted"),
    (SystemExit(2), 2, ""), (SystemExit(None), 0, ""), (BrokenPipeError(32, "Broken pipe"), 1, ""),
    (OSError(28, "No space left on device"), 1, "standard output cannot be written: No space left")])
def test_other_ends(end: BaseException, code: int, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                    capsys: pytest.CaptureFixture[str]) -> None:
    def command() -> None:
        raise end

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("postproc.cli.shared.guard._silence", lambda stream: None)
    assert guarded(command) == code
    err = capsys.readouterr().err
    assert err.startswith(said) and (said or err == "") and not list(tmp_path.iterdir())


def test_a_reader_of_standard_output_that_goes_away(tmp_path: Path) -> None:
    """`postproc ... | head`: neither a traceback nor a report."""
    import subprocess
    import sys

    code = "import sys; from postproc.cli.shared.guard import guarded; sys.exit(guarded(lambda: print('x' * 10**6)))"
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=tmp_path,
                          env={**os.environ, "PYTHONPATH": str(SAMPLES.parent)}) as run:
        assert run.stdout is not None and run.stderr is not None
        run.stdout.read(1)
        run.stdout.close()
        assert run.stderr.read() == b"" and run.wait() == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("arguments", [("inspect", POCKET), ("machine", "check", OWN), ("errors", "schema")])
def test_every_command_has_the_largest_size(arguments: tuple[str, ...]) -> None:
    run = CliRunner().invoke(app, [*arguments, "--max-file-size", "0.001"])
    assert run.exit_code == (0 if "schema" in arguments else 1), run.output
    assert "schema" in arguments or "raise the limit with --max-file-size" in run.stderr
    assert CliRunner().invoke(app, [*arguments, "--max-file-size", "2"]).exit_code == 0
    assert CliRunner().invoke(app, [*arguments, "--max-file-size", "0"]).exit_code == 2


def _caused(fault: Exception) -> Exception:
    """An exception that another one led to, as libraries wrap what their parts raise."""
    outer = ImportError("no numbers")
    outer.__cause__ = fault
    return outer


@pytest.mark.parametrize("fault", [
    MemoryError(), OSError(12, "Cannot allocate memory"), RuntimeError("can't start new thread"),
    _caused(ImportError("libopenblas.so: failed to map segment from shared object"))])
def test_memory_that_is_used_up_is_no_fault_of_the_program(fault: Exception, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                                           capsys: pytest.CaptureFixture[str]) -> None:
    def command() -> None:
        raise fault

    monkeypatch.chdir(tmp_path)
    assert guarded(command) == 1
    assert capsys.readouterr().err.startswith("memory is used up;") and not list(tmp_path.iterdir())


def test_a_limit_too_small_to_begin_is_said(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Below it OpenBLAS waits without end, or ends the process as if Ctrl-C had been pressed."""
    resource = pytest.importorskip("resource")
    ran: list[int] = []
    for limit, code, said in ((200 << 20, 1, "the memory limit of 200 MB is too small, at least 500 MB"),
                              (600 << 20, 0, ""), (resource.RLIM_INFINITY, 0, "")):
        monkeypatch.setattr(resource, "getrlimit", lambda kind, limit=limit: (limit, limit))
        assert guarded(lambda: ran.append(1)) == code
        assert capsys.readouterr().err.startswith(said)
    assert len(ran) == 2


def test_what_is_left_is_not_searched_for_garbage_at_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    kept = list[int]()
    monkeypatch.setattr(__main__.gc, "freeze", lambda: kept.append(1))
    monkeypatch.setattr(__main__, "guarded", lambda command: 3)
    assert ended() == 3 and kept == [1]
