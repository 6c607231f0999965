/* The charts of a run, and the arm at the moment that they point at. */
"use strict";
(() => {
  const held = document.getElementById("run");
  if (!held) return;
  const { Group, chart, unpacked, repaints } = palpate;
  const run = JSON.parse(held.textContent);
  const columns = Object.fromEntries(Object.entries(run.columns).map(([name, column]) => [name, unpacked(column)]));
  const group = new Group(), t = columns.t, rows = t.length;
  const own = { marks: run.marks, shades: run.shades, left: 56 };
  const estimate = (name) => [
    { label: "95 % if the model holds", kind: "band", colour: name, high: `${name}_high`, low: `${name}_low` },
    { label: "on line", kind: "own", colour: name, of: name },
    ...(run.truth[name] == null ? [] : [{ label: "truth", kind: "known", colour: "ink", of: `${name}_true` }]),
  ];
  for (const name of ["K", "B", "M"]) columns[`${name}_true`] = t.map(() => run.truth[name] ?? null);
  const put = (id, spec) => {
    const host = document.getElementById(`chart-${id}`);
    if (!host) return;
    const made = () => chart(host, { ...own, ...spec }, columns, group);
    const fold = host.closest("details");
    if (!fold || fold.open) { made(); return; }
    let there = false;
    const open = () => { if (!there && fold.open) { there = true; made(); const first = group.charts[0].plot.scales.x; group.charts[group.charts.length - 1].plot.setScale("x", { min: first.min, max: first.max }); } };
    fold.addEventListener("toggle", open);
    addEventListener("beforeprint", () => { fold.open = true; open(); });
  };
  put("force", { title: "Force", y: "force [N]", height: 220, alt: "Contact force over time", series: [
    { label: "measured", kind: "measured", colour: "measured", of: "measured" },
    { label: "true", kind: "own", colour: "F", of: "force" },
    { label: "desired", kind: "known", colour: "ink", of: "desired" }] });
  const range = (name) => (run.ranges[name] ? { range: run.ranges[name] } : {});
  put("K", { title: "Stiffness K", y: "K [N/m]", x: "time [s]", height: 190, wordless: true, alt: "Estimate of K over time", series: estimate("K"), ...range("K") });
  put("B", { title: "Damping B", y: "B [N s/m]", x: "time [s]", height: 190, wordless: true, alt: "Estimate of B over time", series: estimate("B"), ...range("B") });
  put("M", { title: "Mass M", y: "M [kg]", x: "time [s]", height: 190, wordless: true, alt: "Estimate of M over time", series: estimate("M"), ...range("M") });
  put("thesis", { title: "Stiffness, from three kinds of signals", y: "K [N/m]", x: "time [s]", height: 200, wordless: true, ...range("thesis"), series: [
    { label: "thesis' signals", kind: "other", colour: "measured", of: "K_thesis" },
    { label: "raw signals", kind: "measured", colour: "measured", of: "K_raw" },
    { label: "matched", kind: "own", colour: "K", of: "K" },
    ...(run.truth.K == null ? [] : [{ label: "truth", kind: "known", colour: "ink", of: "K_true" }])] });
  put("torque", { title: "Torque as applied", y: "torque [N m]", x: "time [s]", height: 210, wordless: true, series: [
    { label: "motor 1", kind: "own", colour: "ink", of: "torque1" },
    { label: "motor 2", kind: "other", colour: "ink", of: "torque2" },
    { label: "motor 3", kind: "own", colour: "measured", of: "torque3" }] });

  /* One moment for the arm, its slider and the cursor of all charts */
  const moment = document.getElementById("moment"), play = document.getElementById("play"), of = document.getElementById("of");
  const canvas = document.getElementById("arm"), draw = palpate.arm(canvas, run.links);
  const q = (i) => [columns.q1[i], columns.q2[i], columns.q3[i]];
  const at = (x) => { let low = 0, high = rows - 1; while (high - low > 1) { const middle = (low + high) >> 1; if (t[middle] < x) low = middle; else high = middle; } return low; };
  let now = at(run.shown), playing = false;
  const show = (i) => {
    now = i;
    draw({ q: q(i), rest: q(0), wall: columns.wall[i], depth: columns.depth[i] / 1000, force: columns.force[i] });
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
