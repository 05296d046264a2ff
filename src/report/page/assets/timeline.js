// Timeline of events: one row for each kind.
const SVG = "http://www.w3.org/2000/svg";
const LEVELS = { lost: "lost", degraded: "degraded", loss: "loss", note: "note" };

const svgElement = (parent, tag, attributes) => {
  const element = parent.appendChild(document.createElementNS(SVG, tag));
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  return element;
};
// A round time between ticks, s: there are at most seven.
const tickStep = (duration) => {
  const decade = 10 ** Math.floor(Math.log10(duration / 6));
  return decade * [1, 2, 5, 10].find((digit) => digit * decade >= duration / 6);
};
const percentOf = (t) => `${(100 * Math.min(Math.max(t / duration, 0), 1)).toFixed(3)}%`;
const span = ([from, to]) => (to - from > 0.05 ? `${from.toFixed(1)} to ${to.toFixed(1)} s` : `${from.toFixed(1)} s`);

const timelineRow = (parent, { name, level, events }) => {
  const row = parent.appendChild(document.createElement("div"));
  row.className = "row";
  const title = row.appendChild(document.createElement("div"));
  title.className = "name";
  title.textContent = name;
  const kind = title.appendChild(document.createElement("span"));
  [kind.className, kind.textContent] = ["level", LEVELS[level]];
  const drawing = svgElement(row, "svg", { role: "img", "aria-label": `${name}: ${events.map(span).slice(0, 20).join(", ")}` });
  svgElement(drawing, "line", { x1: 0, x2: "100%", y1: 12, y2: 12, stroke: "var(--rule)" });
  for (const event of events) {
    const [from, to, sentence] = event;
    const width = `max(4px, ${percentOf(to - from)})`;
    const mark = svgElement(drawing, "rect", { x: percentOf(from), y: 4, height: 16, rx: 2, class: `mark ${level}` });
    mark.style.width = width;
    svgElement(mark, "title", {}).textContent = `${span(event)}: ${sentence}`;
    mark.addEventListener("click", () => {
      timer.set(from);
      byId("picked").textContent = `${span(event)}: ${sentence}`;
    });
  }
  return svgElement(drawing, "line", { y1: 0, y2: 24, class: "now" });
};

if (data.timeline.length) {
  byId("timeline").hidden = false;
  const rows = byId("rows");
  const lines = data.timeline.map((row) => timelineRow(rows, row));
  const ticks = rows.appendChild(document.createElement("div"));
  ticks.className = "ticks";
  for (let t = 0; t <= 1.01 * duration; t += tickStep(duration)) {
    const tick = addElement(ticks, "span", `${Number(t.toFixed(1))} s`);
    tick.style.left = percentOf(t);
    tick.style.transform = `translateX(-${percentOf(t)})`;
  }
  const picked = rows.appendChild(document.createElement("p"));
  picked.id = "picked";
  picked.setAttribute("aria-live", "polite");
  timer.listeners.push((t) => {
    for (const line of lines) for (const end of ["x1", "x2"]) line.setAttribute(end, percentOf(t));
  });
}
timer.set(0);
