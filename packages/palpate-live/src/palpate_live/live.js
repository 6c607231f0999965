/* The live page: rows come in by a socket, and are drawn when the screen is. */
"use strict";
(() => {
  const { figure, make, token, repaints } = palpate;
  const view = JSON.parse(document.getElementById("view").textContent);
  const there = new Set(view.shown);
  const SPAN = 10, MOST = Math.ceil(1.1 * SPAN / view.stride), CALM = 100;
  const byId = (id) => document.getElementById(id);
  const live = { frames: 0, rows: 0, latest: {}, state: null };
  palpate.live = live;
  const write = (node, text) => { if (node.textContent !== text) node.textContent = text; };

  /* Rows of the last seconds, by column, and the ends of the intervals; what is no number is a gap. */
  const columns = Object.fromEntries(view.columns.map((name) => [name, []]));
  const halves = ["K", "B"].filter((name) => there.has(`${name}_half`));
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
  const offered = [
    { title: "Force", y: `force [${view.units.measured}]`, needs: "measured", series: [measured, force, desired] },
    { title: "Position", y: `${view.position} [${view.units.depth}]`, needs: "depth", series: [{ label: view.position, kind: "own", colour: "F", of: "depth" }] },
    ...Object.entries(view.quantities).map(([key, [title, unit]], i) => (
      { title, y: `${title.split(" ").pop()} [${unit}]`, needs: key, series: estimated(key), wanted: about(key, i ? 0.3 : 0.06) })),
  ].filter((one) => there.has(one.needs));
  offered.forEach((one) => { one.series = one.series.filter((s) => there.has((s.of || s.high).replace("_high", "_half"))); });
  const tall = () => (innerWidth > 900 ? Math.max(120, (innerHeight - 150) / offered.length - 44) : 170);
  const strip = palpate.strips(columns, SPAN);
  const strips = offered.map((one, i) => {
    const host = make("figure");
    byId("charts").append(host);
    return strip(host, { wanted: around(one.series.map((s) => s.of)), ...one, height: tall, wordless: i > 0, x: i === offered.length - 1 ? "time [s]" : "" });
  });

  /* The picture: an arm, or force over position where no joints are known */
  const canvas = byId("picture");
  const arm = view.scene ? palpate.arm3(canvas, view.scene, view.rest, () => { fresh = true; }) : view.links.length ? palpate.arm(canvas, view.links) : null;
  const joints = view.rest.map((_, i) => `q${i + 1}`);
  const press = () => {
    const dense = devicePixelRatio || 1, wide = canvas.clientWidth, high = canvas.clientHeight, draw = canvas.getContext("2d");
    canvas.width = Math.round(wide * dense); canvas.height = Math.round(high * dense);
    draw.setTransform(dense, 0, 0, dense, 0, 0);
    /* One row in four: on a screen the others lie between. */
    const few = (list) => list.filter((_, i) => (list.length - 1 - i) % 4 === 0);
    const x = few(columns.depth), y = few(columns.measured), known = x.map((v, i) => v != null && y[i] != null);
    const xs = x.filter((_, i) => known[i]), ys = y.filter((_, i) => known[i]);
    draw.font = "12px sans-serif"; draw.fillStyle = token("quiet");
    draw.textAlign = "left"; draw.fillText(`force [${view.units.measured}]`, 14, 20);
    draw.textAlign = "right"; draw.fillText(`${view.position} [${view.units.depth}]`, wide - 14, high - 8);
    if (!xs.length) return;
    const ends = (list) => { const low = list.reduce((a, b) => Math.min(a, b)), top = list.reduce((a, b) => Math.max(a, b)), room = 0.08 * (top - low) || 1; return [low - room, top + room]; };
    const [x0, x1] = ends(xs), [y0, y1] = ends(ys);
    const px = (v) => 52 + (v - x0) / (x1 - x0) * (wide - 72), py = (v) => high - 46 - (v - y0) / (y1 - y0) * (high - 84);
    for (const share of [0.1, 0.5, 0.9]) {
      const u = x0 + share * (x1 - x0), v = y0 + share * (y1 - y0);
      draw.textAlign = "center"; draw.fillText(figure(u, 3), px(u), high - 26);
      draw.textAlign = "right"; draw.fillText(figure(v, 3), 46, py(v) + 4);
    }
    draw.strokeStyle = token("measured"); draw.lineWidth = 1.25; draw.beginPath();
    let up = true;
    x.forEach((v, i) => { if (!known[i]) { up = true; return; } if (up) draw.moveTo(px(v), py(y[i])); else draw.lineTo(px(v), py(y[i])); up = false; });
    draw.stroke();
    draw.fillStyle = token("F"); draw.beginPath(); draw.arc(px(xs[xs.length - 1]), py(ys[ys.length - 1]), 6, 0, 7); draw.fill();
  };
  const picture = () => {
    if (!arm) { press(); return; }
    const q = joints.map(last), force = last("force") ?? last("measured") ?? 0;
    if (q.some((v) => v == null)) return;
    arm({ q, rest: view.rest.length ? view.rest : null, wall: last("wall"), depth: last("depth") / 1000, force });
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

  /* The card of the stiffness: where the estimate lies within what is stable, on an axis of equal factors */
  const place = byId("place");
  const parts = Object.fromEntries(["rail", "stable", "band", "truth", "own"].map((name) => { const part = make("span", { class: name }); place.append(part); return [name, part]; }));
  let window_ = null, ticks = [];
  const scale = (low, high) => {
    if (window_ && low >= window_[0] && high <= window_[1] && high / low > (window_[1] / window_[0]) ** 0.2) return;
    const middle = Math.sqrt(low * high), factor = [1.3, 1.7, 3, 10, 30, 100, 1000, 1e4, 1e5].find((f) => f >= (high / low) ** 1.4) || 1e6;
    window_ = [middle / Math.sqrt(factor), middle * Math.sqrt(factor)];
    ticks.forEach((one) => one.remove());
    const step = 10 ** Math.floor(Math.log10(window_[1] - window_[0])), list = [];
    if (factor > 8) { for (let e = Math.floor(Math.log10(window_[0])); e < 9; e++) for (const m of factor > 300 ? [1] : factor > 50 ? [1, 3] : [1, 2, 5]) list.push(m * 10 ** e); }
    else { const own = (window_[1] - window_[0]) / step > 4 ? 2 * step : (window_[1] - window_[0]) / step > 2 ? step : step / 2; for (let v = Math.ceil(window_[0] / own) * own; v < window_[1]; v += own) list.push(v); }
    ticks = list.filter((v) => v > window_[0] * 1.01 && v < window_[1] / 1.01).map((v) => { const one = make("span", { class: "at" }, v >= 1000 ? `${+(v / 1000).toPrecision(3)} k` : String(+v.toPrecision(3))); one.style.left = `${share(v)}%`; place.append(one); return one; });
  };
  const share = (value) => Math.max(0, Math.min(100, 100 * Math.log(value / window_[0]) / Math.log(window_[1] / window_[0])));
  const lay = (part, low, high) => { part.hidden = !(low > 0); part.style.display = low > 0 ? "" : "none"; if (!(low > 0)) return; part.style.left = `${share(low)}%`; if (high != null) part.style.width = `${share(high) - share(low)}%`; };
  const legend = byId("place-legend");
  const entry = (kind, text) => make("li", { class: kind }, make("i"), text);
  let legendOf = "";
  const card = () => {
    if (!there.has("K")) { byId("stiffness").style.display = "none"; return; }
    const K = last("K"), half = last("K_half"), truth = last("K_true"), told = live.state && live.state.stability;
    const number = byId("number"), text = K == null ? "" : `${figure(K, 4)} ${figure(half, 2)}`;
    if (number.dataset.text !== text) {
      number.dataset.text = text;
      number.replaceChildren(...(K == null ? [make("span", { class: "quiet" }, "not estimated yet")] : [figure(K, 4), make("i", {}, ` ± ${figure(half, 2)}`), make("small", {}, " N/m")]));
    }
    const stable = told && told.stiffness, values = [K, K && K - half > 0 ? K - half : null, K && K + half, truth, ...(stable || [])].filter((v) => v > 0);
    if (!values.length) return;
    scale(Math.min(...values), Math.max(...values));
    lay(parts.stable, stable ? stable[0] : 0, stable ? stable[1] : 0);
    parts.stable.classList.toggle("proved", !!(told && told.proved));
    lay(parts.band, K == null ? 0 : Math.max(K - half, window_[0]), K + half);
    lay(parts.own, K ?? 0); lay(parts.truth, truth ?? 0);
    const kinds = [["estimate", "estimate"], ["interval", "95 %"], ...(stable ? [["stable", told.label]] : []), ...(truth ? [["truth", "truth"]] : [])];
    const key = JSON.stringify(kinds);
    if (key !== legendOf) { legendOf = key; legend.replaceChildren(...kinds.map(([kind, text]) => entry(kind, text))); }
    write(byId("stiffness-what"), stable ? `estimated, and ${told.label}` : "estimated");
    write(byId("why"), told ? told.text : "");
  };

  /* How it stands */
  const alerts = byId("alerts");
  const alert = (tone, title, text) => make("div", { class: `alert ${tone}`, role: "alert" }, make("p", {}, make("b", {}, title), ` ${text}`));
  let away = "";
  const stand = () => {
    const state = live.state;
    if (!state) return;
    byId("pause").setAttribute("aria-pressed", String(!state.playing));
    byId("pause").replaceChildren(make("span", { "aria-hidden": "true" }, state.playing ? "❚❚" : "▶"), " ", make("span", { class: "word" }, state.playing ? "pause" : "go on"));
    for (const [key, value] of Object.entries(state.values)) if (sliders[key]) sliders[key].put(value);
    const seed = byId("seed");
    if (seed && document.activeElement !== seed) seed.value = state.seed;
    const pace = byId("pace");
    if (pace) pace.value = String(state.pace);
    strips.forEach((one) => { one.marks = state.happened; });
    const over = state.ended.startsWith("done");
    alerts.replaceChildren(
      ...(away ? [alert("", "The program has ended.", away)] : []),
      ...(state.ended ? [alert(over ? "" : "fail", over ? "The end." : "✕ Stopped.", `${state.ended.replace(/^done: /, "")}. Reset, or continue, to start again.`)] : []),
      ...(state.warning ? [alert("", "At its limit:", state.warning)] : []),
      ...(state.said ? [alert("", "Not done:", state.said)] : []));
    fresh = true;
  };
  const phase = () => {
    const kind = last("phase"), node = byId("phase");
    const [word, tone] = away ? ["gone", "fail"] : live.state && !live.state.playing && !live.state.ended ? ["paused", "none"]
      : live.state && live.state.ended && !live.state.ended.startsWith("done") ? ["stopped", "fail"] : live.state && live.state.ended ? ["ended", "none"]
      : view.kind === "replay" ? ["playing", "ok"] : live.state && live.state.stage ? [live.state.stage, "go"] : kind === 1 ? ["pressing", "ok"] : kind === 2 ? ["contact lost", "fail"] : ["approaching", "go"];
    if (node.textContent !== word) { node.textContent = word; node.className = `v ${tone}`; }
  };

  /* The socket: it comes back by itself */
  let socket = null, fresh = false, wait = 250;
  const connect = () => {
    socket = new WebSocket(new URL("stream", location.href.replace(/^http/, "ws")));
    socket.binaryType = "arraybuffer";
    socket.addEventListener("open", () => { away = ""; wait = 250; forget(); stand(); });
    socket.addEventListener("message", ({ data }) => {
      if (typeof data !== "string") { take(new Float64Array(data)); fresh = true; return; }
      const told = JSON.parse(data);
      if (told.kind === "clear") { forget(); fresh = true; }
      else if (told.kind === "state") { live.state = told; stand(); }
      else if (told.kind === "watching") document.body.classList.add("watching");
      else if (told.kind === "refused" && live.state) { live.state.said = told.why; stand(); }
    });
    socket.addEventListener("close", () => {
      away = "The page tries to reconnect, and continues when the program is back."; stand(); fresh = true;
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
    told();
  };
  const told = () => {
    const now = last("t"), moment = byId("moment");
    phase(); card(); strips.forEach((one) => one.read());
    if (now == null) return;
    write(byId("clock"), `${now.toFixed(2)} s`);
    if (moment && document.activeElement !== moment) moment.value = now;
    if (moment) write(byId("of"), `${now.toFixed(1)} of ${view.span[1].toFixed(1)} s`);
  };
  const again = () => { fresh = true; };
  repaints.add(again);
  new ResizeObserver(again).observe(canvas);

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
  byId("seed")?.addEventListener("change", (event) => { if (/^\d{1,15}$/.test(event.target.value)) send({ do: "reset", seed: +event.target.value }); });
  byId("pace")?.addEventListener("change", (event) => send({ do: "pace", value: +event.target.value }));
  byId("moment")?.addEventListener("input", (event) => send({ do: "seek", time: +event.target.value }));
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.matches("input, select, .plot") || (event.key === " " && event.target.matches("button"))) return;
    if (acts[event.key]) { event.preventDefault(); acts[event.key](); }
  });
  connect();
  requestAnimationFrame(draw);
})();
