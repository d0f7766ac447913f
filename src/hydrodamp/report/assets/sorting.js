"use strict";
// Tables of class sortable: a head sorts by its column, a second click reverses the order. Elements
// with data-filter have a choice of axis and grade for the elements that it selects.
{
  const status = document.getElementById("sorted");
  const addSorting = (table) => {
    const heads = [...table.tHead.rows[0].cells];
    const sort = (column, direction) => {
      const numeric = heads[column].querySelector("button").dataset.numeric === "1";
      const sign = direction === "ascending" ? 1 : -1;
      const key = (row) => row.cells[column].dataset.key;
      const compare = (first, second) => {
        const [a, b] = [key(first), key(second)];
        if (a === "" || b === "") return (a === "") - (b === ""); // empty cells are last
        return sign * (numeric ? Number(a) - Number(b) : a.localeCompare(b));
      };
      table.tBodies[0].append(...[...table.tBodies[0].rows].sort(compare));
      for (const head of heads) head.removeAttribute("aria-sort");
      heads[column].setAttribute("aria-sort", direction);
      status.textContent = `Sorted by ${heads[column].textContent}, ${direction}.`;
    };
    heads.forEach((head, column) => {
      head.querySelector("button").addEventListener("click", () => {
        sort(column, head.getAttribute("aria-sort") === "ascending" ? "descending" : "ascending");
      });
    });
  };
  const addFilter = (parent) => {
    const rows = [...parent.querySelectorAll(parent.dataset.filter)];
    const bar = document.createElement("p");
    parent.before(bar);
    const selects = ["axis", "grade"].map((kind) => {
      const box = document.createElement("label");
      const select = document.createElement("select");
      const values = new Set(rows.map((row) => row.dataset[kind]));
      select.dataset.kind = kind;
      select.append(new Option("all", ""), ...[...values].map((text) => new Option(text, text)));
      box.append(`${kind} `, select);
      bar.append(box, " ");
      return select;
    });
    const isShown = (row) => selects.every((select) => ["", row.dataset[select.dataset.kind]].includes(select.value));
    const filter = () => {
      for (const row of rows) row.hidden = !isShown(row);
      status.textContent = `${rows.filter(isShown).length} of ${rows.length} coefficients.`;
    };
    for (const select of selects) select.addEventListener("change", filter);
  };
  // A table that is wider than its box says so.
  const addHint = (box) => {
    const hint = Object.assign(document.createElement("p"), { className: "hint", textContent: "⇆ The table goes on to the right: scroll it sideways." });
    box.before(hint);
    new ResizeObserver(() => { hint.hidden = box.scrollWidth <= box.clientWidth; }).observe(box);
  };
  for (const table of document.querySelectorAll("table.sortable")) addSorting(table);
  for (const box of document.querySelectorAll(".wide")) addHint(box);
  // A link of the contents opens what is folded there.
  for (const link of document.querySelectorAll("nav a[href^='#']")) {
    link.addEventListener("click", () => {
      const [folded, ...others] = document.querySelector(link.hash).querySelectorAll(":scope > details");
      if (folded && !others.length) folded.open = true;
    });
  }
  for (const parent of document.querySelectorAll("[data-filter]")) addFilter(parent);
}
