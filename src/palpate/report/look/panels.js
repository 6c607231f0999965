/* Figures as panels: those in sight are drawn first, the others while the page rests; those over one axis zoom together. */
"use strict";
(() => {
  const element = document.getElementById("panels");
  if (!element) return;
  const { Group, chart, unpacked, make } = palpate;
  const figures = JSON.parse(element.textContent);
  const opened = (columns) => Object.fromEntries(Object.entries(columns).map(([name, column]) => [name, unpacked(column)]));
  const draw = (host, panels) => {
    const groups = {};
    host.replaceChildren(...panels.map(() => make("div", { class: "panel" })));
    panels.forEach((panel, i) => {
      groups[panel.group] ??= new Group();
      chart(host.children[i], panel.spec, opened(panel.columns), groups[panel.group]);
    });
  };
  const hosts = [...document.querySelectorAll("[data-panels]")].filter((host) => figures[host.dataset.panels]);
  const waiting = new Set(hosts);
  const drawNow = (host) => { if (waiting.delete(host)) { draw(host, figures[host.dataset.panels]); host.style.minHeight = ""; } };
  for (const host of hosts) {
    const high = figures[host.dataset.panels].reduce((sum, panel) => sum + panel.spec.height + 100, 0);
    host.style.minHeight = `${high}px`;
  }
  const observer = new IntersectionObserver((entries) => entries.forEach((entry) => { if (entry.isIntersecting) { observer.unobserve(entry.target); drawNow(entry.target); } }), { rootMargin: "600px" });
  hosts.forEach((host) => observer.observe(host));
  const drawNext = () => { const [host] = waiting; if (host) { drawNow(host); setTimeout(drawNext); } };
  addEventListener("load", () => setTimeout(drawNext, 100));
  addEventListener("beforeprint", () => hosts.forEach(drawNow));
})();
