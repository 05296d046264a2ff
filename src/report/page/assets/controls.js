// Controls of the three-dimensional view.

// The slice ends this far above the head if a ceiling would hide the path, m.
const ABOVE_HEAD_M = 0.5;
// A ceiling has at least this fraction of the points.
const CEILING_FRACTION = 0.05;
// In a scene, the slice starts this far above the slice of a run: below a ceiling that is at most so much higher, m.
const CUT_ABOVE_PATH_M = 0.3;
const MAX_CEILING_M = 4;

const view = openView(View);

// Fills the list of colours; the first one that is known of error, height is chosen.
const setUpColours = () => {
  const select = byId("colour");
  for (const [key, { name }] of Object.entries(channels)) {
    const option = select.appendChild(document.createElement("option"));
    [option.value, option.textContent] = [key, name];
  }
  select.value = "height";
  select.addEventListener("change", () => {
    view.cloud.colour(select.value);
    view.draw();
  });
  view.cloud.colour(select.value);
  if (isScene) showMaterials(sceneMaterials);
};

// Applies the two ends of the slice, in metres.
const updateSlice = () => {
  const ends = [byId("low").valueAsNumber, byId("high").valueAsNumber].sort((a, b) => a - b);
  view.slice = [ends[0] - 1e-3, ends[1] + 1e-3];
  byId("slice").textContent = `${ends[0].toFixed(2)} to ${ends[1].toFixed(2)} m`;
};

// Sets the range of the slice, in metres; a ceiling above the path is left out.
const fitSlice = (from, to) => {
  const [low, high] = [byId("low"), byId("high")];
  const { count } = data.cloud;
  const path = estimate.isKnown ? estimate : truth;
  for (const input of [low, high]) [input.min, input.max] = [from, to];
  [low.value, high.value] = [from, to];
  const heights = path.t.map((_, k) => path.pose[7 * k + 2]).sort();
  const above = heights.length ? heights[Math.floor(0.99 * (heights.length - 1))] + ABOVE_HEAD_M : to;
  let hiding = 0;
  for (let k = 0; k < count; k += 16) hiding += view.cloud.place(k)[2] > above ? 16 : 0;
  if (hiding > CEILING_FRACTION * count) high.value = above;
  if (isScene && heights.length && to - above < MAX_CEILING_M) high.value = above + CUT_ABOVE_PATH_M;
  updateSlice();
};

const setUpSlice = () => {
  const { lower, upper, count } = data.cloud;
  const corners = isScene ? view.corners(2) : [];
  const [from, to] = count ? [lower[2], upper[2]] : isScene ? [corners[0], corners[corners.length - 1]] : [-1, 3];
  fitSlice(from, to);
  for (const id of ["low", "high"]) byId(id).addEventListener("input", updateSlice);
};

const setUpShown = () => {
  const check = (id, apply) => {
    const input = byId(id);
    const update = () => {
      apply(input.checked);
      view.draw();
    };
    input.addEventListener("change", update);
    update();
  };
  document.querySelectorAll("[data-needs=cloud]").forEach((control) => (control.hidden = isScene));
  document.querySelector("[data-needs=truth]").hidden = !truth.isKnown;
  document.querySelector("[data-needs=surfaces]").hidden = data.surfaces === "";
  byId("show-surfaces").checked = data.surfaces !== "";
  const whose = isScene ? "" : "true ";
  byId("surfaces-label").textContent = (data.surfacesArePartial ? "largest " : "") + whose + "surfaces";
  check("show-cloud", (shown) => (view.cloud.points.visible = shown && data.cloud.count > 0));
  check("show-estimate", (shown) => (view.estimate.visible = shown));
  check("show-truth", (shown) => (view.truth.visible = shown && truth.isKnown));
  check("show-surfaces", (shown) => (view.surfaces.visible = shown));
  check("grow", (past) => (view.past = past));
  check("follow", (follow) => {
    const turnedOn = follow && !view.follow;
    view.follow = follow;
    if (turnedOn) {
      const radius = view.camera.position.distanceTo(view.controls.target);
      view.move(timer.t);
      view.zoom(Math.min(1, 6 / radius));
    }
  });
  const size = byId("size");
  const resize = () => {
    view.cloud.uniforms.size.value = size.valueAsNumber * Math.min(devicePixelRatio, 2);
    view.draw();
  };
  size.addEventListener("input", resize);
  resize();
};

const setUpPlayback = () => {
  const slider = byId("time");
  slider.max = duration;
  slider.addEventListener("input", () => timer.set(slider.valueAsNumber));
  const isOver = () => timer.t >= duration - 1e-6;
  const advance = (seconds) => {
    timer.set(timer.t + seconds * Number(byId("speed").value));
    return !isOver();
  };
  view.playback = new Playback(advance, () => isOver() && timer.set(0));
  timer.listeners.push((t) => {
    slider.value = t;
    slider.setAttribute("aria-valuetext", `${t.toFixed(1)} s`);
    byId("clock").textContent = `${t.toFixed(1)} s`;
  });
};

if (view) {
  setUpColours();
  setUpSlice();
  setUpShown();
  setUpPlayback();
}
