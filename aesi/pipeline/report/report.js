// Draws the figures of the page: theme from the style sheet, the envelope of the visible samples on every zoom.
(function () {
  "use strict";
  const payload = JSON.parse(document.getElementById("payload").textContent);
  const types = { f8: Float64Array, f4: Float32Array };
  const NARROW = 420; // px; below, the buttons would cover the legend
  const decoded = {};
  const drawn = new Set();

  function samples(id) {
    if (!decoded[id]) {
      const { dtype, data } = payload.arrays[id];
      const bytes = Uint8Array.from(atob(data), (character) => character.charCodeAt(0));
      decoded[id] = new types[dtype](bytes.buffer);
    }
    return decoded[id];
  }

  function variable(name) {
    return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  }

  // Python draws with the light palette; on a dark page the hues that would sink are lifted.
  function themed(name) {
    const swaps = { "#1f2328": "--ink", "#000000": "--ink", "#0072B2": "--blue", "#D55E00": "--vermillion", "#009E73": "--green" };
    let text = JSON.stringify(payload.figures[name]);
    for (const [colour, token] of Object.entries(swaps)) text = text.replaceAll(colour, variable(token));
    const figure = JSON.parse(text);
    const axis = { gridcolor: variable("--grid"), linecolor: variable("--rule"), zerolinecolor: variable("--soft"), zerolinewidth: 1 };
    const label = { bgcolor: variable("--panel"), bordercolor: variable("--rule"), font: { color: variable("--ink") } };
    figure.layout.template = {
      layout: {
        font: { family: getComputedStyle(document.body).fontFamily, size: 12, color: variable("--ink") },
        paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
        xaxis: { ...axis, zeroline: false }, yaxis: { ...axis, zeroline: false }, hoverlabel: label,
        legend: { bgcolor: "rgba(0,0,0,0)" },
        modebar: { bgcolor: "rgba(0,0,0,0)", color: variable("--soft"), activecolor: variable("--ink") },
      },
    };
    return figure;
  }

  // The same rule as aesi/pipeline/report/arrays/decimate.py, over the samples from `low` to `high`.
  function envelope(x, y, low, high, limit, keep) {
    const rows = [];
    if (high - low <= limit) {
      for (let i = low; i < high; i++) rows.push(i);
    } else {
      const buckets = Math.max(Math.floor((limit - 2) / 2), 1);
      rows.push(low);
      for (let b = 0; b < buckets; b++) {
        const from = low + Math.floor((b * (high - low)) / buckets);
        const to = low + Math.floor(((b + 1) * (high - low)) / buckets);
        let smallest = from, largest = from;
        for (let i = from; i < to; i++) {
          if (y[i] < y[smallest] || isNaN(y[smallest])) smallest = i;
          if (y[i] > y[largest] || isNaN(y[largest])) largest = i;
        }
        if (keep === "min") rows.push(smallest);
        else if (keep === "max") rows.push(largest);
        else rows.push(Math.min(smallest, largest), Math.max(smallest, largest));
      }
      rows.push(high - 1);
    }
    return { x: rows.map((i) => x[i]), y: rows.map((i) => y[i]) };
  }

  function position(x, value) {
    let low = 0, high = x.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (x[middle] < value) low = middle + 1; else high = middle;
    }
    return low;
  }

  // All time axes of a figure move together, so one range serves them all; null means the whole record.
  function zoomed(div) {
    const axes = Object.keys(div._fullLayout).filter((key) => /^xaxis\d*$/.test(key));
    const axis = axes.map((key) => div._fullLayout[key]).find((candidate) => !candidate.autorange);
    return { range: axis ? axis.range.map(Number) : null, axes };
  }

  function refine(div) {
    const { range, axes } = zoomed(div);
    const update = { x: [], y: [] }, indices = [];
    div.data.forEach((trace, index) => {
      const meta = trace.meta;
      if (!meta || !meta.x) return;
      const x = samples(meta.x), y = samples(meta.y);
      const low = range ? Math.max(position(x, range[0]) - 1, 0) : 0;
      const high = range ? Math.min(position(x, range[1]) + 1, x.length) : x.length;
      const shown = envelope(x, y, Math.min(low, x.length - 1), Math.max(high, low + 1), meta.limit, meta.keep);
      update.x.push(shown.x); update.y.push(shown.y); indices.push(index);
    });
    if (!indices.length) return;
    const layout = {};
    if (range) for (const key of axes) layout[key + ".range"] = range;
    Plotly.update(div, update, layout, indices);
  }

  function draw(div) {
    const name = div.dataset.figure;
    const figure = themed(name);
    const options = {
      responsive: true, displaylogo: false, scrollZoom: false,
      displayModeBar: div.clientWidth < NARROW ? false : "hover",
      modeBarButtons: [["toImage", "zoom2d", "pan2d", "resetScale2d"]],
      toImageButtonOptions: { format: "svg", filename: name },
    };
    try {
      Plotly.react(div, figure.data, figure.layout, options);
    } catch (problem) {
      div.textContent = "This figure could not be drawn: " + problem.message;
      div.classList.add("failed");
      console.error(name, problem);
      return;
    }
    if (!drawn.has(div)) {
      drawn.add(div);
      let waiting;
      div.on("plotly_relayout", (change) => {
        if (!Object.keys(change).some((key) => key.startsWith("xaxis"))) return;
        clearTimeout(waiting);
        waiting = setTimeout(() => refine(div), 60);
      });
    }
  }

  const plots = Array.from(document.querySelectorAll(".plot"));
  const visible = (div) => !div.closest("details:not([open])");

  // One figure a turn, so that the page can be scrolled while the rest is drawn.
  function drawRest(queue) {
    const next = queue.shift();
    if (!next) { document.documentElement.dataset.plots = "drawn"; return; }
    draw(next);
    setTimeout(() => drawRest(queue), 0);
  }
  drawRest(plots.filter(visible));

  for (const details of document.querySelectorAll("details")) {
    details.addEventListener("toggle", () => {
      if (details.open) plots.filter((div) => details.contains(div) && !drawn.has(div)).forEach(draw);
    });
  }
  const redraw = () => plots.filter((div) => drawn.has(div)).forEach(draw);
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  window.addEventListener("beforeprint", () => {
    for (const details of document.querySelectorAll("details")) details.open = true;
    plots.filter((div) => !drawn.has(div)).forEach(draw);
  });
  window.matchMedia("print").addEventListener("change", redraw);
})();
