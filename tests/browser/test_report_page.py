"""The report in a real browser: headless Chromium, one session for the file; skipped where it is not there."""

from __future__ import annotations

import math
import re
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import reduce
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from postproc.cli.app import app
from tests.postproc.page.page_kit import HOSTILE, LINES, Made, along, refused, reported, small, turned

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed: pip install playwright")
BROWSER = next((found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), None)
pytestmark = pytest.mark.skipif(BROWSER is None, reason="no Chromium here: apt-get install chromium")
NUMBERS = "all => all.map(e => [e.dataset.key, e.dataset.digits, e.textContent])"
PLACE = """() => { const i = shown.run.columns["CL line"].indexOf(14), p = shown.view.places.slice(3 * i, 3 * i + 3);
  const m = shown.view.matrix(), w = shown.view.canvas.clientWidth, h = shown.view.canvas.clientHeight;
  const f = (k) => m[k] * p[0] + m[4 + k] * p[1] + m[8 + k] * p[2] + m[12 + k];
  return [(f(0) + 1) * w / 2, (1 - f(1)) * h / 2]; }"""
"""pixels at which the point of CL line 14 is drawn"""
DARK = """() => { drawNow(); const g = shown.view.gl, w = g.drawingBufferWidth, h = g.drawingBufferHeight;
  const p = new Uint8Array(4 * w * h); g.readPixels(0, 0, w, h, g.RGBA, g.UNSIGNED_BYTE, p);
  return p.some((v, i) => i % 4 < 3 && v < 160); }"""
FLAT = """() => { drawNow(); const c = byId("labels"), d = c.getContext("2d").getImageData(0, 0, c.width, c.height).data;
  let found = 0; for (let i = 0; i < d.length; i += 4) if (d[i + 3] > 40) found++; return found; }"""
"""pixels that the plain canvas has painted"""
OFF = """() => { const run = shown.run, s = run.info.skeleton; let most = 0;
  for (let i = 0; i < run.count; i++) {
    const f = framesOf(s, (a) => run.columns[a][i]), last = f[f.length - 1], axis = turned(last, s.tool_axis);
    ["part x", "part y", "part z"].forEach((n, k) => {
      most = Math.max(most, Math.abs(last.o[k] - 130.25 * axis[k] - run.columns[n][i])); }); }
  return most; }"""
POOR = """() => { const parts = (c) => (c.match(/[\\d.]+/g) || []).map(Number);
  const linear = (v) => { v /= 255; return v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4; };
  const light = (c) => { const [r, g, b] = c.slice(0, 3).map(linear); return 0.2126 * r + 0.7152 * g + 0.0722 * b; };
  const ground = (e) => { for (; e; e = e.parentElement) { const c = parts(getComputedStyle(e).backgroundColor);
    if (c.length === 3 || c[3] > 0) return c; } return [255, 255, 255]; };
  const worded = (e) => [...e.childNodes].some((n) => n.nodeType === 3 && n.data.trim());
  return [...document.querySelectorAll("main *, header *, footer *")].filter(worded).map((e) => {
    const style = getComputedStyle(e), b = light(ground(e));
    const a = light(parts(e instanceof SVGElement ? style.fill : style.color));
    return [(Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05), e.outerHTML.slice(0, 80)];
  }).filter((one) => one[0] < 4.5); }"""
LONG = """() => { const run = report.runs[0], tool = run.tools[0], op = run.conversion.time.operations[0];
  const old = [report.part, tool.name, op.operation];
  report.part = tool.name = op.operation = "X".repeat(10000); words(0, run); recolour();
  const found = document.documentElement.scrollWidth;
  [report.part, tool.name, op.operation] = old; words(0, run); recolour();
  return found; }"""
"""width of the page where names have ten thousand letters"""
MANY = """() => { showLegend(Array.from({length: 200}, (_, k) => ({colour: [0, 0, 0], text: "op " + k})));
  const found = byId("legend").textContent; recolour(); return found; }"""
TRIAD = """(bed) => { byId("bed").checked = bed; fit(); drawNow();
  const v = shown.view, o = v.project([0, 0, 0]), scale = v.span / Math.min(v.canvas.clientWidth, v.canvas.clientHeight);
  const off = (e, k) => v.project(e).map((p, j) => Math.abs((p - o[j]) * scale - partDirections(v)[k][j]));
  return Math.max(...[[1, 0, 0], [0, 1, 0], [0, 0, 1]].flatMap(off)); }"""
"""how far the axes in the corner are from those of the path, of 1"""
LANE = """() => { const at = [], put = (x, y) => at.push([x, y]);
  const g = {beginPath() {}, stroke() {}, moveTo: put, lineTo: put};
  const run = {time: [2, 8], columns: {rest: [2000, 4000]}};
  const lanes = Object.assign(Object.create(Lanes.prototype), {left: 10, from: 0, to: 10, kind: "position", run});
  lanes.curve(g, (i) => [3, 7][i], 0, 1, 100, (v) => v, ""); return at; }"""
"""corners of a lane: it stands until 2 s, rests 4 s more, moves from 3 to 7 until 8 s"""
A4 = 688
"""pixels between the margins of the paper"""
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


@dataclass
class Session:
    """A page that is open, what it has complained of, and what it has asked for besides itself."""

    page: Any
    said: list[str] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)


def until(page: Any, what: str) -> None:
    """Wait for a truth; the page itself may evaluate no texts."""
    for _ in range(200):
        if page.evaluate(what):
            return
        page.wait_for_timeout(25)
    raise AssertionError(f"never: {what}")


def settled(page: Any) -> None:
    """Wait until all is there and the picture, brought into sight, is drawn as it stays."""
    page.wait_for_selector("html[data-ready]", state="attached")
    if page.is_visible("#view"):
        page.evaluate("byId('path').scrollIntoView()")
        page.wait_for_selector("html[data-picture]", state="attached")


@pytest.fixture(scope="module")
def opened() -> Iterator[Session]:
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=BROWSER, args=FLAGS)
        session = Session(browser.new_page(viewport={"width": 1300, "height": 900}))
        session.page.on("console", lambda message: session.said.append(message.text))
        session.page.on("pageerror", lambda fault: session.said.append(str(fault)))
        session.page.on("request", lambda request: session.asked.append(request.url))
        session.page.goto(small().page.as_uri())
        settled(session.page)
        yield session
        browser.close()


def test_it_opens_without_a_complaint_and_asks_for_nothing(opened: Session) -> None:
    assert opened.page.get_attribute("html", "data-ready") != "failed"
    assert opened.said == []
    assert [url for url in opened.asked if not url.startswith(("data:", "blob:"))] == [small().page.as_uri()]


def test_a_hostile_name_is_shown_as_it_stands_and_does_nothing(opened: Session) -> None:
    assert opened.page.inner_text("h1") == HOSTILE
    assert opened.page.evaluate("window.hacked") is None and opened.page.locator("main img[src=x]").count() == 0


def test_texts_of_ten_thousand_letters_and_turned_ones_do_no_harm(opened: Session) -> None:
    """The page is as wide as its window, and a sign that turns the direction of writing stands as a mark."""
    page = opened.page
    assert page.evaluate("make('b', {}, 'a\u202egpj\u0000\u2066.exe').textContent") == "a\ufffdgpj\ufffd\ufffd.exe"
    page.set_viewport_size({"width": 360, "height": 740})
    wide = page.evaluate(LONG)
    page.set_viewport_size({"width": 1300, "height": 900})
    assert wide <= 360


def test_many_operations_do_not_fill_the_page_with_their_legend(opened: Session) -> None:
    said = opened.page.evaluate(MANY)
    assert "op 15" in said and "op 16" not in said and "and 184 more" in said


def read_back(page: Any, made: Made) -> set[str]:
    """Keys of the numbers on the page, each compared with the JSON."""
    shown = page.eval_on_selector_all("[data-key]", NUMBERS)
    assert len(shown) > 60
    for key, digits, text in shown:
        value = reduce(lambda v, step: v[int(step)] if isinstance(v, list) else v[step], key.split("."), made.values)
        number = re.match(r"-?[\d.]+|-", text)
        assert number is not None, (key, text)
        if value is None:
            assert text.strip().startswith("-"), key
        else:
            assert float(number[0]) == pytest.approx(value, abs=0.5001 * 10.0 ** -int(digits)), key
    return {key for key, _, _ in shown}


@pytest.mark.parametrize("run", [0, 1])
def test_every_number_on_the_page_is_that_of_the_json(opened: Session, run: int) -> None:
    opened.page.evaluate(f"pickRun({run})")
    until(opened.page, f"shown.run.k === {run}")
    keys = read_back(opened.page, small())
    base = f"runs.{run}.conversion."
    assert {base + "worst_tip_deviation_mm", base + "cycle_time_s", base + "band_s.0", f"runs.{run}.axes.0.used.0"} <= keys


def test_the_text_is_open_at_the_point_and_never_that_of_another_program(opened: Session) -> None:
    page = opened.page
    page.evaluate("(async () => { shown.texts.close(); await pickRun(0); })()")
    until(page, "shown.texts.kind === 'cl' && shown.texts.here > 0")
    assert page.evaluate("shown.texts.here === shown.run.columns['CL line'][shown.point]")
    page.evaluate("openText('nc0-0', 5, 0)")
    until(page, "shown.texts.kind === 'nc0-0'")
    page.evaluate("pickRun(1)")
    until(page, "shown.run.k === 1 && shown.texts.kind === 'cl'")
    assert page.evaluate("byId('text-file').value") == "cl"


def test_the_axes_in_the_corner_are_those_of_the_path(opened: Session) -> None:
    """x, y, z of the part, the bed standing still or not, point as the pixels of places along them do."""
    page = opened.page
    page.evaluate("pickRun(0)")
    until(page, "shown.run.k === 0")
    for bed in (False, True):
        off = page.evaluate(TRIAD, bed)
        assert off < 1e-3, bed
    page.evaluate("byId('bed').checked = false; fit()")


def test_an_axis_stands_still_on_its_lane_before_it_moves_and_while_the_machine_rests(opened: Session) -> None:
    drawn = opened.page.evaluate(LANE)
    assert [tuple(p) for p in drawn[::2]] == [(10, 3), (30, 3), (70, 3), (90, 7)]


def test_a_click_shows_the_point_and_both_its_lines(opened: Session) -> None:
    page = opened.page
    page.evaluate("pickRun(0)")
    page.uncheck("#machine")
    box = page.locator("#view").bounding_box()
    wanted = page.evaluate(PLACE)
    page.locator("#view").scroll_into_view_if_needed()
    page.locator("#view").click(position={"x": wanted[0], "y": wanted[1]})
    assert box["width"] > 300
    assert "line 14" in page.inner_text("#point")
    page.click("#jump-cl")
    page.wait_for_selector("#text .row.here")
    assert LINES[13] in page.inner_text("#text .row.here")
    page.click("#jump-nc")
    until(page, "shown.texts.kind === 'nc0-0'")
    line = page.inner_text("#text .row.here")
    assert int(page.inner_text("#text .row.here b")) == page.evaluate("shown.run.columns['NC line'][shown.point]")
    # LINES[13] is the sixth cut: it turns the axis from 0.08 to 0.1 rad off z, in one block or more; A alone turns it so
    assert math.degrees(0.08) < abs(float(re.findall(r"A(-?[\d.]+)", line)[0])) < math.degrees(0.1001), line


def test_a_line_of_a_text_leads_to_its_point_and_words_are_found(opened: Session) -> None:
    page = opened.page
    page.evaluate("openText('cl', 1, 0)")
    page.fill("#search", "GOTO/6")
    page.press("#search", "Enter")
    until(page, "byId('found').textContent.startsWith('Line')")
    assert LINES[10].startswith("GOTO/4") and page.inner_text("#found") == "Line 12."
    page.press("#text", "Enter")
    assert page.evaluate("shown.run.columns['CL line'][shown.point]") == 12
    assert "line 12" in page.inner_text("#point")


def test_the_slider_and_play_move_the_machine_and_the_cursor(opened: Session) -> None:
    page = opened.page
    end = page.evaluate("Number(byId('slider').max)")
    assert end == pytest.approx(small().values["runs"][0]["conversion"]["cycle_time_s"], rel=0.02)
    page.evaluate("byId('slider').value = byId('slider').max / 2; byId('slider').dispatchEvent(new Event('input'))")
    half = page.evaluate("[shown.time, shown.lanes.cursor, shown.point]")
    assert half[0] == pytest.approx(end / 2, rel=0.01) and half[1] == half[0] and half[2] > 0
    page.click("#play")
    until(page, f"shown.time > {half[0]}")
    page.click("#play")
    assert page.inner_text("#play") == "Play"


def test_every_colouring_paints_and_says_what_the_colours_mean(opened: Session) -> None:
    page = opened.page
    names = page.eval_on_selector_all("#colour option", "all => all.map(e => e.value)")
    assert set(names) == {"operation", "feed", "limit", "cause", "deviation", "tilt"}
    for name in names:
        page.select_option("#colour", name)
        assert page.inner_text("#legend").strip()
        assert page.evaluate(DARK), name


def test_the_path_is_there_before_webgl_and_without_it(opened: Session) -> None:
    """A plain canvas has the same lines at the same places: before the picture is in sight, in a browser that has no WebGL2,
    and after a graphics process was lost."""
    context = opened.page.context.browser.new_context(viewport={"width": 500, "height": 300})
    page = context.new_page()
    page.goto(small().page.as_uri())
    page.wait_for_selector("html[data-ready]", state="attached")
    assert page.get_attribute("html", "data-picture") is None and page.evaluate("shown.view.gl === null")
    drawn = page.evaluate(FLAT)
    page.add_init_script("HTMLCanvasElement.prototype.getContext = new Proxy(HTMLCanvasElement.prototype.getContext, "
                         "{apply: (f, on, [kind, ...rest]) => kind === 'webgl2' ? null : f.apply(on, [kind, ...rest])})")
    page.reload()
    settled(page)
    assert page.get_attribute("html", "data-picture") == "flat" and page.evaluate(FLAT) == drawn
    assert "no WebGL2" in page.inner_text("#view-note")
    context.close()
    opened.page.evaluate("pickRun(0)")
    letters = opened.page.evaluate(FLAT)
    lost = "byId('view').dispatchEvent(new Event('webglcontextlost', {cancelable: true}))"
    opened.page.evaluate(f"globalThis.kept = shown.view.gl; {lost}")
    without = opened.page.evaluate(FLAT)
    opened.page.evaluate("shown.view.gl = kept; document.documentElement.dataset.picture = 'webgl'; drawNow()")
    assert without > letters + 500 and drawn > 500


def test_the_page_moves_the_axes_as_the_kinematics_does(opened: Session) -> None:
    """The tool that the axes carry ends at the drawn tip, at every point."""
    off = opened.page.evaluate(OFF)
    assert off < 0.002 and opened.page.evaluate("toolLength(shown.run, 3)") == 130.25


def test_keys_do_what_the_mouse_does(opened: Session) -> None:
    page = opened.page
    page.evaluate("setPoint(3)")
    page.focus("#view")
    before = page.evaluate("[...shown.view.turn, shown.view.span, shown.point]")
    for key in ("ArrowRight", "ArrowUp", "+", "."):
        page.keyboard.press(key)
    after = page.evaluate("[...shown.view.turn, shown.view.span, shown.point]")
    assert all(a != b for a, b in zip(before, after, strict=True)) and after[3] == before[3] + 1
    bare = page.eval_on_selector_all("button, select, input", "all => all.filter(e => !(e.labels && e.labels.length) && "
                                     "!e.getAttribute('aria-label') && !e.textContent.trim()).map(e => e.outerHTML)")
    assert bare == []


def test_words_stand_out_from_their_ground(opened: Session) -> None:
    """Contrast of at least 4.5 (WCAG 2.2, 1.4.3) between text and the ground it stands on."""
    poor = opened.page.evaluate(POOR)
    assert poor == []


@pytest.mark.parametrize("width", [360, 820])
def test_small_screens_scroll_in_one_direction_alone(opened: Session, width: int) -> None:
    opened.page.set_viewport_size({"width": width, "height": 740})
    wide = opened.page.evaluate("document.documentElement.scrollWidth")
    opened.page.set_viewport_size({"width": 1300, "height": 900})
    assert wide <= width


def test_it_prints_on_a4_with_the_picture(opened: Session, tmp_path: Path) -> None:
    data = opened.page.pdf(format="A4", prefer_css_page_size=True)
    boxes = re.findall(r"MediaBox \[([^\]]*)\]", data.decode("latin-1"))
    sizes = {tuple(round(float(v)) for v in box.split()[2:]) for box in boxes}
    assert sizes == {(595, 842)}
    opened.page.emulate_media(media="print")
    assert opened.page.is_visible("#compare td >> nth=0 >> button"), "which machine and control a row is of"
    assert opened.page.is_visible("#messages .jump >> nth=0") and not opened.page.is_visible("#print")
    opened.page.emulate_media(media="screen")
    opened.page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    assert opened.page.get_attribute("#printed img", "src").startswith("data:image/png")
    assert opened.said == [], "nothing was complained of to the end"


def test_messages_of_what_was_not_converted_lead_to_the_cl_file(opened: Session) -> None:
    page = opened.page
    page.goto(refused().page.as_uri())
    page.wait_for_selector("html[data-ready]", state="attached")
    assert "NOT CONVERTED" in page.inner_text("#verdict") and not page.is_visible("#view")
    page.click("#first button.jump >> nth=0")
    page.wait_for_selector("#text .row.here")
    assert "9000" in page.inner_text("#text .row.here") and opened.said == []


def test_errors_and_orientation_are_drawn_and_read_back(opened: Session) -> None:
    """The colouring by correction, vectors at places, the polytope of a pass with its reach."""
    page = opened.page
    page.goto(turned().page.as_uri())
    settled(page)
    keys = read_back(page, turned())
    assert {"runs.0.errors.worst_before_um", "runs.0.errors.uncertainty_k2_um", "runs.0.errors.worst.0.after_um",
            "runs.0.errors.worst.0.uncertainty_k2_um",
            "runs.0.orientation.passes.0.time_s", "runs.0.tools.0.cutting_m"} <= keys
    page.select_option("#colour", "correction")
    assert page.inner_text("#legend").count("um") == 1 and page.evaluate(DARK)
    before = page.evaluate("drawNow(), shown.lines.length")
    page.check("#vectors")
    errors = turned().values["runs"][0]["errors"]
    crosses = 2 * 3  # at the ends of both vectors
    assert page.evaluate("drawNow(), shown.lines.length") == before + (2 + crosses) * len(errors["places"])
    worst, sure = errors["worst_before_um"], errors["uncertainty_k2_um"]
    assert f"longest {worst:.2f} um" in page.inner_text("#legend")
    assert f"uncertainty of each (k = 2), largest {sure:.2f} um" in page.inner_text("#legend")
    solid = turned().values["runs"][0]["orientation"]["polytopes"][0]
    shown_rate = float(f"{solid['chosen']['rate']:.3g}")
    reach = turned().values["runs"][0]["orientation"]["passes"][0]["reach"]["chosen"][solid["order"]]
    assert solid["chosen"]["rate"] == pytest.approx(reach["rate"] * (1.0 if reach["unit"] == "mm/s" else 1e-3))
    assert math.hypot(*solid["chosen"]["reach"]) == pytest.approx(solid["chosen"]["rate"])
    drawn = page.get_attribute("#polytope svg", "aria-label")
    assert solid["unit"] in drawn and f"chosen axis {shown_rate:g}" in drawn
    edges = sum(len(solid[key]["edges"]) for key in ("cl_file", "chosen"))
    assert page.locator("#polytope svg line").count() == edges + 2 * 2 + 3  # reach and its key, axes x, y, z
    assert page.evaluate(POOR) == [] and opened.said == []


def test_axes_that_turn_along_a_cut_are_shown_and_not_called_fixed(opened: Session) -> None:
    page = opened.page
    page.goto(along().page.as_uri())
    settled(page)
    keys, said = read_back(page, along()), page.inner_text("#orientation-body")
    base = "runs.0.conversion.orientation.turning."
    assert {base + "cuts.0.turned_deg", base + "cuts.0.off_path_mm", base + "on_the_control.gain_percent"} <= keys
    assert any(key.startswith("runs.0.conversion.time.limiting.") for key in keys), "which axis is the slowest"
    assert "turned along 1 of 1 cuts" in said and "keeps its axes: the tool axis turns within the pass" in said
    assert page.locator("#polytope").count() == 0, "of one fixed axis, which this pass has not"
    assert page.evaluate(POOR) == [] and opened.said == []


def test_a_message_leads_to_its_line_in_both_texts(opened: Session) -> None:
    page, values = opened.page, turned().values["runs"][0]
    page.goto(turned().page.as_uri())
    page.wait_for_selector("html[data-ready]", state="attached")
    wanted = next(links for links in values["message_lines"] if links)[0]
    page.click(f"#messages-body button.jump:has-text('program line {wanted['nc_line']}') >> nth=0")
    until(page, "shown.texts.kind === 'nc0-0'")
    assert page.evaluate("shown.texts.here") == wanted["nc_line"]
    assert page.evaluate("shown.run.columns['NC line'][shown.point]") == wanted["nc_line"]
    page.click(f"#messages-body button.jump:has-text('line {wanted['cl_line']}') >> nth=0")
    until(page, "shown.texts.kind === 'cl'")
    assert page.evaluate("shown.texts.here") == wanted["cl_line"]
    other = page.evaluate("messageItems([{severity: 'warning', code: 'a.b', message: 'm', file: 'd/s.toml', lines: [5]}])"
                          ".textContent")
    assert other.endswith("s.toml, line 5")  # no line of CL file or program
    assert opened.said == []


def test_a_dossier_opens_prints_on_a4_and_fits_small_screens(opened: Session, tmp_path: Path) -> None:
    page, made = opened.page, tmp_path / "m.html"
    done = CliRunner().invoke(app, ["machine", "report", "planar-delta", "-c", "linuxcnc", "-o", str(made)])
    assert done.exit_code == 0, done.output
    page.goto(made.as_uri())
    assert page.evaluate("[...document.images].every((one) => one.complete && one.naturalWidth > 0)")
    for width in (360, 820):
        page.set_viewport_size({"width": width, "height": 740})
        assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.evaluate(POOR) == [] and page.locator("th:empty").count() == 0
    page.emulate_media(media="print")
    page.set_viewport_size({"width": A4, "height": 1017})
    assert page.evaluate("document.documentElement.scrollWidth") <= A4
    tops = page.eval_on_selector_all(".figures figure", "all => all.slice(0, 2).map(e => e.offsetTop)")
    page.emulate_media(media="screen")
    page.set_viewport_size({"width": 1300, "height": 900})
    assert tops[0] == tops[1], "two maps stand side by side on paper"
    assert opened.said == []


@pytest.mark.slow
@pytest.mark.parametrize("points", [100, 10_000])
def test_pages_of_many_points_open_and_are_clicked(opened: Session, points: int) -> None:
    """A million is of tests/benchmarks/bench_report.py."""
    cuts = [f"GOTO/{0.01 * k:.4f},{5.0 * math.sin(0.003 * k):.4f},0" for k in range(points)]
    lines = [*LINES[:7], "GOTO/0,0,50,0,0,1", "FEDRAT/MMPM,600", *cuts, "FINI"]
    opened.page.goto(reported(lines=tuple(lines)).page.as_uri())
    opened.page.wait_for_selector("html[data-ready]", state="attached")
    assert opened.page.evaluate("shown.run.count") >= points
    opened.page.evaluate(f"openText('cl', {9 + points // 2}, 0)")
    until(opened.page, "byId('text').querySelector('.here') !== null")
    opened.page.press("#text", "Enter")
    assert f"line {9 + points // 2}" in opened.page.inner_text("#point") and opened.said == []
