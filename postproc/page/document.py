"""The report as one object (the JSON) and as one page that holds it: no network, nothing but this file."""

from __future__ import annotations

import json
import zlib
from collections.abc import Sequence
from html import escape
from importlib.resources import files
from typing import Any
from unicodedata import category

from postproc.base.json_values import plain, rounded
from postproc.base.version import VERSION
from postproc.page.columns import LEVEL, text_of
from postproc.page.run import Run, run_dict
from postproc.readback.text.canonical import Files
from toolpaths.toolpath import Toolpath

SCHEMA_VERSION = 1
"""of the report; it rises where a key changes its meaning or goes"""
SCRIPTS = ("data.js", "view.js", "flat.js", "scene.js", "machine.js", "labels.js", "vectors.js", "polytope.js", "texts.js",
           "charts.js", "tables.js", "page.js")
"""in the order in which they run"""
POLICY = ("default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; base-uri 'none'; "
          "form-action 'none'")
"""the page may load nothing from anywhere"""


TITLE = 120
"""letters of the title of the window at most"""


def report_dict(toolpath: Toolpath, runs: Sequence[Run]) -> dict[str, Any]:
    """The report: the CL file, and each combination of machine and control in the order asked for."""
    cl_file = toolpath.file.replace("\\", "/").rsplit("/", 1)[-1]
    return {"report_version": SCHEMA_VERSION, "postproc": VERSION, "part": toolpath.name or cl_file, "cl_file": cl_file,
            "points_in_part": len(toolpath), "runs": [run_dict(run) for run in runs]}


def document(report: dict[str, Any], texts: Sequence[tuple[str, str, bytes]]) -> str:
    """The page of a report; `texts` as (kind, name, bytes) of the files that it shows: "cl", "nc0-0", "nc0-1", ..."""
    folder = files("postproc.page")
    style, *scripts = (folder.joinpath(name).read_text("utf-8") for name in ("page.css", *SCRIPTS))
    # figures of points stand in elements of their own, so that reading the rest of the report does not wait for them
    blobs, light = _apart(report)
    parts = [f'<script type="application/octet-stream" id="{escape(name, True)}">{data}</script>' for name, data in blobs]
    parts += [f'<script type="application/octet-stream" id="text-{escape(kind, True)}" data-name="{escape(name, True)}">'
              f"{text_of(zlib.compress(data, LEVEL))}</script>" for kind, name, data in texts]
    body = folder.joinpath("page.html").read_text("utf-8")
    return "\n".join([
        "<!doctype html>", '<html lang="en"><head><meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>{escape(printable(report['part'])[:TITLE])} - report</title>", f"<style>{style}</style></head>", body,
        f'<script type="application/json" id="report">{embedded(light)}</script>', *parts,
        "<script>\n\"use strict\";", *scripts, "</script>", "</body></html>", ""])


def embedded(value: object) -> str:
    """JSON that may stand inside a script element: no text of it can end the element or begin another."""
    text = json.dumps(rounded(value), allow_nan=False, default=plain, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026").replace(
        "\u2028", "\\u2028").replace("\u2029", "\\u2029")


def printable(text: str) -> str:
    """Without what turns the direction of writing, and without control characters (Unicode categories Cc and Cf)."""
    return "".join(" " if category(letter) in ("Cc", "Cf") else letter for letter in text)


def _apart(report: dict[str, Any]) -> tuple[list[tuple[str, str]], dict[str, Any]]:
    """(id, base64) of the points of each run, and the report without them."""
    blobs, runs = list[tuple[str, str]](), list[dict[str, Any]]()
    for k, run in enumerate(report["runs"]):
        points = run["points"]
        if points is not None:
            blobs.append((f"points-{k}", points["data"]))
            points = {key: value for key, value in points.items() if key != "data"}
        runs.append(run | {"points": points})
    return blobs, report | {"runs": runs}


def texts_of(runs: Sequence[Run]) -> list[tuple[str, str, bytes]]:
    """The CL file once, and the program of each run with its subprograms, as `document` takes them."""
    found = list[tuple[str, str, bytes]]()
    source = next((run.result.source for run in runs if run.result.source is not None), None)
    if source is not None:
        found.append(("cl", runs[0].result.toolpath.file.replace("\\", "/").rsplit("/", 1)[-1], source.data))
    for k, run in enumerate(runs):
        if run.result.ok:
            others = run.result.files or {}
            found += [(f"nc{k}-{n}", name, text.encode()) for n, (name, text) in enumerate(
                _in_order(run, {run.name: run.result.text, **others}))]
    return found


def _in_order(run: Run, texts: dict[str, str]) -> list[tuple[str, str]]:
    """Files by their number among those that were read back."""
    c = run.result.comparison
    read: Files = c.executed[0].files if c is not None else ()
    names = [run.name, *[name for name, _ in read[1:]]]
    return [(name, texts[name]) for name in names if name in texts] + [
        (name, text) for name, text in texts.items() if name not in names]
