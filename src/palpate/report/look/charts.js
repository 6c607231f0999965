/* Charts that can be zoomed and read: one cursor and one zoom for all charts of a group. */
"use strict";
const palpate = (() => {
  /* Colours are asked of the style sheet once, and again where light turns to dark. */
  const known = new Map();
  const token = (name) => {
    if (!known.has(name)) known.set(name, getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim());
    return known.get(name);
  };
  const faded = (name, alpha) => {
    const code = parseInt(token(name).slice(1), 16);
    return `rgba(${code >> 16},${(code >> 8) & 255},${code & 255},${alpha})`;
  };
  const make = (tag, attributes = {}, ...inside) => {
    const node = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
    node.append(...inside);
    return node;
  };
  const repaints = new Set();
  const repaint = () => { known.clear(); repaints.forEach((again) => again()); };
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", repaint);
  addEventListener("beforeprint", () => { document.documentElement.dataset.print = ""; repaint(); });
  addEventListener("afterprint", () => { delete document.documentElement.dataset.print; repaint(); });

  /* A number with so many digits that mean something, with a minus that is one. */
  const figure = (value, digits = 4) => {
    if (value == null || !isFinite(value)) return "–";
    if (value === 0) return "0";
    const behind = digits - 1 - Math.floor(Math.log10(Math.abs(value)));
    return value.toFixed(Math.max(0, Math.min(6, behind))).replace("-", "−");
  };
  const tick = (value) => (value == null ? "" : String(+value.toPrecision(6)).replace(/000000$/, "e6").replace("-", "−"));

  /* A column as `report/chart.py` makes it; gaps are null, and what it has no place for is undefined. */
  const unpacked = (column) => column.map((value) => (value === "absent" ? undefined : value));

  /* What a line means decides how it is drawn, everywhere. */
  const KINDS = {
    measured: { width: 1, dash: [] },
    own: { width: 2, dash: [] },
    known: { width: 1.25, dash: [5, 4] },
  };
  const look = (one) => (one.width == null ? KINDS[one.kind] : { width: one.width, dash: one.dash || [] });
  const sample = (one) => {
    const ns = "http://www.w3.org/2000/svg";
    const svg = document.createElementNS(ns, "svg");
    svg.setAttribute("width", 18); svg.setAttribute("height", 10); svg.setAttribute("aria-hidden", "true");
    const put = (tag, attributes) => {
      const node = document.createElementNS(ns, tag);
      for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
      svg.append(node);
    };
    const colour = `var(--${one.colour})`;
    if (one.kind === "band") put("rect", { width: 18, height: 10, rx: 2, fill: colour, "fill-opacity": 0.3 });
    else if (one.dots) put("circle", { cx: 9, cy: 5, r: one.dots / 2, fill: colour });
    else put("line", { x1: 0, x2: 18, y1: 5, y2: 5, stroke: colour, "stroke-width": look(one).width,
      "stroke-dasharray": look(one).dash.join(" ") });
    return svg;
  };

  const legend = (series) => make("ul", { class: "legend" }, ...series.filter((one) => !one.silent).map((one) => make("li", {}, sample(one), one.label)));

  class Group {
    constructor() { this.charts = []; this.busy = false; }
    /* Tells all charts but one where the reader points: a value of x, or null. */
    point(x, from) {
      if (this.busy) return;
      this.busy = true;
      for (const chart of this.charts) if (chart !== from) chart.point(x);
      this.busy = false;
    }
    zoom(low, high, from) {
      if (this.busy) return;
      this.busy = true;
      for (const chart of this.charts) if (chart !== from) chart.plot.setScale("x", { min: low, max: high });
      this.busy = false;
    }
  }

  const axis = (more) => ({ stroke: () => token("quiet"), font: "12px sans-serif", gap: 6, ticks: { show: false },
    grid: { stroke: () => token("grid"), width: 1 }, values: (_, list) => list.map(tick), ...more });

  /* A chart in `host`.
     spec: title, y and x (what stands at the axes), unit of x, height [px], range [low, high] of y, marks [{x, colour}], shades [[from, to, colour]], keys of the legend that are no series, series [{label, colour, of, width, dash, alpha, dots [px]}] or
     [{label, colour, kind: "band", low, high}], where `of`, `low` and `high` name columns, and a `silent` one has no
     place in the legend; log is "", "x", "y" or "xy". */
  const chart = (host, spec, columns, group) => {
    const self = {};
    const whole = make("button", { type: "button", class: "screen" }, "whole range");
    const head = make("header", {}, make("div", {}, make("h3", {}, spec.title), legend([...spec.series, ...spec.keys])), whole);
    const read = make("span", { class: "read" });
    const box = make("div", { class: "plot", tabindex: 0, role: "img", "aria-label": spec.title });
    host.classList.add("chart");
    host.replaceChildren(head, make("div", { class: "axis" }, make("span", {}, spec.y), read), box);
    if (spec.x) host.append(make("div", { class: "axis below" }, make("span", {}, spec.x)));

    const series = [{}], bands = [], rows = [];
    for (const one of spec.series) {
      if (one.kind === "band") {
        rows.push(one.high, one.low);
        bands.push({ series: [series.length, series.length + 1], fill: () => faded(one.colour, 0.22) });
        series.push({ width: 0, points: { show: false } }, { width: 0, points: { show: false } });
      } else {
        rows.push(one.of);
        const ink = () => (one.alpha < 1 ? faded(one.colour, one.alpha) : token(one.colour));
        const dots = one.dots ? { paths: () => null, points: { show: true, size: one.dots, fill: ink, stroke: ink } } : { points: { show: false } };
        series.push({ stroke: ink, ...look(one), ...dots });
      }
    }
    const logarithmic = { x: spec.log.includes("x"), y: spec.log.includes("y") };
    const data = [columns.t, ...rows.map((name) => columns[name])];
    const height = () => (innerWidth < 560 ? Math.round(0.85 * spec.height) : spec.height);
    const ends = () => [data[0][0], data[0][data[0].length - 1]];
    const nearest = (x) => {
      let low = 0, high = data[0].length - 1;
      while (high - low > 1) { const middle = (low + high) >> 1; if (data[0][middle] < x) low = middle; else high = middle; }
      return x - data[0][low] < data[0][high] - x ? low : high;
    };
    /* A column's value at the place of its own that is nearest to the i-th. */
    const there = (column, i) => {
      for (let away = 0; away < column.length; away++) for (const at of [i - away, i + away]) if (at in column && column[at] !== undefined) return column[at];
      return null;
    };
    const tell = (x) => {
      if (x == null || !data[0].length) { read.textContent = ""; return; }
      const i = nearest(x), parts = [`${figure(data[0][i], 5)} ${spec.unit}`];
      let k = 1;
      for (const one of spec.series) {
        if (one.kind === "band" && one.silent) k += 2;
        else if (one.kind === "band") { parts.push(`${one.label} ${figure(data[k + 1][i])} to ${figure(data[k][i])}`); k += 2; }
        else if (one.silent) k++;
        else parts.push(`${one.label} ${figure(there(data[k++], i))}`);
      }
      read.textContent = parts.join("  ·  ");
    };
    const behind = (plot) => {
      const { ctx, bbox } = plot;
      for (const [from, to, colour] of spec.shades) {
        const left = Math.max(bbox.left, plot.valToPos(from, "x", true));
        const right = Math.min(bbox.left + bbox.width, plot.valToPos(to, "x", true));
        ctx.fillStyle = faded(colour, 0.16);
        if (right > left) ctx.fillRect(left, bbox.top, right - left, bbox.height);
      }
    };
    const before = (plot) => {
      const { ctx, bbox } = plot, dense = devicePixelRatio || 1;
      ctx.save();
      ctx.beginPath(); ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height); ctx.clip();
      for (const mark of spec.marks) {
        const at = plot.valToPos(mark.x, "x", true);
        if (at < bbox.left - 1) continue;
        ctx.strokeStyle = token(mark.colour);
        ctx.lineWidth = 1.25 * dense; ctx.setLineDash([3 * dense, 3 * dense]);
        ctx.beginPath(); ctx.moveTo(at, bbox.top); ctx.lineTo(at, bbox.top + bbox.height); ctx.stroke();
      }
      ctx.restore();
    };
    let ready = false;
    const plot = new uPlot({
      width: Math.max(160, box.clientWidth), height: height(), padding: [8, 14, 0, 0], legend: { show: false },
      cursor: { y: false, drag: { x: true, y: false, setScale: true }, points: { show: false },
        bind: { dblclick: () => () => full() } },
      scales: { x: { time: false, distr: logarithmic.x ? 3 : 1, range: (_, low, high) => [low, high] },
        y: { distr: logarithmic.y ? 3 : 1, range: spec.range } },
      axes: [axis({ size: 26 }), axis({ size: 52, space: 22, ...(spec.y ? {} : { values: () => [] }) })],
      series, bands,
      hooks: {
        setCursor: [(own) => {
          if (group.busy) return;
          const x = own.cursor.left < 0 ? null : own.posToVal(own.cursor.left, "x");
          tell(x); group.point(x, self);
        }],
        setScale: [(own, key) => {
          if (key !== "x") return;
          const { min, max } = own.scales.x, [low, high] = ends();
          host.classList.toggle("zoomed", max - min < 0.995 * (high - low));
          if (ready) group.zoom(min, max, self);
        }],
        drawClear: [behind], draw: [before],
      },
    }, data, box);
    const full = () => { const [low, high] = ends(); plot.setScale("x", { min: low, max: high }); };
    self.plot = plot;
    self.point = (x) => {
      plot.setCursor({ left: x == null ? -10 : plot.valToPos(x, "x"), top: 10 }, false, false);
      tell(x);
    };
    whole.addEventListener("click", full);
    let at = null;
    box.addEventListener("keydown", (event) => {
      const { min, max } = plot.scales.x, wide = max - min, middle = at == null ? (min + max) / 2 : at;
      const [low, high] = ends();
      const moves = {
        ArrowLeft: () => { at = Math.max(min, middle - 0.01 * wide); }, ArrowRight: () => { at = Math.min(max, middle + 0.01 * wide); },
        "+": () => plot.setScale("x", { min: Math.max(low, middle - 0.3 * wide), max: Math.min(high, middle + 0.3 * wide) }),
        "-": () => plot.setScale("x", { min: Math.max(low, middle - wide), max: Math.min(high, middle + wide) }),
        0: () => { at = null; full(); }, Escape: () => { at = null; full(); },
      };
      if (!moves[event.key]) return;
      event.preventDefault();
      moves[event.key](); self.point(at); group.point(at, self);
    });
    new ResizeObserver(() => {
      const wide = box.clientWidth;
      if (wide && Math.abs(wide - plot.width) > 1) plot.setSize({ width: wide, height: height() });
    }).observe(box);
    repaints.add(() => plot.redraw(false, true));
    group.charts.push(self);
    setTimeout(() => { ready = true; });
    return self;
  };
  return { Group, KINDS, chart, unpacked, figure, token, faded, make, legend, repaints };
})();
