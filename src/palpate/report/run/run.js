/* The charts of a run, and the arm at the moment that they point at. */
"use strict";
(() => {
  const held = document.getElementById("run");
  if (!held) return;
  const { Group, chart, unpacked, repaints } = palpate;
  const run = JSON.parse(held.textContent);
  const opened = (columns) => Object.fromEntries(Object.entries(columns).map(([name, column]) => [name, unpacked(column)]));
  const columns = opened(run.columns), group = new Group(), t = columns.t, rows = t.length;
  const put = (id, panel) => {
    const host = document.getElementById(`chart-${id}`);
    if (!host) return;
    const made = () => chart(host, { ...panel.spec, left: 56 }, opened(panel.columns), group);
    const fold = host.closest("details");
    if (!fold || fold.open) { made(); return; }
    let there = false;
    const open = () => { if (!there && fold.open) { there = true; made(); const first = group.charts[0].plot.scales.x; group.charts[group.charts.length - 1].plot.setScale("x", { min: first.min, max: first.max }); } };
    fold.addEventListener("toggle", open);
    addEventListener("beforeprint", () => { fold.open = true; open(); });
  };
  for (const [id, panel] of Object.entries(run.charts)) put(id, panel);

  /* One moment for the arm, its slider and the cursor of all charts */
  const moment = document.getElementById("moment"), play = document.getElementById("play"), of = document.getElementById("of");
  const canvas = document.getElementById("arm"), draw = palpate.arm(canvas, run.links);
  const q = (i) => [columns.q1[i], columns.q2[i], columns.q3[i]];
  const at = (x) => { let low = 0, high = rows - 1; while (high - low > 1) { const middle = (low + high) >> 1; if (t[middle] < x) low = middle; else high = middle; } return low; };
  let now = at(run.shown), playing = false;
  const show = (i) => {
    now = i;
    draw({ q: q(i), rest: q(0), wall: columns.wall[i], depth: columns.depth[i], force: columns.force[i] });
    moment.value = (t[i] - t[0]) / (t[rows - 1] - t[0] || 1);
    of.textContent = `${t[i].toFixed(2)} s`;
  };
  group.watchers.push((x) => { if (x != null && !playing) show(at(x)); });
  const point = (x) => { show(at(x)); group.point(x, null); };
  const stop = () => { playing = false; play.textContent = "▶"; };
  moment.addEventListener("input", () => { stop(); point(t[0] + moment.value * (t[rows - 1] - t[0])); });
  play.addEventListener("click", () => {
    if (playing) { stop(); return; }
    playing = true; play.textContent = "❚❚";
    let x = t[now] > t[rows - 1] - 0.05 ? Math.max(t[0], run.shown - 2) : t[now], last = performance.now();
    const step = (clock) => {
      if (!playing) return;
      x += (clock - last) / 1000; last = clock;
      if (x >= t[rows - 1]) { stop(); return; }
      point(x);
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  });
  new ResizeObserver(() => show(now)).observe(canvas);
  repaints.add(() => show(now));
  const [from, to] = run.window;
  for (const one of group.charts) one.plot.setScale("x", { min: from, max: to });
})();
