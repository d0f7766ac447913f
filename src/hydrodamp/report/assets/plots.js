"use strict";
// Time series with uPlot, for reports and the app. All plots of a page share a view and a cursor.
//
//   const view = seriesPlots.makeView([start, end], onChange)   view.show(low, high), zoom(factor, at), move(share), whole()
//   seriesPlots.plot(element, { label, series, bands, view, ... }) -> uPlot
//     series   [{ label, x, y, unit, colour, dash, width }], each with times of its own; null in y is a gap;
//              the first unit is that of the left axis, all others are that of the right axis
//     bands    [{ label, x, low, high, colour }]
//     marks    times of vertical lines; limits [low, high] of the values; downward: values grow downward
//     select   (low, high) of a dragged interval, instead of a zoom; hooks of uPlot
//   seriesPlots.plotXY(element, { label, names, units, t, x, y, isTrack, shade, onTime }) -> uPlot with mark(time)
//     isTrack  equal scales; shade(time) the colour of a point; onTime(time) of the point under the cursor
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
  const PALETTE = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#8c6d1f", "#56b4e9", "#7a3e9d", "#5f5f5f"];
  const make = (tag, properties, ...children) => {
    const made = Object.assign(document.createElement(tag), properties);
    made.append(...children);
    return made;
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
      isWhole: () => view.high - view.low > 0.999 * (end - start),
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

  // The wheel zooms after a click on a plot, and with Ctrl, unless there is no more to show: else it scrolls the page.
  const addWheel = (over, zoom, isWhole) => {
    const group = over.closest("[tabindex]");
    over.addEventListener("mousedown", () => group?.focus({ preventScroll: true }));
    over.addEventListener("wheel", (event) => {
      const isMeant = event.ctrlKey || event.metaKey || document.activeElement === group;
      if (!isMeant || (event.deltaY > 0 && isWhole())) return;
      event.preventDefault();
      const { left, top } = over.getBoundingClientRect();
      zoom(event.deltaY > 0 ? 1.25 : 0.8, event.clientX - left, event.clientY - top);
    }, { passive: false });
  };

  const describe = ({ ctx }, ariaLabel) => Object.assign(ctx.canvas, { role: "img", ariaLabel });
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

  const plot = (home, { label, series, bands = [], view, marks = [], limits, downward, select, formatTime, height = 150, hooks = {} }) => {
    const columns = [...bands.flatMap(({ x, low, high }) => [[x, low], [x, high]]), ...series.map(({ x, y }) => [x, y])];
    const isShared = columns.every(([x]) => x === columns[0][0]); // joining takes time
    const joined = () => (isShared ? [columns[0][0], ...columns.map(([, y]) => y)] : uPlot.join(columns));
    const [unit, ...others] = new Set(series.map((each) => each.unit ?? ""));
    const scaleOf = (each) => ((each.unit ?? "") === unit || !series.includes(each) ? "y" : "right");
    const vertical = (text, extra) => axis({ size: text ? 70 : 56, space: 22, label: text || null, labelSize: 16, labelFont: "12px system-ui, sans-serif", ...extra });
    const data = columns.length ? joined() : [[view.low, view.high]];
    const made = new uPlot({
      width: Math.max(home.clientWidth, 200),
      height,
      scales: { x: { time: false, range: () => [view.low, view.high] }, y: { dir: downward ? -1 : 1, range: range(limits) }, ...(others.length && { right: { range: range() } }) },
      axes: [axis({ size: 28 }), vertical(unit), ...(others.length ? [vertical(others.filter(Boolean).join(", "), { side: 1, scale: "right", grid: { show: false } })] : [])],
      series: [
        { label: "t [s]", value: (_, time) => (time == null ? "" : formatTime?.(time) ?? time.toFixed(2)) },
        ...bands.flatMap((band) => [edge(band), edge(band)]),
        ...series.map((each) => ({ ...line(each), scale: scaleOf(each) })),
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
    addWheel(made.over, (factor, at) => view.zoom(factor, made.posToVal(at, "x")), () => view.isWhole());
    const names = [...series, ...bands].map((each) => each.label).join(", ");
    describe(made, `${label} over time: ${names || "nothing"}`);
    made.root.querySelector(".u-legend")?.setAttribute("aria-hidden", "true");
    const entries = made.root.querySelectorAll(".u-legend .u-series");
    bands.forEach((_, k) => { entries[2 * k + 2].hidden = true; });
    return made;
  };

  // One channel against another. The scales follow the data until a zoom; a double click shows all.
  const plotXY = (home, { label, names, units, t, x, y, isTrack, shade: shadeAt = () => "--link", onTime, height = 320 }) => {
    const whole = [x, y].map((values) => {
      const known = values.filter((value) => value !== null);
      return range()(null, known.length ? Math.min(...known) : null, Math.max(...known));
    });
    let shown = whole;
    const ranges = ({ bbox }) => {
      if (!isTrack || !bbox?.width) return shown;
      const scale = Math.max((shown[0][1] - shown[0][0]) / bbox.width, (shown[1][1] - shown[1][0]) / bbox.height);
      return shown.map(([low, high], k) => [-0.5, 0.5].map((share) => 0.5 * (low + high) + share * scale * [bbox.width, bbox.height][k]));
    };
    const show = (next) => { shown = next; made.batch(() => ["x", "y"].forEach((key, k) => made.setScale(key, { min: shown[k][0], max: shown[k][1] }))); };
    const draw = ({ ctx, bbox, valToPos }) => {
      ctx.save();
      const frame = new Path2D();
      frame.rect(bbox.left, bbox.top, bbox.width, bbox.height);
      ctx.clip(frame);
      ctx.lineWidth = 1.5 * devicePixelRatio;
      let last;
      x.forEach((value, k) => {
        const point = value === null || y[k] === null ? undefined : [valToPos(value, "x", true), valToPos(y[k], "y", true)];
        ctx.strokeStyle = shade(shadeAt(t[k]));
        if (last && point) ctx.stroke(new Path2D(`M${last} L${point}`));
        last = point;
      });
      ctx.restore();
    };
    const title = (k) => `${names[k]}${units[k] ? ` [${units[k]}]` : ""}`;
    const made = new uPlot({
      width: Math.max(home.clientWidth, 200), height,
      scales: { x: { time: false, range: (plot) => ranges(plot)[0] }, y: { range: (plot) => ranges(plot)[1] } },
      axes: [axis({ size: 44, label: title(0), labelSize: 18, labelFont: "12px system-ui, sans-serif" }), axis({ size: 70, label: title(1), labelSize: 16, labelFont: "12px system-ui, sans-serif" })],
      series: [{}, { show: true, points: { show: false } }],
      cursor: { drag: { x: true, y: true, uni: 30, setScale: false }, points: { show: false }, bind: { dblclick: () => () => { show(whole); return null; } } },
      legend: { show: false },
      hooks: {
        draw: [draw],
        setSelect: [({ select: box, posToVal, setSelect }) => {
          if (box.width < 3 && box.height < 3) return;
          const spans = [[box.left, box.left + box.width].map((at) => posToVal(at, "x")), [box.top + box.height, box.top].map((at) => posToVal(at, "y"))];
          setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
          show(spans.map(([low, high], k) => (low < high ? [low, high] : shown[k])));
        }],
      },
    }, [whole[0], [null, null]], home);
    const words = home.appendChild(make("p", { className: "xy-values" }));
    const dot = made.over.appendChild(make("i", { className: "xy-dot", hidden: true }));
    const nearest = (distance) => t.reduce((best, _, k) => (x[k] !== null && y[k] !== null && distance(k) < (best < 0 ? Infinity : distance(best)) ? k : best), -1);
    const mark = (time) => {
      const k = time === null ? -1 : nearest((each) => Math.abs(t[each] - time));
      dot.hidden = k < 0;
      words.textContent = k < 0 ? "" : `t ${t[k].toFixed(2)} s: ${names[0]} ${short(x[k])}, ${names[1]} ${short(y[k])}`;
      if (k >= 0) Object.assign(dot.style, { left: `${made.valToPos(x[k], "x")}px`, top: `${made.valToPos(y[k], "y")}px` });
    };
    made.over.addEventListener("mousemove", () => {
      const k = nearest((each) => Math.hypot(made.valToPos(x[each], "x") - made.cursor.left, made.valToPos(y[each], "y") - made.cursor.top));
      if (k >= 0) { mark(t[k]); onTime?.(t[k]); }
    });
    addWheel(made.over, (factor, left, top) => {
      const at = [made.posToVal(left, "x"), made.posToVal(top, "y")];
      show(shown.map(([low, high], k) => [at[k] - factor * (at[k] - low), at[k] + factor * (high - at[k])]));
    }, () => shown.every(([low, high], k) => high - low > 0.999 * (whole[k][1] - whole[k][0])));
    describe(made, label);
    show(whole);
    return Object.assign(made, { mark });
  };
  return { PALETTE, make, decode, times, values, colour, makeView, addControls, plot, plotXY };
})();

// Panels of series that the server decimates: they ask it for the interval that they have in view.
// Any channel goes into any panel: by a select, by its button in a table, or by dragging that button.
//   element.dataset  panels: [[channel, ...], ...], empty for the track; units of channels
//   ask              (kind, names, view) -> document of series, or of a pair
//   isFixed          without controls; onSelect(low, high, zoom); hooks of uPlot; shade(time) of the track
seriesPlots.serve = (home, { ask, isFixed = false, onSelect, hooks = {}, shade, height = 150 } = {}) => {
  const { make, decode, times, values } = seriesPlots;
  const units = JSON.parse(home.dataset.units ?? "{}");
  const rows = () => [...document.querySelectorAll("[data-channel]")];
  const unitOf = (name) => rows().find((row) => row.dataset.channel === name)?.querySelector("[data-unit]")?.dataset.unit ?? (Object.hasOwn(units, name) ? units[name] : "");
  const KINDS = { time: "over time", xy: "XY", track: "track" };
  const panels = [];
  let active, view, marks = [], count = 0, asked = 0; // requests so far: an answer to an earlier one is late
  const activate = (panel) => {
    active = panel;
    for (const each of panels) each.place.classList.toggle("active", each === active && panels.length > 1);
    for (const row of rows()) row.querySelector("[data-toggle]")?.setAttribute("aria-pressed", active?.names.includes(row.dataset.channel) ?? false);
  };
  const toggle = (panel, name, isIn = panel.names.includes(name)) => {
    panel.names = isIn ? panel.names.filter((each) => each !== name) : [...panel.names, name];
    change(Object.assign(panel, { kind: panel.kind === "track" ? "time" : panel.kind }));
  };
  const change = (panel) => { fillHead(panel); activate(panel); load(); };
  const fillHead = (panel) => {
    if (isFixed) return;
    const kind = make("select", { ariaLabel: "Kind of plot" }, ...Object.entries(KINDS).map(([value, text]) => make("option", { value, textContent: text, selected: value === panel.kind })));
    kind.onchange = () => { panel.kind = kind.value; change(panel); panel.head.firstChild.focus(); };
    const chips = panel.kind === "track" ? [] : panel.names.map((name) => make("button", {
      type: "button", className: "chip", textContent: `${name} ×`, ariaLabel: `Remove ${name} from the panel`, onclick: () => toggle(panel, name),
    }));
    const rest = rows().map((row) => row.dataset.channel).filter((name) => !panel.names.includes(name));
    const add = make("select", { ariaLabel: "Add a channel to the panel" }, make("option", { textContent: "+ channel", value: "" }), ...rest.map((name) => make("option", { value: name, textContent: name })));
    add.onchange = () => { toggle(panel, add.value); panel.head.querySelectorAll("select")[1]?.focus(); };
    const remove = make("button", { type: "button", className: "remove", textContent: "Remove", ariaLabel: "Remove the panel" });
    remove.onclick = () => { panel.drawn?.destroy(); panel.place.remove(); panels.splice(panels.indexOf(panel), 1); activate(panels.at(-1)); };
    panel.head.replaceChildren(kind, ...chips, ...(panel.kind === "track" ? [] : [add]), remove);
  };
  const addPanel = (names, kind = names.length ? "time" : "track") => {
    count += 1;
    const panel = { names, kind, head: make("div", { className: "panel-head" }), plot: make("div", { className: "plot" }) };
    panel.place = make("section", { className: "panel", ariaLabel: `Panel ${count}` }, panel.head, panel.plot);
    for (const kindOfEvent of ["focusin", "pointerdown"]) panel.place.addEventListener(kindOfEvent, () => activate(panel));
    panel.place.ondragover = (event) => event.preventDefault();
    panel.place.ondrop = (event) => { event.preventDefault(); toggle(panel, event.dataTransfer.getData("text/plain"), false); };
    panels.push(panel);
    home.append(panel.place);
    return fillHead(panel) ?? panel;
  };
  const showTime = (time, panel) => {
    for (const { drawn } of panels.filter((each) => each !== panel && each.drawn)) {
      if (drawn.mark) drawn.mark(time);
      else if (panel.drawn?.mark) drawn.setCursor({ left: time === null ? -10 : drawn.valToPos(time, "x"), top: 0 });
    }
  };
  const draw = (panel, found) => {
    panel.drawn = panel.drawn?.destroy();
    panel.plot.replaceChildren();
    const say = (textContent) => panel.plot.append(make("p", { className: "hint", textContent }));
    if (panel.kind === "time") {
      const series = panel.names.filter((name) => Object.hasOwn(found.series, name)).map((name, k) => ({
        label: name, unit: unitOf(name), ...decode(found.series[name]), width: 1.25, colour: seriesPlots.PALETTE[k % seriesPlots.PALETTE.length],
      }));
      if (!series.length) return say("Add a channel by the list above, or by its name in the table.");
      const setCursor = ({ cursor, posToVal }) => showTime(cursor.left < 0 ? null : posToVal(cursor.left, "x"), panel);
      panel.drawn = seriesPlots.plot(panel.plot, { label: panel.names.join(", "), series, view, marks, height, select: onSelect && ((low, high) => onSelect(low, high, view.show)), hooks: { ...hooks, setCursor: [setCursor] } });
    } else if (panel.pair?.x) {
      const { pair } = panel;
      const isTrack = panel.kind === "track";
      const names = isTrack ? ["east", "north"] : panel.names;
      const about = isTrack ? { label: "Track, north against east", units: ["m", "m"], shade, isTrack } : { label: `${names[1]} against ${names[0]}`, units: names.map(unitOf) };
      panel.drawn = seriesPlots.plotXY(panel.plot, { ...about, names, t: times(pair.t), x: values(pair.x), y: values(pair.y), onTime: (time) => showTime(time, panel) });
    } else say(panel.pair?.text ?? "Choose two channels: the first is horizontal, the second vertical.");
  };
  async function load() {
    const request = (asked += 1);
    const names = new Set(panels.flatMap((panel) => (panel.kind === "time" ? panel.names : [])));
    const [found] = await Promise.all([ask("", [...names], view), ...panels.map(async (panel) => {
      const isPair = panel.kind === "track" || (panel.kind === "xy" && panel.names.length > 1);
      panel.pair = isPair ? await ask("/pair", panel.kind === "track" ? [] : panel.names.slice(0, 2), view) : undefined;
    })]);
    if (request < asked || found.start === undefined) return;
    view ??= seriesPlots.makeView([found.start, found.end], load);
    marks = found.marks;
    for (const panel of panels) draw(panel, found);
    document.getElementById("view").textContent = `${view.low.toFixed(1)} to ${view.high.toFixed(1)} s`;
    home.dataset.drawn = String(Number(home.dataset.drawn ?? 0) + 1);
  }
  for (const names of JSON.parse(home.dataset.panels)) addPanel(names);
  seriesPlots.addControls(home, () => view);
  document.getElementById("add-panel")?.addEventListener("click", () => { const panel = addPanel([], "time"); change(panel); panel.head.firstChild.focus(); });
  document.addEventListener("click", ({ target }) => { if ("toggle" in target.dataset) toggle(active ?? addPanel([], "time"), target.closest("[data-channel]").dataset.channel); });
  document.addEventListener("dragstart", ({ target, dataTransfer }) => { if (target.dataset && "toggle" in target.dataset) dataTransfer.setData("text/plain", target.closest("[data-channel]").dataset.channel); });
  window.addEventListener("resize", () => { for (const { drawn, plot } of panels) drawn?.setSize({ width: plot.clientWidth, height: drawn.height }); });
  const redraw = () => { for (const { drawn } of panels) drawn?.redraw(); };
  document.addEventListener("theme", redraw);
  activate(panels[0]);
  load();
  return { redraw, load };
};

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
    resize(); // the first plots were made before there were two columns
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
