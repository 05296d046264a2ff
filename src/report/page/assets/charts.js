// Interactive charts over time; their cursors move together, and a click moves the view to that time.
const CHART_HEIGHT = 220;
const chartSync = vendor.uPlot.sync("time");
const plots = [];

const LOOKS = {
  estimate: { colour: "estimate", width: 1.5 },
  truth: { colour: "truth", width: 1.5, dash: [7, 5] },
  second: { colour: "second", width: 1.2 },
  bound: { colour: "bound", width: 1, fill: "band", dash: [2, 2] },
  "band-top": { colour: "band", width: 0.5 },
  "band-bottom": { colour: "band", width: 0.5 },
  limit: { colour: "limit", width: 1.5, dash: [2, 4] },
};

const columns = ({ t, curves, log }) => {
  const values = (text) => Array.from(floats(text), (y) => (Number.isFinite(y) && (!log || y > 0) ? y : null));
  return [Array.from(floats(t)), ...curves.map(({ y }) => values(y))];
};

// A curve of a chart in the colours of the theme.
const series = ({ name, style }) => {
  const { colour, width, dash, fill } = LOOKS[style];
  return {
    label: name,
    stroke: () => themeColour(colour),
    fill: fill && (() => themeColour(fill)),
    width,
    dash,
    points: { show: false },
    spanGaps: false,
  };
};

// The band between the upper and the lower edge.
const bands = (curves) => {
  const top = curves.findIndex(({ style }) => style === "band-top");
  return top < 0 ? [] : [{ series: [top + 1, top + 2], fill: () => themeColour("band") }];
};

// A tick of a logarithmic axis: powers of ten only.
const powers = (plot, splits) =>
  splits.map((y) => (y > 0 && Math.abs(Math.log10(y) % 1) < 1e-9 ? (y < 0.01 ? y.toExponential(0) : String(y)) : ""));

const axis = (label) => ({
  label,
  labelSize: 22,
  labelFont: "13px system-ui, sans-serif",
  font: "12px system-ui, sans-serif",
  stroke: () => themeColour("ink"),
  grid: { stroke: () => themeColour("rule"), width: 1 },
  ticks: { stroke: () => themeColour("rule"), width: 1, size: 5 },
});

// Draws the time of the view on a chart.
const nowLine = (plot) => {
  const x = Math.round(plot.valToPos(timer.t, "x", true));
  const { left, top, width, height } = plot.bbox;
  if (x < left || x > left + width) return;
  const { ctx } = plot;
  ctx.save();
  ctx.strokeStyle = themeColour("ink");
  ctx.lineWidth = devicePixelRatio;
  ctx.beginPath();
  ctx.moveTo(x, top);
  ctx.lineTo(x, top + height);
  ctx.stroke();
  ctx.restore();
};

const options = (chart, width, onValues) => ({
  width,
  height: CHART_HEIGHT,
  legend: { show: false },
  cursor: { sync: { key: chartSync.key }, drag: { x: true, y: false }, points: { size: 6 } },
  scales: { x: { time: false }, y: chart.log ? { distr: 3 } : {} },
  series: [{}, ...chart.curves.map(series)],
  bands: bands(chart.curves),
  axes: [{ ...axis("Time (s)"), space: 60, size: 34 }, { ...axis(chart.label), size: 62, ...(chart.log && { values: powers }) }],
  hooks: { draw: [nowLine], setCursor: [(plot) => onValues(plot.cursor.idx)] },
});

// Names, line samples and values at the cursor.
const keyList = (chart, values) => {
  const list = document.createElement("ul");
  list.className = "keys";
  const isBand = ({ style }) => style === "band-bottom";
  const outputs = chart.curves.map((curve) => {
    if (isBand(curve)) return null;
    const { colour, dash } = LOOKS[curve.style];
    const item = list.appendChild(document.createElement("li"));
    const isWide = curve.style === "band-top";
    const stroke = `stroke="var(--${colour})" stroke-width="${isWide ? 8 : 2}" stroke-dasharray="${dash ?? ""}"`;
    item.innerHTML = `<svg viewBox="0 0 26 8" aria-hidden="true"><path d="M0 4H26" ${stroke}/></svg>`;
    item.append(isWide ? "2 sigma" : curve.name, " ");
    return item.appendChild(document.createElement("b"));
  });
  const show = (index) =>
    outputs.forEach((output, k) => {
      const value = index == null ? null : values[k + 1][index];
      if (output) output.textContent = value == null ? "" : threeDigits(value);
    });
  return { list, show };
};

// A short description for those who cannot see the chart.
const description = (chart, values) => {
  const range = ({ name }, k) => {
    const known = values[k + 1].filter((y) => y !== null);
    if (!known.length) return `${name}: no values`;
    const [low, high] = known.reduce(([low, high], y) => [Math.min(low, y), Math.max(high, y)], [Infinity, -Infinity]);
    return `${name}: ${threeDigits(low)} to ${threeDigits(high)}`;
  };
  return `${chart.title}. ${chart.label}, over time. ${chart.curves.map(range).join("; ")}.`;
};

class ChartFigure {
  constructor(parent, charts) {
    this.charts = charts;
    this.figure = parent.appendChild(document.createElement("figure"));
    const caption = this.figure.appendChild(document.createElement("figcaption"));
    if (charts.length > 1) caption.append(this.choice());
    else caption.textContent = charts[0].title;
    this.place = this.figure.appendChild(document.createElement("div"));
    this.place.setAttribute("role", "img");
    this.keys = this.figure.appendChild(document.createElement("div"));
    this.show(charts[0]);
    plots.push(this);
  }

  choice() {
    const select = document.createElement("select");
    select.setAttribute("aria-label", "Chart");
    this.charts.forEach(({ title }, k) => select.add(new Option(title, k)));
    select.addEventListener("change", () => this.show(this.charts[select.value]));
    return select;
  }

  show(chart) {
    this.plot?.destroy();
    const values = columns(chart);
    const keys = keyList(chart, values);
    this.keys.replaceChildren(keys.list);
    this.place.setAttribute("aria-label", description(chart, values));
    this.plot = new vendor.uPlot(options(chart, this.width, keys.show), values, this.place);
    this.plot.over.addEventListener("click", () => {
      const { left } = this.plot.cursor;
      if (left >= 0) timer.set(this.plot.posToVal(left, "x"));
    });
  }

  get width() {
    return Math.max(this.figure.clientWidth, 200);
  }

  fit() {
    this.plot.setSize({ width: this.width, height: CHART_HEIGHT });
  }

  redraw() {
    this.plot.redraw(false, true);
  }
}

for (const { section, charts } of data.charts) {
  const element = document.querySelector(`#${section}[data-charts], [data-charts="${section}"]`);
  element.hidden = false;
  new ChartFigure(element.querySelector(".charts"), charts);
}
plots.forEach((figure) => figure.fit());
addEventListener("resize", () => plots.forEach((figure) => figure.fit()));
onTheme.push(() => plots.forEach((figure) => figure.redraw()));
let isRedrawing = false;
timer.listeners.push(() => {
  if (isRedrawing) return;
  isRedrawing = true;
  setTimeout(() => {
    isRedrawing = false;
    plots.forEach((figure) => figure.redraw());
  }, 100);
});
