"use strict";
{
  const find = (selector, home = document) => home.querySelector(selector);
  const series = find("#series[data-series]");
  const say = (text) => find("#message").replaceChildren(Object.assign(document.createElement("div"), { className: "fault", textContent: text }));

  // Copy buttons, previews, dismissals: one listener, since htmx replaces parts of the page.
  document.addEventListener("click", async ({ target }) => {
    const { copy, preview, channel, add, value } = target.dataset;
    if (copy) {
      await navigator.clipboard.writeText(document.getElementById(copy).textContent).then(
        () => { target.textContent = "Copied"; }, () => { target.textContent = "Select the text to copy it"; });
    }
    if ("dismiss" in target.dataset) find("#message").replaceChildren();
    if (preview) showPreview(preview, channel);
    if (add) addInterval(add, value);
  });

  // Before and after a cleaning step.
  async function showPreview(step, channel) {
    const home = find("#preview");
    const query = new URLSearchParams({ step, channel });
    const answer = await fetch(`${document.body.dataset.project}/channels/preview?${query}`);
    if (!answer.ok) return say("The step cannot be previewed.");
    const found = await answer.json();
    home.replaceChildren();
    for (const [name, pair] of Object.entries(found.series)) {
      const place = document.createElement("div");
      home.append(Object.assign(document.createElement("h3"), { textContent: `${name} before and after ${step}` }), place);
      const [before, after] = pair.map(seriesPlots.decode);
      const lines = [{ label: "before", ...before, colour: "--faint" }, { label: "after", ...after }];
      const view = seriesPlots.makeView([before.x[0], before.x.at(-1)], (low, high) => plot.setScale("x", { min: low, max: high }));
      const plot = seriesPlots.plot(place, { label: `${name} before and after`, series: lines, view });
    }
    if (!Object.keys(found.series).length) home.textContent = "The step changes no channel.";
    home.scrollIntoView({ block: "nearest" });
  }

  // An error stays at its field until the field changes.
  document.addEventListener("input", ({ target }) => find(".field-error", target.closest(".field") ?? document.createElement("i"))?.replaceChildren());

  // The sketch of a vehicle has the numbers of the form.
  document.addEventListener("input", ({ target }) => { for (const text of document.querySelectorAll(`[data-of="${target.name}"]`)) text.textContent = target.value || "?"; });

  // The action of the first step counts the chosen logs.
  const opening = find("#open");
  const countLogs = () => {
    const chosen = new FormData(opening).getAll("log").join("\n").split("\n").filter((line) => line.trim()).length;
    Object.assign(find("#bar .primary"), { disabled: !chosen, textContent: chosen > 1 ? `Open ${chosen} logs` : "Open" });
    find("#selected").textContent = chosen ? "" : "Choose, drop or enter a log, or open the example.";
  };
  if (opening) for (const kind of ["input", "pageshow"]) window.addEventListener(kind, countLogs);

  // The menu of projects closes by a click elsewhere and by Escape.
  const switcher = find(".switcher");
  document.addEventListener("click", ({ target }) => { if (switcher && !switcher.contains(target)) switcher.open = false; });
  document.addEventListener("keydown", ({ key }) => { if (switcher?.open && key === "Escape") { switcher.open = false; find("summary", switcher).focus(); } });

  // A refused change shows what the file has.
  document.addEventListener("htmx:responseError", ({ detail }) => {
    if (detail.elt.matches("tr")) for (const option of detail.elt.querySelectorAll("option")) option.selected = option.defaultSelected;
  });

  // Dropped or chosen files go into the folder of logs.
  const drop = find("#drop");
  if (drop) {
    const paths = find("#paths");
    const send = async (files) => {
      const status = find("#uploads");
      for (const file of files) {
        status.textContent = `copying ${file.name}`;
        const answer = await fetch(`${drop.dataset.upload}?name=${encodeURIComponent(file.name)}`, { method: "PUT", body: file });
        if (!answer.ok) {
          const page = new DOMParser().parseFromString(await answer.text(), "text/html");
          say(page.body.textContent.trim().replace(/\s+Dismiss$/, ""));
          status.textContent = "";
          return;
        }
        paths.value = `${paths.value.trimEnd()}\n${(await answer.json()).path}`.trimStart();
      }
      status.textContent = `${files.length} copied`;
      countLogs();
    };
    find("#chooser").addEventListener("change", ({ target }) => send([...target.files]));
    drop.addEventListener("dragover", (event) => { event.preventDefault(); drop.classList.add("over"); });
    drop.addEventListener("dragleave", () => drop.classList.remove("over"));
    drop.addEventListener("drop", (event) => {
      event.preventDefault();
      drop.classList.remove("over");
      send([...event.dataTransfer.files]);
    });
  }

  // Intervals of training and test data.
  const form = find("#split");
  const lines = (side) => find(`#${side}`).value.split("\n").map((text) => text.trim()).filter(Boolean);
  function addInterval(side, text) {
    const area = find(`#${side}`);
    area.value = [...lines(side), text].join("\n");
    form.requestSubmit();
    plots.redraw();
  }
  const spans = (side) => {
    const segments = JSON.parse(series.dataset.segments);
    return lines(side).map((text) => {
      const segment = segments.find(([name]) => name === text);
      return segment ? segment.slice(1) : text.split(":").map(Number);
    }).filter(([low, high]) => low < high);
  };
  const SIDES = { train: "--train", test: "--test" };
  const shade = (plot) => {
    plot.ctx.save();
    plot.ctx.globalAlpha = 0.2;
    for (const [side, name] of Object.entries(SIDES)) {
      plot.ctx.fillStyle = seriesPlots.colour(name);
      for (const [low, high] of spans(side)) {
        const [left, right] = [Math.max(low, plot.scales.x.min), Math.min(high, plot.scales.x.max)].map((time) => plot.valToPos(time, "x", true));
        plot.ctx.fillRect(left, plot.bbox.top, Math.max(right - left, 0), plot.bbox.height);
      }
    }
    plot.ctx.restore();
  };
  let plots;
  if (series) {
    const ask = async (kind, names, view) => {
      const span = view ? [["start", view.low], ["end", view.high]] : [];
      const columns = (kind || names.length ? names : [""]).map((name) => ["column", name]);
      const answer = await fetch(`${document.body.dataset.project}/${series.dataset.series}${kind}?${new URLSearchParams([...span, ...columns])}`);
      return answer.ok ? answer.json() : { series: {}, text: "This cannot be drawn." };
    };
    const onSelect = (low, high, zoom) => {
      const side = new FormData(form).get("side");
      if (side) addInterval(side, `${low.toFixed(1)}:${high.toFixed(1)}`);
      else zoom(low, high);
    };
    const sideOf = (time) => Object.keys(SIDES).find((side) => spans(side).some(([low, high]) => low <= time && time <= high));
    const shadeTrack = (time) => SIDES[sideOf(time)] ?? "--line";
    plots = seriesPlots.serve(series, form ? { ask, isFixed: true, onSelect, hooks: { drawClear: [shade] }, shade: shadeTrack, height: 130 } : { ask });
    form?.addEventListener("input", () => plots.redraw());
  }
}
