/* The figures of a study: settings against each other surface by surface, clouds, curves and maps. Curves over numbers are
   charts that can be zoomed; all else is drawn as SVG, so that light and dark, narrow and wide are the style sheet's work. */
"use strict";
(() => {
  const held = document.getElementById("study");
  if (!held) return;
  const study = JSON.parse(held.textContent);
  const NS = "http://www.w3.org/2000/svg";
  const make = (tag, attributes = {}, ...inside) => {
    const node = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
    node.append(...inside);
    return node;
  };
  const put = (parent, tag, attributes = {}, text = null) => {
    const node = document.createElementNS(NS, tag);
    for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
    if (text != null) node.textContent = text;
    parent.append(node);
    return node;
  };
  const figure = (value, digits = 3) => {
    if (value == null || !isFinite(value)) return "–";
    if (value === 0) return "0";
    const size = Math.floor(Math.log10(Math.abs(value)));
    if (size < -4 || size > 6) return value.toExponential(digits - 1).replace("-", "−");
    return value.toFixed(Math.max(0, digits - 1 - size)).replace("-", "−");
  };
  const signed = (value) => (value > 0 ? "+" : "") + figure(value);
  const tick = (value) => {
    const size = Math.abs(value);
    const plain = size >= 1e6 ? `${+(value / 1e6).toPrecision(4)} M` : size >= 1e4 ? `${+(value / 1e3).toPrecision(4)} k`
      : size > 0 && size < 1e-3 ? value.toExponential(0) : String(+value.toPrecision(4));
    return plain.replace("-", "−");
  };
  const finite = (list) => list.filter((v) => v != null);
  const ordered = (list) => Float64Array.from(finite(list)).sort();
  const quantile = (sorted, share) => {
    const at = share * (sorted.length - 1), below = Math.floor(at);
    return below + 1 < sorted.length ? sorted[below] + (at - below) * (sorted[below + 1] - sorted[below]) : sorted[below];
  };
  /* The middle 98 %, or all where they lie not far beyond: few from far away must not squeeze the rest. */
  const bulk = (list) => {
    const sorted = ordered(list);
    if (!sorted.length) return [0, 1];
    let low = quantile(sorted, 0.01), high = quantile(sorted, 0.99);
    const room = high - low || Math.abs(high) || 1;
    if (sorted[0] >= low - 0.5 * room) low = sorted[0];
    if (sorted[sorted.length - 1] <= high + 0.5 * room) high = sorted[sorted.length - 1];
    return [low, high];
  };
  const scale = (low, high, log, from, to) => {
    if (log && low > 0) { const a = Math.log(low), b = Math.log(high); return (v) => from + (to - from) * (Math.log(v) - a) / (b - a || 1); }
    return (v) => from + (to - from) * (v - low) / (high - low || 1);
  };
  const ticks = (low, high, log, most) => {
    if (log && low > 0) {
      const found = [], steps = high / low > 100 ? [1] : high / low > 15 ? [1, 3] : [1, 2, 5];
      for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power++)
        for (const step of steps) { const v = step * 10 ** power; if (v >= low * 0.999 && v <= high * 1.001) found.push(v); }
      const every = Math.ceil(found.length / most);
      return found.filter((_, i) => i % every === 0);
    }
    const raw = (high - low) / most || 1, base = 10 ** Math.floor(Math.log10(raw));
    const step = base * [1, 2, 5, 10].find((m) => m * base >= raw);
    const found = [];
    for (let v = Math.ceil(low / step) * step; v <= high + 1e-9 * step; v += step) found.push(Math.abs(v) < 1e-9 * step ? 0 : v);
    return found;
  };

  /* One panel: axes with their labels, what is drawn inside, and a line that reads the nearest value. */
  const panel = (host, { title = "", alt, x, y, height = 220, left = 52 }) => {
    const box = make("figure", { class: "panel" }), read = make("span", { class: "read" });
    if (title) box.append(make("h3", {}, title));
    box.append(make("div", { class: "axis" }, make("span", {}, y.label || ""), read));
    host.append(box);
    const width = Math.max(200, Math.min(box.clientWidth || 320, 1100)), bottom = x.names && x.names.some((n) => n.length > 8) ? 34 : 22;
    const svg = put(box, "svg", { width: "100%", viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": alt || title });
    const inner = [left, width - 10, height - bottom, 8];
    const sx = scale(x.low, x.high, x.log, inner[0], inner[1]), sy = scale(y.low, y.high, y.log, inner[2], inner[3]);
    const grid = put(svg, "g", { class: "ticks" });
    const along = x.names && x.names.length ? x.names.map((name, i) => [x.places[i], name]) : ticks(x.low, x.high, x.log, Math.max(2, Math.floor(width / 70))).map((v) => [v, tick(v)]);
    for (const [v, text] of along) {
      put(grid, "line", { x1: sx(v), x2: sx(v), y1: inner[3], y2: inner[2] });
      put(grid, "text", { x: Math.min(inner[1] - 8, sx(v)), y: height - bottom + 15, "text-anchor": "middle" }, text.length > 16 ? `${text.slice(0, 15)}…` : text);
    }
    const up = y.names && y.names.length ? y.names.map((name, i) => [y.places[i], name]) : ticks(y.low, y.high, y.log, Math.max(2, Math.floor(height / 45))).map((v) => [v, tick(v)]);
    for (const [v, text] of up) {
      put(grid, "line", { x1: inner[0], x2: inner[1], y1: sy(v), y2: sy(v) });
      put(grid, "text", { x: left - 6, y: sy(v) + 4, "text-anchor": "end" }, text);
    }
    if (x.label) box.append(make("div", { class: "axis below" }, make("span", {}, x.label)));
    const ink = put(svg, "g");
    const points = [];
    svg.addEventListener("pointermove", (event) => {
      const at = svg.getBoundingClientRect(), px = (event.clientX - at.left) * width / at.width, py = (event.clientY - at.top) * height / at.height;
      let best = null, least = 900;
      for (const p of points) { const d = (p.x - px) ** 2 + (p.y - py) ** 2; if (d < least) { least = d; best = p; } }
      read.textContent = best ? best.text : "";
    });
    svg.addEventListener("pointerleave", () => { read.textContent = ""; });
    return { box, svg, ink, sx, sy, inner, points, width };
  };
  const clipped = (value, low, high) => Math.min(high, Math.max(low, value));
  const dot = (p, x, y, radius, attributes, text) => {
    put(p.ink, "circle", { cx: x, cy: y, r: radius, ...attributes });
    p.points.push({ x, y, text });
  };
  const path = (p, xs, ys, attributes) => {
    let line = "", pen = false;
    xs.forEach((x, i) => {
      if (x == null || ys[i] == null) { pen = false; return; }
      line += `${pen ? "L" : "M"}${p.sx(x).toFixed(1)} ${clipped(p.sy(ys[i]), p.inner[3] - 4, p.inner[2] + 4).toFixed(1)}`;
      pen = true;
    });
    if (line) put(p.ink, "path", { d: line, fill: "none", ...attributes });
  };
  const legend = (labels) => {
    const list = make("ul", { class: "legend" });
    labels.forEach(([label, kind]) => list.append(make("li", {}, make("i", { class: `key ${kind}` }), label)));
    return list;
  };
  const beyond = (p, count) => {
    if (count) put(p.svg, "text", { x: p.inner[1], y: p.inner[3] + 10, "text-anchor": "end", class: "beyond" }, `${count} beyond ▴`);
  };

  const draw = {
    cloud(host, panels, label) {
      for (const one of panels) {
        const every = one.series.flatMap((s) => s.y), words = one.words;
        const [low, high] = words.length ? [-0.4, words.length - 0.6] : bulk(every), room = 0.04 * (high - low);
        const places = finite(one.x.places);
        const p = panel(host, { alt: `${label} over ${one.x.label}`, x: { label: one.x.label, low: Math.min(...places), high: Math.max(...places), log: one.x.log },
          y: { label, low: one.log ? low : low - room, high: one.log ? high : high + room, log: one.log, names: words, places: words.map((_, i) => i) }, left: words.length ? 64 : 52 });
        let out = 0;
        one.series.forEach((s, k) => {
          const tone = `s${k % 6}`;
          s.x.forEach((x, i) => {
            const v = s.y[i];
            if (v == null) return;
            if (!words.length && (v > high || v < low)) out += 1;
            const aside = words.length ? 6 * ((i * 0.618 + k) % 1) - 3 : 0;
            dot(p, p.sx(x), clipped(p.sy(v), p.inner[3], p.inner[2]) + 3 * aside, 2, { class: `cloud ${tone}` }, `${s.label ? `${s.label}: ` : ""}${figure(x)}, ${words.length ? words[Math.round(v)] : figure(v)}`);
          });
        });
        one.series.forEach((s, k) => path(p, s.middle[0], s.middle[1], { class: `line s${k % 6}` }));
        beyond(p, out);
      }
      const names = panels.length ? panels[0].series.map((s, k) => [s.label, `s${k % 6}`]) : [];
      return names.length > 1 ? legend(names) : null;
    },
    curve(host, panels, label) {
      const every = panels.flatMap((one) => one.series.flatMap((s) => [...s.y, ...s.low, ...s.high]));
      const log = panels.every((one) => one.log) && finite(every).every((v) => v > 0), [low, high] = bulk(every), room = 0.05 * (high - low);
      const group = new palpate.Group();
      for (const one of panels) {
        if (one.spec) {
          const box = make("figure", { class: "panel" });
          host.append(box);
          const out = log ? 0 : finite(one.series.flatMap((s) => [...s.y, ...s.low, ...s.high])).filter((v) => v > high || v < low).length;
          palpate.chart(box, { ...one.spec, y: label, alt: `${label} over ${one.x.label}`, log: `${one.x.log ? "x" : ""}${log ? "y" : ""}`,
            range: log ? [low / 1.2, high * 1.2] : [low - room, high + room], caption: out ? `${out} beyond` : "" },
            Object.fromEntries(Object.entries(one.columns).map(([name, column]) => [name, palpate.unpacked(column)])), group);
          continue;
        }
        const places = finite(one.x.places), wide = 0.4;
        const p = panel(host, { title: one.title, alt: `${label} over ${one.x.label}`, x: { ...one.x, low: Math.min(...places) - wide, high: Math.max(...places) + wide },
          y: { label, low: log ? low : low - room, high: log ? high : high + room, log } });
        let k = 0;
        one.series.forEach((s, number) => {
          const tone = s.reference ? "ref" : `s${k++ % 6}`, aside = 7 * (number - (one.series.length - 1) / 2);
          s.x.forEach((x, i) => {
            if (s.y[i] == null) return;
            const px = p.sx(x) + aside, py = clipped(p.sy(s.y[i]), p.inner[3], p.inner[2]);
            put(p.ink, "line", { class: `line ${tone}`, x1: px, x2: px, y1: clipped(p.sy(s.low[i]), p.inner[3], p.inner[2]), y2: clipped(p.sy(s.high[i]), p.inner[3], p.inner[2]) });
            dot(p, px, py, 3, { class: `mark ${tone}` }, `${s.label}: ${figure(s.y[i])} (${figure(s.low[i])} to ${figure(s.high[i])}) at ${one.x.names[i]}`);
          });
        });
        beyond(p, finite(every).filter((v) => v > high || v < low).length);
      }
      let k = 0;
      const names = panels.length ? panels[0].series.map((s) => [s.label, s.reference ? "ref" : `s${k++ % 6}`]) : [];
      return names.length > 1 && !panels[0].spec ? legend(names) : null;
    },
    map(host, panels, label) {
      const every = panels.flatMap((one) => (one.colours ? [] : one.values)), [low, high] = bulk(every);
      const log = panels.every((one) => one.log), shade = scale(low, high, log, 0, 1);
      for (const one of panels) {
        const ex = finite(one.x.edges), ey = finite(one.y.edges), nx = one.x.places.length;
        const p = panel(host, { title: one.title, alt: `${label} over ${one.x.label} and ${one.y.label}`, x: { ...one.x, low: ex[0], high: ex[ex.length - 1] },
          y: { ...one.y, low: ey[0], high: ey[ey.length - 1] }, height: 250, left: one.y.names.length ? 84 : 52 });
        one.values.forEach((value, n) => {
          const i = n % nx, j = Math.floor(n / nx), x0 = p.sx(ex[i]), x1 = p.sx(ex[i + 1]), y0 = p.sy(ey[j + 1]), y1 = p.sy(ey[j]);
          const none = one.colours ? value === "" : value == null;
          const cell = put(p.ink, "rect", { class: "cell", x: Math.min(x0, x1), y: Math.min(y0, y1), width: Math.abs(x1 - x0) + 0.5, height: Math.abs(y1 - y0) + 0.5 });
          if (none) cell.setAttribute("fill", "var(--card)");
          else if (one.colours) cell.setAttribute("fill", one.colours[value]);
          else cell.setAttribute("fill", `color-mix(in oklab, var(--map-high) ${Math.round(100 * clipped(shade(value), 0, 1))}%, var(--map-low))`);
          const place = `${one.x.names[i] || figure(one.x.places[i])}, ${one.y.names[j] || figure(one.y.places[j])}`;
          p.points.push({ x: (x0 + x1) / 2, y: (y0 + y1) / 2, text: `${place}: ${none ? "nothing" : one.colours ? value : figure(value)}${one.failed[n] ? ", most failed" : ""}` });
          if (one.failed[n]) put(p.ink, "text", { class: "cross", x: (x0 + x1) / 2, y: (y0 + y1) / 2 + 4, "text-anchor": "middle" }, "×");
        });
        for (const bound of one.bounds) path(p, bound.x, bound.y, { class: "bound" });
      }
      if (panels.length && panels[0].colours) {
        const list = make("ul", { class: "legend" }), seen = {};
        panels.forEach((one) => Object.assign(seen, one.colours));
        Object.entries(seen).forEach(([word, colour]) => { if (word) list.append(make("li", {}, make("i", { class: "key", style: `background:${colour}` }), word)); });
        return list;
      }
      return every.length ? make("p", { class: "small" }, `${figure(low)} `, make("i", { class: "ramp" }), ` ${figure(high)}`) : null;
    },
  };

  /* Settings on the same surfaces */
  const infinite = 1e308;
  const differences = (one, other, most) => {
    const found = [];
    one.values.forEach((value, i) => {
      if (value == null && other.values[i] == null) return;
      if (value == null) found.push([most ? -infinite : infinite, i]);
      else if (other.values[i] == null) found.push([most ? infinite : -infinite, i]);
      else found.push([value - other.values[i], i]);
    });
    return found;
  };
  const shares = (one, other, most) => {
    const all = differences(one, other, most), sign = most ? 1 : -1;
    const won = all.filter(([d]) => sign * d > 0).length, lost = all.filter(([d]) => sign * d < 0).length;
    return { n: all.length, won: all.length ? won / all.length : 0, lost: all.length ? lost / all.length : 0 };
  };
  const percent = (share) => `${Math.round(100 * share)} %`;
  const strips = (host, comparison, reference) => {
    const ref = comparison.entrants[reference], most = comparison.most, others = comparison.entrants.filter((e) => e !== ref);
    const all = others.map((e) => differences(e, ref, most));
    const [low, high] = bulk(all.flat().map(([d]) => d).filter((d) => Math.abs(d) < infinite)), room = 0.06 * (high - low) || 1;
    const row = 62, left = 8;
    const p = panel(host, { alt: "differences surface by surface", x: { label: `${comparison.label}, less that of ${ref.name}`, low: Math.min(0, low - room), high: Math.max(0, high + room), log: false },
      y: { label: `← ${most ? "worse" : "better"} · ${most ? "better" : "worse"} than ${ref.name} →`, low: 0, high: 1, log: false, names: [""], places: [0] }, height: row * others.length + 34, left });
    put(p.ink, "line", { class: "zero", x1: p.sx(0), x2: p.sx(0), y1: p.inner[3], y2: p.inner[2] });
    others.forEach((entrant, k) => {
      const top = p.inner[3] + k * row, middle = top + 32, bins = {};
      put(p.svg, "text", { x: left + 6, y: top + 12, class: "name" }, entrant.name.length > 48 ? `${entrant.name.slice(0, 47)}…` : entrant.name);
      for (const [d, i] of all[k]) {
        const x = clipped(p.sx(d), p.inner[0] + 4, p.inner[1] - 4), bin = Math.round(x / 3);
        bins[bin] = (bins[bin] || 0) + 1;
        const place = Object.entries(comparison.conditions).map(([name, values]) => `${name} ${typeof values[i] === "number" ? figure(values[i]) : values[i]}`).join(", ");
        const aside = Math.min(Math.floor(bins[bin] / 2) * 2.4, 15) * (bins[bin] % 2 ? 1 : -1), failed = Math.abs(d) === infinite;
        if (failed) { put(p.ink, "text", { class: "cross bad", x, y: middle + aside + 4, "text-anchor": "middle" }, "×"); p.points.push({ x, y: middle + aside, text: `${place}: ${(d > 0) === !most ? entrant.name : ref.name} failed` }); }
        else dot(p, x, middle + aside, all[k].length > 50 ? 1.9 : 3, { class: "cloud" }, `${place}: ${signed(d)}`);
      }
      const sorted = all[k].map(([d]) => d).sort((a, b) => a - b), pair = entrant.pairs[reference];
      if (pair && pair.median != null) {
        const at = (d) => clipped(p.sx(d), p.inner[0] + 4, p.inner[1] - 4), y = top + 56;
        const decided = pair.low != null && (pair.low > 0 || pair.high < 0), tone = !decided ? "open" : (pair.low > 0) === most ? "better" : "worse";
        if (pair.low != null && pair.high != null) put(p.ink, "line", { class: `interval ${tone}`, x1: at(pair.low), x2: at(pair.high), y1: y, y2: y });
        dot(p, at(pair.median), y, 4.5, { class: `median ${tone}` }, `${entrant.name}: median ${signed(pair.median)}${pair.low == null ? "" : ` (95 %: ${signed(pair.low)} to ${signed(pair.high)})`}`);
      }
      if (!sorted.length) return;
    });
  };
  const bars = (host, comparison, reference) => {
    const ref = comparison.entrants[reference], table = make("table", { class: "bars" });
    for (const e of comparison.entrants) {
      if (e === ref) continue;
      const s = shares(e, ref, comparison.most), line = make("div", { class: "bar" });
      line.append(make("b", { style: `width:${100 * s.won}%` }), make("i", { style: `width:${100 * s.lost}%` }));
      table.append(make("tr", {}, make("th", { scope: "row" }, e.name), make("td", {}, line), make("td", { class: "n" }, `${percent(s.won)} won`)));
    }
    host.append(make("h3", {}, `Share of surfaces won against ${ref.name}`), table);
  };
  const matrix = (host, comparison) => {
    const es = comparison.entrants.slice(0, 8), table = make("table", { class: "matrix" }), head = make("tr", {}, make("th"));
    es.forEach((e) => head.append(make("th", { scope: "col", class: "n" }, e.name)));
    table.append(make("thead", {}, head));
    const body = make("tbody");
    es.forEach((one) => {
      const row = make("tr", {}, make("th", { scope: "row" }, one.name));
      es.forEach((other) => {
        const share = one === other ? null : shares(one, other, comparison.most).won;
        row.append(make("td", { class: "n", style: share == null ? "" : `background:color-mix(in srgb, var(--F) ${Math.round(45 * share)}%, var(--card))` }, share == null ? "·" : percent(share)));
      });
      body.append(row);
    });
    table.append(body);
    host.append(make("h3", {}, "Pairwise comparison"), make("p", { class: "small" }, "Share of surfaces on which the row is better than the column."), make("div", { class: "scroll" }, table));
  };

  const choice = (host, label, names, chosen, pick) => {
    const group = make("div", { class: "choice screen", role: "group", "aria-label": label }, make("span", { class: "small" }, label));
    names.forEach((name, i) => {
      const button = make("button", { type: "button", "aria-pressed": String(i === chosen) }, name);
      button.addEventListener("click", () => pick(i));
      group.append(button);
    });
    host.append(group);
  };
  const state = { metric: 0, reference: 0 };
  const controls = document.getElementById("controls"), versus = document.getElementById("versus"), drawn = document.getElementById("drawn");
  const places = () => study.comparisons.filter((c) => c.metric === study.metrics[state.metric].name);
  const show = () => {
    const metric = study.metrics[state.metric];
    palpate.repaints.clear();
    controls.replaceChildren(); versus.replaceChildren(); drawn.replaceChildren();
    if (study.metrics.length > 1) choice(controls, "measure", study.metrics.map((m) => m.name), state.metric, (i) => { state.metric = i; state.reference = 0; show(); });
    const own = places();
    if (own.length) choice(controls, "compared with", own[0].entrants.map((e) => e.name), state.reference, (i) => { state.reference = i; show(); });
    for (const comparison of own) {
      const title = Object.entries(comparison.of).map(([name, value]) => `${name} ${value}`).join(", ");
      const left = make("div"), right = make("div");
      versus.append(make("h2", {}, `Surface by surface${title ? `: ${title}` : ""}`),
        make("p", { class: "small" }, `Each dot is one surface: ${metric.text} on it, less that of the reference on the same surface. Below the dots the median with its 95 % interval: green where it is significantly better, red where it is worse. A cross is a run that failed.`),
        make("div", { class: "grid two" }, left, right));
      const reference = Math.min(state.reference, comparison.entrants.length - 1);
      strips(left, comparison, reference); bars(right, comparison, reference); matrix(right, comparison);
    }
    for (const one of study.figures.filter((f) => f.metric === metric.name)) {
      const across = make("div", { class: one.panels.length > 1 ? "grid panels" : "grid" }), box = make("section", { class: "drawn" });
      drawn.append(box);
      box.append(make("h2", {}, one.label), make("p", { class: "small" }, one.caption), across);
      const key = draw[one.panels[0].kind](across, one.panels, one.label);
      if (key) across.before(key);
    }
  };
  show();
  let width = innerWidth;
  addEventListener("resize", () => { if (Math.abs(innerWidth - width) > 40) { width = innerWidth; show(); } });
})();
