"use strict";
// Time series with uPlot, for reports and the app. All plots of a page share a view and a cursor.
//
//   const view = seriesPlots.makeView([start, end], onChange)   view.show(low, high), zoom(factor, at), move(share), whole()
//   seriesPlots.plot(element, { label, series, bands, view, ... }) -> uPlot
//     series   [{ label, x, y, colour, dash, width }], each with times of its own; null in y is a gap
//     bands    [{ label, x, low, high, colour }]
//     units    the unit of the values, beside the vertical axis
//     marks    times of vertical lines; limits [low, high] of the values; downward: values grow downward
//     select   (low, high) of a dragged interval, instead of a zoom; hooks of uPlot
//   seriesPlots.decode({ x, y }) -> { x, y } of a document; seriesPlots.colour("--name") of the theme
const seriesPlots = (() => {
  const MISSING = 65535; // a packed value that is not there
  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
  const times = (text) => Array.from(new Float64Array(bytes(text)));
  const values = ({ low, step, steps }) => Array.from(new Uint16Array(bytes(steps)), (count) => (count === MISSING ? null : low + step * count));
  const decode = ({ x, y }) => ({ x: times(x), y: values(y) });
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  // A colour of the palette, lighter in the dark theme.
  const shade = (hex, opacity = 1) => {
    if (!hex.startsWith("#")) return colour(hex);
    const share = parseFloat(colour("--lift")) / 100;
    const component = (k) => Math.round(parseInt(hex.slice(k, k + 2), 16) * (1 - share) + 255 * share);
    return `rgba(${component(1)}, ${component(3)}, ${component(5)}, ${opacity})`;
  };
  const short = (value) => (value == null ? "" : Number(value.toPrecision(4)).toString());

  const makeView = ([start, end], changed) => {
    const view = {
      low: start,
      high: end,
      show(low, high) {
        const width = Math.min(Math.max(high - low, 1e-6 * (end - start)), end - start);
        view.low = Math.min(Math.max(low, start), end - width);
        view.high = view.low + width;
        changed(view.low, view.high);
      },
      zoom(factor, at = 0.5 * (view.low + view.high)) {
        view.show(at - factor * (at - view.low), at + factor * (view.high - at));
      },
      move(share) {
        const step = share * (view.high - view.low);
        view.show(view.low + step, view.high + step);
      },
      whole: () => view.show(start, end),
    };
    return view;
  };
  // Buttons with data-zoom, and the keys of an element, act on the view that `current` returns.
  const addControls = (home, current) => {
    const actions = {
      whole: () => current().whole(), in: () => current().zoom(0.5), out: () => current().zoom(2),
      left: () => current().move(-0.5), right: () => current().move(0.5),
    };
    const keys = {
      ArrowLeft: () => current().move(-0.2), ArrowRight: () => current().move(0.2),
      "+": actions.in, "=": actions.in, "-": actions.out, 0: actions.whole, Home: actions.whole,
    };
    for (const button of document.querySelectorAll("[data-zoom]")) {
      button.addEventListener("click", () => current() && actions[button.dataset.zoom]());
    }
    home.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || !current() || !(event.key in keys)) return;
      event.preventDefault();
      keys[event.key]();
    });
  };

  const axis = (extra) => ({
    stroke: () => colour("--faint"),
    grid: { stroke: () => colour("--line"), width: 1 },
    ticks: { stroke: () => colour("--line"), width: 1 },
    font: "12px system-ui, sans-serif",
    ...extra,
  });
  const range = (limits) => (_, low, high) => {
    const [least, most] = limits ?? [-Infinity, Infinity];
    if (low == null) return limits ?? [-1, 1];
    const [a, b] = [Math.max(low, least), Math.min(high, most)];
    if (!(a < b)) return limits ?? [a - (Math.abs(a) || 1), a + (Math.abs(a) || 1)];
    return [a - 0.06 * (b - a), b + 0.06 * (b - a)];
  };
  const drawMarks = (marks) => ({ ctx, bbox, valToPos }) => {
    ctx.save();
    ctx.strokeStyle = colour("--faint");
    ctx.setLineDash([2, 4]);
    ctx.beginPath();
    for (const time of marks) {
      const x = valToPos(time, "x", true);
      if (x < bbox.left || x > bbox.left + bbox.width) continue;
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
    }
    ctx.stroke();
    ctx.restore();
  };
  const line = ({ label, colour: stroke = "--link", dash = [], width = 1.5 }) => ({
    label, dash, width, stroke: () => shade(stroke), points: { show: false }, value: (_, value) => short(value),
  });
  // The legend has one entry for both edges of a band.
  const edge = ({ label, colour: stroke }) => ({
    ...line({ label, width: 0.5 }),
    stroke: () => shade(stroke, 0.6),
    value: (plot, low, k, index) => (low == null ? "" : `${short(low)} to ${short(plot.data[k + 1][index])}`),
  });

  const plot = (home, { label, units = "", series, bands = [], view, marks = [], limits, downward, select, formatTime, height = 150, hooks = {} }) => {
    const columns = [...bands.flatMap(({ x, low, high }) => [[x, low], [x, high]]), ...series.map(({ x, y }) => [x, y])];
    const isShared = columns.every(([x]) => x === columns[0][0]); // joining takes time
    const joined = () => (isShared ? [columns[0][0], ...columns.map(([, y]) => y)] : uPlot.join(columns));
    const data = columns.length ? joined() : [[view.low, view.high]];
    const made = new uPlot({
      width: Math.max(home.clientWidth, 200),
      height,
      scales: { x: { time: false, range: () => [view.low, view.high] }, y: { dir: downward ? -1 : 1, range: range(limits) } },
      axes: [axis({ size: 28 }), axis({ size: units ? 70 : 56, space: 22, label: units || null, labelSize: 16, labelFont: "12px system-ui, sans-serif" })],
      series: [
        { label: "t [s]", value: (_, time) => (time == null ? "" : formatTime?.(time) ?? time.toFixed(2)) },
        ...bands.flatMap((band) => [edge(band), edge(band)]),
        ...series.map(line),
      ],
      bands: bands.map((band, k) => ({ series: [2 * k + 2, 2 * k + 1], fill: () => shade(band.colour, 0.22) })),
      cursor: {
        sync: { key: "time", setSeries: false, filters: { pub: (type) => type !== "mousedown" && type !== "mouseup" } },
        y: false,
        drag: { x: true, y: false, setScale: false },
        bind: { dblclick: () => () => { view.whole(); return null; } },
      },
      legend: { show: columns.length > 0, live: true },
      hooks: {
        ...hooks,
        draw: [drawMarks(marks), ...(hooks.draw ?? [])],
        setSelect: [({ select: box, posToVal, setSelect }) => {
          if (box.width < 3) return;
          const [low, high] = [box.left, box.left + box.width].map((position) => posToVal(position, "x"));
          setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
          (select ?? view.show)(low, high);
        }],
      },
    }, data, home);
    // The wheel scrolls the page, unless a click or Ctrl says that it is meant for the plot.
    const group = home.closest("[tabindex]");
    made.over.addEventListener("mousedown", () => group?.focus({ preventScroll: true }));
    made.over.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && !event.metaKey && document.activeElement !== group) return;
      event.preventDefault();
      view.zoom(event.deltaY > 0 ? 1.25 : 0.8, made.posToVal(event.clientX - made.over.getBoundingClientRect().left, "x"));
    }, { passive: false });
    made.ctx.canvas.setAttribute("role", "img");
    const names = [...series, ...bands].map((each) => each.label).join(", ");
    made.ctx.canvas.setAttribute("aria-label", `${label} over time: ${names || "nothing"}`);
    made.root.querySelector(".u-legend")?.setAttribute("aria-hidden", "true");
    const entries = made.root.querySelectorAll(".u-legend .u-series");
    bands.forEach((_, k) => { entries[2 * k + 2].hidden = true; });
    return made;
  };
  return { decode, times, values, colour, makeView, addControls, plot };
})();

// The time series of a report: its panels with the chosen lines.
if (document.getElementById("data")) {
  const about = JSON.parse(document.getElementById("data").textContent);
  const [home, choices, recorded] = ["plots", "shown", "recorded"].map((name) => document.getElementById(name));
  const [band, residuals] = ["band", "residuals"].map((name) => document.getElementById(name));
  const x = seriesPlots.times(about.time);
  const decoded = new Map(); // a series is unpacked when it is first shown
  const unpack = (packed) => {
    if (!decoded.has(packed)) decoded.set(packed, seriesPlots.values(packed));
    return decoded.get(packed);
  };
  const formatTime = (time) => {
    const segment = about.segments.findLast((each) => each.start <= time) ?? about.segments[0];
    const since = Math.min(Math.max(time, segment.start), segment.stop) - segment.start;
    return `${about.segments.length > 1 ? `${segment.name} ` : ""}${since.toFixed(2)} s`;
  };
  let plots = [];
  const view = seriesPlots.makeView([x[0], x.at(-1)], (low, high) => {
    for (const plot of plots) plot.setScale("x", { min: low, max: high });
    document.getElementById("view").textContent = `${formatTime(low)} to ${formatTime(high)}`;
  });
  const chosen = () => new Set([...choices?.querySelectorAll("input[name=line]:checked") ?? []].map((box) => Number(box.value)));
  const addPanel = (panel) => {
    const isReplay = panel.residuals !== null;
    const isResidual = isReplay && residuals.checked;
    const shown = isReplay ? chosen() : null;
    const lines = panel.names.map((label, k) => ({
      label, x, y: unpack((isResidual ? panel.residuals : panel.series)[k]),
      ...(isReplay && k ? { colour: about.lines[k - 1].colour, dash: about.lines[k - 1].dashes }
        : { colour: isReplay ? "--ink" : about.palette[k % about.palette.length], width: isReplay ? 1.5 : 1 }),
    })).filter((_, k) => !isReplay || (shown.has(k) && (k || !isResidual)));
    const bands = panel.band.length && !isResidual && (!band || band.checked)
      ? [{ label: about.band?.label ?? "band", colour: about.band?.colour ?? about.palette[0], x, low: unpack(panel.band[0]), high: unpack(panel.band[1]) }] : [];
    const limits = isResidual ? null : panel.limits;
    const isCut = limits && [...lines.map(({ y }) => y), ...bands.flatMap(({ low, high }) => [low, high])]
      .some((values) => values.some((value) => value !== null && (value < limits[0] || value > limits[1])));
    const label = `${isResidual ? "residual of " : ""}${panel.label}${isCut ? ", lines are cut at ten times the measured range" : ""}`;
    const place = Object.assign(document.createElement("div"), { className: "plot" });
    place.append(Object.assign(document.createElement("h3"), { textContent: label }));
    (isReplay || !recorded ? home : recorded.lastElementChild).append(place);
    const marks = about.segments.slice(1).map((segment) => segment.start);
    return seriesPlots.plot(place, { label, series: lines, bands, view, marks, limits, downward: panel.downward, formatTime });
  };
  const build = () => {
    for (const plot of plots) plot.destroy();
    for (const place of document.querySelectorAll("#series .plot")) place.remove();
    plots = about.panels.map(addPanel);
    view.show(view.low, view.high);
  };
  seriesPlots.addControls(home, () => view);
  choices?.addEventListener("change", build);
  const resize = () => {
    for (const plot of plots) plot.setSize({ width: plot.root.parentElement.clientWidth, height: plot.height });
  };
  window.addEventListener("resize", resize);
  recorded?.addEventListener("toggle", resize);
  // Browsers print a canvas line by line, dash by dash; of noise that takes minutes. So print gets
  // pictures. This comes after the listener of the theme, when the plots are drawn in light.
  window.addEventListener("beforeprint", () => {
    for (const plot of plots) {
      const { canvas } = plot.ctx;
      const copy = { className: "copy", alt: canvas.getAttribute("aria-label"), src: canvas.toDataURL("image/png") };
      plot.root.querySelector(".u-wrap").append(Object.assign(document.createElement("img"), copy));
    }
  });
  document.addEventListener("theme", build);
  for (const element of [document.getElementById("tools"), choices]) if (element) element.hidden = false;
  build();
}
