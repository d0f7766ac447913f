"use strict";
// Light or dark: as the system has it, until the button says otherwise. Print is light.
{
  const root = document.documentElement;
  const button = document.getElementById("theme");
  const system = window.matchMedia("(prefers-color-scheme: dark)");
  const remembered = () => {
    try { return window.localStorage.getItem("hydrodamp-theme"); } catch { return null; }
  };
  const remember = (name) => {
    try { window.localStorage.setItem("hydrodamp-theme", name); } catch { /* not allowed here */ }
  };
  const isDark = () => (root.dataset.theme ? root.dataset.theme === "dark" : system.matches);
  const changed = () => {
    button.setAttribute("aria-pressed", String(isDark()));
    document.dispatchEvent(new Event("theme"));
  };
  const before = remembered();
  if (before === "dark" || before === "light") root.dataset.theme = before;
  button.hidden = false;
  button.addEventListener("click", () => {
    root.dataset.theme = isDark() ? "light" : "dark";
    remember(root.dataset.theme);
    changed();
  });
  system.addEventListener("change", changed);
  let kept;
  window.addEventListener("beforeprint", () => {
    kept = root.dataset.theme;
    root.dataset.theme = "light";
    changed();
  });
  window.addEventListener("afterprint", () => {
    if (kept === undefined) delete root.dataset.theme; else root.dataset.theme = kept;
    changed();
  });
  changed();
}
