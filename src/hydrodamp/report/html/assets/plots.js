"use strict";
// One plot a velocity: measured and replayed, one view and one cursor for all of them.
{
  const about = JSON.parse(document.getElementById("data").textContent);
  const levels = hydrodampLevels.open(about);
  const home = document.getElementById("plots");
  const tools = document.getElementById("tools");
  const choices = document.getElementById("shown");
  const DASHES = [[], [8, 4], [2, 3], [10, 3, 2, 3], [5, 2], [1, 4], [12, 4, 4, 4], [3, 6]];
  const HEIGHT = 150;
  const SYNC = "hydrodamp";
  const view = { from: levels.start, to: levels.stop };
  let shown = [1];
  let plots = [];

  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const lifted = (hex) => {
    const share = parseFloat(colour("--lift")) / 100;
    const part = (k) => Math.round(parseInt(hex.slice(k, k + 2), 16) * (1 - share) + 255 * share);
    return `rgb(${part(1)}, ${part(3)}, ${part(5)})`;
  };
  const place = (time) => {
    const part = about.segments.findLast((one) => one.start <= time) ?? about.segments[0];
    const since = Math.min(Math.max(time, part.start), part.stop) - part.start;
    return `${part.name} ${since.toFixed(2)} s`;
  };
  const short = (value) => (value == null ? "–" : Number(value.toPrecision(4)).toString());

  // A replay that runs away must not flatten what was measured: twice its span is enough.
  const limits = about.velocities.map((_, velocity) => {
    const known = levels.measured(velocity).filter((value) => value !== null);
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
  const lines = () => [
    { label: "time", value: (_, time) => (time == null ? "–" : place(time)) },
    { label: "measured", stroke: () => colour("--ink"), width: 1.5, points: { show: false }, value: (_, v) => short(v) },
    ...shown.map((series, order) => ({
      label: about.replays[series - 1].name,
      stroke: () => lifted(about.replays[series - 1].colour),
      width: 1.5,
      dash: DASHES[order % DASHES.length],
      points: { show: false },
      value: (_, v) => short(v),
    })),
  ];
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
    cursor: {
      sync: { key: SYNC, setSeries: false },
      y: false,
      drag: { x: true, y: false, setScale: false },
      bind: { dblclick: () => () => { look(levels.start, levels.stop); return null; } },
    },
    legend: { live: true, markers: { dash: (_, k) => (DASHES[Math.max(k - 2, 0) % DASHES.length].length ? "dashed" : "solid") } },
    hooks: { drawClear: [joins], setSelect: [selected] },
  });

  const look = (from, to) => {
    const whole = levels.stop - levels.start;
    const width = Math.min(Math.max(to - from, 1e-6 * whole), whole);
    view.from = Math.min(Math.max(from, levels.start), levels.stop - width);
    view.to = view.from + width;
    const level = levels.fitting(view.from, view.to);
    plots.forEach((plot, velocity) => plot.setData(levels.data(level, velocity, shown)));
    document.getElementById("view").textContent = `${place(view.from)} to ${place(view.to)}`;
    home.dataset.level = String(level);
  };
  const build = () => {
    for (const plot of plots) plot.destroy();
    home.replaceChildren();
    const level = levels.fitting(view.from, view.to);
    plots = about.velocities.map(({ name, unit }, velocity) => {
      const panel = document.createElement("div");
      panel.className = "plot";
      const title = document.createElement("h3");
      title.textContent = `${name} [${unit}]`;
      panel.append(title);
      home.append(panel);
      const plot = new uPlot(options(velocity), levels.data(level, velocity, shown), panel);
      const { canvas } = plot.ctx;
      canvas.setAttribute("role", "img");
      canvas.setAttribute("aria-label", `${name} in ${unit} over time, measured and as replayed`);
      plot.root.querySelector(".u-legend").setAttribute("aria-hidden", "true");
      return plot;
    });
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
    whole: () => look(levels.start, levels.stop),
    worst: () => look(...about.worst),
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
  choices.addEventListener("change", () => {
    shown = [...choices.querySelectorAll("input:checked")].map((box) => Number(box.value));
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
  document.addEventListener("theme", build); // marks of a legend keep the colour they were made with
  tools.hidden = false;
  choices.hidden = false;
  build();
}
