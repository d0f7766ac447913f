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
  const unpack = (packed) => {
    if (!decoded.has(packed)) decoded.set(packed, values(packed));
    return decoded.get(packed);
  };
  const unpacked = (kind, first, second) => unpack(about[kind][first][second]);
  const time = times(about.time);
  const start = time[0];
  const stop = time[time.length - 1];
  // The edges of the band, where there is one, then the lines that are shown.
  const data = (velocity, shown) => [
    time,
    ...(hasBand() ? [0, 1] : []).map((side) => unpacked("edges", side, velocity)),
    ...shown.map((line) => (isResidual() ? residualOf(line, velocity) : unpacked("series", line, velocity))),
  ];
  const residualOf = (line, velocity) => {
    if (about.residuals.length) return unpacked("residuals", line - 1, velocity);
    const measured = unpacked("series", 0, velocity);
    return unpacked("series", line, velocity).map((value, k) => (value === null ? null : value - measured[k]));
  };
  const home = document.getElementById("plots");
  const tools = document.getElementById("tools");
  const choices = document.getElementById("shown");
  const band = document.getElementById("band"); // its box, where there is a band
  const residuals = document.getElementById("residuals");
  const isResidual = () => residuals.checked;
  const hasBand = () => Boolean(about.band) && !isResidual();
  const EDGES = [1, 2]; // the series that are its edges
  const HEIGHT = 150;
  const SYNC = "hydrodamp";
  const view = { from: start, to: stop };
  const checkedLines = () => [...choices.querySelectorAll("input[name=line]:checked")]
    .map((box) => Number(box.value))
    .filter((line) => line > 0 || !isResidual());
  let shown = checkedLines();
  let plots = [];
  let channelPlots = [];

  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const lighten = (hex, opacity = 1) => {
    const share = parseFloat(colour("--lift")) / 100;
    const component = (k) => Math.round(parseInt(hex.slice(k, k + 2), 16) * (1 - share) + 255 * share);
    return `rgba(${component(1)}, ${component(3)}, ${component(5)}, ${opacity})`;
  };
  const formatTime = (time) => {
    const segment = about.segments.findLast((each) => each.start <= time) ?? about.segments[0];
    const since = Math.min(Math.max(time, segment.start), segment.stop) - segment.start;
    return `${segment.name} ${since.toFixed(2)} s`;
  };
  const short = (value) => (value == null ? "" : Number(value.toPrecision(4)).toString());

  // A diverging replay must not flatten the measured velocity: ten times its span is shown.
  const limits = about.velocities.map((_, velocity) => {
    const known = unpacked("series", 0, velocity).filter((value) => value !== null);
    const low = known.reduce((a, b) => Math.min(a, b), Infinity);
    const high = known.reduce((a, b) => Math.max(a, b), -Infinity);
    const room = 4.5 * (high - low) || 1e-3;
    return { low: low - room, high: high + room };
  });
  const range = (velocity) => (_, low, high) => {
    const limit = isResidual() ? { low: -Infinity, high: Infinity } : limits[velocity];
    if (low == null && isResidual()) return [-1, 1];
    if (low == null) return [limit.low, limit.high];
    const [a, b] = [Math.max(low, limit.low), Math.min(high, limit.high)];
    if (!(a < b)) return isResidual() ? [a - 1e-3, a + 1e-3] : [limit.low, limit.high];
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
    return low == null ? "" : `${short(low)} to ${short(high)}`;
  };
  const edges = () => (hasBand() ? EDGES : []).map(() => ({
    label: about.band.name,
    stroke: () => lighten(about.band.colour, 0.6),
    width: 0.5,
    show: band.checked,
    points: { show: false },
    value: (plot, _, __, k) => between(plot, k),
  }));
  const lineName = (series, velocity) => {
    if (!series) return "measured";
    const { name, fits } = about.replays[series - 1];
    const fit = velocity === undefined ? null : fits[velocity];
    return fit == null ? name : `${name}, ${fit < 0 ? "<0" : Math.round(fit)} %`;
  };
  const line = (series, velocity) => ({
    label: lineName(series, velocity),
    stroke: () => (series ? lighten(about.replays[series - 1].colour) : colour("--ink")),
    dash: series ? about.replays[series - 1].dashes : [],
    width: 1.5,
    points: { show: false },
    value: (_, v) => short(v),
  });
  const clock = { label: "time", value: (_, time) => (time == null ? "" : formatTime(time)) };
  const lines = (velocity) => [clock, ...edges(), ...shown.map((series) => line(series, velocity))];
  // The legend has the samples of the boxes; of the two edges of the band one stands for both.
  const addSamples = (plot) => {
    const rows = [...plot.root.querySelectorAll(".u-legend .u-series")].slice(1);
    const boxes = [...(hasBand() ? [band, null] : []), ...shown.map((series) => choices.querySelector(`input[value="${series}"]`))];
    rows.forEach((row, k) => {
      if (boxes[k] === null) row.hidden = true;
      else row.firstChild.prepend(boxes[k].parentElement.querySelector("svg").cloneNode(true));
    });
  };
  const toggleBand = (plot, k, { show }) => {
    if (!hasBand() || !EDGES.includes(k) || show === undefined || show === band.checked) return;
    band.checked = show;
    showBand();
  };
  const showBand = () => {
    for (const plot of hasBand() ? plots : []) {
      for (const k of EDGES) if (plot.series[k].show !== band.checked) plot.setSeries(k, { show: band.checked });
    }
    describe();
  };
  // What the plots show, for those who cannot see them.
  const describe = () => {
    const names = [...shown.map((series) => lineName(series)), ...(hasBand() && band.checked ? [about.band.name] : [])];
    plots.forEach((plot, velocity) => {
      const title = panelTitle(velocity);
      plot.root.parentElement.querySelector("h3").textContent = title;
      plot.ctx.canvas.setAttribute("aria-label", `${title} over time: ${names.join(", ") || "nothing"}`);
    });
  };
  const drawJoins = (plot) => {
    const { ctx, bbox } = plot;
    ctx.save();
    ctx.strokeStyle = colour("--faint");
    ctx.setLineDash([2, 4]);
    for (const segment of about.segments.slice(1)) {
      const x = plot.valToPos(segment.start, "x", true);
      if (x < bbox.left || x > bbox.left + bbox.width) continue;
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
    }
    ctx.restore();
  };
  const zoomToSelection = (plot) => {
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
    series: lines(velocity),
    bands: hasBand() ? [{ series: [2, 1], fill: () => lighten(about.band.colour, 0.22) }] : [],
    cursor: {
      sync: { key: SYNC, setSeries: false },
      y: false,
      drag: { x: true, y: false, setScale: false },
      bind: { dblclick: () => () => { look(start, stop); return null; } },
    },
    legend: { live: true, markers: { show: false } },
    hooks: { ready: [addSamples], drawClear: [drawJoins], setSelect: [zoomToSelection], setSeries: [toggleBand] },
  });

  const look = (from, to) => {
    const whole = stop - start;
    const width = Math.min(Math.max(to - from, 1e-6 * whole), whole);
    view.from = Math.min(Math.max(from, start), stop - width);
    view.to = view.from + width;
    for (const plot of [...plots, ...channelPlots]) plot.setScale("x", { min: view.from, max: view.to });
    document.getElementById("view").textContent = `${formatTime(view.from)} to ${formatTime(view.to)}`;
  };
  const addPanel = (text) => {
    const panel = document.createElement("div");
    panel.className = "plot";
    const title = document.createElement("h3");
    title.textContent = text;
    panel.append(title);
    home.append(panel);
    return panel;
  };
  const isCut = (velocity) => !isResidual()
    && [...shown.map((line) => unpacked("series", line, velocity)),
      ...(hasBand() && band.checked ? [0, 1] : []).map((side) => unpacked("edges", side, velocity))]
      .some((values) => values.some((value) => value !== null
        && (value < limits[velocity].low || value > limits[velocity].high)));
  const panelTitle = (velocity) => {
    const { name, unit } = about.velocities[velocity];
    const cut = isCut(velocity) ? ", lines are cut at ten times the measured range" : "";
    return `${isResidual() ? "residual of " : ""}${name} [${unit}]${cut}`;
  };
  // Actuation and depth of the test data, below the velocities.
  const addChannels = ({ label, downward, names, series }) => {
    const panel = addPanel(label);
    const plot = new uPlot({
      ...options(0),
      scales: { x: { time: false, range: () => [view.from, view.to] }, y: { dir: downward ? -1 : 1 } },
      series: [clock, ...names.map((name, k) => ({
        label: name,
        stroke: () => lighten(about.palette[k % about.palette.length]),
        width: 1,
        points: { show: false },
        value: (_, v) => short(v),
      }))],
      bands: [],
      hooks: { drawClear: [drawJoins], setSelect: [zoomToSelection] },
      legend: { live: true },
    }, [time, ...series.map(unpack)], panel);
    plot.ctx.canvas.setAttribute("role", "img");
    plot.ctx.canvas.setAttribute("aria-label", `${label} over time: ${names.join(", ")}`);
    plot.root.querySelector(".u-legend").setAttribute("aria-hidden", "true");
    return plot;
  };
  const build = () => {
    for (const plot of [...plots, ...channelPlots]) plot.destroy();
    home.replaceChildren();
    plots = about.velocities.map((_, velocity) => {
      const panel = addPanel(panelTitle(velocity));
      const plot = new uPlot(options(velocity), data(velocity, shown), panel);
      plot.ctx.canvas.setAttribute("role", "img");
      plot.root.querySelector(".u-legend").setAttribute("aria-hidden", "true");
      return plot;
    });
    channelPlots = about.channels.map(addChannels);
    describe();
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
  const actions = {
    whole: () => look(start, stop),
    in: () => zoom(0.5),
    out: () => zoom(2),
    earlier: () => move(-0.5),
    later: () => move(0.5),
  };
  const keys = {
    ArrowLeft: () => move(-0.2), ArrowRight: () => move(0.2),
    "+": actions.in, "=": actions.in, "-": actions.out, 0: actions.whole, Home: actions.whole,
  };
  tools.addEventListener("click", (event) => actions[event.target.dataset.do]?.());
  home.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || !(event.key in keys)) return;
    event.preventDefault();
    keys[event.key]();
  });
  choices.addEventListener("change", ({ target }) => {
    if (target === band) return showBand();
    shown = checkedLines();
    build();
  });
  const resize = () => {
    for (const plot of [...plots, ...channelPlots]) plot.setSize({ width: home.clientWidth, height: HEIGHT });
  };
  window.addEventListener("resize", resize);
  // Browsers print a canvas line by line, dash by dash; of noise that takes minutes. So print gets
  // pictures. This comes after the listener of the theme, when the plots are drawn in light.
  window.addEventListener("beforeprint", () => {
    for (const plot of [...plots, ...channelPlots]) {
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
