// Interactive charts; their cursors move together.
const CHART_HEIGHT = 220;
const chartSync = vendor.uPlot.sync("charts");
const plots = [];
// Called with a plot when it is drawn, and with the abscissa of a click on a plot.
const onDraw = [];
const onPick = [];

const ABSCISSAE = {
  time: { label: "Time (s)", unit: "s", isLog: false },
  frequency: { label: "Frequency (Hz)", unit: "Hz", isLog: true },
};

const LOOKS = {
  estimate: { colour: "estimate", width: 1.5 },
  truth: { colour: "truth", width: 1.5, dash: [7, 5] },
  second: { colour: "second", width: 1.2 },
  bound: { colour: "bound", width: 1, fill: "band", dash: [2, 2] },
  "band-top": { colour: "band", width: 0.5 },
  "band-bottom": { colour: "band", width: 0.5 },
  limit: { colour: "limit", width: 1.5, dash: [2, 4] },
  measured: { colour: "estimate", width: 1, isDots: true },
  model: { colour: "second", width: 1.5 },
};

const columns = ({ x, curves, ordinate }) => {
  const isKnown = (y) => Number.isFinite(y) && (ordinate !== "logarithmic" || y > 0);
  return [Array.from(floats(x)), ...curves.map(({ y }) => Array.from(floats(y), (y) => (isKnown(y) ? y : null)))];
};

// A curve of a chart in the colours of the theme.
const series = ({ name, style }) => {
  const { colour, width, dash, fill, isDots } = LOOKS[style];
  return {
    label: name,
    stroke: () => themeColour(colour),
    fill: fill && (() => themeColour(fill)),
    width,
    dash,
    paths: isDots ? () => null : undefined,
    points: isDots ? { show: true, size: 4, fill: () => themeColour(colour) } : { show: false },
    spanGaps: false,
  };
};

// The band between the upper and the lower edge.
const bands = (curves) => {
  const top = curves.findIndex(({ style }) => style === "band-top");
  return top < 0 ? [] : [{ series: [top + 1, top + 2], fill: () => themeColour("band") }];
};

// The labels of a logarithmic axis: powers of ten, and on a short axis also 2 and 5 times these.
const logarithmicTicks = (plot, splits, at) => {
  const { min, max } = plot.scales[plot.axes[at].scale];
  const shown = max / min < 300 ? [1, 2, 5] : [1];
  const label = (y) => (y < 0.01 || y >= 1e4 ? y.toExponential(0) : String(Number(y.toPrecision(1))));
  return splits.map((y) => (y > 0 && shown.includes(Math.round(y / 10 ** Math.floor(Math.log10(y) + 1e-9))) ? label(y) : ""));
};

// Just below a power of ten, uPlot steps over it and then never ends: such a scale starts at the ninefold of the power before.
const belowTick = (y) => {
  const decade = 10 ** Math.floor(Math.log10(y));
  return y > 9 * decade ? 9 * decade : y;
};

// A logarithmic scale that ends at the data, where uPlot would add up to a decade, and covers at least the ratio `least`.
const logarithmicScale = (margin, least) => ({
  distr: 3,
  range: (plot, min, max) => {
    if (!(min > 0)) return [0.1, 10];
    const widened = Math.max(margin, Math.sqrt((least * min) / max));
    return [belowTick(min / widened), max * widened];
  },
});

// A scale of angles that covers at least 10 degrees: less is noise.
const angleScale = {
  range: (plot, min, max) => {
    const margin = Math.max(0.05 * (max - min), 5 - 0.5 * (max - min));
    return [min - margin, max + margin];
  },
};

const ordinateScale = ({ ordinate }) =>
  ({ logarithmic: logarithmicScale(1.3, 10), degrees: angleScale })[ordinate] ?? {};

const axis = (label) => ({
  label,
  labelSize: 22,
  labelFont: "13px system-ui, sans-serif",
  font: "12px system-ui, sans-serif",
  stroke: () => themeColour("ink"),
  grid: { stroke: () => themeColour("rule"), width: 1 },
  ticks: { stroke: () => themeColour("rule"), width: 1, size: 5 },
});

const abscissaAxis = ({ label, isLog }) => ({
  ...axis(label),
  space: isLog ? 30 : 60,
  size: 34,
  ...(isLog && { values: logarithmicTicks }),
});

// Angles have ticks at parts of a turn.
const ordinateAxis = ({ label, ordinate }) => ({
  ...axis(label),
  size: 62,
  ...(ordinate === "logarithmic" && { values: logarithmicTicks, space: 18 }),
  ...(ordinate === "degrees" && { incrs: [1, 5, 15, 45, 90, 180, 360] }),
});

const options = (chart, width, onValues) => {
  const abscissa = ABSCISSAE[chart.abscissa];
  return {
    width,
    height: CHART_HEIGHT,
    legend: { show: false },
    cursor: { sync: { key: chartSync.key }, drag: { x: true, y: false }, points: { size: 6 } },
    scales: {
      x: { time: false, ...(abscissa.isLog && logarithmicScale(1, 1.01)) },
      y: ordinateScale(chart),
    },
    series: [{}, ...chart.curves.map(series)],
    bands: bands(chart.curves),
    axes: [abscissaAxis(abscissa), ordinateAxis(chart)],
    hooks: { draw: [(plot) => onDraw.forEach((draw) => draw(plot))], setCursor: [(plot) => onValues(plot.cursor.idx)] },
  };
};

// Names, line samples and values at the cursor.
const keyList = (chart, values) => {
  const list = document.createElement("ul");
  list.className = "keys";
  const place = list.appendChild(document.createElement("li"));
  const isBand = ({ style }) => style === "band-bottom";
  const outputs = chart.curves.map((curve) => {
    if (isBand(curve)) return null;
    const { colour, dash, isDots } = LOOKS[curve.style];
    const item = list.appendChild(document.createElement("li"));
    const isWide = curve.style === "band-top";
    const stroke = `stroke="var(--${colour})" stroke-width="${isWide ? 8 : 2}" stroke-dasharray="${dash ?? (isDots ? "3 5" : "")}"`;
    item.innerHTML = `<svg viewBox="0 0 26 8" aria-hidden="true"><path d="M0 4H26" ${stroke}/></svg>`;
    item.append(curve.name, " ");
    return item.appendChild(document.createElement("b"));
  });
  const show = (index) => {
    place.textContent = index == null ? "" : `${threeDigits(values[0][index])} ${ABSCISSAE[chart.abscissa].unit}:`;
    outputs.forEach((output, k) => {
      const value = index == null ? null : values[k + 1][index];
      if (output) output.textContent = value == null ? "" : threeDigits(value);
    });
  };
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
  return `${chart.title}. ${chart.label}, over ${chart.abscissa}. ${chart.curves.map(range).join("; ")}.`;
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
    this.place.tabIndex = 0;
    this.place.addEventListener("keydown", (event) => this.onKey(event));
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
      if (left >= 0) onPick.forEach((pick) => pick(this.plot.posToVal(left, "x")));
    });
  }

  // Moves the cursor by one point with the arrow keys, by ten with shift; its values are then read aloud.
  onKey(event) {
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!step || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    const [x] = this.plot.data;
    const from = this.plot.cursor.idx ?? (step > 0 ? -1 : x.length);
    const index = Math.min(Math.max(from + step * (event.shiftKey ? 10 : 1), 0), x.length - 1);
    this.keys.setAttribute("aria-live", "polite");
    this.plot.setCursor({ left: this.plot.valToPos(x[index], "x"), top: this.plot.over.clientHeight / 2 }, true, true);
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
