"use strict";
// Plots of series that the server decimates: they ask it for the interval that they have in view.
//   loadSeries(element, { select(low, high, zoom), hooks }) -> { redraw() }
const loadSeries = (home, { onSelect, hooks } = {}) => {
  const address = `${document.body.dataset.project}/${home.dataset.series}`;
  const plots = new Map();
  const seen = new Set();
  let view;
  let marks = []; // starts of runs
  let asked = 0; // zooms so far: an answer for an earlier one is late
  const places = () => [...home.querySelectorAll("[data-plot]")];
  const zoom = () => {
    asked += 1;
    load([...seen]);
  };
  const draw = (place, pair) => {
    const name = place.dataset.plot;
    plots.get(name)?.destroy();
    place.replaceChildren();
    const select = onSelect && ((low, high) => onSelect(low, high, view.show));
    const series = [{ label: name, ...seriesPlots.decode(pair), width: 1 }];
    plots.set(name, seriesPlots.plot(place, { label: name, series, view, marks, select, hooks, height: 110 }));
  };
  async function load(names) {
    const request = asked;
    for (const name of names) seen.add(name);
    const query = new URLSearchParams();
    if (view) { query.set("start", view.low); query.set("end", view.high); }
    for (const name of names) query.append("column", name);
    const answer = await fetch(`${address}?${query}`);
    if (!answer.ok) return;
    const found = await answer.json();
    if (request < asked) return;
    view ??= seriesPlots.makeView([found.start, found.end], zoom);
    marks = found.marks;
    if (!places().length) {
      for (const name of Object.keys(found.series)) {
        const heading = Object.assign(document.createElement("h3"), { textContent: name });
        const place = Object.assign(document.createElement("div"), { className: "plot" });
        place.dataset.plot = name;
        home.append(heading, place);
      }
    }
    for (const place of places()) {
      const name = place.dataset.plot; // a column may be called `__proto__`
      if (Object.hasOwn(found.series, name)) draw(place, found.series[name]);
    }
    document.getElementById("view").textContent = `${view.low.toFixed(1)} to ${view.high.toFixed(1)} s`;
    home.dataset.drawn = String(Number(home.dataset.drawn ?? 0) + 1);
  }
  seriesPlots.addControls(home, () => view);
  if (places().length) {
    const watcher = new IntersectionObserver((entries) => {
      const names = entries.filter((entry) => entry.isIntersecting).map((entry) => {
        watcher.unobserve(entry.target);
        return entry.target.dataset.plot;
      });
      if (names.length) load(names);
    }, { rootMargin: "300px" });
    for (const place of places()) watcher.observe(place);
  } else load([]);
  window.addEventListener("resize", () => {
    for (const place of places()) plots.get(place.dataset.plot)?.setSize({ width: place.clientWidth, height: 110 });
  });
  const redraw = () => { for (const plot of plots.values()) plot.redraw(); };
  document.addEventListener("theme", redraw);
  return { redraw };
};
