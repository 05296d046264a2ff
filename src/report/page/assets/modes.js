// The head on its spring, at rest and in its modes.

// Duration of a cycle in slow motion, s.
const SLOW_CYCLE_S = 2;
// A mode with a smaller amplitude in the shake is not excited by it.
const LEAST_SHAKEN = 1e-4;
// Half of the extent of a head whose parts have no size, m.
const ASSUMED_M = 0.06;
// Length of the axes as a fraction of the radius of the view.
const AXIS_FRACTION = 0.38;
// The largest displacement of a mode, m.
const LARGEST_SHIFT_M = 0.04;

const fixedBase = { position: new vendor.Vector3(), quaternion: new vendor.Quaternion() };
const rest = within(fixedBase, data.rest);
const centre = new vendor.Vector3().fromArray(data.centre);

// The pose of the head that a mode displaces from its rest pose.
const displaced = (mode, amount) => {
  const shift = new vendor.Vector3().fromArray(mode.shape, 0).multiplyScalar(amount);
  const axis = new vendor.Vector3().fromArray(mode.shape, 3);
  const angle = axis.length() * amount;
  const turn = new vendor.Quaternion().setFromAxisAngle(axis.lengthSq() > 0 ? axis.normalize() : axis.set(0, 0, 1), angle);
  const arm = rest.position.clone().sub(centre).applyQuaternion(turn);
  return { position: arm.add(centre).add(shift), quaternion: turn.multiply(rest.quaternion) };
};

// The corners of a part in the base, at rest; the bits of the index choose the sides.
const partCorners = ({ centre, size }) =>
  Array.from({ length: 8 }, (_, bits) => {
    const corner = centre.map((x, axis) => x + ((bits >> axis) & 1 ? 0.5 : -0.5) * size[axis]);
    return within(rest, [...corner, 0, 0, 0, 1]).position;
  });

// The edges of the parts at rest.
const outlines = () => {
  const positions = [];
  for (const part of data.parts) {
    const corners = partCorners(part);
    corners.forEach((corner, bits) => {
      for (const axis of [1, 2, 4]) if (!(bits & axis)) positions.push(...corner, ...corners[bits | axis]);
    });
  }
  const geometry = new vendor.BufferGeometry();
  geometry.setAttribute("position", new vendor.BufferAttribute(new Float32Array(positions), 3));
  return new vendor.LineSegments(geometry, new vendor.LineBasicMaterial());
};

class ModesView extends Stage {
  constructor(canvas) {
    super(canvas);
    this.directions.oblique = [-0.62, -0.78, 0.3];
    this.head = new Head(this.scene, data);
    this.rest = outlines();
    this.scene.add(this.rest);
    this.addAxes();
    this.start();
    this.show(null, 0);
  }

  // The axes of the base at the centre of mass, in front of everything, with their names.
  addAxes() {
    this.axes = new vendor.Group();
    this.axes.position.copy(centre);
    const length = AXIS_FRACTION * radiusOf(this.extent);
    this.axisMaterial = new vendor.LineMaterial({ linewidth: 2, depthTest: false, transparent: true });
    this.axisNames = ["x", "y", "z"].map((name, axis) => {
      const end = [0, 1, 2].map((k) => (k === axis ? length : 0));
      const line = wideLine([0, 0, 0, ...end], this.axisMaterial);
      line.renderOrder = 5;
      this.axes.add(line);
      const label = addElement(this.canvas.parentElement, "span", name, "axis");
      label.setAttribute("aria-hidden", "true");
      return { label, place: new vendor.Vector3(...end).multiplyScalar(1.1).add(centre) };
    });
    this.scene.add(this.axes);
  }

  // The box of head and linkage at rest, with room for their displacement.
  get extent() {
    const points = data.parts.flatMap(partCorners);
    if (!points.length) points.push(rest.position.clone().subScalar(ASSUMED_M), rest.position.clone().addScalar(ASSUMED_M));
    for (const link of data.links) {
      const ends = link.foot ? [within(fixedBase, link.foot), within(rest, link.top)].map((end) => end.position) : [];
      if (link.from) ends.push(new vendor.Vector3(...link.from), within(rest, [...link.to, 0, 0, 0, 1]).position);
      const radius = link.radius ?? 0;
      ends.forEach((end) => points.push(end.clone().subScalar(radius), end.clone().addScalar(radius)));
    }
    const low = points.reduce((low, point) => low.min(point), new vendor.Vector3(1e9, 1e9, 1e9));
    const high = points.reduce((high, point) => high.max(point), new vendor.Vector3(-1e9, -1e9, -1e9));
    const room = new vendor.Vector3(1, 1, 0.5).multiplyScalar(LARGEST_SHIFT_M);
    return { low: low.sub(room), high: high.add(room) };
  }

  // Shows a mode (null: the rest pose) displaced by an amount.
  show(mode, amount) {
    this.isMoved = Boolean(mode);
    this.head.place(mode ? displaced(mode, amount) : rest, fixedBase);
    this.draw();
  }

  paint() {
    this.head.paint();
    this.rest.material.color.set(themeColour("soft"));
    this.axisMaterial.color.set(themeColour("estimate"));
    super.paint();
  }

  render() {
    this.rest.visible = this.isMoved && byId("show-rest").checked;
    this.axes.visible = byId("show-axes").checked;
    super.render();
    this.placeAxisNames();
    this.showScale();
  }

  placeAxisNames() {
    const { width, height } = this.size;
    for (const { label, place } of this.axisNames) {
      const { x, y, z } = place.clone().project(this.camera);
      label.hidden = !this.axes.visible || Math.abs(x) > 0.97 || Math.abs(y) > 0.97 || z > 1;
      label.style.transform = `translate(${((x + 1) / 2) * width}px, ${((1 - y) / 2) * height}px) translate(-50%, -50%)`;
    }
  }

  // A bar of a round length at the distance of the target.
  showScale() {
    const away = this.camera.position.distanceTo(this.controls.target);
    const pixelsPerMetre = this.size.height / (2 * away * Math.tan((this.camera.fov * Math.PI) / 360));
    const decade = 10 ** Math.floor(Math.log10(120 / pixelsPerMetre));
    const length = [5, 2, 1].map((digit) => digit * decade).find((length) => length * pixelsPerMetre <= 120);
    const bar = byId("scale");
    bar.textContent = length < 1 ? `${Number((length * 1e3).toPrecision(1))} mm` : `${length} m`;
    bar.style.setProperty("--length", `${length * pixelsPerMetre}px`);
  }
}

// The state of the animation.
const motion = {
  mode: null,
  // 0 to 1; a quarter is the largest displacement.
  phase: 0.25,
  get amplitude() {
    return byId("amplitude").valueAsNumber;
  },
  // Cycles of the animation in a second.
  get rate() {
    const speed = byId("speed").value;
    return speed === "slow" ? 1 / SLOW_CYCLE_S : this.mode.frequency * Number(speed);
  },
};

const timesInWords = (ratio) => (ratio >= 100 ? ratio.toFixed(0) : Number(ratio.toPrecision(2)).toString());

// Displacement and rotation of a mode, and whether it is enlarged.
const amplitudeInWords = ({ shape, shaken }, amplitude) => {
  const millimetres = Math.hypot(...shape.slice(0, 3)) * amplitude * 1e3;
  const degrees = (Math.hypot(...shape.slice(3)) * amplitude * 180) / Math.PI;
  const size = `${degrees.toFixed(1)}\u00b0 and ${millimetres.toFixed(1)} mm`;
  if (shaken < LEAST_SHAKEN) return `${size}: enlarged, the shake does not excite this mode`;
  const ratio = amplitude / shaken;
  return `${size}: ${ratio > 1.05 ? "enlarged, " : ""}${timesInWords(ratio)} times the response`;
};

const inSeconds = (seconds) => (seconds < 0.1 ? `${(seconds * 1e3).toFixed(1)} ms` : `${seconds.toFixed(2)} s`);

const showMotion = (view) => {
  const { mode, phase } = motion;
  const [slider, clock] = [byId("time"), byId("clock")];
  view.show(mode, mode ? motion.amplitude * Math.sin(2 * Math.PI * phase) : 0);
  slider.value = phase;
  slider.disabled = byId("amplitude").disabled = byId("speed").disabled = !mode;
  slider.setAttribute("aria-valuetext", `${(360 * phase).toFixed(0)} degrees`);
  clock.textContent = mode ? `${inSeconds(phase / mode.frequency)} of ${inSeconds(1 / mode.frequency)}` : "at rest";
};

const showAmplitude = () => {
  byId("amplitude-words").textContent = motion.mode ? amplitudeInWords(motion.mode, motion.amplitude) : "";
};

// Says by how much slow motion is slower than the mode.
const showSpeed = () => {
  const ratio = motion.mode ? motion.mode.frequency * SLOW_CYCLE_S : 1;
  const words = ratio > 1 ? `real time / ${timesInWords(ratio)}` : `${timesInWords(1 / ratio)} x real time`;
  const name = `${SLOW_CYCLE_S} s a cycle`;
  byId("speed").options[0].textContent = motion.mode ? `${name} (${words})` : name;
};

const setUpModes = (view) => {
  const radios = [...document.querySelectorAll("[name=mode]")];
  const choose = (mode) => {
    motion.mode = mode;
    motion.phase = 0.25;
    showSpeed();
    showAmplitude();
    showMotion(view);
  };
  const advance = (seconds) => {
    if (!motion.mode) return false;
    motion.phase = (motion.phase + seconds * motion.rate) % 1;
    showMotion(view);
    return true;
  };
  // Playing the rest pose plays the slowest mode.
  const rewind = () => {
    if (motion.mode) return;
    radios[1].checked = true;
    choose(data.modes[0]);
  };
  view.playback = new Playback(advance, rewind);
  for (const radio of radios) {
    radio.addEventListener("change", () => choose(data.modes[radio.value] ?? null));
  }
  byId("time").addEventListener("input", () => {
    motion.phase = byId("time").valueAsNumber;
    showMotion(view);
  });
  byId("amplitude").addEventListener("input", () => {
    showAmplitude();
    showMotion(view);
  });
  choose(null);
};

const view = openView(ModesView);
if (view) {
  for (const id of ["show-rest", "show-axes"]) byId(id).addEventListener("change", () => view.draw());
  document.querySelector("[data-needs=modes]").hidden = !data.modes.length;
  if (data.modes.length) setUpModes(view);
}
