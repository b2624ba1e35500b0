"use strict";
(() => {
  // Colours keep a contrast of at least 3:1 to the paper of their scheme and differ in lightness too;
  // dashes tell the models apart without colour.
  const light = {
    paper: "#ffffff", ink: "#1b1f24", grid: "#e3e7eb", axis: "#8c959f",
    series: "#b3261e", brush: "#1a7f37", lugre: "#0b57c2", lugre_patch: "#7a3fb8", modified_lugre: "#8a5a00",
    measured: "#4a5568", reference: "#8c959f", band: "rgba(179,38,30,0.18)",
  };
  const dark = {
    paper: "#14171c", ink: "#e6e9ed", grid: "#2b323b", axis: "#6e7883",
    series: "#ff7b72", brush: "#56d364", lugre: "#79b8ff", lugre_patch: "#d2a8ff", modified_lugre: "#e3b341",
    measured: "#aab4c0", reference: "#8b95a1", band: "rgba(255,123,114,0.22)",
  };
  const dash = {
    series: "solid", brush: "dashdot", lugre: "solid", lugre_patch: "dot", modified_lugre: "dash",
    measured: "solid", reference: "dot", band: "solid",
  };
  const symbol = { measured: "circle", series: "diamond", reference: "cross" };
  const width = { series: 2, measured: 1.4, reference: 1.4, band: 0 };
  const query = window.matchMedia("(prefers-color-scheme: dark)");
  const scheme = () => (query.matches ? dark : light);

  // "friction torque, N m" has its unit behind the last comma.
  const unit = (title) => (title.includes(", ") ? " " + title.slice(title.lastIndexOf(", ") + 2) : "");
  const narrow = () => document.documentElement.clientWidth < 600;
  const axis = (n) => (n === 0 ? "" : String(n + 1));

  function layout(chart, c) {
    const rows = chart.panels.length;
    const gap = 0.05;
    const height = (1 - gap * (rows - 1)) / rows;
    const out = {
      paper_bgcolor: c.paper, plot_bgcolor: c.paper,
      font: { color: c.ink, size: narrow() ? 11 : 13, family: getComputedStyle(document.body).fontFamily },
      margin: narrow() ? { l: 44, r: 6, t: 60, b: 44 } : { l: 72, r: 16, t: 60, b: 52 },
      legend: { orientation: "h", y: 1.0, yanchor: "bottom", x: 0, bgcolor: "rgba(0,0,0,0)" },
      hovermode: "x", dragmode: "zoom",
      hoverlabel: { bgcolor: c.paper, bordercolor: c.axis, font: { color: c.ink } },
    };
    const common = {
      gridcolor: c.grid, linecolor: c.axis, zerolinecolor: c.axis, tickcolor: c.axis, ticks: "outside",
      showline: true, zeroline: false, automargin: true,
    };
    out.xaxis = { ...common, title: { text: chart.x }, anchor: "y" + axis(rows - 1), exponentformat: "none" };
    if (chart.log) out.xaxis.type = "log";
    chart.panels.forEach((title, row) => {
      const top = 1 - row * (height + gap);
      out["yaxis" + axis(row)] = { ...common, title: { text: title }, domain: [Math.max(0, top - height), top] };
    });
    if (chart.windows.length) out.xaxis.range = toAxis(chart, chart.windows[0].range);
    return out;
  }

  const toAxis = (chart, range) => (chart.log ? range.map(Math.log10) : range);

  // Means of what was measured stand against a law as points.
  function mode(chart, t) {
    if (!chart.counts.length || t.role === "band") return "lines";
    const alone = chart.traces.filter((other) => other.row === t.row).length === 1;
    if (alone) return "lines+markers";
    return t.role === "measured" ? "markers" : "lines";
  }

  function traces(chart, c) {
    return chart.traces.map((t) => ({
      type: "scatter", mode: mode(chart, t), name: t.name, legendgroup: t.name, showlegend: t.legend, x: t.x, y: t.y,
      yaxis: "y" + axis(t.row), xaxis: "x",
      line: { color: c[t.role], dash: dash[t.role], width: width[t.role] || 1.7 },
      marker: { color: c[t.role], size: 7, symbol: symbol[t.role] || "circle" },
      customdata: chart.counts,
      ...(t.role === "band" ? { fill: "toself", fillcolor: c.band, hoverinfo: "skip" } : {}),
      hovertemplate: `%{y:.5~g}${unit(chart.panels[t.row])} at %{x:.6~g}${unit(chart.x)}`
        + (chart.counts.length ? ", mean of %{customdata} samples" : ""),
    }));
  }

  // The range of y that the lines of a panel cover in a range of x, with a margin.
  function span(chart, row, [from, to]) {
    let low = Infinity;
    let high = -Infinity;
    for (const t of chart.traces) {
      if (t.row !== row) continue;
      for (let i = 0; i < t.x.length; i++) {
        const near = t.x[i] >= from && t.x[i] <= to;
        const next = i > 0 && t.x[i - 1] < from && t.x[i] > to;
        if ((near || next) && t.y[i] !== null) {
          low = Math.min(low, t.y[i]);
          high = Math.max(high, t.y[i]);
        }
      }
    }
    if (!(high > low)) return null;
    const margin = 0.06 * (high - low);
    return [low - margin, high + margin];
  }

  function show(div, chart, range) {
    const change = { "xaxis.range": toAxis(chart, range), "xaxis.autorange": false };
    chart.panels.forEach((_, row) => {
      const y = span(chart, row, range);
      if (y) change["yaxis" + axis(row) + ".range"] = y;
    });
    return Plotly.relayout(div, change);
  }

  function everything(div, chart) {
    const change = { "xaxis.autorange": true };
    chart.panels.forEach((_, row) => { change["yaxis" + axis(row) + ".autorange"] = true; });
    return Plotly.relayout(div, change);
  }

  function keys(div, chart) {
    div.tabIndex = 0;
    div.setAttribute("role", "group");
    div.setAttribute("aria-label", chart.title + ": arrow keys move, plus and minus zoom, 0 shows everything");
    div.addEventListener("keydown", (event) => {
      const [from, to] = div.layout.xaxis.range;
      const size = to - from;
      const moves = {
        ArrowLeft: [from - 0.2 * size, to - 0.2 * size],
        ArrowRight: [from + 0.2 * size, to + 0.2 * size],
        "+": [from + 0.25 * size, to - 0.25 * size],
        "=": [from + 0.25 * size, to - 0.25 * size],
        "-": [from - 0.5 * size, to + 0.5 * size],
      };
      if (event.key === "0") {
        everything(div, chart);
      } else if (moves[event.key]) {
        Plotly.relayout(div, { "xaxis.range": moves[event.key] });
      } else {
        return;
      }
      event.preventDefault();
    });
  }

  const drawn = [];
  function draw(script) {
    const div = document.getElementById(script.dataset.chart);
    const chart = JSON.parse(script.textContent);
    const c = scheme();
    const config = { displaylogo: false, responsive: true, scrollZoom: false, doubleClick: "autosize",
      modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"] };
    const ready = Plotly.newPlot(div, traces(chart, c), layout(chart, c), config);
    if (chart.windows.length) ready.then(() => show(div, chart, chart.windows[0].range));
    if (chart.windows.length > 1) {
      const bar = document.createElement("div");
      bar.className = "windows";
      for (const w of chart.windows) {
        const button = document.createElement("button");
        button.type = "button";
        button.textContent = w.label;
        button.addEventListener("click", () => show(div, chart, w.range));
        bar.append(button);
      }
      div.before(bar);
    }
    keys(div, chart);
    drawn.push([div, chart]);
  }

  // Charts are drawn when they come near the view: a page with many of them opens at once.
  const scripts = document.querySelectorAll("script[data-chart]");
  const watcher = new IntersectionObserver((entries) => {
    for (const entry of entries) {
      if (!entry.isIntersecting) continue;
      watcher.unobserve(entry.target);
      draw(document.querySelector(`script[data-chart="${entry.target.id}"]`));
    }
  }, { rootMargin: "1200px" });
  for (const script of scripts) watcher.observe(document.getElementById(script.dataset.chart));
  window.addEventListener("beforeprint", () => {
    for (const script of scripts) {
      const div = document.getElementById(script.dataset.chart);
      if (!drawn.some(([d]) => d === div)) { watcher.unobserve(div); draw(script); }
    }
  });

  query.addEventListener("change", () => {
    const c = scheme();
    for (const [div, chart] of drawn) {
      const style = traces(chart, c).map((t) => t.line.color);
      Plotly.restyle(div, { "line.color": style, fillcolor: style });
      const next = layout(chart, c);
      const change = { paper_bgcolor: c.paper, plot_bgcolor: c.paper, font: next.font, hoverlabel: next.hoverlabel };
      for (const name of ["xaxis", ...chart.panels.map((_, row) => "yaxis" + axis(row))]) {
        for (const key of ["gridcolor", "linecolor", "zerolinecolor", "tickcolor"]) change[name + "." + key] = next[name][key];
      }
      Plotly.relayout(div, change);
    }
  });
})();
