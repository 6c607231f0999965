"""Draws the film and the pictures of the README and of the first page of the documentation.

`make pictures` runs it; a Chromium takes the pictures of the pages.
"""

import argparse
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image
from PIL.PngImagePlugin import PngInfo
from playwright.sync_api import Page, sync_playwright

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PALPATE = str(Path(sys.executable).with_name("palpate"))
LOG = [
    str(ROOT / "examples/data/press.csv"),
    *["--time", "time_s", "--position", "position_mm:mm", "--force", "force_N:N"],
]
WIDTH, HEIGHT = 1200, 760


def palpate(folder: Path, *words: str) -> str:
    """Run the program in a folder; its output."""
    run = subprocess.run([PALPATE, *words], cwd=folder, check=False, capture_output=True, text=True)  # noqa: S603 - our own program
    if run.returncode not in {0, 1}:
        raise SystemExit(run.stderr)
    return run.stdout


def picture(page: Page, address: str, path: Path, seconds: float) -> None:
    """The top of a page, after some seconds; its headings stand in the file, for a test to compare."""
    page.goto(address)
    page.wait_for_timeout(1e3 * seconds)
    page.screenshot(path=path, clip={"x": 0, "y": 0, "width": WIDTH, "height": HEIGHT})
    words = PngInfo()
    words.add_itxt("Description", " ".join(page.locator("h1, h1 ~ p, .sentence").all_inner_texts()))
    with Image.open(path) as image:
        image.save(path, pnginfo=words, optimize=True)
    print(f"{path.name}: {path.stat().st_size // 1024} kB")


def main() -> None:
    """Draw them all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=DOCS, help="folder for them")
    out = parser.parse_args().out
    with tempfile.TemporaryDirectory() as place, sync_playwright() as browsers:
        folder = Path(place)
        palpate(folder, "identify", *LOG, "--report", "identify.html")
        (folder / "found.json").write_text(palpate(folder, "identify", *LOG, "--json"))
        gains = ["--arm", "ur5e", "--force", "15", "--out", "gains.toml", "--report", "tune.html"]
        palpate(folder, "tune", "found.json", *gains)
        palpate(
            folder,
            *["press", "--arm", "fr3", "--force", "20:N", "--surface", "K=5000,B=50", "--out", "press"],
        )
        shutil.copy(folder / "press/film.svg", out / "film.svg")
        browser = browsers.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
        for name, file in (
            ("identify", "identify.html"),
            ("tune", "tune.html"),
            ("press", "press/report.html"),
        ):
            picture(page, (folder / file).as_uri(), out / f"{name}.png", 2.0)
        live = subprocess.Popen([PALPATE, "live", "--arm", "fr3"], stdout=subprocess.PIPE, text=True)  # noqa: S603
        assert live.stdout is not None
        try:
            picture(page, live.stdout.readline().strip(), out / "live.png", 8.0)
        finally:
            live.terminate()
            live.wait()


if __name__ == "__main__":
    main()
