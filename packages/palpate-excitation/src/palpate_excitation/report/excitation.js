/* The charts of a designed excitation: the force, its spectrum, and what it will tell after how long. */
"use strict";
(() => {
  const { Group, chart, unpacked } = palpate;
  const told = JSON.parse(document.getElementById("excitation").textContent);
  const opened = (columns) => Object.fromEntries(Object.entries(columns).map(([name, column]) => [name, unpacked(column)]));
  const host = (name) => document.getElementById(`chart-${name}`);
  const felt = { label: "on the surfaces", kind: "band", colour: "F", high: "high", low: "low" };
  const force = chart(host("force"), { title: "Desired force", y: "force [N]", x: "time [s]", height: 220, series: [felt,
    { label: "desired", kind: "model", colour: "ink", of: "desired" },
    { label: "lowest and highest allowed", kind: "known", colour: "quiet", of: "most" },
    { label: "", kind: "known", colour: "quiet", of: "least", silent: true }] }, opened(told.force), new Group());
  const [from, to] = told.window;
  force.plot.setScale("x", { min: from, max: to });
  chart(host("spectrum"), { title: "Spectrum", y: "amplitude [N]", x: "frequency [Hz]", unit: "Hz", log: "x", height: 240, series: [felt,
    { label: "desired", kind: "model", colour: "ink", of: "desired" }] }, told.spectrum, new Group());
  const series = told.names.flatMap((name) => [
    { label: name, kind: "band", colour: name, high: `${name}_high`, low: `${name}_low`, silent: true },
    { label: name, kind: "own", colour: name, of: `${name}_high` },
    ...(told.precision[`${name}_asked`] ? [{ label: `${name} asked`, kind: "known", colour: name, of: `${name}_asked`, silent: true }] : [])]);
  chart(host("precision"), { title: "Predicted uncertainty", y: "95 % half-width [%]", x: "duration [s]", unit: "s", log: "xy", height: 240, digits: 2,
    caption: "Line: the worst surface; shaded: the others; dashed: requested.", marks: [{ x: told.seconds, text: "this design" }], series }, told.precision, new Group());
})();
