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

// Red, green and blue of a colour like "#0060a8", 0 to 255.
const rgb = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16));

const addElement = (parent, tag, text, className) => {
  const element = parent.appendChild(document.createElement(tag));
  element.textContent = text;
  if (className) element.className = className;
  return element;
};
