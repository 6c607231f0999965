/* Tables that can be sorted by their heads and sifted by a word: `data-sort` and `data-sift` on a table. */
"use strict";
(() => {
  const sortKey = (cell) => {
    const text = cell.textContent.trim().replace("−", "-");
    const number = parseFloat(text);
    return Number.isNaN(number) ? text.toLowerCase() : number;
  };
  const compare = (a, b) => (typeof a === typeof b ? (a < b ? -1 : a > b ? 1 : 0) : typeof a === "number" ? -1 : 1);
  for (const table of document.querySelectorAll("table[data-sort]")) {
    const body = table.tBodies[0];
    [...table.tHead.rows[0].cells].forEach((head, column) => {
      const button = document.createElement("button");
      button.append(...head.childNodes);
      head.append(button);
      button.addEventListener("click", () => {
        const descending = head.getAttribute("aria-sort") === "ascending";
        for (const cell of table.tHead.rows[0].cells) cell.removeAttribute("aria-sort");
        head.setAttribute("aria-sort", descending ? "descending" : "ascending");
        const rows = [...body.rows].sort((a, b) => compare(sortKey(a.cells[column]), sortKey(b.cells[column])));
        body.append(...(descending ? rows.reverse() : rows));
      });
    });
  }
  for (const table of document.querySelectorAll("table[data-sift]")) {
    const field = document.createElement("input");
    field.type = "search"; field.className = "sift screen"; field.placeholder = "only rows with …";
    field.setAttribute("aria-label", "only rows with this text");
    (table.closest(".scroll") || table).before(field);
    field.addEventListener("input", () => {
      const wanted = field.value.toLowerCase();
      for (const row of table.tBodies[0].rows) row.hidden = !row.textContent.toLowerCase().includes(wanted);
    });
  }
})();
