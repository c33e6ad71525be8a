"""The report: bytes by part, seconds to make and to open it, frames per second while it turns, by number of points.

    python tests/benchmarks/bench_report.py [--five-axis] [POINTS ...]

Default 100, 10000, 1000000 points of `samples/make_big.py` on the three-axis machine under LinuxCNC; with --five-axis on the
trunnion. Each page is opened by three browsers that were just begun and three times by a warm one, in headless Chromium with
software rendering, and brought into sight. Two times each, from the begin of the navigation: all is there, the picture on a
plain canvas ("ready"), and WebGL draws it ("WebGL"). With them the least processor time of all processes of the browser
until then, and that of an empty page, which a browser just begun needs too. Asked for: at most 3 MB and 16
bytes a point without texts, open within 1 s at 10,000 points and 3 s at a million.
"""

from __future__ import annotations

import os
import re
import resource
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from playwright.sync_api import Browser, Page, Playwright, sync_playwright

ROOT = Path(__file__).parents[2]
TIMES = 3
FRAMES = """(coarse) => new Promise((done) => { const view = shown.view, g = view.gl; view.coarse = coarse; let n = 0;
  const from = performance.now(), pixel = new Uint8Array(4);
  const step = () => {
    view.turn[0] += 0.02; drawNow(); g.readPixels(0, 0, 1, 1, g.RGBA, g.UNSIGNED_BYTE, pixel); n++;
    const span = performance.now() - from; if (span > 2000) done(1000 * n / span); else requestAnimationFrame(step);
  };
  step(); })"""


def made(count: int, folder: Path, five: bool) -> tuple[Path, float, float]:
    """(page, processor seconds, MB of memory) of a report of so many points."""
    cl, page = folder / f"{count}.cls", folder / f"{count}.html"
    subprocess.run([sys.executable, "samples/make_big.py", str(max(count, 1000)), str(cl),
                    *(["--five-axis"] if five else [])], cwd=ROOT, check=True)
    if count < 1000:
        lines = cl.read_text().splitlines()
        cl.write_text("\n".join([*lines[:count], *lines[-3:]]) + "\n")
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    machine = ["-m", "mikron-ucp710"] if five else ["-m", "mill-3axis", "--setup", "samples/tools.setup.toml"]
    subprocess.run([sys.executable, "-m", "postproc", "report", str(cl), *machine, "-c", "linuxcnc", "-o", str(page), "-q"],
                   cwd=ROOT, check=True)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return page, used.ru_utime - before, used.ru_maxrss / 1024.0


def processor() -> float:
    """Seconds of processor of the browsers that this process has begun, those of their ended children among them."""
    parents, used = dict[int, int](), dict[int, float]()
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            name, _, rest = (folder / "stat").read_text().rpartition(")")
        except OSError:
            continue  # it has ended since
        fields, pid = rest.split(), int(folder.name)
        parents[pid] = int(fields[1])
        if "(chrom" in name:
            used[pid] = sum(int(field) for field in fields[11:15]) / os.sysconf("SC_CLK_TCK")
    return sum(seconds for pid, seconds in used.items() if _own(pid, parents))


def _own(pid: int, parents: dict[int, int]) -> bool:
    while pid in parents and pid != os.getpid():
        pid = parents[pid]
    return pid == os.getpid()


def drawn(browser: Browser, page: Path) -> tuple[Page, list[float]]:
    """The page, opened; s until all is there and s until WebGL draws, s of processor until each."""
    shown, begin = browser.new_page(viewport={"width": 1300, "height": 900}), processor()
    shown.goto(page.as_uri())
    shown.wait_for_selector("html[data-ready]", state="attached", timeout=120_000)
    ready = processor() - begin
    shown.evaluate("byId('path').scrollIntoView()")
    shown.wait_for_selector("html[data-picture]", state="attached", timeout=120_000)
    full = processor() - begin
    marks = dict(shown.evaluate("performance.getEntriesByType('mark').map((e) => [e.name, e.startTime / 1000])"))
    return shown, [marks["ready"], marks["webgl"], ready, full]


def begun(driver: Playwright) -> Browser:
    return driver.chromium.launch(executable_path=shutil.which("chromium"), args=[
        "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"])


def empty(driver: Playwright) -> float:
    """Seconds of processor of a browser just begun for a page of one word."""
    browser = begun(driver)
    shown, begin = browser.new_page(viewport={"width": 1300, "height": 900}), processor()
    shown.goto("data:text/html,word")
    shown.evaluate("new Promise((done) => requestAnimationFrame(() => setTimeout(done)))")
    used = processor() - begin
    browser.close()
    return used


def opened(page: Path) -> tuple[list[list[float]], list[list[float]], list[float], float]:
    """(`drawn` by three browsers just begun, three times by a warm one, frames per second while it moves and in full, s of
    processor for an empty page)."""
    cold = []
    with sync_playwright() as driver:
        for _ in range(TIMES):
            browser = begun(driver)
            cold.append(drawn(browser, page)[1])
            browser.close()
        browser = begun(driver)
        drawn(browser, page)
        warm = [drawn(browser, page) for _ in range(TIMES)]
        frames = [warm[-1][0].evaluate(FRAMES, coarse) for coarse in (True, False)]
        return cold, [one for _, one in warm], frames, empty(driver)


def said(name: str, found: list[list[float]]) -> str:
    """The times of one way of opening, the least first."""
    ready, full, ready_used, full_used = (sorted(column) for column in zip(*found, strict=True))
    return (f"{name}: ready {', '.join(f'{s:.2f}' for s in ready)} s ({ready_used[0]:.2f} s of processor), "
            f"WebGL {', '.join(f'{s:.2f}' for s in full)} s ({full_used[0]:.2f})")


def main() -> None:
    with TemporaryDirectory() as folder:
        words = [word for word in sys.argv[1:] if word != "--five-axis"]
        for count in [int(word) for word in words] or [100, 10_000, 1_000_000]:
            page, used, memory = made(count, Path(folder), "--five-axis" in sys.argv)
            text = page.read_text("utf-8")
            found = re.finditer(r'(?s)<script type=[^>]*id="([\w-]+)"[^>]*>(.*?)</script>', text)
            parts = {one[1]: len(one[2]) for one in found}
            figures = sum(size for name, size in parts.items() if name.startswith("points"))
            texts = sum(size for name, size in parts.items() if name.startswith("text"))
            cold, warm, frames, nothing = opened(page)
            print(f"{count:>9,} points: {len(text) / 1e6:.2f} MB (texts {texts / 1e6:.2f}, points {figures / 1e6:.2f} = "
                  f"{figures / count:.1f} bytes each, all else {(len(text) - texts - figures) / 1e6:.2f}); made in "
                  f"{used:.1f} s of processor, {memory:.0f} MB; {frames[0]:.0f} frames per second turning, {frames[1]:.0f} "
                  f"in full; load {os.getloadavg()[0]:.1f}\n  {said('browser just begun', cold)}; an empty page "
                  f"{nothing:.2f}\n  {said('warm browser', warm)}", flush=True)


if __name__ == "__main__":
    main()
