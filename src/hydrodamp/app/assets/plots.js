"use strict";
// Plots of series that the server decimates, on one time axis that all of them share.
const seriesPlots = (() => {
  const HEIGHT = 110;
  const decode = (text, Kind) => {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    return new Kind(bytes.buffer);
  };
  const numbers = ({ x, y }) => [
    Array.from(decode(x, Float64Array)),
    Array.from(decode(y, Float32Array), (value) => (Number.isFinite(value) ? value : null)),
  ];
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const axis = (more) => ({ stroke: colour("--faint"), grid: { stroke: colour("--line"), width: 1 }, ticks: { stroke: colour("--line"), width: 1 }, font: "12px system-ui", ...more });
  const cursors = uPlot.sync("time");

  // A plot in an element; lines are [label, colour] pairs, onSelect gets an interval of time.
  const makePlot = (home, label, lines, data, onSelect, hooks = {}) => new uPlot({
    width: Math.max(home.clientWidth, 200), height: HEIGHT,
    cursor: { sync: { key: cursors.key, filters: { pub: (type) => type !== "mousedown" && type !== "mouseup" } }, drag: { x: true, y: false, setScale: false } },
    legend: { show: lines.length > 1 },
    scales: { x: { time: false } },
    axes: [axis({ size: 28 }), axis({ size: 56, space: 18 })],
    series: [{ label: "t [s]" }, ...lines.map(([name, stroke]) => ({ label: name, stroke, width: 1, points: { show: false } }))],
    hooks: {
      ready: [(plot) => plot.ctx.canvas.setAttribute("role", "img"), (plot) => plot.ctx.canvas.setAttribute("aria-label", label)],
      setSelect: [(plot) => {
        if (plot.select.width < 3) return;
        const [low, high] = [plot.select.left, plot.select.left + plot.select.width].map((place) => plot.posToVal(place, "x"));
        plot.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
        onSelect(low, high);
      }],
      ...hooks,
    },
  }, data, home);

  // All plots of a page: they ask the server for the interval that they have in view.
  const start = (home, { onSelect, hooks } = {}) => {
    const address = `${document.body.dataset.project}/${home.dataset.series}`;
    const plots = new Map();
    let whole;
    let view;
    let marks = []; // starts of runs
    const drawMarks = (plot) => {
      const { ctx, bbox } = plot;
      ctx.save();
      ctx.strokeStyle = colour("--faint");
      ctx.setLineDash([4, 4]);
      ctx.beginPath();
      for (const time of marks) {
        const left = plot.valToPos(time, "x", true);
        if (left < bbox.left || left > bbox.left + bbox.width) continue;
        ctx.moveTo(left, bbox.top);
        ctx.lineTo(left, bbox.top + bbox.height);
      }
      ctx.stroke();
      ctx.restore();
    };
    let asked = 0; // zooms so far: an answer for an earlier one is late
    const places = () => [...home.querySelectorAll("[data-plot]")];
    const seen = new Set();
    const zoom = (low, high) => {
      view = [Math.max(low, whole[0]), Math.min(high, whole[1])];
      asked += 1;
      load([...seen]);
    };
    const draw = (place, pair) => {
      const name = place.dataset.plot;
      const data = numbers(pair);
      plots.get(name)?.destroy();
      place.replaceChildren();
      const plot = makePlot(place, name, [[name, colour("--link")]], data, (low, high) => (onSelect ?? zoom)(low, high, zoom), { ...hooks, draw: [drawMarks] });
      plot.setScale("x", { min: view[0], max: view[1] });
      plots.set(name, plot);
    };
    const report = () => {
      document.getElementById("view").textContent = `${view[0].toFixed(1)} to ${view[1].toFixed(1)} s`;
    };
    async function load(names) {
      const request = asked;
      for (const name of names) seen.add(name);
      const query = new URLSearchParams();
      if (view) { query.set("start", view[0]); query.set("end", view[1]); }
      for (const name of names) query.append("column", name);
      const answer = await fetch(`${address}?${query}`);
      if (!answer.ok) return;
      const found = await answer.json();
      if (request < asked) return;
      whole ??= [found.start, found.end];
      marks = found.marks;
      view ??= whole;
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
      report();
      home.dataset.drawn = String(Number(home.dataset.drawn ?? 0) + 1);
    }
    const actions = {
      in: () => zoom(...around(0.5)), out: () => zoom(...around(2)),
      left: () => move(-0.5), right: () => move(0.5), whole: () => zoom(...whole),
    };
    const around = (factor) => {
      const middle = (view[0] + view[1]) / 2;
      const half = factor * (view[1] - view[0]) / 2;
      return [middle - half, middle + half];
    };
    const move = (share) => {
      const shift = Math.max(whole[0] - view[0], Math.min(share * (view[1] - view[0]), whole[1] - view[1]));
      zoom(view[0] + shift, view[1] + shift);
    };
    for (const button of document.querySelectorAll("[data-zoom]")) {
      button.addEventListener("click", () => whole && actions[button.dataset.zoom]());
    }
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
    const redraw = () => { for (const plot of plots.values()) plot.redraw(); };
    window.addEventListener("resize", () => {
      for (const place of places()) plots.get(place.dataset.plot)?.setSize({ width: place.clientWidth, height: HEIGHT });
    });
    document.addEventListener("theme", () => { if (view) load([...seen]); });
    return { redraw };
  };
  return { start, makePlot, numbers, colour };
})();
