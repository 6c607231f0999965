/* Shows the claims of a verdict, or with a word; what has none left is folded away. */
"use strict";
(() => {
  const all = (selector, within = document) => [...within.querySelectorAll(selector)];
  const buttons = all("#filter button"), field = document.getElementById("word"), count = document.getElementById("shown");
  const claims = all(".claim").map((node) => ({ node, verdict: node.dataset.verdict, text: node.textContent.toLowerCase() }));
  let verdict = "";
  const sift = () => {
    const word = field.value.trim().toLowerCase();
    let left = 0;
    for (const one of claims) {
      const fits = (!verdict || one.verdict === verdict) && (!word || one.text.includes(word));
      one.node.hidden = !fits;
      left += fits;
    }
    for (const study of all("section.study")) {
      const own = all(".claim", study), some = own.some((node) => !node.hidden) || (!own.length && !verdict && !word);
      study.hidden = !some;
      for (const line of all(`[data-of="${CSS.escape(study.id)}"]`)) line.hidden = !some;
    }
    count.textContent = `${left} of ${claims.length} shown`;
  };
  for (const button of buttons) button.addEventListener("click", () => {
    verdict = button.value;
    for (const other of buttons) other.setAttribute("aria-pressed", String(other === button));
    sift();
  });
  field.addEventListener("input", sift);
  addEventListener("beforeprint", () => all("details").forEach((one) => { one.open = true; }));
})();
