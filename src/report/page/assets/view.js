// The three-dimensional view of a run or a scene, with a close-up of head and spring.

// The close-up shows this height, m.
const CLOSE_UP_M = 0.45;

// Twice the area of a triangle.
const twiceArea = (corners, k) => {
  const at = (corner) => new vendor.Vector3().fromArray(corners, 9 * k + 3 * corner);
  return at(1).sub(at(0)).cross(at(2).sub(at(0))).length();
};
const surfaceCorners = floats(data.surfaces);
const sceneMaterials = materialsByWeight(data.surfaceMaterials, (k) => twiceArea(surfaceCorners, k));

// The surfaces: those of a scene opaque, those of a run as a background.
const surfaceMesh = () => {
  const corners = surfaceCorners;
  const colours = data.materials.map((_, code) => rgb(materialColour(Math.max(sceneMaterials.indexOf(code), 0))));
  const shades = new Float32Array(corners.length);
  const [a, b, c] = [new vendor.Vector3(), new vendor.Vector3(), new vendor.Vector3()];
  const light = new vendor.Vector3(0.4, 0.25, 0.88).normalize();
  for (let k = 0; k < corners.length; k += 9) {
    a.fromArray(corners, k);
    b.fromArray(corners, k + 3).sub(a);
    c.fromArray(corners, k + 6).sub(a);
    const shade = 0.35 + 0.65 * Math.abs(b.cross(c).normalize().dot(light));
    if (!isScene) shades.fill(shade, k, k + 9);
    else for (let at = k; at < k + 9; at++) {
      // Vertex colours are linear; the exponent is that of sRGB.
      shades[at] = Math.pow(colours[data.surfaceMaterials[k / 9]][(at - k) % 3] / 255, 2.2) * shade;
    }
  }
  const geometry = new vendor.BufferGeometry();
  geometry.setAttribute("position", new vendor.BufferAttribute(corners, 3));
  geometry.setAttribute("color", new vendor.BufferAttribute(shades, 3));
  const background = { transparent: true, opacity: 0.1, depthWrite: false };
  const options = { vertexColors: true, side: vendor.DoubleSide, ...(isScene ? {} : background) };
  const mesh = new vendor.Mesh(geometry, new vendor.MeshBasicMaterial(options));
  mesh.visible = false;
  return mesh;
};

class View extends Stage {
  constructor(canvas) {
    super(canvas);
    this.renderer.localClippingEnabled = true;
    this.cloud = new Cloud(this.scene);
    this.estimate = pathLine(estimate, false);
    this.truth = pathLine(truth, true);
    this.truth.visible = truth.isKnown;
    this.surfaces = surfaceMesh();
    this.planes = [new vendor.Plane(new vendor.Vector3(0, 0, 1), 1e9), new vendor.Plane(new vendor.Vector3(0, 0, -1), 1e9)];
    this.surfaces.material.clippingPlanes = this.planes;
    this.scene.add(this.surfaces, this.estimate, this.truth);
    this.head = new Head(this.scene, { parts: data.parts, links: data.links });
    this.head.addHandle();
    this.markers = new Markers(this.scene);

    this.closeUp = new vendor.PerspectiveCamera(30, 1, 0.05, 20);
    this.closeUp.up.set(0, 0, 1);
    this.follow = false;
    byId("closeup-label").textContent = data.links.length ? "Head and spring" : "Head and base";
    this.start();
    this.move(0);
    timer.listeners.push((t) => this.move(t));
  }

  // The box of the path and most of the cloud, or of the surfaces.
  get extent() {
    const [low, high] = [new vendor.Vector3(1e9, 1e9, 1e9), new vendor.Vector3(-1e9, -1e9, -1e9)];
    const spread = (values) => [values[Math.floor(0.02 * values.length)], values[Math.floor(0.98 * (values.length - 1))]];
    const add = (axis, [from, to]) => {
      low.setComponent(axis, Math.min(low.getComponent(axis), from));
      high.setComponent(axis, Math.max(high.getComponent(axis), to));
    };
    for (let axis = 0; axis < 3; axis++) {
      const places = Float32Array.from({ length: Math.min(data.cloud.count, 5000) }, (_, k) => {
        return this.cloud.place(Math.floor((k / 5000) * data.cloud.count))[axis];
      });
      if (places.length) add(axis, spread(places.sort()));
      if (isScene) add(axis, spread(this.corners(axis)));
      const poses = estimate.t.map((_, k) => estimate.pose[7 * k + axis]).sort();
      if (poses.length) add(axis, spread(poses));
    }
    if (low.x > high.x) return { low: new vendor.Vector3(-3, -3, -3), high: new vendor.Vector3(3, 3, 3) };
    const margin = 0.25;
    return { low: low.subScalar(margin), high: high.addScalar(margin) };
  }

  // The sorted coordinates of the corners of the surfaces along an axis.
  corners(axis) {
    return this.surfaces.geometry.attributes.position.array.filter((_, k) => k % 3 === axis).sort();
  }

  // Moves head, spring and live scan to time t.
  move(t) {
    // The head is drawn where it truly is, if that is known.
    const [headPose, basePose] = [truth.at(t) ?? estimate.at(t), base.at(t)];
    this.head.place(headPose, basePose);
    const poses = headPose && { head: headPose, base: basePose };
    const shown = estimate.at(t) ?? poses?.head;
    this.cloud.live(t, shown?.position);
    this.poses = poses;
    if (shown) this.markers.put(2, shown.position);
    if (this.follow && shown) this.shift(shown.position.clone().sub(this.controls.target));
    if (this.onlyPast) this.cloud.uniforms.latest.value = t / data.cloud.duration;
    this.draw();
  }

  set past(onlyPast) {
    this.onlyPast = onlyPast;
    this.cloud.uniforms.latest.value = onlyPast ? timer.t / data.cloud.duration : 2;
    this.draw();
  }

  set slice([low, high]) {
    this.cloud.uniforms.slice.value = [low, high];
    this.planes[0].constant = -low;
    this.planes[1].constant = high;
    this.draw();
  }

  paint() {
    const set = (material, name) => material.color.set(themeColour(name));
    set(this.estimate.material, "estimate");
    set(this.estimate.casing.material, "stage");
    set(this.truth.material, "truth");
    if (!isScene) set(this.surfaces.material, "soft");
    set(this.cloud.beams.material, "second");
    this.head.paint();
    const { uniforms } = this.markers.points.material;
    uniforms.fill.value = ["paper", "estimate", "second"].map(shaderColour);
    uniforms.edge.value = shaderColour("ink");
    super.paint();
  }

  resize() {
    this.markers.points.material.uniforms.ratio.value = Math.min(devicePixelRatio, 2);
    super.resize();
  }

  render() {
    this.head.head.visible = Boolean(this.poses);
    super.render();
    const { width, height } = this.size;
    this.renderCloseUp(width, height);
  }

  // Draws the head on its spring, upright and seen from its side, in the upper right corner.
  renderCloseUp(width, height) {
    const { poses, renderer } = this;
    const isShown = Boolean(poses?.base);
    byId("closeup-label").hidden = !isShown;
    if (!isShown) return;
    const size = Math.round(Math.min(0.3 * Math.min(width, height), 180));
    const forward = new vendor.Vector3(1, 0, 0).applyQuaternion(poses.base.quaternion);
    const heading = Math.atan2(forward.y, forward.x) - 1.2;
    const away = CLOSE_UP_M / 2 / Math.tan((this.closeUp.fov * Math.PI) / 360);
    const target = poses.base.position.clone().add(new vendor.Vector3(0, 0, 0.06));
    this.closeUp.position.set(Math.cos(heading) * away, Math.sin(heading) * away, 0.1).add(target);
    this.closeUp.lookAt(target);
    const hidden = [this.cloud.points, this.cloud.beams, this.markers.points, this.surfaces, this.estimate, this.truth];
    const visible = hidden.map((object) => object.visible);
    hidden.forEach((object) => (object.visible = false));
    const corner = [width - size - 8, height - size - 8, size, size];
    renderer.setViewport(...corner);
    renderer.setScissor(...corner);
    renderer.setScissorTest(true);
    renderer.setClearColor(themeColour("paper"));
    renderer.clear();
    renderer.render(this.scene, this.closeUp);
    renderer.setScissorTest(false);
    renderer.setClearColor(themeColour("stage"));
    hidden.forEach((object, k) => (object.visible = visible[k]));
    byId("closeup-label").style.cssText = `right:8px;top:${size + 12}px`;
  }
}
