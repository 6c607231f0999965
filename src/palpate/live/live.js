/* The live page: rows come in by a socket, and are drawn when the screen is. */
"use strict";
(() => {
  const { figure, make, token, repaints } = palpate;
  const view = JSON.parse(document.getElementById("view").textContent);
  const SPAN = 10, MOST = Math.ceil(1.1 * SPAN / view.stride), CALM = 100;
  const byId = (id) => document.getElementById(id);
  const live = { frames: 0, rows: 0, latest: {}, state: null };
  palpate.live = live;
  const write = (node, text) => { if (node.textContent !== text) node.textContent = text; };

  /* Rows of the last seconds, by column, and the ends of the intervals; what is no number is a gap. */
  const columns = Object.fromEntries(view.columns.map((name) => [name, []]));
  const halves = ["K", "B"];
  for (const name of halves) { columns[`${name}_high`] = []; columns[`${name}_low`] = []; }
  const forget = () => { for (const list of Object.values(columns)) list.length = 0; strips.forEach((one) => one.forget()); };
  const take = (numbers) => {
    const width = view.columns.length, count = numbers.length / width;
    view.columns.forEach((name, i) => {
      for (let row = 0; row < count; row++) { const value = numbers[row * width + i]; columns[name].push(Number.isNaN(value) ? null : value); }
    });
    for (const name of halves) {
      const value = columns[name], half = columns[`${name}_half`];
      for (let i = value.length - count; i < value.length; i++) {
        const known = value[i] != null && half[i] != null;
        columns[`${name}_high`].push(known ? value[i] + half[i] : null); columns[`${name}_low`].push(known ? value[i] - half[i] : null);
      }
    }
    if (columns.t.length > 1.2 * MOST) for (const list of Object.values(columns)) list.splice(0, list.length - MOST);
    live.rows += count;
  };
  const last = (name) => { const list = columns[name]; return list.length ? list[list.length - 1] : null; };

  /* Charts */
  const around = (names) => () => {
    let low = Infinity, high = -Infinity;
    const t = columns.t, end = t.length - 1;
    for (const name of names) for (let i = end, list = columns[name]; i >= 0 && t[i] >= t[end] - SPAN; i--) {
      const v = list[i];
      if (v != null) { if (v < low) low = v; if (v > high) high = v; }
    }
    return high > low ? [low, high] : high === low ? [low - Math.abs(low) / 10 - 1e-9, high + Math.abs(high) / 10 + 1e-9] : null;
  };
  const about = (name, share) => () => {
    const value = last(`${name}_true`) ?? last(name), half = last(`${name}_half`) ?? 0;
    if (value == null) return null;
    const room = Math.max(share * value, 2.2 * half, 1.3 * Math.abs((last(name) ?? value) - value));
    return [value - room, value + room];
  };
  const measured = { label: "measured", kind: "measured", colour: "measured", of: "measured" };
  const force = { label: "true", kind: "own", colour: "F", of: "force" };
  const desired = { label: "desired", kind: "known", colour: "ink", of: "desired" };
  const estimated = (name) => [
    { label: "95 %", kind: "band", colour: name, high: `${name}_high`, low: `${name}_low` },
    { label: "estimate", kind: "own", colour: name, of: name },
    { label: "truth", kind: "known", colour: "ink", of: `${name}_true` },
  ];
  const figures = [
    { title: "Force", y: "force [N]", series: [measured, force, desired] },
    { title: "Position", y: "depth in the surface [mm]", series: [{ label: "depth in the surface", kind: "own", colour: "F", of: "depth" }] },
    ...[["K", "Stiffness K", "N/m"], ["B", "Damping B", "N s/m"]].map(([key, title, unit], i) => (
      { title, y: `${title.split(" ").pop()} [${unit}]`, series: estimated(key), wanted: about(key, i ? 0.3 : 0.06) })),
  ];
  const tall = () => (innerWidth > 900 ? Math.max(120, (innerHeight - 150) / figures.length - 44) : 170);
  const strip = palpate.strips(columns, SPAN);
  const strips = figures.map((one, i) => {
    const host = make("figure");
    byId("charts").append(host);
    return strip(host, { wanted: around(one.series.map((s) => s.of)), ...one, height: tall, wordless: i > 0, x: i === figures.length - 1 ? "time [s]" : "" });
  });

  /* The picture of the arm */
  const canvas = byId("picture");
  const arm = view.scene ? palpate.arm3(canvas, view.scene, view.rest, () => { fresh = true; }) : palpate.arm(canvas, view.links);
  const joints = view.rest.map((_, i) => `q${i + 1}`);
  const picture = () => {
    const q = joints.map(last), force = last("force") ?? last("measured") ?? 0;
    if (q.some((v) => v == null)) return;
    arm({ q, rest: view.rest, wall: last("wall"), depth: last("depth") / 1000, force });
  };

  /* Sliders */
  const sliders = {};
  const send = (request) => { if (socket && socket.readyState === 1) socket.send(JSON.stringify(request)); };
  const spelled = (slider, value) => `${figure(value, 3)} ${slider.unit}`.trim();
  for (const one of view.sliders) {
    const to = (share) => (one.logarithmic ? one.low * (one.high / one.low) ** share : one.low + share * (one.high - one.low));
    const from = (value) => (one.logarithmic ? Math.log(value / one.low) / Math.log(one.high / one.low) : (value - one.low) / (one.high - one.low));
    const field = make("input", { type: "range", min: 0, max: 1, step: "any", "aria-label": one.name, class: one.colour });
    const output = make("span", { class: "value", "aria-hidden": "true" });
    byId("sliders").append(make("label", {}, make("span", {}, one.name), output, field));
    const show = (value) => { output.textContent = spelled(one, value); field.setAttribute("aria-valuetext", output.textContent); };
    const clipped = (value) => Math.min(one.high, Math.max(one.low, value));
    let held = false;
    const ask = (value) => { show(value); send({ do: "set", key: one.key, value: clipped(value) }); };
    field.addEventListener("input", () => { held = true; ask(to(+field.value)); });
    field.addEventListener("change", () => { held = false; });
    sliders[one.key] = {
      put: (value) => { if (!held) { field.value = from(value); show(value); } },
      by: (change) => { const value = clipped(change(to(+field.value))); field.value = from(value); ask(value); },
    };
    sliders[one.key].put(one.value);
  }

  /* The card of the stiffness */
  const card = () => {
    const K = last("K"), half = last("K_half"), number = byId("number"), text = K == null ? "" : `${figure(K, 4)} ${figure(half, 2)}`;
    if (number.dataset.text !== text) {
      number.dataset.text = text;
      number.replaceChildren(...(K == null ? [make("span", { class: "quiet" }, "not estimated yet")] : [figure(K, 4), make("i", {}, ` ± ${figure(half, 2)}`), make("small", {}, " N/m")]));
    }
  };

  /* State of the simulation */
  const alerts = byId("alerts");
  const alert = (tone, title, text) => make("div", { class: `alert ${tone}`, role: "alert" }, make("p", {}, make("b", {}, title), ` ${text}`));
  let away = "";
  const showState = () => {
    const state = live.state;
    if (!state) return;
    byId("pause").setAttribute("aria-pressed", String(!state.playing));
    byId("pause").replaceChildren(make("span", { "aria-hidden": "true" }, state.playing ? "❚❚" : "▶"), " ", make("span", { class: "word" }, state.playing ? "pause" : "go on"));
    for (const [key, value] of Object.entries(state.values)) if (sliders[key]) sliders[key].put(value);
    const seed = byId("seed");
    if (document.activeElement !== seed) seed.value = state.seed;
    strips.forEach((one) => { one.marks = state.events; });
    const over = state.ended.startsWith("done");
    alerts.replaceChildren(
      ...(away ? [alert("", "The program has ended.", away)] : []),
      ...(state.ended ? [alert(over ? "" : "fail", over ? "The end." : "✕ Stopped.", `${state.ended.replace(/^done: /, "")}. Reset, or continue, to start again.`)] : []),
      ...(state.warning ? [alert("", "At its limit:", state.warning)] : []),
      ...(state.refusal ? [alert("", "Not done:", state.refusal)] : []));
    fresh = true;
  };
  const phase = () => {
    const kind = last("phase"), node = byId("phase");
    const [word, tone] = away ? ["gone", "fail"] : live.state && !live.state.playing && !live.state.ended ? ["paused", "none"]
      : live.state && live.state.ended && !live.state.ended.startsWith("done") ? ["stopped", "fail"] : live.state && live.state.ended ? ["ended", "none"]
      : kind === 1 ? ["pressing", "ok"] : kind === 2 ? ["contact lost", "fail"] : ["approaching", "go"];
    if (node.textContent !== word) { node.textContent = word; node.className = `v ${tone}`; }
  };

  /* The socket: it comes back by itself */
  let socket = null, fresh = false, wait = 250;
  const connect = () => {
    socket = new WebSocket(new URL("stream", location.href.replace(/^http/, "ws")));
    socket.binaryType = "arraybuffer";
    socket.addEventListener("open", () => { away = ""; wait = 250; forget(); showState(); });
    socket.addEventListener("message", ({ data }) => {
      if (typeof data !== "string") { take(new Float64Array(data)); fresh = true; return; }
      const message = JSON.parse(data);
      if (message.kind === "clear") { forget(); fresh = true; }
      else if (message.kind === "state") { live.state = message; showState(); }
      else if (message.kind === "watching") document.body.classList.add("watching");
      else if (message.kind === "refused" && live.state) { live.state.refusal = message.why; showState(); }
    });
    socket.addEventListener("close", () => {
      away = "The page tries to reconnect, and continues when the program is back."; showState(); fresh = true;
      setTimeout(connect, wait); wait = Math.min(5000, 2 * wait);
    });
  };

  /* Drawn once a frame, and only if there is something new; words and the card ten times a second. */
  let calm = 0;
  const draw = (clock) => {
    requestAnimationFrame(draw);
    if (!fresh) return;
    fresh = false;
    live.frames++;
    for (const name of view.columns) live.latest[name] = last(name);
    strips.forEach((one) => one.draw());
    picture();
    if (clock - calm < CALM) { fresh = fresh || !live.state || !live.state.playing; return; }
    calm = clock;
    words();
  };
  const words = () => {
    const now = last("t");
    phase(); card(); strips.forEach((one) => one.read());
    if (now != null) write(byId("clock"), `${now.toFixed(2)} s`);
  };
  const redraw = () => { fresh = true; };
  repaints.add(redraw);
  new ResizeObserver(redraw).observe(canvas);

  /* Buttons and keys */
  const forceSlider = sliders["force.first"] || sliders.force;
  const paused = () => live.state && !live.state.playing;
  const acts = {
    " ": () => send({ do: "pause", on: !paused() }), ".": () => send({ do: "step" }), 0: () => send({ do: "reset" }),
    ArrowUp: () => forceSlider?.by((v) => v + 1), ArrowDown: () => forceSlider?.by((v) => v - 1),
    "[": () => sliders["surface.stiffness"]?.by((v) => v / 1.1), "]": () => sliders["surface.stiffness"]?.by((v) => v * 1.1),
  };
  byId("pause").addEventListener("click", acts[" "]);
  byId("step").addEventListener("click", acts["."]);
  byId("reset").addEventListener("click", acts[0]);
  byId("seed").addEventListener("change", (event) => { if (/^\d{1,15}$/.test(event.target.value)) send({ do: "reset", seed: +event.target.value }); });
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.matches("input, select, .plot") || (event.key === " " && event.target.matches("button"))) return;
    if (acts[event.key]) { event.preventDefault(); acts[event.key](); }
  });
  connect();
  requestAnimationFrame(draw);
})();
