// Colour scales, safe for colour-blind readers: viridis for magnitudes, blue to red over grey for signed quantities, and the
// palette of Okabe and Ito for materials.
const SCALES = {
  sequential: ["#440154", "#472d7b", "#3b528b", "#2c728e", "#21918c", "#28ae80", "#5ec962", "#addc30", "#fde725"],
  signed: ["#2166ac", "#4393c3", "#92c5de", "#c9ccd1", "#f4a582", "#d6604d", "#b2182b"],
};
const PALETTE = ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#b8a800", "#7a4fb5", "#737373"].concat(
  ["#7f3b08", "#7fc97f", "#1b3a6b", "#f4a6a0", "#4d6b1e", "#a8d0d8", "#8b1a5c"],
);
// The two materials that cover most of a scene are neutral.
const NEUTRAL = ["#d8d4cb", "#8a6f4d"];
const UNKNOWN_COLOUR = "#8a8f96";

// 256 colours for the codes of a quantity; the last one is for unknown values.
const table = (stops) => {
  const colours = new Uint8Array(4 * 256);
  for (let code = 0; code < 256; code++) {
    const at = (Math.min(code, 254) / 254) * (stops.length - 1);
    const below = Math.min(Math.floor(at), stops.length - 2);
    const [from, to] = [rgb(stops[below]), rgb(stops[below + 1])];
    const mixed = code === 255 ? rgb(UNKNOWN_COLOUR) : from.map((c, k) => Math.round(c + (to[k] - c) * (at - below)));
    colours.set([...mixed, 255], 4 * code);
  }
  return colours;
};

// Whether the page shows a scene: the surfaces in the colours of their materials.
const isScene = data.surfaceMaterials.length > 0;

// Codes of the materials that occur, by the sum of their weights; the first ones have colours of their own.
const materialsByWeight = (codes, weight) => {
  const sums = new Float64Array(256);
  codes.forEach((code, k) => (sums[code] += weight(k)));
  const occur = data.materials.map((_, code) => code).filter((code) => sums[code] > 0);
  return occur.sort((a, b) => sums[b] - sums[a] || a - b);
};
const MATERIAL_COLOURS = isScene ? NEUTRAL.concat(PALETTE) : PALETTE;
const materialColour = (rank) => MATERIAL_COLOURS[rank % MATERIAL_COLOURS.length];

const materialTable = (order) => {
  const colours = table([UNKNOWN_COLOUR, UNKNOWN_COLOUR]);
  order.forEach((code, rank) => colours.set(rgb(materialColour(rank)), 4 * code));
  return colours;
};

// The quantities that can colour the cloud: name, unit, codes, range and scale.
const channels = (() => {
  const { cloud } = data;
  const known = { height: { name: "height", unit: "m", scale: "sequential", lower: cloud.lower[2], upper: cloud.upper[2] } };
  const add = (key, name, unit, scale) => {
    const channel = cloud.channels[key];
    if (channel) {
      const { lower, upper } = channel;
      known[key] = { name, unit, scale, lower, upper, codes: bytes(channel.codes) };
    }
  };
  add("error", "error (distance to the true surface)", "m", "signed");
  add("sigma", "estimated standard deviation", "m", "sequential");
  const time = shorts(cloud.time);
  known.time = { name: "time", unit: "s", scale: "sequential", lower: 0, upper: cloud.duration };
  known.time.codes = Uint8Array.from(time, (code) => Math.round((code / 65535) * 254));
  add("turn_rate", "angular velocity", "\u00b0/s", "sequential");
  add("intensity", "intensity", "", "sequential");
  const material = bytes(cloud.material);
  if (material.some((code) => code !== 255)) {
    known.material = { name: "surface material", codes: material, order: materialsByWeight(material, () => 1) };
  }
  known.height.codes = heightCodes(known.height, shorts(cloud.position));
  return known;
})();

// Codes of the height between the 1st and the 99th percentile, which become the range of the channel.
function heightCodes(channel, positions) {
  const { cloud } = data;
  const heights = Uint16Array.from({ length: cloud.count }, (_, k) => positions[3 * k + 2]);
  const sorted = heights.slice().sort();
  const low = sorted[Math.floor(0.01 * sorted.length)] ?? 0;
  const high = Math.max(sorted[Math.floor(0.99 * (sorted.length - 1))] ?? 1, low + 1);
  const metres = (code) => cloud.lower[2] + (code / 65535) * (cloud.upper[2] - cloud.lower[2]);
  channel.lower = metres(low);
  channel.upper = metres(high);
  return Uint8Array.from(heights, (code) => Math.round(Math.min(Math.max((code - low) / (high - low), 0), 1) * 254));
}

// Shows the colours of materials in the legend.
const showMaterials = (order) => {
  byId("legend").replaceChildren();
  addElement(byId("legend"), "span", "surface material");
  const keys = addElement(byId("legend"), "div", "");
  order.forEach((code, rank) => {
    const key = addElement(keys, "span", "", "key");
    addElement(key, "i", "").style.background = materialColour(rank);
    addElement(key, "span", data.materials[code]);
  });
};

// Shows the scale of a channel in the legend.
const showLegend = (channel) => {
  if (!channel.scale) return showMaterials(channel.order);
  const [legend, add] = [byId("legend"), addElement];
  legend.replaceChildren();
  add(legend, "span", channel.name);
  add(legend, "span", "", "bar").style.background = `linear-gradient(to right, ${SCALES[channel.scale].join(",")})`;
  const ends = add(legend, "div", "", "ends");
  rangeInWords(channel.lower, channel.upper, channel.unit).forEach((end) => add(ends, "span", end));
};
