"""What an installation brings is listed with its licence, and nothing of it is asked of the network while commands run."""

from __future__ import annotations

import re
import socket
import tomllib
from importlib.metadata import distributions
from pathlib import Path
from typing import Any

import pytest
from packaging.specifiers import SpecifierSet

from tests.source import ROOT, product, written
from tests.supply_chain import PAGE, licence, locked, parts, sbom

IMPORTED = re.compile(r"^\s*(?:import|from) +(\w+)", re.MULTILINE)
NETWORK = {"socket", "ssl", "http", "urllib", "ftplib", "smtplib", "requests", "httpx", "aiohttp", "asyncio"}


def test_the_page_names_every_part_with_its_licence() -> None:
    """`python tests/supply_chain.py` writes it."""
    listed = dict(re.findall(r"^\| `([\w-]+)` \| (.+?) \|", PAGE.read_text("utf-8"), re.MULTILINE))
    assert set(listed) == set(parts())
    assert not [name for name, text in listed.items() if not text.strip() or "UNKNOWN" in text]
    assert not [name for name, text in listed.items() if re.search(r"(?<!L)GPL|Proprietary", text)]


def test_a_licence_is_found_wherever_a_package_states_it() -> None:
    from email.message import Message

    one = Message()
    assert licence(one) == ""
    one["License"] = "\nMIT License\n\nlong text"
    assert licence(one) == "MIT License"
    one["Classifier"] = "License :: OSI Approved :: BSD License"
    assert licence(one) == "BSD License"
    one["License-Expression"] = "BSD-3-Clause"
    assert licence(one) == "BSD-3-Clause"


def test_what_is_pinned_installs_on_the_oldest_python() -> None:
    """Debian 12 has 3.11.2: a pinned version that asks for a later one ends `make demo` and the container there."""
    oldest = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["requires-python"].removeprefix(">=") + ".0"
    asked = {one.metadata["Name"]: one.metadata.get("Requires-Python") or "" for one in distributions()
             if re.sub(r"[-_.]+", "-", one.metadata["Name"]).lower() in locked()}
    assert len(asked) > 50
    assert {name: text for name, text in asked.items() if not SpecifierSet(text).contains(oldest)} == {}


def test_the_list_of_parts_is_whole() -> None:
    made = sbom()
    names = {part["name"] for part in made["components"]}
    assert names == set(parts()) <= set(locked()) and {"numpy", "pydantic-core"} <= names
    refs = {part["bom-ref"] for part in made["components"]} | {"postproc"}
    assert {one["ref"] for one in made["dependencies"]} == refs
    assert {ref for one in made["dependencies"] for ref in one["dependsOn"]} <= refs
    assert all(part["externalReferences"][0]["hashes"] for part in made["components"])


def test_only_the_name_of_the_computer_is_asked_of_the_network_modules() -> None:
    found = {(path.name, name) for path in product() for name in IMPORTED.findall(written(path)) if name in NETWORK}
    assert found == {("interrupted_runs.py", "socket")}


def test_no_socket_is_opened_while_commands_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from typer.testing import CliRunner

    from postproc.cli.app import app
    from tests.faults.commands import commands

    def forbidden(*args: Any, **more: Any) -> None:
        raise AssertionError("a socket is opened")

    for owner, name in ((socket.socket, "__init__"), (socket, "getaddrinfo"), (socket, "gethostbyname")):
        monkeypatch.setattr(owner, name, forbidden)
    monkeypatch.chdir(tmp_path)
    for name in ("convert", "machine new", "inspect"):
        got = CliRunner().invoke(app, list(commands(tmp_path)[name]))
        assert got.exit_code == 0, got.output
    with pytest.raises(AssertionError, match="a socket is opened"):
        socket.socket()
