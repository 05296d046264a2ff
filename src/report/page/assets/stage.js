// The stage of a three-dimensional view: renderer, scene, and a camera that pointer and keyboard move.

const ARROWS = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
};

// Colour of the theme for a shader.
const shaderColour = (name) => new vendor.Vector3(...rgb(themeColour(name)).map((c) => c / 255));

// Half the size of the picture that "whole" fills, as a fraction.
const FILLED = 0.92;

const radiusOf = ({ low, high }) => low.distanceTo(high) / 2;

// The corners of a box; the bits of the index choose the sides.
const boxCorners = ({ low, high }) =>
  Array.from({ length: 8 }, (_, bits) => new vendor.Vector3(...[0, 1, 2].map((axis) => ((bits >> axis) & 1 ? high : low).getComponent(axis))));

// Where the camera must be on an axis of its picture, and how far back, so that it sees all corners between lines of sight with
// this slope. Corners are in the axes of the camera: x to the right, y up, z back.
const fitted = (corners, axis, slope) => {
  const reach = (sign) => Math.max(...corners.map((corner) => sign * corner.getComponent(axis) + slope * corner.z));
  const [right, left] = [reach(1), reach(-1)];
  return { middle: (right - left) / 2, back: (right + left) / (2 * slope) };
};

// A view derives from it, gives the box of what it shows as `extent`, and calls `start` when the scene is complete.
class Stage {
  constructor(canvas) {
    this.canvas = canvas;
    this.renderer = new vendor.WebGLRenderer({ canvas, antialias: true });
    this.renderer.autoClear = false;
    this.scene = new vendor.Scene();
    this.camera = new vendor.PerspectiveCamera(45, 1, 0.05, 2000);
    this.camera.up.set(0, 0, 1);
    this.directions = { oblique: [-0.5, -0.75, 0.75], top: [0, -1e-3, 1], side: [0, -1, 0.02] };
    this.controls = new vendor.OrbitControls(this.camera, canvas);
    this.controls.addEventListener("change", () => this.draw());
    this.playback = null;
    canvas.addEventListener("keydown", (event) => this.onKey(event));
    for (const from of Object.keys(this.directions)) {
      byId(`camera-${from}`).addEventListener("click", () => this.whole(from));
    }
  }

  start() {
    this.resize();
    this.whole("oblique");
    this.paint();
    onTheme.push(() => this.paint());
    new ResizeObserver(() => this.resize()).observe(this.canvas.parentElement);
  }

  // Shows everything, from one of three directions.
  whole(from) {
    const { extent } = this;
    this.camera.position.set(...this.directions[from]);
    this.camera.lookAt(0, 0, 0);
    const { quaternion } = this.camera;
    const turned = boxCorners(extent).map((corner) => corner.applyQuaternion(quaternion.clone().invert()));
    const half = FILLED * Math.tan((this.camera.fov * Math.PI) / 360);
    const [x, y] = [half * this.camera.aspect, half].map((slope, axis) => fitted(turned, axis, slope));
    const target = extent.low.clone().add(extent.high).multiplyScalar(0.5).applyQuaternion(quaternion.clone().invert());
    const place = new vendor.Vector3(x.middle, y.middle, Math.max(x.back, y.back));
    const away = place.z - target.z;
    this.camera.position.copy(place).applyQuaternion(quaternion);
    this.controls.target.set(place.x, place.y, target.z).applyQuaternion(quaternion);
    this.camera.near = Math.max(away / 1000, 0.02);
    this.camera.far = away * 20;
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.draw();
  }

  // Rotates the camera about its target; angles in rad.
  orbit(azimuth, elevation) {
    const offset = this.camera.position.clone().sub(this.controls.target);
    const radius = offset.length();
    const about = Math.atan2(offset.y, offset.x) + azimuth;
    const polar = Math.min(Math.max(Math.acos(offset.z / radius) - elevation, 0.01), Math.PI - 0.01);
    offset.set(Math.sin(polar) * Math.cos(about), Math.sin(polar) * Math.sin(about), Math.cos(polar));
    this.camera.position.copy(this.controls.target).addScaledVector(offset, radius);
    this.controls.update();
    this.draw();
  }

  // Moves camera and target sideways and up by fractions of their distance.
  pan(right, up) {
    const radius = this.camera.position.distanceTo(this.controls.target);
    const shift = new vendor.Vector3(right * radius, up * radius, 0).applyQuaternion(this.camera.quaternion);
    this.shift(shift);
    this.draw();
  }

  shift(by) {
    this.camera.position.add(by);
    this.controls.target.add(by);
    this.controls.update();
  }

  zoom(factor) {
    const offset = this.camera.position.clone().sub(this.controls.target).multiplyScalar(factor);
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    this.draw();
  }

  onKey(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const [right, up] = ARROWS[event.key] ?? [0, 0];
    if (right || up) event.shiftKey ? this.pan(0.05 * right, 0.05 * up) : this.orbit(-0.1 * right, 0.1 * up);
    else if (event.key === "+" || event.key === "=") this.zoom(0.85);
    else if (event.key === "-") this.zoom(1 / 0.85);
    else if (event.key === " ") this.playback?.toggle();
    else return;
    event.preventDefault();
  }

  // Takes the colours of the theme.
  paint() {
    this.renderer.setClearColor(themeColour("stage"));
    this.draw();
  }

  // Width and height of the stage in pixels of the page.
  get size() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    return { width, height };
  }

  resize() {
    const { width, height } = this.size;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  // Draws before the next picture of the screen.
  draw() {
    if (this.isWaiting) return;
    this.isWaiting = true;
    requestAnimationFrame(() => {
      this.isWaiting = false;
      this.render();
      document.documentElement.dataset.drawn ??= String(Math.round(performance.now()));
    });
  }

  render() {
    const { width, height } = this.size;
    this.renderer.setViewport(0, 0, width, height);
    this.renderer.setScissorTest(false);
    this.renderer.clear();
    this.renderer.render(this.scene, this.camera);
  }
}

// Builds the view of the page; without WebGL, null and the reason in place of the view.
const openView = (View) => {
  try {
    return new View(byId("scene"));
  } catch (error) {
    byId("legend").textContent = `The 3-D view needs WebGL, which this browser does not offer (${error.message}).`;
    return null;
  }
};
