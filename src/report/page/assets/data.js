// Data of the page: JSON with binary arrays in base64.
const data = JSON.parse(document.getElementById("data").textContent);
const byId = (id) => document.getElementById(id);

const bytes = (text) => {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const raw = atob(text);
  const out = new Uint8Array(raw.length);
  for (let k = 0; k < raw.length; k++) out[k] = raw.charCodeAt(k);
  return out;
};
const floats = (text) => new Float32Array(bytes(text).buffer);
const shorts = (text) => new Uint16Array(bytes(text).buffer);

// A path of the head or the base: times in s and poses of seven numbers, position and quaternion.
class Path {
  constructor({ t, pose }) {
    this.t = floats(t);
    this.pose = floats(pose);
  }

  get isKnown() {
    return this.t.length > 1;
  }

  get end() {
    return this.t.length ? this.t[this.t.length - 1] : 0;
  }

  position(k) {
    return new vendor.Vector3().fromArray(this.pose, 7 * k);
  }

  // Interpolates the pose at time t; null outside the path.
  at(t) {
    if (!this.isKnown || t < this.t[0] - 0.1 || t > this.end + 0.1) return null;
    const after = Math.min(Math.max(firstAfter(this.t, t), 1), this.t.length - 1);
    const before = after - 1;
    const share = Math.min(Math.max((t - this.t[before]) / (this.t[after] - this.t[before]), 0), 1);
    const quaternion = new vendor.Quaternion().fromArray(this.pose, 7 * before + 3);
    const next = new vendor.Quaternion().fromArray(this.pose, 7 * after + 3);
    return {
      position: this.position(before).lerp(this.position(after), share),
      quaternion: quaternion.slerp(next, share),
    };
  }
}

// Index of the first element of a sorted array that is larger than x.
const firstAfter = (sorted, x) => {
  let [low, high] = [0, sorted.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (sorted[middle] <= x) low = middle + 1;
    else high = middle;
  }
  return low;
};

const estimate = new Path(data.estimate);
const truth = new Path(data.truth);
const base = new Path(data.base);
const duration = Math.max(estimate.end, truth.end, data.cloud.count ? data.cloud.duration : 0, 1e-3);

// The time of the view; each listener is called when it changes.
const timer = {
  t: 0,
  listeners: [],
  set(t) {
    this.t = Math.min(Math.max(t, 0), duration);
    this.listeners.forEach((listener) => listener(this.t));
  },
};
// Called when the colour scheme of the system changes.
const onTheme = [];
const themeColour = (name) => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => onTheme.forEach((update) => update()));

const threeDigits = (x) => (Math.abs(x) >= 1000 ? x.toFixed(0) : Number(x.toPrecision(3)).toString());
// The ends of a range in one unit: mm for short lengths.
const rangeInWords = (low, high, unit) => {
  const isShort = unit === "m" && Math.max(Math.abs(low), Math.abs(high)) < 0.5;
  const step = (high - low) * (isShort ? 1e3 : 1) / 100;
  const digits = Math.min(Math.max(-Math.floor(Math.log10(step)), 0), 6);
  return [low, high].map((x) => `${(isShort ? x * 1e3 : x).toFixed(digits).replace(/^-(?=[0.]*$)/, "")} ${isShort ? "mm" : unit}`.trim());
};
