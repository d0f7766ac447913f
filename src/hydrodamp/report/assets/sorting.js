"use strict";
// Tables of class sortable: a head sorts by its column, a second click reverses the order. Tables
// with data-filter have a choice of axis and grade.
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
  const addFilter = (table) => {
    const rows = [...table.tBodies[0].rows];
    const grade = (row) => row.lastElementChild.textContent.split(":")[0];
    const axis = (row) => row.cells[0].textContent[0];
    const addSelect = (label, valueOf) => {
      const box = document.createElement("label");
      const select = document.createElement("select");
      select.append(new Option("all", ""), ...[...new Set(rows.map(valueOf))].map((text) => new Option(text, text)));
      box.append(`${label} `, select, " ");
      table.parentElement.before(box);
      return (row) => select.value === "" || select.value === valueOf(row);
    };
    const matches = [addSelect("axis", axis), addSelect("grade", grade)];
    const filter = () => rows.forEach((row) => { row.hidden = !matches.every((match) => match(row)); });
    for (const select of table.parentElement.parentElement.querySelectorAll("select")) select.addEventListener("change", filter);
  };
  for (const table of document.querySelectorAll("table.sortable")) {
    addSorting(table);
    if (table.dataset.filter) addFilter(table);
  }
}
