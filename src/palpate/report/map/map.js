// The numbers of the map under the pointer, in a line of fixed height above it.
(() => {
  const map = JSON.parse(document.getElementById("map").textContent);
  const image = document.querySelector(".grid.two figure img");
  const line = document.createElement("p");
  line.className = "small";
  line.setAttribute("aria-live", "polite");
  const rest = "Point at the map for its numbers.";
  line.textContent = rest;
  image.parentElement.prepend(line);
  const nearest = (list, value) =>
    list.reduce((best, each, i) => (Math.abs(each - value) < Math.abs(list[best] - value) ? i : best), 0);
  const number = (value) => Number(value.toPrecision(3)).toLocaleString("en", { useGrouping: false });
  image.addEventListener("pointermove", (event) => {
    const frame = image.getBoundingClientRect();
    const [left, top, right, bottom] = map.box;
    const u = ((event.clientX - frame.left) / frame.width - left) / (right - left);
    const v = ((event.clientY - frame.top) / frame.height - top) / (bottom - top);
    const x = map.x[0] + u * (map.x[1] - map.x[0]);
    const y = map.y[1] - v * (map.y[1] - map.y[0]);
    const column = nearest(map.columns, x);
    const row = nearest(map.rows, y);
    const found = u >= 0 && u <= 1 && v >= 0 && v <= 1 ? map.values[row * map.columns.length + column] : null;
    if (!found) {
      line.textContent = rest;
      return;
    }
    const [k, low, high, nextLow, nextHigh] = found.map(number);
    line.textContent = `${k} N/m (95 %: ${low} to ${high}); next press ${nextLow} to ${nextHigh}; at ${x.toFixed(1)}, ${y.toFixed(1)} mm`;
  });
  image.addEventListener("pointerleave", () => {
    line.textContent = rest;
  });
})();
