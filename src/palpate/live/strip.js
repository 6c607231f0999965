/* Charts that move: a strip on which only what is new is drawn; it is drawn whole where its scale changes. */
"use strict";
palpate.strips = (columns, span) => {
  const { token, faded, figure, make, legend, repaints } = palpate;
  const LEFT = 52, RIGHT = 8, TOP = 8, BELOW = 24;
  const KEPT = 0.4; /* of a scale that the data has to fill, or it is drawn larger */
  const strips = [];
  let pointed = null;

  const steps = (low, high, most) => {
    const rough = (high - low) / most || 1, power = 10 ** Math.floor(Math.log10(rough));
    return [1, 2, 5, 10].map((m) => m * power).find((step) => step >= rough * 0.999);
  };
  const word = (value) => String(+value.toPrecision(6)).replace("-", "−");
  const nearest = (x) => {
    const t = columns.t;
    let low = 0, high = t.length - 1;
    while (high - low > 1) { const middle = (low + high) >> 1; if (t[middle] < x) low = middle; else high = middle; }
    return high > 0 && x - t[low] >= t[high] - x ? high : low;
  };

  /* spec: title, y, x, height(), digits, wanted() -> [low, high] or null, wordless, series as `palpate.chart` has them. */
  const strip = (host, spec) => {
    const self = { marks: [] };
    const read = make("span", { class: "read" });
    const canvas = make("canvas", { role: "img", "aria-label": spec.title });
    const line = make("span", { class: "pointer" });
    const box = make("div", { class: "plot strip" }, canvas, line);
    host.classList.add("chart");
    host.replaceChildren(make("header", {}, make("h3", {}, spec.title), legend(spec.series)),
      make("div", { class: "axis" }, make("span", {}, spec.y), read), box);
    if (spec.x) host.append(make("div", { class: "axis below" }, make("span", {}, spec.x)));
    const front = canvas.getContext("2d"), ring = document.createElement("canvas"), pen = ring.getContext("2d");
    const lines = spec.series.filter((one) => one.kind !== "band"), bands = spec.series.filter((one) => one.kind === "band");
    let wide = 0, tall = 0, dense = 1, low = 0, high = 1, ticks = [], zero = null, drawn = -Infinity, at = 0, clean = 0, second = 0, column = 0, whole = true;

    const x = (t) => (t - zero) * wide / span;
    const y = (v) => tall * (high - v) / (high - low);
    const sized = () => {
      dense = devicePixelRatio || 1;
      const across = Math.max(160, box.clientWidth), up = spec.height();
      canvas.style.height = `${up}px`;
      canvas.width = Math.round(across * dense); canvas.height = Math.round(up * dense);
      wide = Math.round((across - LEFT - RIGHT) * dense); tall = Math.round((up - TOP - BELOW) * dense);
      ring.width = wide + 8; ring.height = tall + Math.round(BELOW * dense);
      whole = true;
    };
    const scaled = () => {
      const ends = spec.wanted();
      if (!ends || !(ends[1] > ends[0])) return;
      if (!whole && ends[0] >= low && ends[1] <= high && ends[1] - ends[0] > KEPT * (high - low)) return;
      const room = 0.08 * (ends[1] - ends[0]), step = steps(ends[0] - room, ends[1] + room, tall / dense / 34);
      const from = step * Math.floor((ends[0] - room) / step), to = step * Math.ceil((ends[1] + room) / step);
      if (from === low && to === high && ticks.length) return;
      low = from; high = to; ticks = [];
      for (let i = 0; from + i * step <= to + step / 2; i++) ticks.push(from + i * step);
      whole = true;
    };
    const axis = () => {
      front.setTransform(1, 0, 0, 1, 0, 0);
      front.clearRect(0, 0, canvas.width, canvas.height);
      front.font = `${12 * dense}px sans-serif`; front.fillStyle = token("quiet"); front.textAlign = "right"; front.textBaseline = "middle";
      for (const value of ticks) front.fillText(word(value), (LEFT - 6) * dense, TOP * dense + y(value));
    };
    /* On the ring a place comes again after its width: what goes over its end is drawn at both. */
    const twice = (from, to, act) => {
      const first = Math.floor(from / ring.width), last = Math.floor(to / ring.width);
      for (let turn = first; turn <= last; turn++) { pen.setTransform(1, 0, 0, 1, -turn * ring.width, 0); act(); }
    };
    const wipe = (to) => {
      if (to <= clean) return;
      twice(clean, to, () => {
        pen.clearRect(clean, 0, to - clean, ring.height);
        pen.fillStyle = token("grid");
        for (const value of ticks) pen.fillRect(clean, Math.round(y(value)), to - clean, 1);
      });
      clean = to;
    };
    const seconds = (now) => {
      const each = wide / dense < 420 ? 2 : 1;
      for (let s = Math.max(second, Math.ceil(zero)); x(s) + 14 * dense < x(now); s++, second = s) {
        twice(x(s) - 14 * dense, x(s) + 14 * dense, () => {
          pen.globalCompositeOperation = "destination-over"; pen.fillStyle = token("grid"); pen.fillRect(Math.round(x(s)), 0, 1, tall);
          pen.globalCompositeOperation = "source-over";
          if (s % each) return;
          pen.font = `${12 * dense}px sans-serif`; pen.fillStyle = token("quiet"); pen.textAlign = "center"; pen.textBaseline = "top";
          pen.fillText(String(s), x(s), tall + 7 * dense);
        });
      }
    };
    const band = (one, first, last) => {
      /* Whole pixels, so that nothing is covered twice, and under what is there. */
      const top = columns[one.high], bottom = columns[one.low], t = columns.t;
      pen.globalCompositeOperation = "destination-over"; pen.fillStyle = faded(one.colour, 0.22);
      let i = first;
      for (let c = column; c < Math.floor(x(t[last])); c++) {
        let up = -Infinity, down = Infinity;
        while (i < last && x(t[i + 1]) <= c) i++;
        for (let k = i; k <= last && x(t[k]) < c + 1; k++) if (top[k] != null) { up = Math.max(up, top[k]); down = Math.min(down, bottom[k]); }
        if (up > -Infinity) { const a = Math.max(0, y(up)), b = Math.min(tall, y(down)); if (b > a) pen.fillRect(c, a, 1, b - a); }
      }
      pen.globalCompositeOperation = "source-over";
    };
    const trace = (one, first, last) => {
      const values = columns[one.of], t = columns.t, kind = palpate.KINDS[one.kind];
      pen.strokeStyle = token(one.colour); pen.lineWidth = kind.width * dense; pen.lineJoin = "round";
      pen.setLineDash(kind.dash.map((length) => length * dense));
      pen.beginPath();
      let up = true, begun = 0;
      for (let i = first; i <= last; i++) {
        const value = values[i];
        if (value == null) { up = true; continue; }
        const px = x(t[i]), py = Math.max(-9, Math.min(tall + 9, y(value)));
        if (up) { if (!begun) begun = px; pen.moveTo(px, py); } else pen.lineTo(px, py);
        up = false;
      }
      pen.lineDashOffset = begun;
      pen.stroke();
    };
    /* Adds what has come since. */
    const add = () => {
      const t = columns.t, end = t.length - 1, now = t[end];
      if (now <= drawn) return;
      let first = Math.min(at, end);
      while (first > 0 && t[first] > drawn) first--;
      while (first < end && t[first] < drawn) first++;
      first = Math.max(0, first - (t[first] > drawn ? 1 : 0));
      wipe(Math.ceil(x(now)) + 4);
      twice(x(t[first]) - 2, x(now) + 2, () => {
        pen.save();
        pen.beginPath(); pen.rect(x(t[first]) - 4, 0, x(now) - x(t[first]) + 8, tall); pen.clip();
        lines.forEach((one) => trace(one, first, end));
        bands.forEach((one) => band(one, Math.max(0, first - 3), end));
        pen.restore();
      });
      column = Math.floor(x(now)); drawn = now; at = end;
      seconds(now);
    };
    const again = () => {
      const t = columns.t, now = t[t.length - 1];
      pen.setTransform(1, 0, 0, 1, 0, 0); pen.clearRect(0, 0, ring.width, ring.height);
      zero = t[0]; if (now - span > zero) zero = now - span;
      at = nearest(zero); drawn = -Infinity; clean = 0; second = Math.ceil(zero); column = 0;
      while (at < t.length - 1 && t[at] < zero) at++;
      drawn = t[at]; axis(); add();
      whole = false;
    };
    const marks = (from) => {
      let free = -Infinity;
      front.save();
      front.beginPath(); front.rect(0, 0, wide, tall); front.clip();
      for (const mark of self.marks) {
        const px = Math.round(x(mark.x) - from) + 0.5, failed = mark.tone === "fail";
        if (px < 0 || px > wide) continue;
        front.strokeStyle = token(failed ? "fail" : "quiet"); front.lineWidth = 1.25 * dense; front.setLineDash([3 * dense, 3 * dense]);
        front.beginPath(); front.moveTo(px, 0); front.lineTo(px, tall); front.stroke(); front.setLineDash([]);
        if (!mark.text || spec.wordless) continue;
        front.font = `${failed ? 600 : 400} ${12 * dense}px sans-serif`;
        const length = front.measureText(mark.text).width, start = px + length + 10 * dense > wide ? px - length - 5 * dense : px + 5 * dense;
        if (start < free) continue;
        free = start + length + 6 * dense;
        front.textAlign = "left"; front.textBaseline = "alphabetic"; front.lineJoin = "round"; front.lineWidth = 4 * dense;
        front.strokeStyle = token("paper"); front.fillStyle = token(failed ? "bad" : "quiet");
        front.strokeText(mark.text, start, tall - 8 * dense); front.fillText(mark.text, start, tall - 8 * dense);
      }
      front.restore();
    };
    const show = () => {
      const now = columns.t[columns.t.length - 1], from = Math.max(0, Math.round(x(now)) - wide), part = from % ring.width;
      front.setTransform(1, 0, 0, 1, LEFT * dense, TOP * dense);
      front.clearRect(0, 0, wide + RIGHT * dense, ring.height);
      const first = Math.min(wide, ring.width - part);
      front.drawImage(ring, part, 0, first, ring.height, 0, 0, first, ring.height);
      if (first < wide) front.drawImage(ring, 0, 0, wide - first, ring.height, first, 0, wide - first, ring.height);
      if (self.marks.length) marks(from);
    };
    self.draw = () => {
      if (!columns.t.length) { whole = true; return; }
      if (!wide) sized();
      if (columns.t[columns.t.length - 1] < drawn || zero == null || columns.t[columns.t.length - 1] - drawn > span) whole = true;
      scaled();
      if (whole) again(); else add();
      show();
    };
    self.read = () => {
      line.hidden = pointed == null || !columns.t.length;
      if (line.hidden) { if (read.textContent) read.textContent = ""; return; }
      const now = columns.t[columns.t.length - 1], from = Math.max(zero, now - span), i = nearest(from + pointed * span);
      line.style.transform = `translateX(${LEFT + pointed * wide / dense}px)`;
      read.textContent = [`${figure(columns.t[i], 5)} s`, ...spec.series.map((one) => (one.kind === "band"
        ? `${one.label} ${figure(columns[one.low][i], 4)} to ${figure(columns[one.high][i], 4)}` : `${one.label} ${figure(columns[one.of][i], 4)}`))].join("  ·  ");
    };
    self.forget = () => { whole = true; zero = null; drawn = -Infinity; at = 0; };
    self.anew = () => { whole = true; };
    new ResizeObserver(() => { wide = 0; self.forget(); self.draw(); }).observe(box);
    box.addEventListener("pointermove", (event) => {
      const inside = box.getBoundingClientRect(), share = (event.clientX - inside.left - LEFT) / (inside.width - LEFT - RIGHT);
      pointed = share >= 0 && share <= 1 ? share : null;
      strips.forEach((one) => one.read());
    });
    box.addEventListener("pointerleave", () => { pointed = null; strips.forEach((one) => one.read()); });
    repaints.add(() => { self.anew(); self.draw(); });
    strips.push(self);
    return self;
  };
  return strip;
};
