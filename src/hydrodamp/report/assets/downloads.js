"use strict";
// Buttons that copy or download tables as CSV, pictures as SVG, the comparison as JSON and the command.
{
  const download = (name, address) => {
    const link = document.createElement("a");
    link.download = name;
    link.href = address;
    link.click();
  };
  const addressOf = (text, type) => URL.createObjectURL(new Blob([text], { type }));
  const addButton = (parent, text, subject, action) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = text;
    button.setAttribute("aria-label", `${text}: ${subject}`);
    button.className = "download";
    button.addEventListener("click", action);
    parent.append(button);
  };
  // A browser refuses the clipboard where the page has no permission; then the text is downloaded.
  const copy = async (event, text, name) => {
    const button = event.currentTarget;
    try {
      await navigator.clipboard.writeText(text);
      button.textContent = "Copied";
    } catch {
      button.textContent = "Clipboard refused: downloaded";
      download(name, addressOf(text, "text/plain"));
    }
  };
  const quote = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
  const toCsv = (table) => [...table.rows]
    .filter((row) => !row.hidden)
    .map((row) => [...row.cells].map((cell) => quote(cell.dataset.key ?? cell.textContent.replace(/[\u25b4\u25be]/g, "").trim())).join(","))
    .join("\n");
  for (const table of document.querySelectorAll("table.sortable")) {
    const bar = document.createElement("p");
    table.parentElement.after(bar);
    const name = `${table.dataset.file}.csv`;
    addButton(bar, "Copy CSV", name, (event) => copy(event, toCsv(table), name));
    addButton(bar, "Download CSV", name, () => download(name, addressOf(toCsv(table), "text/csv")));
  }
  for (const picture of document.querySelectorAll("figure img")) {
    const name = `${picture.dataset.file ?? "picture"}.svg`;
    addButton(picture.nextElementSibling, "Download SVG", name, () => download(name, picture.src));
  }
  const bar = document.createElement("p");
  document.querySelector("#origin h2").after(bar);
  const comparison = document.getElementById("comparison")?.textContent;
  if (comparison) addButton(bar, "Download JSON", "comparison.json", () => download("comparison.json", addressOf(comparison, "application/json")));
  const terms = [...document.querySelectorAll("#origin dt")];
  const command = terms.find((term) => term.textContent === "command")?.nextElementSibling;
  if (command) addButton(bar, "Copy command", "this report", (event) => copy(event, command.textContent, "command.txt"));
}
