/* Charts that move: two tiles that lie side by side and are shifted; only what is new is drawn, and all where a scale changes. */
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
    const scale = make("div", { class: "scale" });
    const line = make("span", { class: "pointer" });
    const tiles = [make("canvas"), make("canvas")], belt = make("div", { class: "belt" }, ...tiles), face = make("div", { class: "face" }, belt);
    const box = make("div", { class: "plot strip", role: "img", "aria-label": spec.title }, scale, face, line);
    host.classList.add("chart");
    host.replaceChildren(make("header", {}, make("h3", {}, spec.title), legend(spec.series)),
      make("div", { class: "axis" }, make("span", {}, spec.y), read), box);
    if (spec.x) host.append(make("div", { class: "axis below" }, make("span", {}, spec.x)));
    const pens = tiles.map((one) => one.getContext("2d"));
    const lines = spec.series.filter((one) => one.kind !== "band"), bands = spec.series.filter((one) => one.kind === "band");
    let wide = 0, tall = 0, dense = 1, low = 0, high = 1, ticks = [], zero = null, drawn = -Infinity, at = 0, laid = -1, second = 0, column = 0, whole = true, pen = null;

    const x = (t) => (t - zero) * wide / span;
    const y = (v) => tall * (high - v) / (high - low);
    const sized = () => {
      dense = devicePixelRatio || 1;
      const across = Math.max(160, box.clientWidth), up = spec.height();
      box.style.height = `${up}px`;
      wide = Math.round((across - LEFT - RIGHT) * dense); tall = Math.round((up - TOP - BELOW) * dense);
      for (const one of tiles) {
        one.width = wide; one.height = tall + Math.round(BELOW * dense);
        one.style.width = `${wide / dense}px`; one.style.height = `${one.height / dense}px`;
      }
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
    const axis = () => scale.replaceChildren(...ticks.map((value) => {
      const one = make("span", {}, word(value));
      one.style.top = `${TOP + y(value) / dense}px`;
      return one;
    }));
    /* Tile n holds the places from n times its width on; what goes over its end is drawn on both. */
    const across = (from, to, act) => {
      for (let n = Math.max(0, laid - 1, Math.floor(from / wide)); n <= Math.min(laid, Math.floor(to / wide)); n++) {
        pen = pens[n % 2];
        pen.setTransform(1, 0, 0, 1, -n * wide, 0);
        act();
      }
    };
    const lay = (n) => {
      const one = tiles[n % 2];
      pen = pens[n % 2]; laid = n;
      one.style.left = `${n * wide / dense}px`;
      pen.setTransform(1, 0, 0, 1, 0, 0); pen.clearRect(0, 0, wide, one.height);
      pen.fillStyle = token("grid");
      for (const value of ticks) pen.fillRect(0, Math.round(y(value)), wide, 1);
    };
    const seconds = (now) => {
      const each = wide / dense < 420 ? 2 : 1;
      for (let s = Math.max(second, Math.ceil(zero)); x(s) + 14 * dense < x(now); s++, second = s) {
        across(x(s) - 14 * dense, x(s) + 14 * dense, () => {
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
      while (laid < Math.floor(x(now) / wide)) lay(laid + 1);
      across(x(t[first]) - 2, x(now) + 2, () => {
        pen.save();
        pen.beginPath(); pen.rect(x(t[first]) - 4, 0, x(now) - x(t[first]) + 8, tall); pen.clip();
        lines.forEach((one) => trace(one, first, end));
        bands.forEach((one) => band(one, Math.max(0, first - 3), end));
        pen.restore();
      });
      column = Math.floor(x(now)); drawn = now; at = end;
      seconds(now);
    };
    /* A moment's line and word; one that is told late is drawn where it was. */
    const mark = (one) => {
      const px = Math.round(x(one.x)) + 0.5, failed = one.tone === "fail", worded = one.text && !spec.wordless;
      pen = pens[0]; pen.font = `${failed ? 600 : 400} ${12 * dense}px sans-serif`;
      const length = worded ? pen.measureText(one.text).width : 0;
      across(px - 2, px + length + 10 * dense, () => {
        pen.strokeStyle = token(failed ? "fail" : "quiet"); pen.lineWidth = 1.25 * dense; pen.setLineDash([3 * dense, 3 * dense]); pen.lineDashOffset = 0;
        pen.beginPath(); pen.moveTo(px, 0); pen.lineTo(px, tall); pen.stroke(); pen.setLineDash([]);
        if (!worded) return;
        pen.font = `${failed ? 600 : 400} ${12 * dense}px sans-serif`;
        pen.textAlign = "left"; pen.textBaseline = "alphabetic"; pen.lineJoin = "round"; pen.lineWidth = 4 * dense;
        pen.strokeStyle = token("paper"); pen.fillStyle = token(failed ? "bad" : "quiet");
        pen.strokeText(one.text, px + 5 * dense, tall - 8 * dense); pen.fillText(one.text, px + 5 * dense, tall - 8 * dense);
      });
    };
    let marked = new Set();
    const marks = () => {
      for (const one of self.marks) {
        const key = `${one.x} ${one.text}`;
        if (marked.has(key) || one.x < zero || x(one.x) + 90 * dense > x(drawn)) continue;
        marked.add(key); mark(one);
      }
    };
    const again = () => {
      const t = columns.t, now = t[t.length - 1];
      zero = t[0]; if (now - span > zero) zero = now - span;
      at = nearest(zero); laid = -1; second = Math.ceil(zero); column = 0; marked = new Set();
      while (at < t.length - 1 && t[at] < zero) at++;
      drawn = at < t.length - 1 ? t[at] : -Infinity; axis(); add();
      if (laid < 0) lay(0);
      whole = false;
    };
    const show = () => {
      marks();
      const from = Math.max(0, Math.round(x(drawn)) - wide);
      belt.style.transform = `translateX(${-from / dense}px)`;
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
