"use strict";
// The table of scores: a head sorts by its column, and again the other way round.
{
  const table = document.getElementById("score-table");
  const heads = [...table.tHead.rows[0].cells];
  const said = document.getElementById("sorted");
  const sort = (place, direction) => {
    const numeric = heads[place].querySelector("button").dataset.numeric === "1";
    const sign = direction === "ascending" ? 1 : -1;
    const key = (row) => row.cells[place].dataset.key;
    const compare = (one, other) => {
      const [a, b] = [key(one), key(other)];
      if (a === "" || b === "") return (a === "") - (b === ""); // nothing stands last either way
      return sign * (numeric ? Number(a) - Number(b) : a.localeCompare(b));
    };
    table.tBodies[0].append(...[...table.tBodies[0].rows].sort(compare));
    for (const head of heads) head.removeAttribute("aria-sort");
    heads[place].setAttribute("aria-sort", direction);
    said.textContent = `Sorted by ${heads[place].textContent}, ${direction}.`;
  };
  heads.forEach((head, place) => {
    head.querySelector("button").addEventListener("click", () => {
      sort(place, head.getAttribute("aria-sort") === "ascending" ? "descending" : "ascending");
    });
  });
}
