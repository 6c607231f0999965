"""How smooth the live page is: frames a second, and the time from a slider to the picture, in headless Chromium.

The program runs as a user starts it, in a process of its own. What is measured is the page's: a frame counts when it
was drawn with rows that had not been drawn before; a slider's time ends with the frame that shows the surface it set.
"""

import argparse
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

FRAMES, DELAY = 60.0, 0.050
"""What is aimed at: frames a second, and seconds from slider to picture."""
QUIET = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
GAPS = """seconds => new Promise(done => {
  const gaps = [], drawn = palpate.live.frames, start = performance.now();
  let last = start;
  const frame = now => {
    gaps.push(now - last); last = now;
    if (now - start < 1000 * seconds) requestAnimationFrame(frame);
    else done({gaps: gaps.slice(1), drawn: palpate.live.frames - drawn, seconds: (now - start) / 1000});
  };
  requestAnimationFrame(frame);
})"""
SLIDE = """share => new Promise(done => {
  const slider = document.querySelector('#sliders input.K'), before = palpate.live.latest.K_true;
  slider.value = share;
  const start = performance.now();
  slider.dispatchEvent(new Event('input'));
  const frame = () => {
    if (palpate.live.latest.K_true !== before) done(performance.now() - start);
    else requestAnimationFrame(frame);
  };
  requestAnimationFrame(frame);
})"""


def ticks(pid: int) -> float:
    """Seconds of the processor that a process has used."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def measured(address: str, pid: int, seconds: float, slides: int) -> dict[str, float]:
    from playwright.sync_api import sync_playwright

    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if chromium is None:
        sys.exit("there is no Chromium on this machine (Debian: apt-get install chromium)")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=QUIET)
        page = browser.new_page(viewport={"width": 1400, "height": 900})
        page.goto(address)
        page.wait_for_timeout(12_000)  # the charts are full, and the loop's stability is worked out
        rows, cpu, start = page.evaluate("palpate.live.rows"), ticks(pid), time.monotonic()
        told = page.evaluate(GAPS, seconds)
        span = time.monotonic() - start
        found = {
            "frames_per_s": told["drawn"] / told["seconds"],
            "gap_p50_ms": quantile(told["gaps"], 0.5),
            "gap_p99_ms": quantile(told["gaps"], 0.99),
            "kB_per_s": (page.evaluate("palpate.live.rows") - rows) * 16 * 8 / 1000 / span,
            "cores": (ticks(pid) - cpu) / span,
        }
        delays = []
        for i in range(slides):
            delays.append(page.evaluate(SLIDE, 0.3 + 0.4 * ((i * 7) % 11) / 11))
            page.wait_for_timeout(150)
        browser.close()
    return found | {"slider_p50_ms": quantile(delays, 0.5), "slider_max_ms": max(delays)}


def quantile(values: list[float], share: float) -> float:
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--slides", type=int, default=30)
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    command = [sys.executable, "-m", "palpate", "live", "--run", "foam-hybrid", "--seed", "1"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as program:  # noqa: S603 - our own interpreter
        try:
            assert program.stdout is not None
            address = program.stdout.readline().strip()
            found = measured(address, program.pid, asked.seconds, asked.slides)
        finally:
            program.send_signal(signal.SIGINT)
    found["load"] = os.getloadavg()[0] / (os.cpu_count() or 1)
    if asked.json:
        print(json.dumps(found))
        return
    print(f"frames drawn                {found['frames_per_s']:7.1f} a second; aimed at {FRAMES:g}")
    print(f"gap between frames, p50 p99 {found['gap_p50_ms']:7.1f} {found['gap_p99_ms']:.1f} ms")
    delays = f"{found['slider_p50_ms']:7.1f} {found['slider_max_ms']:.1f} ms"
    print(f"slider to picture, p50 max  {delays}; aimed at {1e3 * DELAY:g}")
    print(f"sent to the page            {found['kB_per_s']:7.1f} kB/s")
    print(
        f"the program                 {found['cores']:7.2f} cores; load of the machine {found['load']:.1f} a core"
    )


if __name__ == "__main__":
    main()
