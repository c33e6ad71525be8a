"""The dossier as one page that opens offline: no script, no network, nothing but this file; it prints on A4."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from importlib.resources import files
from typing import Any

from postproc.page.document import printable
from toolpaths.units import DEG

POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'"
"""the page may load nothing from anywhere"""
SECTIONS = {"drawing": "Axes and frames", "limits": "Limits and sources", "pivots": "Pivots as each control holds them",
            "workspace": "Workspace", "condition": "Condition, speed and force", "certificate": "Certificate",
            "errors": "Geometric errors", "messages": "Messages"}
"""by the id of the element"""
MEASURES = {"condition_number": "condition number", "speed_transmission": "drive speed per speed of the platform",
            "force_transmission": "drive force per force on the platform", "manipulability": "manipulability |det J|",
            "conditioning_factor": "conditioning factor",
            "acceleration_per_speed_squared_per_mm": "drive acceleration per speed squared, 1/mm"}
"""of the analysis of legs, by its key"""
LIMITS = ("lower", "upper", "velocity", "acceleration", "jerk")


def page(dossier: Mapping[str, Any], pictures: Sequence[tuple[str, str, bytes]]) -> str:
    """The page; `pictures` as (section, title, SVG bytes)."""
    machine = dossier["machine"]
    style = files("postproc.dossier").joinpath("dossier.css").read_text("utf-8")
    bodies = {"drawing": _rotary(machine), "limits": _limits(dossier), "pivots": _pivots(dossier),
              "workspace": _workspace(dossier), "condition": _condition(dossier), "certificate": _certificate(dossier),
              "errors": _errors(dossier["errors"]), "messages": _messages(dossier["diagnostics"])}
    parts = []
    for key, title in SECTIONS.items():
        shown = [_figure(of, data) for section, of, data in pictures if section == key]
        body = "".join(bodies[key]) + (f'<div class="figures">{"".join(shown)}</div>' if len(shown) > 1 else "".join(shown))
        parts.append(f'<section id="{key}"><h2>{title}</h2>{body}</section>')
    title = _text(f"{machine['name']} - machine dossier")
    links = "".join(f'<a href="#{key}">{name}</a>' for key, name in SECTIONS.items())
    return "\n".join(["<!doctype html>", '<html lang="en"><head><meta charset="utf-8">',
                      f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">',
                      '<meta name="viewport" content="width=device-width, initial-scale=1">',
                      f"<title>{title}</title>", f"<style>{style}</style></head><body>", "<header>", *_head(dossier),
                      f'<nav aria-label="Sections">{links}</nav></header>', "<main>", *parts, "</main>",
                      "</body></html>", ""])


def _head(dossier: Mapping[str, Any]) -> Iterator[str]:
    machine = dossier["machine"]
    yield f"<h1>{_text(machine['name'])}</h1>"
    yield f"<p>{_text(machine['description'])}<br>structure {_text(machine['structure'])}</p>"
    state = [f"{len(dossier['assumed'])} figures are assumed: {', '.join(dossier['assumed'])}" if dossier["assumed"] else
             "no figure is assumed"]
    if (space := machine["workspace"]) is not None:
        state.append("workspace proved to be reached and free of singular positions" if space["certificate"] else
                     "workspace sampled, not proved: postproc machine certify proves it")
    warned = sum(d["severity"] != "info" for d in dossier["diagnostics"])
    state += [f"{warned} warnings: see Messages"] if warned else []
    good = not dossier["assumed"] and not warned
    yield f'<p class="said {"good" if good else "warn"}">{"<br>".join(map(_text, state))}</p>'
    yield from (f'<p class="note">file {_text(one["file"])}, SHA-256 <span class="hash">{one["sha256"]}</span></p>'
                for one in dossier["files"])
    yield f'<p class="note">postproc {_text(dossier["postproc"])}</p>'


def _rotary(machine: Mapping[str, Any]) -> Iterator[str]:
    if machine["rotary_axes"]:
        yield "<p>With the axes at zero the table frame is the machine's.</p>"
        yield _table(("axis", "through, mm", "along"), [(row["letter"], _numbers(row["point"]), _numbers(row["direction"]))
                                                       for row in machine["rotary_axes"]])
    if machine["control"]:
        pins = ", ".join(f"{name} {value:g}" for name, value in machine["control"]["pins"].items())
        yield f"<p>The control runs the kinematics {_text(machine['control']['module'])} ({_text(pins)}).</p>"


def _limits(dossier: Mapping[str, Any]) -> Iterator[str]:
    machine = dossier["machine"]
    rows = []
    for axis in machine["axes"]:
        cells = []
        for key in LIMITS:
            value = "no end" if axis[key] is None else f"{axis[key]:g}"
            # travel is one figure of the machine file, its ends are two columns here
            named = "travel" if key in ("lower", "upper") else key
            cells.append(_assumed(value) if named in axis["assumed"] else escape(value))
        rows.append([_text(axis["letter"]), *cells, escape(f"{axis['home']:g}"), axis["unit"]])
    yield _html_table(("axis", "travel from", "to", "velocity", "acceleration", "jerk", "home", "unit"), rows, range(1, 7))
    yield ('<p class="note">velocity per s, acceleration per s2, jerk per s3; <span class="assumed">*</span> assumed: '
           "no source</p>")
    times = [[_text(name.replace("_", " ")), _assumed(f"{value:g}") if name in machine["timing_assumed"] else f"{value:g}"]
             for name, value in machine["timing_s"].items()]
    yield _html_table(("time", "s"), times, (1,))
    places: dict[str, list[str]] = {}
    for axis in machine["axes"]:
        for key, origin in axis["sources"].items():
            places.setdefault(origin, []).append(f"{axis['letter']}.{key}")
    if places:
        yield _table(("source", "figures"), [(origin, ", ".join(keys)) for origin, keys in places.items()])
    yield from (f'<p class="note">{_text(one["document"])}: {_text(one["address"])}</p>' for one in machine["documents"]
                if one["address"])


def _pivots(dossier: Mapping[str, Any]) -> Iterator[str]:
    rows = [(name, line) for name, lines in dossier["pivots"].items() for line in lines]
    if not rows:
        yield "<p>No chain of rotary axes: no control holds pivots of it.</p>"
        return
    yield "<p>Machine coordinates, all axes at 0, anywhere along each axis. Compare them with the control's own.</p>"
    yield _table(("control", "vector"), rows)


def _workspace(dossier: Mapping[str, Any]) -> Iterator[str]:
    found = dossier["analysis"]
    rows = [("tool for which it counts, mm", f"{found['tool_mm']:g}")]
    if (box := found["reachable_box_mm"]) is not None:
        rows.append(("box that the tip reaches, mm", "; ".join(f"{k} {a:g} to {b:g}" for k, (a, b) in box.items())))
        rows.append(("it ends at", ", ".join(found["reachable_box_ends_at"])))
    rows.append(("tilt in every direction, degrees", _or_dash(found["tilt_in_every_direction_deg"])))
    rows.append(("largest tilt, degrees", _or_dash(found["largest_tilt_deg"])))
    for name, margin in found.get("least_margins", {}).items():
        size = next(f"{margin[unit]:.4g} {unit}" for unit in ("deg", "mm") if unit in margin)
        rows.append((name.replace("_", " "), f"{margin['what']}: {size} at {_place(margin)}"))
    yield _table(("", ""), rows)


def _condition(dossier: Mapping[str, Any]) -> Iterator[str]:
    found = dossier["analysis"]
    rows = [(words, f"{one['worst']:.6g}", _place(one), _or_dash(one.get("nowhere_more_than")),
             _or_dash(one.get("least_on_grid", one.get("best_on_grid")))) for key, words in MEASURES.items()
            if (one := found.get(key)) is not None]
    yield _table(("measure", "worst", "at", "proved nowhere more", "best seen"), rows, (1, 3, 4))
    indices = found.get("indices", {})
    yield _table(("index", ""), [(key.replace("_", " "), "without end: singular" if value is None and
                                key.startswith("condition") else _figures(value)) for key, value in indices.items()])
    if dossier["levers"]:
        yield "<p>Torque of a rotary axis per force at the tip: the largest distance of the tip from it within travel.</p>"
        levers = [(letter, f"{row['mm']:.4g}", " ".join(f"{k}{v:g}" for k, v in row["at"].items()))
                  for letter, row in dossier["levers"].items()]
        yield _table(("axis", "Nm per kN", "at"), levers, (1,))


def _certificate(dossier: Mapping[str, Any]) -> Iterator[str]:
    if (found := dossier["certificate"]) is None:
        legs = dossier["machine"]["workspace"] is not None
        yield "<p>None: the workspace was sampled. postproc machine certify makes one.</p>" if legs else \
            "<p>None. postproc machine certify proves a box of tips.</p>"
        return
    proved = ", ".join(f"{name} {value:g}" for name, value in found["proved"].items())
    yield _table(("", ""), [("file", found["file"]), ("boxes", str(found["boxes"])), ("region", _region(found["region"])),
                            ("distances from singular positions, at least", proved),
                            ("margin asked for", f"{found['margin']:g}"),
                            ("drives inside their travel", "proved" if found["travel_proved"] else "not proved"),
                            ("confirmed with this version", "yes" if found["checked_with_this_version"] else
                             "no: postproc machine certify --check")])


def _region(region: Mapping[str, Any]) -> str:
    """What was proved of which part and tool, ranges in mm and degrees."""
    ranges = []
    turns = {f"{letter}_rad": ends for letter, ends in region.get("turns_rad", {}).items()}
    for key, ends in {**region, **turns}.items():
        name, _, unit = key.rpartition("_")
        if isinstance(ends, list):
            low, high = (value / DEG if unit == "rad" else value for value in ends)
            ranges.append(f"{name} {low:.6g} to {high:.6g} {'degrees' if unit == 'rad' else unit}")
    return f"of the {region['of']} with a tool of {region['tool_mm']:g} mm: {', '.join(ranges)}"


def _errors(found: Mapping[str, Any] | None) -> Iterator[str]:
    if found is None:
        yield "<p>No error model was given (--error-model).</p>"
        return
    yield (f"<p>{_text(found['file'])}: {found['parameters']} parameters, corrected by the {_text(found['corrected_by'])}, "
           f'fingerprint <span class="hash">{_text(found["fingerprint"])}</span></p>')
    yield _table(("error", "largest", "", "at"), [(name, f"{c['largest']:.2f}", c["unit"], f"{c['at']:g}")
                                                 for name, c in found["components"].items()], (1, 3))
    places = [(name, f"{c['value']:.3g}", c["unit"]) for name, c in found["location"].items()]
    yield _table(("line or zero", "value", ""), places, (1,))
    if (volume := found["volume"]) is not None:
        yield _table(("over the work volume", ""), [
            ("tip, worst, um", f"{volume['tip_worst_um']:.2f}"), ("tip, rms, um", f"{volume['tip_rms_um']:.2f}"),
            ("axis, worst, arcsec", f"{volume['axis_worst_arcsec']:.2f}"),
            ("tip left after correction, um", f"{volume['residual_tip_worst_um']:.3f}")], (1,))


def _messages(found: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    yield _table(("", "message", "what to do"), [(d["severity"], f"{d['message']} [{d['code']}]", d.get("hint") or "")
                                               for d in found]) if found else "<p>None.</p>"


def _figure(title: str, data: bytes) -> str:
    # an image from data runs no script that a name in it might hold
    return (f'<figure><img alt="{_text(title)}" src="data:image/svg+xml;base64,{base64.b64encode(data).decode()}">'
            f"<figcaption>{_text(title)}</figcaption></figure>")


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]], right: Iterable[int] = ()) -> str:
    """A table of plain texts; columns `right` hold numbers."""
    return _html_table(heads, [[_text(cell) for cell in row] for row in rows], right)


def _html_table(heads: Sequence[str], rows: Sequence[Sequence[str]], right: Iterable[int] = ()) -> str:
    """The same of cells that are HTML; "" without rows."""
    if not rows:
        return ""
    n = [' class="n"' if k in set(right) else "" for k in range(len(heads))]
    head = "".join(f'<th scope="col"{c}>{escape(name)}</th>' if name else "<td></td>"
                   for c, name in zip(n, heads, strict=True)) if any(heads) else ""
    lines = "".join(f"<tr>{''.join(f'<td{c}>{cell}</td>' for c, cell in zip(n, row, strict=True))}</tr>" for row in rows)
    return f'<div class="scroll"><table>{f"<tr>{head}</tr>" if head else ""}{lines}</table></div>'


def _place(found: Mapping[str, Any]) -> str:
    """Where a figure of the platform counts."""
    heading = f", into {found['at_heading_deg']:.6g} degrees" if "at_heading_deg" in found else ""
    tilt = f", tilt {found['at_tilt_deg']:.6g} degrees{heading}" if found["at_tilt_deg"] else ""
    return f"({_numbers(found['at_mm'])}) mm{tilt}"


def _figures(value: Any) -> str:
    """Figures inside one cell."""
    if isinstance(value, Mapping):
        return ", ".join(f"{key.replace('_', ' ')} {_figures(one)}" for key, one in value.items())
    if isinstance(value, list | tuple):
        return f"({_numbers(value)})"
    return _or_dash(value)


def _numbers(values: Iterable[Any]) -> str:
    return ", ".join(_or_dash(value) for value in values)


def _or_dash(value: Any) -> str:
    return "-" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)


def _assumed(value: str) -> str:
    return f'<span class="assumed">{escape(value)} *</span>'


def _text(value: str) -> str:
    return escape(printable(str(value)), quote=True)
