// Numbers under the pointer in lines of fixed height above the maps, the map as it grew, and its files.
(() => {
  const map = JSON.parse(document.getElementById("map").textContent);
  const pair = document.querySelector(".grid.two");
  const image = pair.querySelector("figure img");
  const make = (kind, parent, set = {}) => Object.assign(parent.appendChild(document.createElement(kind)), set);
  const images = [...pair.querySelectorAll("figure img")];
  const rest = ["Point at the map for its numbers.", "Light: not known. Numbered: where to press next."];
  const lines = rest.map((textContent, i) => {
    const line = make("p", images[i].parentElement, { className: "small", textContent });
    images[i].before(line);
    line.setAttribute("aria-live", "polite");
    return line;
  });
  const say = (texts) => texts.forEach((text, i) => (lines[i].textContent = text));
  const nearest = (list, value) =>
    list.reduce((best, each, i) => (Math.abs(each - value) < Math.abs(list[best] - value) ? i : best), 0);
  const number = (value) => Number(value.toPrecision(3)).toLocaleString("en", { useGrouping: false });
  const show = (event) => {
    const frame = event.target.getBoundingClientRect();
    const [left, top, right, bottom] = map.box;
    const u = ((event.clientX - frame.left) / frame.width - left) / (right - left);
    const v = ((event.clientY - frame.top) / frame.height - top) / (bottom - top);
    const x = map.x[0] + u * (map.x[1] - map.x[0]);
    const y = map.y[1] - v * (map.y[1] - map.y[0]);
    const cell = nearest(map.rows, y) * map.columns.length + nearest(map.columns, x);
    const found = u >= 0 && u <= 1 && v >= 0 && v <= 1 ? map.values[cell] : null;
    if (!found) return say(rest);
    const [k, low, high, nextLow, nextHigh] = found.slice(-map.names.length).map(number);
    say([
      `${k} N/m (95 %: ${low} to ${high}) at ${x.toFixed(1)}, ${y.toFixed(1)} mm`,
      `± ${Math.round(100 * (high / k - 1))} %; a next press ${nextLow} to ${nextHigh} N/m`,
    ]);
  };
  for (const each of images.slice(0, 2)) {
    each.addEventListener("pointermove", show);
    each.addEventListener("pointerleave", () => say(rest));
  }
  document.querySelector(".panels").style.gridTemplateColumns = "minmax(0, 1fr)";
  document.querySelector("details").open = true;

  const files = make("p", image.parentElement, { className: "small screen" });
  const save = (name, content) => {
    const url = URL.createObjectURL(content);
    make("a", document.body, { href: url, download: `stiffness-map.${name}` }).click();
    setTimeout(() => URL.revokeObjectURL(url), 1000);
  };
  const text = (lines) => new Blob([`${lines.join("\n")}\n`], { type: "text/plain" });
  const cells = map.values.filter(Boolean);
  const head = [...map.axes, ...map.names];
  const kinds = {
    CSV: () => save("csv", text([head.join(","), ...cells.map((row) => row.join(","))])),
    PLY: () => {
      const z = map.axes.length === 3;
      const names = z ? head : ["x", "y", "z", ...map.names];
      const points = cells.map((row) => (z ? row : [row[0], row[1], 0, ...row.slice(2)]).join(" "));
      const top = ["ply", "format ascii 1.0", `element vertex ${points.length}`];
      save("ply", text([...top, ...names.map((name) => `property float ${name}`), "end_header", ...points]));
    },
    PNG: () => {
      const canvas = document.createElement("canvas");
      [canvas.width, canvas.height] = [1600, (1600 * image.naturalHeight) / image.naturalWidth];
      const pen = canvas.getContext("2d");
      pen.fillStyle = getComputedStyle(document.body).backgroundColor;
      pen.fillRect(0, 0, canvas.width, canvas.height);
      pen.drawImage(image, 0, 0, canvas.width, canvas.height);
      canvas.toBlob((content) => save("png", content));
    },
  };
  for (const [name, write] of Object.entries(kinds)) {
    make("button", files, { type: "button", textContent: name, onclick: write }).style.marginRight = "8px";
  }

  const { shape, frames, ramps, presses } = map.film;
  const section = document.createElement("section");
  pair.after(section);
  make("h2", section, { textContent: "The map as it grew" });
  const bar = make("p", section, { className: "small screen" });
  const play = make("button", bar, { type: "button", textContent: "play" });
  const slider = make("input", bar, { type: "range", min: 0, max: frames.length - 1, value: frames.length - 1 });
  slider.setAttribute("aria-label", "number of presses");
  slider.style.cssText = "width: 45%; margin: 0 12px; vertical-align: middle";
  const count = make("span", bar);
  const grown = make("div", section, { className: "grid two" });
  const panes = ["Stiffness", "Half-width of its 95 % interval"].map((caption) => {
    const figure = make("figure", grown);
    const canvas = make("canvas", figure, { width: 10 * shape[1], height: 10 * shape[0] });
    canvas.style.cssText = "display: block; width: 100%; max-width: 420px";
    make("figcaption", figure, { textContent: caption });
    return canvas;
  });
  const draw = (step) => {
    const frame = frames[step];
    count.textContent = `${frame.count} presses`;
    panes.forEach((canvas, k) => {
      const cells = Object.assign(document.createElement("canvas"), { width: shape[1], height: shape[0] });
      const brush = cells.getContext("2d");
      [frame.stiffness, frame.half][k].forEach((level, i) => {
        if (level === null) return;
        brush.fillStyle = ramps[k][level];
        brush.fillRect(i % shape[1], shape[0] - 1 - Math.floor(i / shape[1]), 1, 1);
      });
      const pen = canvas.getContext("2d");
      pen.clearRect(0, 0, canvas.width, canvas.height);
      pen.drawImage(cells, 0, 0, canvas.width, canvas.height);
      for (const [u, v] of presses.slice(0, frame.count)) {
        pen.beginPath();
        pen.arc(u * canvas.width, (1 - v) * canvas.height, 3.5, 0, 7);
        pen.fillStyle = "white";
        pen.fill();
        pen.stroke();
      }
    });
  };
  slider.addEventListener("input", () => draw(Number(slider.value)));
  play.addEventListener("click", () => {
    let step = 0;
    const timer = setInterval(() => {
      slider.value = step;
      draw(step);
      step += 1;
      if (step === frames.length) clearInterval(timer);
    }, 400);
  });
  draw(frames.length - 1);
})();
