"""Wheel and sdist, and what they do in fresh environments outside the tree.

    python tests/packages.py --python python3.12 --python python3.13

The sdist is made from the tree, the wheel from the unpacked sdist, so that the one holds what the other needs. For each
interpreter the wheel is installed in a new environment in a folder whose name has a blank and letters beyond ASCII, at the
versions of requirements.lock; a smoke set of commands runs there, then tests of the sdist against the installed packages:
the packages of the sdist itself are put away before.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = ("toolpaths", "machines", "postproc")
TESTS = ("tests/toolpaths/cl", "tests/toolpaths/test_transaction.py", "tests/toolpaths/test_input_files.py", "tests/plugins",
         "tests/bridges", "tests/machines/test_kinds.py", "tests/postproc/proof")
"""rooms whose tests need nothing but the installed packages, samples and each other"""
IN_TREE = ("tests/postproc/proof/test_traceability.py",)
"""of these, what looks at the source tree"""
FOLDER = "out of the tree \N{LATIN SMALL LETTER E WITH ACUTE}"
ON = ["-m", "mikron-ucp710", "-c", "linuxcnc", "--setup", "samples/tools.setup.toml"]
POCKET = ["samples/pocket.cls", "-m", "mill-3axis", "-c", "linuxcnc", "--setup", "samples/tools.setup.toml"]
SMOKE = (
    ["--version"], ["convert", *POCKET, "-o", "pocket.ngc", "--proof"],
    ["verify", "pocket.ngc", *POCKET], ["time", *POCKET], ["time", "pocket.ngc", "-c", "linuxcnc", "-m", "mill-3axis"],
    ["convert", *POCKET, "-o", "planned.ngc", "--feed", "planned"], ["report", *POCKET, "-o", "pocket.html"],
    ["orient", "samples/tool_axis_tour.apt", *ON], ["machine", "show", "mikron-ucp710"], ["explain", "travel.exceeded"],
    ["inspect", "samples/dialects/nx.cls"])
"""commands that must end with 0"""


def build(folder: Path) -> tuple[Path, Path]:
    """(wheel, unpacked sdist) of this tree.

    Raises:
        subprocess.CalledProcessError: where one is not built.
    """
    made = folder / "packages"
    made.mkdir()
    text = "import sys; from setuptools.build_meta import build_sdist; build_sdist(sys.argv[1])"
    quiet([sys.executable, "-c", text, made], ROOT)
    shutil.unpack_archive(next(made.glob("*.tar.gz")), folder / "sdist")
    source = next((folder / "sdist").iterdir())
    quiet([sys.executable, "-m", "pip", "wheel", "--quiet", "--disable-pip-version-check", "--no-deps",
           "--no-build-isolation", "-w", made, source], folder)
    return next(made.glob("*.whl")), source


def constraints(folder: Path) -> Path:
    """Versions of the lock without their hashes, which a wheel of this day is not among."""
    pins = [line.split()[0] for line in (ROOT / "requirements.lock").read_text("utf-8").splitlines()
            if "==" in line and not line.startswith("#")]
    place = folder / "constraints.txt"
    place.write_text("\n".join(pins) + "\n", encoding="utf-8")
    return place


def installed(python: str, wheel: Path, folder: Path, extras: str) -> Path:
    """The interpreter of a new environment that has the wheel."""
    quiet([python, "-m", "venv", folder / "env"], folder)
    own = folder / "env" / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    quiet([own, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-c", constraints(folder),
           f"{wheel}{extras}", "pytest", "hypothesis"], folder)
    return own


def smoke(own: Path, source: Path, folder: Path) -> list[str]:
    """Commands of SMOKE that do not end with 0, by what they say."""
    work, console = folder / "work", own.with_name("postproc.exe" if os.name == "nt" else "postproc")
    work.mkdir()
    shutil.copytree(source / "samples", work / "samples")
    found = []
    for words in SMOKE:
        done = subprocess.run([console, *words], cwd=work, capture_output=True, text=True, encoding="utf-8", check=False)
        if done.returncode:
            found.append(f"postproc {' '.join(words)}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    where = subprocess.run([own, "-c", "import postproc, machines, toolpaths; print(postproc.__file__)"], cwd=work,
                           capture_output=True, text=True, check=True).stdout.strip()
    return found if str(folder) in where else [*found, f"the package is {where}, not the installed one"]


def tested(own: Path, source: Path, folder: Path, tests: tuple[str, ...]) -> str:
    """The last line of the tests of the sdist against the installed packages.

    Raises:
        subprocess.CalledProcessError: where one fails.
    """
    place = folder / "tests of the sdist"
    shutil.copytree(source, place)
    for name in PACKAGES:
        shutil.rmtree(place / name)
    words = [own, "-m", "pytest", "-q", "-p", "no:cacheprovider", *tests,
             *(f"--ignore={name}" for name in IN_TREE)]
    done = subprocess.run(words, cwd=place, capture_output=True, text=True, encoding="utf-8", check=False)
    if done.returncode:
        sys.stderr.write(done.stdout[-20_000:] + done.stderr[-5000:])
        done.check_returncode()
    return next(line for line in reversed(done.stdout.splitlines()) if " passed" in line or "[100%]" in line)


def size_of(folder: Path) -> float:
    """Megabytes of files."""
    return sum(one.stat().st_size for one in folder.rglob("*") if one.is_file()) / 1e6


def quiet(words: list[object], folder: Path) -> None:
    done = subprocess.run([str(word) for word in words], cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.stderr.write(done.stdout[-5000:] + done.stderr[-5000:])
        done.check_returncode()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--python", action="append", help="interpreter; this one where none is named")
    parser.add_argument("--extras", default="", help="of the wheel, in brackets: [all]")
    parser.add_argument("--no-tests", action="store_true", help="the smoke set alone")
    parser.add_argument("--tests", action="append", help="files or folders of tests instead of the usual ones")
    given = parser.parse_args()
    bad = 0
    with tempfile.TemporaryDirectory(prefix="packages ") as name:
        folder = Path(name)
        wheel, source = build(folder)
        print(f"{wheel.name}: {wheel.stat().st_size / 1e6:.2f} MB")
        for number, python in enumerate(given.python or [sys.executable]):
            began, place = time.monotonic(), folder / f"{FOLDER} {number}"
            place.mkdir()
            own = installed(str(Path(shutil.which(python) or python).absolute()), wheel, place, given.extras)
            faults = smoke(own, source, place)
            bad += len(faults)
            said = "not run" if given.no_tests else tested(own, source, place, tuple(given.tests or TESTS))
            print(json.dumps({"python": python, "environment_MB": round(size_of(place / "env")), "commands": len(SMOKE),
                              "failed": faults, "tests": said, "seconds": round(time.monotonic() - began)}, indent=1))
            shutil.rmtree(place)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
