// Links the charts with the time of the view: a line marks that time, and a click moves the view there.

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

onDraw.push(nowLine);
onPick.push((t) => timer.set(t));
let isRedrawing = false;
timer.listeners.push(() => {
  if (isRedrawing) return;
  isRedrawing = true;
  setTimeout(() => {
    isRedrawing = false;
    plots.forEach((figure) => figure.redraw());
  }, 100);
});
