"""The one place where input files are opened: what is read, what is refused, how much."""

from __future__ import annotations

import io
import os
import socket
from pathlib import Path

import pytest

from toolpaths.cl.read import read_file
from toolpaths.input_files import InputFault, largest_file, read_input, shown, unreadable


def faulty(folder: Path, kind: str) -> str:
    """A name that is no file to be read."""
    path = folder / kind
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "socket":
        os.chdir(folder)  # names of sockets are short
        with socket.socket(socket.AF_UNIX) as made:
            made.bind(kind)
    elif kind == "folder":
        path.mkdir()
    elif kind == "loop":
        path.symlink_to(path)
    return {"device": "/dev/zero", "NUL": f"{folder}/a\0b", "long": "x" * 5000, "long name": "x" * 300}.get(kind, str(path))


KINDS = ("pipe", "socket", "folder", "device", "NUL", "long", "long name", "loop", "missing")


@pytest.mark.parametrize("kind", KINDS)
def test_only_regular_files_are_read(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    name = faulty(tmp_path, kind)
    with pytest.raises(OSError) as fault:
        read_input(name)
    noted = unreadable(fault.value, "cl.open", name)
    assert noted.message.startswith("cannot be read: ") and noted.hint and "\0" not in str(noted) and len(str(noted)) < 600
    found = read_file(name).diagnostics
    assert [d.code for d in found] == ["cl.open"]


def test_a_file_that_becomes_a_pipe_is_not_waited_for(tmp_path: Path,
                                                      monkeypatch: pytest.MonkeyPatch) -> None:
    pipe, plain = tmp_path / "pipe", tmp_path / "plain"
    os.mkfifo(pipe)
    plain.write_text("x")
    state = plain.stat()
    monkeypatch.setattr("toolpaths.input_files.check_input", lambda path: state)
    with pytest.raises(InputFault, match="pipe"):
        read_input(pipe)


def test_the_size_is_limited_and_the_limit_can_be_raised(tmp_path: Path) -> None:
    path = tmp_path / "part.cls"
    path.write_bytes(b"x" * 1001)
    with largest_file(1000):
        with pytest.raises(InputFault, match=r"it has 0\.001 MB, and files of up to 0\.001 MB are read") as fault:
            read_input(path)
        assert "--max-file-size" in fault.value.hint
        with largest_file(1001):
            assert read_input(path) == path.read_bytes()
    assert read_input(path) == path.read_bytes()


def test_a_file_that_states_no_size_is_read_up_to_the_limit() -> None:
    """Files of /proc have size 0."""
    text = Path("/proc/self/status").read_bytes()
    assert read_input("/proc/self/status")[:12] == text[:12]
    with largest_file(100), pytest.raises(InputFault, match="does not end"):
        read_input("/proc/self/status")


class Stream:
    def __init__(self, data: bytes) -> None:
        self.buffer = io.BytesIO(data)


def test_standard_input_is_read_where_it_may_be(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("sys.stdin", Stream(b"abc" * 1000))
    assert read_input("-", standard_input=True) == b"abc" * 1000
    monkeypatch.setattr("sys.stdin", Stream(b"abc" * 1000))
    with largest_file(2999), pytest.raises(InputFault, match="does not end"):
        read_input("-", standard_input=True)
    monkeypatch.setattr("sys.stdin", None)
    with pytest.raises(InputFault, match="no standard input"):
        read_input("/dev/stdin", standard_input=True)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(FileNotFoundError):
        read_input("-")


def test_names_are_shown_on_one_line() -> None:
    assert shown("a\0b\nc") == "a\N{REPLACEMENT CHARACTER}b\N{REPLACEMENT CHARACTER}c"
    assert len(shown("x" * 5000)) < 300
