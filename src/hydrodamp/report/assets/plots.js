"use strict";
// One plot a velocity: measured and replayed, one view and one cursor for all of them.
{
  const about = JSON.parse(document.getElementById("data").textContent);
  const bytes = (text) => new DataView(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);
  const times = (text) => {
    const view = bytes(text);
    return Array.from({ length: view.byteLength / 8 }, (_, k) => view.getFloat64(8 * k, true));
  };
  const NOTHING = 65535; // a packed value that is not there
  const values = ({ low, step, steps }) => {
    const view = bytes(steps);
    return Array.from({ length: view.byteLength / 2 }, (_, k) => {
      const count = view.getUint16(2 * k, true);
      return count === NOTHING ? null : low + step * count;
    });
  };
  const decoded = new Map(); // a series is unpacked when it is first shown
  const unpacked = (kind, first, second) => {
    const key = `${kind} ${first} ${second}`;
    if (!decoded.has(key)) decoded.set(key, values(about[kind][first][second]));
    return decoded.get(key);
  };
  const time = times(about.time);
  const start = time[0];
  const stop = time[time.length - 1];
  // The edges of the band, where there is one, then the lines that are shown.
  const data = (velocity, shown) => [
    time,
    ...(about.band ? [0, 1] : []).map((side) => unpacked("edges", side, velocity)),
    ...shown.map((line) => unpacked("series", line, velocity)),
  ];
  const home = document.getElementById("plots");
  const tools = document.getElementById("tools");
  const choices = document.getElementById("shown");
  const band = document.getElementById("band"); // its box, where there is a band
  const EDGES = [1, 2]; // the series that are its edges
  const HEIGHT = 150;
  const SYNC = "hydrodamp";
  const view = { from: start, to: stop };
  const chosen = () => [...choices.querySelectorAll("input[name=line]:checked")].map((box) => Number(box.value));
  let shown = chosen();
  let plots = [];

  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const lifted = (hex, opacity = 1) => {
    const share = parseFloat(colour("--lift")) / 100;
    const part = (k) => Math.round(parseInt(hex.slice(k, k + 2), 16) * (1 - share) + 255 * share);
    return `rgba(${part(1)}, ${part(3)}, ${part(5)}, ${opacity})`;
  };
  const place = (time) => {
    const part = about.segments.findLast((one) => one.start <= time) ?? about.segments[0];
    const since = Math.min(Math.max(time, part.start), part.stop) - part.start;
    return `${part.name} ${since.toFixed(2)} s`;
  };
  const short = (value) => (value == null ? "–" : Number(value.toPrecision(4)).toString());

  // A replay that runs away must not flatten what was measured: twice its span is enough.
  const limits = about.velocities.map((_, velocity) => {
    const known = unpacked("series", 0, velocity).filter((value) => value !== null);
    const low = known.reduce((a, b) => Math.min(a, b), Infinity);
    const high = known.reduce((a, b) => Math.max(a, b), -Infinity);
    const room = 0.5 * (high - low) || 1e-3;
    return { low: low - room, high: high + room };
  });
  const range = (velocity) => (_, low, high) => {
    const limit = limits[velocity];
    if (low == null) return [limit.low, limit.high];
    const [a, b] = [Math.max(low, limit.low), Math.min(high, limit.high)];
    if (!(a < b)) return [limit.low, limit.high];
    return [a - 0.06 * (b - a), b + 0.06 * (b - a)];
  };

  const axis = (extra) => ({
    stroke: () => colour("--faint"),
    grid: { stroke: () => colour("--line"), width: 1 },
    ticks: { stroke: () => colour("--line"), width: 1 },
    font: "12px system-ui, sans-serif",
    ...extra,
  });
  const between = (plot, k) => {
    const [low, high] = EDGES.map((edge) => (k == null ? null : plot.data[edge][k]));
    return low == null ? "–" : `${short(low)} to ${short(high)}`;
  };
  const edges = () => (band ? EDGES : []).map(() => ({
    label: about.band.name,
    stroke: () => lifted(about.band.colour, 0.6),
    width: 0.5,
    show: band.checked,
    points: { show: false },
    value: (plot, _, __, k) => between(plot, k),
  }));
  const line = (series) => ({
    label: series ? about.replays[series - 1].name : "measured",
    stroke: () => (series ? lifted(about.replays[series - 1].colour) : colour("--ink")),
    dash: series ? about.replays[series - 1].dashes : [],
    width: 1.5,
    points: { show: false },
    value: (_, v) => short(v),
  });
  const lines = () => [
    { label: "time", value: (_, time) => (time == null ? "–" : place(time)) },
    ...edges(),
    ...shown.map(line),
  ];
  // The legend has the samples of the boxes; of the two edges of the band one stands for both.
  const sampled = (plot) => {
    const rows = [...plot.root.querySelectorAll(".u-legend .u-series")].slice(1);
    const boxes = [...(band ? [band, null] : []), ...shown.map((series) => choices.querySelector(`input[value="${series}"]`))];
    rows.forEach((row, k) => {
      if (boxes[k] === null) row.hidden = true;
      else row.firstChild.prepend(boxes[k].parentElement.querySelector("svg").cloneNode(true));
    });
  };
  const toggled = (plot, k, { show }) => {
    if (!band || !EDGES.includes(k) || show === undefined || show === band.checked) return;
    band.checked = show;
    banded();
  };
  const banded = () => {
    for (const plot of plots) {
      for (const k of EDGES) if (plot.series[k].show !== band.checked) plot.setSeries(k, { show: band.checked });
    }
    described();
  };
  // What the plots show, for those who cannot see them.
  const described = () => {
    const names = [...shown.map((series) => line(series).label), ...(band?.checked ? [about.band.name] : [])];
    plots.forEach((plot, velocity) => {
      const { name, unit } = about.velocities[velocity];
      plot.ctx.canvas.setAttribute("aria-label", `${name} in ${unit} over time: ${names.join(", ") || "nothing"}`);
    });
  };
  const joins = (plot) => {
    const { ctx, bbox } = plot;
    ctx.save();
    ctx.strokeStyle = colour("--faint");
    ctx.setLineDash([2, 4]);
    for (const part of about.segments.slice(1)) {
      const x = plot.valToPos(part.start, "x", true);
      if (x < bbox.left || x > bbox.left + bbox.width) continue;
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
    }
    ctx.restore();
  };
  const selected = (plot) => {
    if (plot.select.width < 4) return;
    const from = plot.posToVal(plot.select.left, "x");
    const to = plot.posToVal(plot.select.left + plot.select.width, "x");
    plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    look(from, to);
  };
  const options = (velocity) => ({
    width: home.clientWidth,
    height: HEIGHT,
    scales: { x: { time: false, range: () => [view.from, view.to] }, y: { range: range(velocity) } },
    axes: [
      axis({ size: 28, values: (_, marks) => marks.map((mark) => `${mark} s`) }),
      axis({ size: 58, space: 24 }),
    ],
    series: lines(),
    bands: band ? [{ series: [2, 1], fill: () => lifted(about.band.colour, 0.22) }] : [],
    cursor: {
      sync: { key: SYNC, setSeries: false },
      y: false,
      drag: { x: true, y: false, setScale: false },
      bind: { dblclick: () => () => { look(start, stop); return null; } },
    },
    legend: { live: true, markers: { show: false } },
    hooks: { ready: [sampled], drawClear: [joins], setSelect: [selected], setSeries: [toggled] },
  });

  const look = (from, to) => {
    const whole = stop - start;
    const width = Math.min(Math.max(to - from, 1e-6 * whole), whole);
    view.from = Math.min(Math.max(from, start), stop - width);
    view.to = view.from + width;
    for (const plot of plots) plot.setScale("x", { min: view.from, max: view.to });
    document.getElementById("view").textContent = `${place(view.from)} to ${place(view.to)}`;
  };
  const build = () => {
    for (const plot of plots) plot.destroy();
    home.replaceChildren();
    plots = about.velocities.map(({ name, unit }, velocity) => {
      const panel = document.createElement("div");
      panel.className = "plot";
      const title = document.createElement("h3");
      title.textContent = `${name} [${unit}]`;
      panel.append(title);
      home.append(panel);
      const plot = new uPlot(options(velocity), data(velocity, shown), panel);
      plot.ctx.canvas.setAttribute("role", "img");
      plot.root.querySelector(".u-legend").setAttribute("aria-hidden", "true");
      return plot;
    });
    described();
    look(view.from, view.to);
  };

  const middle = () => 0.5 * (view.from + view.to);
  const zoom = (factor) => {
    const half = 0.5 * factor * (view.to - view.from);
    look(middle() - half, middle() + half);
  };
  const move = (share) => {
    const step = share * (view.to - view.from);
    look(view.from + step, view.to + step);
  };
  const deeds = {
    whole: () => look(start, stop),
    in: () => zoom(0.5),
    out: () => zoom(2),
    earlier: () => move(-0.5),
    later: () => move(0.5),
  };
  const keys = {
    ArrowLeft: () => move(-0.2), ArrowRight: () => move(0.2),
    "+": deeds.in, "=": deeds.in, "-": deeds.out, 0: deeds.whole, Home: deeds.whole,
  };
  tools.addEventListener("click", (event) => deeds[event.target.dataset.do]?.());
  home.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || !(event.key in keys)) return;
    event.preventDefault();
    keys[event.key]();
  });
  choices.addEventListener("change", ({ target }) => {
    if (target === band) return banded();
    shown = chosen();
    build();
  });
  const resize = () => {
    for (const plot of plots) plot.setSize({ width: home.clientWidth, height: HEIGHT });
  };
  window.addEventListener("resize", resize);
  // Browsers print a canvas line by line, dash by dash; of noise that takes minutes. So print gets
  // pictures. This comes after the listener of the theme, when the plots are drawn in light.
  window.addEventListener("beforeprint", () => {
    for (const plot of plots) {
      const copy = document.createElement("img");
      copy.className = "copy";
      copy.alt = plot.ctx.canvas.getAttribute("aria-label");
      copy.src = plot.ctx.canvas.toDataURL("image/png");
      plot.root.querySelector(".u-wrap").append(copy);
    }
  });
  document.addEventListener("theme", build);
  tools.hidden = false;
  choices.hidden = false;
  build();
}
