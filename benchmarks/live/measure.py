"""How smooth the live page is: frames a second, what one costs, and the time from a slider to the picture.

The program runs as a user starts it, in a process of its own, the page in headless Chromium. A frame counts when it
was drawn with rows that had not been drawn before; a slider's time ends with the frame that shows the surface it set.
What a frame costs is time of the processor on the page's own thread, which other programs do not change; how many
there are a second, and the slider's time, they do.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path
from typing import Any

from headless import Costs, browser, chromium, running

FRAMES, COST, DELAY = 60.0, 4.0, 50.0
"""What is aimed at: frames a second, milliseconds of the processor a frame, milliseconds from slider to picture."""
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


def quantile(values: list[float], share: float) -> float:
    return sorted(values)[round(share * (len(values) - 1))]


def ticks(pid: int) -> float:
    """Seconds of the processor that a process has used."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def frames(page: Any, seconds: float) -> dict[str, float]:
    """How many there are, and what one costs; the charts are full, and nothing is compiled or proved any more."""
    costs = Costs(page)
    before = costs.now()
    told = page.evaluate(GAPS, seconds)
    spent = {name: value - before[name] for name, value in costs.now().items()}
    return {
        "frames_per_s": told["drawn"] / told["seconds"],
        "drawn_of_shown": told["drawn"] / len(told["gaps"]),
        "gap_p50_ms": quantile(told["gaps"], 0.5),
        "gap_p99_ms": quantile(told["gaps"], 0.99),
        "cost_ms": 1000 * spent["TaskDuration"] / told["drawn"],
        "script_ms": 1000 * spent["ScriptDuration"] / told["drawn"],
    }


def delays(page: Any, slides: int) -> list[float]:
    """From a slider to the frame that shows the surface it set [ms]."""
    found = []
    for i in range(slides):
        found.append(page.evaluate(SLIDE, 0.3 + 0.4 * ((i * 7) % 11) / 11))
        page.wait_for_timeout(150)
    return found


def measured(address: str, pid: int, seconds: float, slides: int, settle: float) -> dict[str, float]:
    with browser() as own:
        page = own.new_page(viewport={"width": 1400, "height": 900})
        page.goto(address)
        page.wait_for_timeout(1000 * settle)
        rows, cpu, start = page.evaluate("palpate.live.rows"), ticks(pid), time.monotonic()
        found = frames(page, seconds)
        span = time.monotonic() - start
        width = page.evaluate("JSON.parse(document.getElementById('view').textContent).columns.length")
        found["kB_per_s"] = (page.evaluate("palpate.live.rows") - rows) * width * 8 / 1000 / span
        found["cores"] = (ticks(pid) - cpu) / span
        late = delays(page, slides)
    return found | {
        "slider_first_ms": late[0],
        "slider_p50_ms": quantile(late, 0.5),
        "slider_p99_ms": quantile(late, 0.99),
        "slider_max_ms": max(late),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--slides", type=int, default=100)
    parser.add_argument("--settle", type=float, default=15.0, help="before it is measured [s]")
    asked = parser.parse_args()
    if chromium() is None:
        sys.exit("there is no Chromium on this machine (Debian: apt-get install chromium)")
    with running("--run", "foam-hybrid", "--seed", 1) as (program, (address,)):
        found = measured(address, program.pid, asked.seconds, asked.slides, asked.settle)
    found["load"] = os.getloadavg()[0] / (os.cpu_count() or 1)
    shown = f"{found['drawn_of_shown']:.0%} of those the browser showed"
    late = " ".join(f"{found[f'slider_{name}_ms']:7.1f}" for name in ("first", "p50", "p99", "max"))
    cost = f"{found['cost_ms']:7.2f} ms of the processor, {found['script_ms']:.2f} in scripts"
    print(f"frames drawn                {found['frames_per_s']:7.1f} a second, {shown}; aimed at {FRAMES:g}")
    print(f"gap between frames, p50 p99 {found['gap_p50_ms']:7.1f} {found['gap_p99_ms']:.1f} ms")
    print(f"a frame                     {cost}; aimed at {COST:g}")
    print(
        f"slider to picture           {late} ms: first, p50, p99, max of {asked.slides}; aimed at {DELAY:g}"
    )
    print(f"sent to the page            {found['kB_per_s']:7.1f} kB/s")
    print(
        f"the program                 {found['cores']:7.2f} cores; load of the machine {found['load']:.1f} a core"
    )


if __name__ == "__main__":
    main()
