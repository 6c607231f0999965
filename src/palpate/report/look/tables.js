/* Tables that can be sorted by their heads and sifted by a word: `data-sort` and `data-sift` on a table. */
"use strict";
(() => {
  const worth = (cell) => {
    const own = cell.querySelector("data");
    const text = (own ? own.value : cell.textContent).trim().replace("−", "-");
    const number = parseFloat(text);
    return Number.isNaN(number) ? text.toLowerCase() : number;
  };
  const compared = (a, b) => (typeof a === typeof b ? (a < b ? -1 : a > b ? 1 : 0) : typeof a === "number" ? -1 : 1);
  for (const table of document.querySelectorAll("table[data-sort]")) {
    const body = table.tBodies[0];
    [...table.tHead.rows[0].cells].forEach((head, column) => {
      const button = document.createElement("button");
      button.append(...head.childNodes);
      head.append(button);
      button.addEventListener("click", () => {
        const falling = head.getAttribute("aria-sort") === "ascending";
        for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
        head.setAttribute("aria-sort", falling ? "descending" : "ascending");
        const rows = [...body.rows].sort((a, b) => compared(worth(a.cells[column]), worth(b.cells[column])));
        body.append(...(falling ? rows.reverse() : rows));
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
