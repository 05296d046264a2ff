// The page of a run that is not complete: it requests what it lacks, and the view follows the newest data.

// The view approaches the newest data with this time constant, s.
const APPROACH_S = 0.4;
// Time between changes of the lines, and of the colours, the slice and the camera, ms.
const LINES_MS = 250;
const FIT_MS = 700;
// The camera moves if the map has grown by this factor.
const GROWTH = 1.15;
// Number of scans that are kept, and the largest time between a scan and the view, s.
const MAX_SCANS = 200;
const SCAN_S = 0.3;
// After this number of failed requests the run has ended.
const MAX_FAILURES = 4;
const RETRY_MS = 500;

const viewer = crypto.getRandomValues(new Uint32Array(1))[0];
const has = { version: 0, points: [0, 0], estimate: [0, 0], truth: [0, 0], scan: 0 };
let scans = [];

// Appends an increment to arrays of fixed size; `widths` are the numbers of values of an item.
const append = (buffers, widths, { first, count }, values) => {
  buffers.forEach((buffer, k) => buffer.set(values[k].subarray(0, widths[k] * count), widths[k] * first));
};

// A path that grows in place.
class GrowingPath {
  constructor(path) {
    this.path = path;
    this.buffers = [new Float32Array(data.capacity.poses), new Float32Array(7 * data.capacity.poses)];
    this.resize(0);
  }

  resize(count) {
    this.path.t = this.buffers[0].subarray(0, count);
    this.path.pose = this.buffers[1].subarray(0, 7 * count);
  }

  take(increment, { t, pose }) {
    append(this.buffers, [1, 7], increment, [floats(t), floats(pose)]);
    this.resize(increment.first + increment.count);
  }
}

const paths = { estimate: new GrowingPath(estimate), truth: new GrowingPath(truth), base: new GrowingPath(base) };

// The points of the cloud of the view, which grow in place.
class GrowingCloud {
  constructor(cloud) {
    const { points } = data.capacity;
    this.cloud = cloud;
    this.positions = new Uint16Array(3 * points);
    this.times = new Uint16Array(points);
    const { geometry } = cloud.points;
    geometry.setAttribute("position", new vendor.BufferAttribute(this.positions, 3, true));
    geometry.setAttribute("time", new vendor.BufferAttribute(this.times, 1, true));
    for (const channel of [channels.height, channels.time]) channel.codes = new Uint8Array(points);
    cloud.codes = this.positions;
    cloud.live = (t, sensor) => this.drawScan(t, sensor);
    cloud.colour(byId("colour").value);
    this.resize(0);
  }

  resize(count) {
    data.cloud.count = count;
    this.cloud.times = this.times.subarray(0, count);
    this.cloud.points.geometry.setDrawRange(0, count);
    this.cloud.points.visible = count > 0 && byId("show-cloud").checked;
  }

  take(increment) {
    const { first, count } = increment;
    append([this.positions, this.times], [3, 1], increment, [shorts(increment.position), shorts(increment.time)]);
    // Until the ranges are computed again, the new points have the colours of the present ones.
    const { height } = channels;
    const [lower, upper] = [data.cloud.lower[2], data.cloud.upper[2]];
    for (let k = first; k < first + count; k++) {
      const metres = lower + (this.positions[3 * k + 2] / 65535) * (upper - lower);
      height.codes[k] = Math.min(Math.max((metres - height.lower) / (height.upper - height.lower), 0), 1) * 254;
    }
    channels.time.codes.fill(254, first, first + count);
    const { position, time, code } = this.cloud.points.geometry.attributes;
    for (const [attribute, width] of [[position, 3], [time, 1], [code, 1]]) {
      attribute.addUpdateRange(width * first, width * count);
      attribute.needsUpdate = true;
    }
    this.resize(first + count);
  }

  // Computes the colours again, whose ranges have changed.
  colour() {
    const { count } = data.cloud;
    const { height, time } = channels;
    const before = [height.lower, height.upper, time.upper];
    height.codes.set(heightCodes(height, this.positions));
    const latest = Math.max(this.times[count - 1], 1);
    time.upper = (latest / 65535) * data.cloud.duration;
    for (let k = 0; k < count; k++) time.codes[k] = Math.min((254 * this.times[k]) / latest, 254);
    this.cloud.points.geometry.attributes.code.needsUpdate = true;
    const chosen = channels[byId("colour").value];
    const isOther = [height.lower, height.upper, time.upper].some((end, k) => Math.abs(end - before[k]) > 0.05);
    if (isOther) showLegend(chosen);
  }

  // Draws the scan just before time t if it is known, or the points that were new then.
  drawScan(t, sensor) {
    const scan = scans.findLast((each) => each.t <= t);
    const place = scan && (estimate.at(scan.t) ?? truth.at(scan.t));
    if (!place || t - scan.t > SCAN_S) return Cloud.prototype.live.call(this.cloud, t, sensor);
    const { lower, upper } = data.cloud;
    const count = Math.min(scan.codes.length / 3, MAX_BEAMS);
    this.cloud.drawBeams(place.position, count, (k) =>
      [0, 1, 2].map((axis) => lower[axis] + (scan.codes[3 * k + axis] / 65535) * (upper[axis] - lower[axis])),
    );
  }

  // Lowest and highest point, m.
  get heights() {
    const { count, lower, upper } = data.cloud;
    let [low, high] = [65535, 0];
    for (let k = 0; k < count; k++) {
      low = Math.min(low, this.positions[3 * k + 2]);
      high = Math.max(high, this.positions[3 * k + 2]);
    }
    return [low, high].map((code) => lower[2] + (code / 65535) * (upper[2] - lower[2]));
  }
}

const cloud = view && new GrowingCloud(view.cloud);

// Draws a path again. The geometry is replaced, because that of a line cannot grow.
const redraw = (line, path, isShown) => {
  if (!path.isKnown) return;
  const positions = pathPositions(path);
  line.geometry.dispose();
  line.geometry = new vendor.LineGeometry();
  line.geometry.setPositions(positions);
  line.visible = isShown;
  if (line.casing) line.casing.geometry = line.geometry;
  if (!line.material.dashed) return;
  line.material.dashSize = line.material.gapSize = dashLength(positions);
  line.computeLineDistances();
};

// What the reader has set, and the page must not change any more.
const reader = { hasMoved: false, hasSliced: false };
let radius = 0;

const fitView = () => {
  if (!view || !data.cloud.count) return;
  cloud.colour();
  const [from, to] = cloud.heights;
  if (!reader.hasSliced) fitSlice(from, to);
  else for (const id of ["low", "high"]) [byId(id).min, byId(id).max] = [from, to];
  const shown = radiusOf(view.extent);
  if (!reader.hasMoved && (shown > GROWTH * radius || shown < radius / 2)) {
    radius = shown;
    view.whole("oblique");
  }
  view.draw();
};

const drawLines = () => {
  if (!view) return;
  redraw(view.estimate, estimate, byId("show-estimate").checked);
  redraw(view.truth, truth, byId("show-truth").checked);
  document.querySelector("[data-needs=truth]").hidden = !truth.isKnown;
  view.markers.points.visible = estimate.isKnown;
  if (!estimate.isKnown) return;
  view.markers.put(0, estimate.position(0));
  view.markers.put(1, estimate.position(estimate.t.length - 1));
};

// Calls an action, but not more often than once in a period.
const limited = (period, action) => {
  let isWaiting = false;
  return () => {
    if (isWaiting) return;
    isWaiting = true;
    setTimeout(() => {
      isWaiting = false;
      action();
    }, period);
  };
};
const fitSoon = limited(FIT_MS, fitView);
const drawLinesSoon = limited(LINES_MS, drawLines);

const setText = (element, text) => {
  if (element.textContent !== text) element.textContent = text;
};

const showVerdict = (verdict) => {
  byId("verdicts").hidden = !verdict;
  for (const line of document.querySelectorAll("#verdicts .verdict")) {
    const isShown = Boolean(verdict) && line.classList.contains(verdict.status);
    line.hidden = !isShown;
    if (isShown) setText(line.querySelector("span").lastChild, ` ${verdict.reason}`);
  }
  document.documentElement.dataset.status = verdict?.status ?? "";
};

let shownEvents = "";
const showEvents = (events) => {
  if (events.join("\n") === shownEvents) return;
  shownEvents = events.join("\n");
  byId("event-list").replaceChildren();
  for (const event of events) addElement(byId("event-list"), "li", event);
};

const showState = ({ stage, fraction, done, verdict, events, end }) => {
  setText(byId("stage"), end ? end.sentence : stage);
  const progress = byId("progress");
  progress.hidden = Boolean(end);
  if (fraction === null) progress.removeAttribute("value");
  else progress.value = fraction;
  setText(byId("done"), !end && done > 0 ? `${done.toFixed(0)} s of data` : "");
  setText(byId("count"), `${data.cloud.count.toLocaleString("en")} points`);
  showVerdict(verdict);
  showEvents(events);
};

const take = (update) => {
  const { points, estimate: poses, truth: truths } = update;
  if (view && (points.count || points.restart !== has.points[0])) cloud.take(points);
  paths.estimate.take(poses, poses.path);
  paths.truth.take(truths, truths.head);
  paths.base.take(truths, truths.base);
  // Scans of another stage are at other places.
  if (byId("stage").textContent !== update.stage) scans = [];
  for (const { t, position } of update.scans) scans.push({ t, codes: shorts(position) });
  scans = scans.slice(-MAX_SCANS);
  for (const name of ["points", "estimate", "truth"]) has[name] = [update[name].restart, update[name].first + update[name].count];
  [has.version, has.scan] = [update.version, update.nextScan];
  duration = Math.max(newest(), 1e-3);
  byId("time").max = duration;
  if (points.count) fitSoon();
  if (poses.count || truths.count) drawLinesSoon();
  showState(update);
};

// Time of the newest data, s: those of the estimator when it runs.
const newest = () => (estimate.isKnown ? estimate.end : truth.end);

// Moves the view towards the newest data.
let last = performance.now();
const follow = (now) => {
  requestAnimationFrame(follow);
  const share = Math.min((now - last) / 1000 / APPROACH_S, 1);
  last = now;
  if (view.playback?.isRunning) byId("newest").checked = false;
  if (!byId("newest").checked) return;
  const behind = newest() - timer.t;
  if (Math.abs(behind) > 1e-3) timer.set(behind > 0 ? timer.t + behind * share : newest());
};

const query = (more) => {
  const cursors = ["points", "estimate", "truth"].map((name) => `${name}=${has[name].join(".")}`).join("&");
  return `updates?viewer=${viewer}&version=${has.version}&scan=${has.scan}&${cursors}${more}`;
};

// Shows where the report is, and fetches it before the server ends, so that the link works afterwards.
const finish = async ({ report }) => {
  if (report) {
    const paragraph = byId("end");
    paragraph.hidden = false;
    paragraph.textContent = `The report is ${report}. `;
    const response = await fetch("report.html");
    if (response.ok) {
      const link = addElement(paragraph, "a", "Open the report");
      [link.href, link.target] = [URL.createObjectURL(await response.blob()), "_blank"];
    }
  }
  // The server may end before it has answered.
  await fetch(query("&leaves=1")).catch(() => null);
};

const listen = async () => {
  let failures = 0;
  for (;;) {
    try {
      const response = await fetch(query(""));
      if (!response.ok) throw new Error(`the server answers ${response.status}`);
      const update = await response.json();
      take(update);
      failures = 0;
      if (update.end && !update.points.count) return await finish(update.end);
    } catch (error) {
      failures++;
      if (failures > MAX_FAILURES) {
        byId("progress").hidden = true;
        return setText(byId("stage"), "zsim has ended before this page had everything");
      }
      await new Promise((done) => setTimeout(done, RETRY_MS));
    }
  }
};

if (view) {
  view.controls.addEventListener("start", () => (reader.hasMoved = true));
  byId("scene").addEventListener("keydown", () => (reader.hasMoved = true));
  for (const id of ["low", "high"]) byId(id).addEventListener("input", () => (reader.hasSliced = true));
  byId("time").addEventListener("input", () => (byId("newest").checked = false));
  byId("newest").addEventListener("change", () => byId("newest").checked && view.playback?.isRunning && view.playback.toggle());
  requestAnimationFrame(follow);
}
addEventListener("pagehide", () => fetch(query("&leaves=1"), { keepalive: true }));
listen();
