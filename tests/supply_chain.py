"""What an installation brings: licences as a page, and a CycloneDX list of parts.

    python tests/supply_chain.py               writes docs/licences.md
    python tests/supply_chain.py --sbom FILE   writes CycloneDX JSON 1.5, with the hashes of requirements.lock

The parts are those that the `dependencies` of pyproject.toml and its extras for users need, followed through the metadata
of what is installed.
"""

from __future__ import annotations

import argparse
import json
import re
import tomllib
from importlib.metadata import PackageMetadata, distribution
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "licences.md"
OF_DEVELOPERS = ("dev", "docs")
"""extras that no user installs"""
HEAD = """# Licences of what an installation brings

Written by `python tests/supply_chain.py` from the metadata of the packages; versions: `requirements.lock`. The licence
of the project itself is MIT (`LICENSE`).

| package | licence | needed by |
|---|---|---|
"""


def plain(name: str) -> str:
    """A package's name as PEP 503 compares it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def parts() -> dict[str, set[str]]:
    """package -> the packages that need it; "postproc" for those of pyproject.toml."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    extras = [text for name, some in project["optional-dependencies"].items() if name not in OF_DEVELOPERS for text in some]
    todo = [("postproc", need) for text in (*project["dependencies"], *extras)
            if plain((need := Requirement(text)).name) != "postproc"]
    found: dict[str, set[str]] = {}
    while todo:
        parent, need = todo.pop()
        if need.marker is not None and not need.marker.evaluate({"extra": ""}):
            continue
        name = plain(need.name)
        if name not in found:
            todo += [(name, Requirement(text)) for text in distribution(name).requires or []]
        found.setdefault(name, set()).add(parent)
    return dict(sorted(found.items()))


def licence(metadata: PackageMetadata) -> str:
    """The licence that a package states: expression, classifiers, or the first line of its text."""
    if stated := metadata.get("License-Expression"):
        return str(stated)
    named = [c.rpartition(":: ")[2] for c in metadata.get_all("Classifier") or [] if c.startswith("License ::")]
    text = str(metadata.get("License") or "").strip().splitlines()
    return ", ".join(named) or (text[0] if text else "")


def page() -> str:
    """The page."""
    rows = [f"| `{name}` | {licence(distribution(name).metadata)} | {', '.join(sorted(by))} |"
            for name, by in parts().items()]
    return HEAD + "\n".join(rows) + "\n"


def locked() -> dict[str, tuple[str, list[str]]]:
    """package -> version and SHA-256 of its files, by requirements.lock."""
    found: dict[str, tuple[str, list[str]]] = {}
    name = ""
    for line in (ROOT / "requirements.lock").read_text("utf-8").splitlines():
        if pinned := re.match(r"([\w.-]+)==([^\s;\\]+)", line):
            name = plain(pinned[1])
            found[name] = (pinned[2], [])
        elif digest := re.search(r"--hash=sha256:([0-9a-f]{64})", line):
            found[name][1].append(digest[1])
    return found


def sbom() -> dict[str, Any]:
    """CycloneDX 1.5: the parts with the versions and files of requirements.lock."""
    pins, needs = locked(), parts()
    refs = {n: f"pkg:pypi/{n}@{pins[n][0]}" for n in needs}
    components = [{"type": "library", "bom-ref": refs[n], "name": n, "version": pins[n][0], "purl": refs[n],
                   "licenses": [{"license": {"name": licence(distribution(n).metadata)}}],
                   "externalReferences": [{"type": "distribution", "url": f"https://pypi.org/project/{n}/{pins[n][0]}/",
                                           "hashes": [{"alg": "SHA-256", "content": h} for h in pins[n][1]]}]}
                  for n in needs]
    tree = [{"ref": refs.get(n, n), "dependsOn": [refs[m] for m, by in needs.items() if n in by]}
            for n in ("postproc", *needs)]
    return {"bomFormat": "CycloneDX", "specVersion": "1.5", "version": 1,
            "metadata": {"component": {"type": "application", "bom-ref": "postproc", "name": "postproc"}},
            "components": components, "dependencies": tree}


def main() -> None:
    """Writes the page, or the list."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--sbom", type=Path)
    given = options.parse_args()
    if given.sbom is None:
        PAGE.write_text(page(), "utf-8")
    else:
        given.sbom.write_text(json.dumps(sbom(), indent=1) + "\n", "utf-8")


if __name__ == "__main__":
    main()
