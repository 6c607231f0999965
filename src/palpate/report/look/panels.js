/* Figures as panels: each is drawn when it comes into sight, and those over the same axis are zoomed together. */
"use strict";
(() => {
  const held = document.getElementById("panels");
  if (!held) return;
  const { Group, chart, unpacked, make, legend } = palpate;
  const figures = JSON.parse(held.textContent);
  const opened = (columns) => Object.fromEntries(Object.entries(columns).map(([name, column]) => [name, unpacked(column)]));
  const draw = (host, panels) => {
    const groups = {};
    host.replaceChildren(...panels.map((one) => {
      const box = make("div", { class: one.wide > 560 ? "panel wide" : "panel" });
      if (one.legend) { box.className = "panel wide"; box.append(legend(one.legend)); }
      if (one.picture) {
        const image = make("img", { src: one.picture, alt: one.title || host.dataset.alt || "", width: one.wide });
        box.append(image);
      }
      return box;
    }));
    panels.forEach((one, i) => {
      if (!one.spec) return;
      groups[one.group] ??= new Group();
      chart(host.children[i], one.spec, opened(one.columns), groups[one.group]);
    });
  };
  const hosts = [...document.querySelectorAll("[data-panels]")].filter((host) => figures[host.dataset.panels]);
  const waiting = new Set(hosts);
  const now = (host) => { if (waiting.delete(host)) { draw(host, figures[host.dataset.panels]); host.style.minHeight = ""; } };
  for (const host of hosts) {
    const high = figures[host.dataset.panels].reduce((sum, one) => sum + (one.spec ? one.spec.height + 100 : 260), 0);
    host.style.minHeight = `${high}px`;
  }
  const seen = new IntersectionObserver((entries) => entries.forEach((one) => { if (one.isIntersecting) { seen.unobserve(one.target); now(one.target); } }), { rootMargin: "600px" });
  hosts.forEach((host) => seen.observe(host));
  addEventListener("beforeprint", () => hosts.forEach(now));
})();
