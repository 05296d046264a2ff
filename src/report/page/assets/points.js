// The runs as points over two columns, with the Pareto front in front.

const MARGIN = { left: 70, right: 14, top: 10, bottom: 48 };
const POINTS_HEIGHT = 420;
// A logarithmic axis from this ratio of the largest to the smallest value.
const LOGARITHMIC_FROM = 50;
// Maximum distance of the pointer to a point, px.
const REACH = 14;

const drawing = (name, attributes, parent) => {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  Object.entries(attributes).forEach(([key, value]) => element.setAttribute(key, value));
  return parent ? parent.appendChild(element) : element;
};

// Ticks at 1, 2 or 5 times powers of ten, about `count` of them.
const linearTicks = (low, high, count) => {
  const raw = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((step) => step >= raw);
  const first = Math.ceil(low / step - 1e-9);
  const last = Math.floor(high / step + 1e-9);
  return Array.from({ length: Math.max(last - first + 1, 0) }, (_, k) => Number(((first + k) * step).toPrecision(12)));
};

const decadeTicks = (low, high) => {
  const factors = high / low < 1e3 ? [1, 2, 5] : [1];
  const [first, last] = [Math.floor(Math.log10(low)), Math.ceil(Math.log10(high))];
  const decades = Array.from({ length: last - first + 1 }, (_, k) => first + k);
  const all = decades.flatMap((decade) => factors.map((factor) => Number((factor * 10 ** decade).toPrecision(1))));
  return all.filter((tick) => tick >= low && tick <= high);
};

// The axis over the finite values: from a value to a fraction of its length, and ticks.
const pointAxis = (values, count) => {
  let [low, high] = values.reduce(([low, high], x) => [Math.min(low, x), Math.max(high, x)], [Infinity, -Infinity]);
  const isLog = low > 0 && high / low > LOGARITHMIC_FROM;
  const [to, from] = isLog ? [Math.log, Math.exp] : [(x) => x, (x) => x];
  const margin = 0.04 * (to(high) - to(low)) || (isLog ? 0.1 : Math.abs(high) * 0.1 || 1);
  [low, high] = [from(to(low) - margin), from(to(high) + margin)];
  const fraction = (x) => (to(x) - to(low)) / (to(high) - to(low));
  return { fraction, ticks: isLog ? decadeTicks(low, high) : linearTicks(low, high, count) };
};

class Points {
  constructor({ columns, x, y, front }, place) {
    this.columns = columns.map(({ label, values }) => ({ label, values: Array.from(floats(values)) }));
    this.isFront = new Set(front);
    this.place = place;
    this.choices = [["abscissa", x], ["ordinate", y]].map(([id, chosen]) => this.choice(byId(id), chosen));
    place.addEventListener("pointermove", (event) => this.hover(this.nearest(event)));
    place.addEventListener("pointerleave", () => this.hover(null));
    place.addEventListener("click", (event) => {
      const point = this.nearest(event);
      if (point) openRun(point.run);
    });
    place.addEventListener("keydown", (event) => this.onKey(event));
  }

  choice(select, chosen) {
    this.columns.forEach(({ label }, k) => select.add(new Option(label, k, k === chosen, k === chosen)));
    select.addEventListener("change", () => this.draw());
    return select;
  }

  draw() {
    const [x, y] = this.choices.map((select) => this.columns[select.value]);
    const isShown = (k) => !runRows[k].hidden && Number.isFinite(x.values[k]) && Number.isFinite(y.values[k]);
    const shown = runRows.map((_, k) => k).filter(isShown);
    const width = Math.max(this.place.clientWidth, 240);
    this.svg = drawing("svg", { width, height: POINTS_HEIGHT, viewBox: `0 0 ${width} ${POINTS_HEIGHT}` });
    this.place.replaceChildren(this.svg);
    [this.points, this.front, this.ring] = [[], [], null];
    if (!shown.length) {
      byId("hovered").textContent = "No run has both values.";
      return;
    }
    const across = pointAxis(shown.map((k) => x.values[k]), width / 90);
    const up = pointAxis(shown.map((k) => y.values[k]), 7);
    const [plotWidth, plotHeight] = [width - MARGIN.left - MARGIN.right, POINTS_HEIGHT - MARGIN.top - MARGIN.bottom];
    const toX = (value) => MARGIN.left + across.fraction(value) * plotWidth;
    const toY = (value) => MARGIN.top + (1 - up.fraction(value)) * plotHeight;
    this.drawAxes({ width, toX, toY, xTicks: across.ticks, yTicks: up.ticks, names: [x.label, y.label] });
    this.points = shown.map((run) => {
      const words = `run ${runName(run)}: ${x.label} ${threeDigits(x.values[run])}, ${y.label} ${threeDigits(y.values[run])}`;
      return { run, x: toX(x.values[run]), y: toY(y.values[run]), words, isFront: this.isFront.has(run) };
    });
    this.drawPoints();
    this.hover(null);
  }

  drawAxes({ width, toX, toY, xTicks, yTicks, names }) {
    const [right, bottom] = [width - MARGIN.right, POINTS_HEIGHT - MARGIN.bottom];
    const rules = xTicks.map((x) => `M${toX(x)} ${MARGIN.top}V${bottom}`).concat(yTicks.map((y) => `M${MARGIN.left} ${toY(y)}H${right}`));
    drawing("path", { class: "rules", d: rules.join("") }, this.svg);
    drawing("path", { class: "frame", d: `M${MARGIN.left} ${MARGIN.top}V${bottom}H${right}` }, this.svg);
    const text = (words, attributes) => (drawing("text", attributes, this.svg).textContent = words);
    xTicks.forEach((x) => text(String(x), { x: toX(x), y: bottom + 16, "text-anchor": "middle" }));
    yTicks.forEach((y) => text(String(y), { x: MARGIN.left - 6, y: toY(y) + 4, "text-anchor": "end" }));
    const [middleX, middleY] = [(MARGIN.left + right) / 2, (MARGIN.top + bottom) / 2];
    text(names[0], { class: "name", x: middleX, y: POINTS_HEIGHT - 10, "text-anchor": "middle" });
    text(names[1], { class: "name", x: 16, y: middleY, "text-anchor": "middle", transform: `rotate(-90 16 ${middleY})` });
  }

  // All runs as one path of dots, and each point of the front as an element of its own.
  drawPoints() {
    const dots = this.points.filter(({ isFront }) => !isFront).map(({ x, y }) => `M${x.toFixed(1)} ${y.toFixed(1)}h0`);
    drawing("path", { class: "dots", d: dots.join("") }, this.svg);
    this.front = this.points.filter(({ isFront }) => isFront).sort((a, b) => a.x - b.x || b.y - a.y);
    this.ring = drawing("circle", { class: "ring", r: 9, visibility: "hidden" }, this.svg);
    this.front.forEach((point, k) => {
      const role = runPage(point.run) ? "link" : "button";
      const label = `Pareto front, ${point.words}`;
      const attributes = { class: "front", cx: point.x, cy: point.y, r: 5.5, role, tabindex: k ? -1 : 0, "aria-label": label };
      point.element = drawing("circle", attributes, this.svg);
      point.element.addEventListener("focus", () => this.hover(point));
    });
  }

  // The point that is nearest to the pointer; those of the front are preferred.
  nearest({ clientX, clientY }) {
    const box = this.svg.getBoundingClientRect();
    const distance = (point) => Math.hypot(point.x + box.left - clientX, point.y + box.top - clientY) - (point.isFront ? 4 : 0);
    const [best] = this.points.reduce(
      ([best, least], point) => (distance(point) < least ? [point, distance(point)] : [best, least]),
      [null, REACH],
    );
    return best;
  }

  hover(point) {
    this.place.classList.toggle("pointing", Boolean(point));
    byId("hovered").textContent = point ? point.words + (point.isFront ? ", on the Pareto front" : "") : this.counts();
    if (!this.ring) return;
    this.ring.setAttribute("visibility", point ? "visible" : "hidden");
    if (point) {
      this.ring.setAttribute("cx", point.x);
      this.ring.setAttribute("cy", point.y);
    }
  }

  counts() {
    const front = this.front.length ? `, ${this.front.length} on the Pareto front` : "";
    return `${this.points.length} runs${front}`;
  }

  // The arrow keys move along the front, Enter opens the run.
  onKey(event) {
    const at = this.front.findIndex(({ element }) => element === document.activeElement);
    if (at < 0 || event.ctrlKey || event.metaKey || event.altKey) return;
    const step = { ArrowLeft: -1, ArrowUp: -1, ArrowRight: 1, ArrowDown: 1 }[event.key];
    const isPress = event.key === "Enter" || event.key === " ";
    if (!step && !isPress) return;
    event.preventDefault();
    if (isPress) {
      openRun(this.front[at].run);
      return;
    }
    const to = this.front[Math.min(Math.max(at + step, 0), this.front.length - 1)].element;
    this.front[at].element.setAttribute("tabindex", -1);
    to.setAttribute("tabindex", 0);
    to.focus();
  }
}

if (data.columns.length > 1 && runRows.length) {
  byId("points").hidden = false;
  if (!data.front.length) document.querySelector("#points .help").textContent = "Click on a point to open its run.";
  const points = new Points(data, document.querySelector(".points"));
  points.draw();
  addEventListener("resize", () => points.draw());
  onFilter.push(() => points.draw());
}
