"""What is fuzzed: a target takes bytes, and breaks a law by raising `Broken` or anything that no reader may raise.

Laws: a reader ends with a value or with diagnostics, never with another exception; what converts, verifies; a file that is
refused has an error that says why.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from postproc.controllers.model import load_controller

ROOT = Path(__file__).parents[2]
SAMPLES = ROOT / "samples"
CONTROLS = {"fanuc": "fanuc-30i", "haas": "haas-ngc", "siemens": "siemens-840d", "klartext": "heidenhain-tnc640",
            "linuxcnc": "linuxcnc", "iso": "generic-iso"}
MACRO = {"fanuc": "fanuc.nc", "haas": "haas.nc", "siemens": "siemens.mpf", "klartext": "klartext.h",
         "linuxcnc": "linuxcnc.ngc", "iso": "linuxcnc.ngc"}
MOST_BLOCKS = 5_000
"""blocks that a program may execute: loops without an end are a fault of the program"""


class Broken(Exception):
    """A law that does not hold."""


@cache
def _machine() -> Any:
    import machines
    return machines.load("mill-3axis")


@cache
def _setup() -> Any:
    from postproc.setup.model import load_setup
    return load_setup(str(SAMPLES / "tools.setup.toml"))[0]


def _said(found: Any) -> bool:
    return any(d.severity == 2 for d in found)


def cl(data: bytes) -> None:
    """A CL file of any dialect: read, converted, read back."""
    import postproc
    import toolpaths
    from toolpaths.diagnostics import DiagnosticError

    try:
        path, found = toolpaths.read_bytes(data, file="fuzz.cls")
    except DiagnosticError as refused:
        if not _said(refused.diagnostics):
            raise Broken("refused without an error") from refused
        return
    result = postproc.convert(path, _machine(), "linuxcnc", _setup(), diagnostics=list(found))
    if result.ok == _said(result.diagnostics):
        raise Broken(f"ok is {result.ok}, errors: {[d.code for d in result.diagnostics if d.severity == 2]}")
    if result.ok and not result.text:
        raise Broken("done, and no program")
    if result.reached == "verify" and not all(d.hint for d in result.diagnostics if d.severity == 2):
        raise Broken(f"written, and its own read-back refuses: {[d.code for d in result.diagnostics if d.severity == 2]}")


def program(kind: str) -> Callable[[bytes], None]:
    """The reader of a control, by the estimate of time, which executes all that a program says."""
    from postproc.cycle_time.source import from_gcode
    from postproc.readback.macros.held import most_blocks
    from postproc.verification.neighbour_files import NeighbourFiles
    from toolpaths.diagnostics import DiagnosticError

    spec = load_controller(CONTROLS[kind])[0]

    def target(data: bytes) -> None:
        try:
            with most_blocks(MOST_BLOCKS):
                others = NeighbourFiles(Path("/nowhere/fuzz.nc"))
                blocks, found = from_gcode(data, _machine(), spec, _setup(), "fuzz.nc", others)
        except DiagnosticError as refused:
            blocks, found = None, list(refused.diagnostics)
        if blocks is None and not _said(found):
            raise Broken("refused without an error")

    return target


def _from_file(ending: str, reader: Callable[[Path], Any]) -> Callable[[bytes], None]:
    """A reader of files: value and diagnostics, or DiagnosticError; without a value, an error."""
    from toolpaths.diagnostics import DiagnosticError

    folder = Path(tempfile.gettempdir())

    def target(data: bytes) -> None:
        path = folder / f"postproc-fuzz-{os.getpid()}{ending}"
        path.write_bytes(data)
        try:
            value, found = reader(path)
        except DiagnosticError as refused:
            value, found = None, list(refused.diagnostics)
        finally:
            path.unlink()
        if value is None and not _said(found):
            raise Broken("refused without an error")

    return target


def _loaded(path: Path) -> Any:
    import machines
    return machines.load(path), []


def targets() -> dict[str, Callable[[bytes], None]]:
    """name -> what takes bytes."""
    from postproc.collision.mesh import load_mesh
    from postproc.setup.model import load_setup
    from postproc.time_fit.log import read_log

    files: dict[str, tuple[str, Callable[[Path], Any]]] = {
        "setup": (".toml", load_setup), "machine": (".toml", _loaded), "controller": (".toml", load_controller),
        "log": (".csv", lambda path: read_log(path, ("X", "Y", "Z"))),
        **{ending: (f".{ending}", load_mesh) for ending in ("stl", "off", "obj", "ply")}}
    return {"cl": cl, **{kind: program(kind) for kind in CONTROLS},
            **{name: _from_file(*one) for name, one in files.items()}}


def seeds(target: str) -> list[bytes]:
    """Small files that the reader takes."""
    if target == "cl":
        endings = (".apt", ".cls", ".ncl", ".clt", ".aptsource", ".as", ".nci", ".nc", ".stp")
        found = [p.read_bytes() for folder in ("dialects", "other_forms", "macros")
                 for p in sorted((SAMPLES / folder).iterdir()) if p.suffix in endings]
        return [*found, *(p.read_bytes() for p in sorted((ROOT / "tests" / "bad").glob("*.apt")))]
    if target in CONTROLS:
        plain = b"G90 G21\nT1 M6\nS1000 M3\nG0 X0. Y0. Z50.\nG1 Z5. F200.\nG2 X10. Y0. I5. J0.\nM5\nM30\n"
        return [(SAMPLES / "macros" / MACRO[target]).read_bytes(), plain]
    folders = {"machine": ROOT / "machines" / "data", "controller": ROOT / "postproc" / "controllers", "setup": SAMPLES}
    if target in folders:
        return [p.read_bytes() for p in sorted(folders[target].glob("*.toml"))][:20]
    return {"log": [b"nc_line,time_s,X,Y,Z\n1,0.0,0,0,0\n2,0.5,1,2,3\n"],
            "stl": [b"solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 9 0 0\nvertex 0 9 0\nendloop\nendfacet\n"
                    b"endsolid s\n"],
            "off": [b"OFF\n4 4 0\n0 0 0\n9 0 0\n0 9 0\n0 0 9\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n"],
            "obj": [b"v 0 0 0\nv 9 0 0\nv 0 9 0\nv 0 0 9\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"],
            "ply": [b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                    b"element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n9 0 0\n0 9 0\n3 0 1 2\n"],
            }[target]
