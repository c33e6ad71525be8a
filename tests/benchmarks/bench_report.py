"""The report: bytes by part, seconds to make and to open it, frames per second while it turns, by number of points.

    python tests/benchmarks/bench_report.py [--five-axis] [POINTS ...]

Default 100, 10000, 1000000 points of `samples/make_big.py` on the three-axis machine under LinuxCNC; with --five-axis on the
trunnion. The page is opened
three times in headless Chromium with software rendering; the first time starts its graphics process. Asked for: at most 3 MB
and 16 bytes a point without texts, open within 1 s at 10,000 points and 3 s at a million.
"""

from __future__ import annotations

import re
import resource
import shutil
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from playwright.sync_api import sync_playwright

ROOT = Path(__file__).parents[2]
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


def opened(page: Path) -> tuple[list[float], list[float]]:
    """(seconds until the page is drawn, three times; frames per second while it moves and in full)."""
    seconds = []
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=[
            "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"])
        for _ in range(3):
            shown = browser.new_page(viewport={"width": 1300, "height": 900})
            begin = time.perf_counter()
            shown.goto(page.as_uri())
            shown.wait_for_selector("html[data-ready]", state="attached", timeout=120_000)
            seconds.append(time.perf_counter() - begin)
        return seconds, [shown.evaluate(FRAMES, coarse) for coarse in (True, False)]


def main() -> None:
    with TemporaryDirectory() as folder:
        words = [word for word in sys.argv[1:] if word != "--five-axis"]
        for count in [int(word) for word in words] or [100, 10_000, 1_000_000]:
            page, processor, memory = made(count, Path(folder), "--five-axis" in sys.argv)
            text = page.read_text("utf-8")
            found = re.finditer(r'(?s)<script type=[^>]*id="([\w-]+)"[^>]*>(.*?)</script>', text)
            parts = {one[1]: len(one[2]) for one in found}
            figures = sum(size for name, size in parts.items() if name.startswith("points"))
            texts = sum(size for name, size in parts.items() if name.startswith("text"))
            seconds, frames = opened(page)
            print(f"{count:>9,} points: {len(text) / 1e6:.2f} MB (texts {texts / 1e6:.2f}, points {figures / 1e6:.2f} = "
                  f"{figures / count:.1f} bytes each, all else {(len(text) - texts - figures) / 1e6:.2f}); made in "
                  f"{processor:.1f} s of processor, {memory:.0f} MB; open in {', '.join(f'{s:.2f}' for s in seconds)} s; "
                  f"{frames[0]:.0f} frames per second turning, {frames[1]:.0f} in full")


if __name__ == "__main__":
    main()
