// Paths, head, base, and the elements between them.

// Points of a coil in the drawing of a spring.
const POINTS_PER_COIL = 20;

// A line with a width in pixels; positions are x, y, z for each point.
const wideLine = (positions, material) => {
  const line = new vendor.Line2(new vendor.LineGeometry(), material);
  if (positions.length) line.geometry.setPositions(positions);
  line.frustumCulled = false;
  return line;
};

// Length of a dash: a fraction of the size of a path, m.
const dashLength = (positions) => {
  const spread = (axis) => {
    const values = positions.filter((_, k) => k % 3 === axis);
    return values.reduce((most, x) => Math.max(most, x), -Infinity) - values.reduce((least, x) => Math.min(least, x), Infinity);
  };
  return Math.min(Math.max(Math.hypot(spread(0), spread(1), spread(2)) / 100, 0.02), 2) || 0.1;
};

const pathPositions = (path) => {
  const positions = [];
  for (let k = 0; k < path.t.length; k++) positions.push(...path.pose.subarray(7 * k, 7 * k + 3));
  return positions;
};

// A path as a line that nothing hides; the truth is dashed and in front.
const pathLine = (path, isDashed) => {
  const options = { linewidth: isDashed ? 1.6 : 3, depthTest: false, depthWrite: false, transparent: true };
  const positions = pathPositions(path);
  const dashes = { dashed: true, dashSize: dashLength(positions), gapSize: dashLength(positions) };
  const line = wideLine(positions, new vendor.LineMaterial(isDashed ? { ...options, ...dashes } : options));
  if (isDashed && positions.length) line.computeLineDistances();
  line.renderOrder = isDashed ? 3 : 2;
  return line;
};

// Round or square markers of a fixed size on the screen: start, end and present position.
class Markers {
  constructor(scene) {
    const geometry = new vendor.BufferGeometry();
    geometry.setAttribute("position", new vendor.BufferAttribute(new Float32Array(9), 3));
    geometry.setAttribute("kind", new vendor.BufferAttribute(new Float32Array([0, 1, 2]), 1));
    const material = new vendor.ShaderMaterial({
      uniforms: { ratio: { value: 1 }, fill: { value: [] }, edge: { value: new vendor.Vector3() } },
      vertexShader: `
        attribute float kind;
        uniform float ratio;
        varying float what;
        void main() {
          what = kind;
          gl_PointSize = ratio * (kind > 1.5 ? 12.0 : 14.0);
          gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
        }`,
      fragmentShader: `
        uniform vec3 fill[3];
        uniform vec3 edge;
        varying float what;
        void main() {
          vec2 from = abs(gl_PointCoord - 0.5) * 2.0;
          float away = what > 0.5 && what < 1.5 ? max(from.x, from.y) : length(from);
          if (away > 1.0) discard;
          vec3 inside = what < 0.5 ? fill[0] : what < 1.5 ? fill[1] : fill[2];
          gl_FragColor = vec4(away > 0.7 ? edge : inside, 1.0);
        }`,
      depthTest: false,
      transparent: true,
    });
    this.points = new vendor.Points(geometry, material);
    this.points.frustumCulled = false;
    this.points.renderOrder = 5;
    this.points.visible = estimate.isKnown;
    if (estimate.isKnown) {
      this.put(0, estimate.position(0));
      this.put(1, estimate.position(estimate.t.length - 1));
    }
    scene.add(this.points);
  }

  put(index, position) {
    const attribute = this.points.geometry.attributes.position;
    attribute.setXYZ(index, position.x, position.y, position.z);
    attribute.needsUpdate = true;
  }
}

const box = (size, material) => new vendor.Mesh(new vendor.BoxGeometry(...size), material);

// A spring as a helix whose centre line is a cubic from the foot to the top, tangent to both axes.
class Spring {
  constructor(link, material) {
    this.link = link;
    this.count = Math.max(2, Math.round(link.coils * POINTS_PER_COIL)) + 1;
    this.places = new Float32Array(3 * this.count);
    this.line = wideLine(this.places, material);
  }

  update(basePose, headPose) {
    const { link, count, places } = this;
    const [foot, top] = [within(basePose, link.foot), within(headPose, link.top)];
    const length = foot.position.distanceTo(top.position);
    const axis = (end) => new vendor.Vector3(0, 0, length).applyQuaternion(end.quaternion);
    const [fromFoot, fromTop] = [axis(foot), axis(top)];
    const [turned, place] = [new vendor.Quaternion(), new vendor.Vector3()];
    for (let k = 0; k < count; k++) {
      const s = k / (count - 1);
      const angle = 2 * Math.PI * link.coils * s;
      turned.copy(foot.quaternion).slerp(top.quaternion, s);
      place.set(link.radius * Math.cos(angle), link.radius * Math.sin(angle), 0).applyQuaternion(turned);
      place.addScaledVector(foot.position, 1 + s * s * (2 * s - 3)).addScaledVector(top.position, s * s * (3 - 2 * s));
      place.addScaledVector(fromFoot, s * (1 - s) * (1 - s)).addScaledVector(fromTop, s * s * (s - 1));
      place.toArray(places, 3 * k);
    }
    this.line.geometry.setPositions(places);
  }
}

class Cord {
  constructor(link, material) {
    this.link = link;
    this.line = wideLine(new Float32Array(6), material);
  }

  update(basePose, headPose) {
    const { from, to } = this.link;
    const place = (pose, point) => new vendor.Vector3(...point).applyQuaternion(pose.quaternion).add(pose.position);
    this.line.geometry.setPositions([...place(basePose, from), ...place(headPose, to)]);
  }
}

// A pose of seven numbers within another pose.
const within = (pose, seven) => ({
  position: new vendor.Vector3().fromArray(seven, 0).applyQuaternion(pose.quaternion).add(pose.position),
  quaternion: pose.quaternion.clone().multiply(new vendor.Quaternion().fromArray(seven, 3)),
});

// Head, base and what connects them. The elements need the true poses of both; the head is drawn where it truly is then.
class Head {
  constructor(scene) {
    this.materials = {
      head: new vendor.MeshBasicMaterial(),
      second: new vendor.MeshBasicMaterial(),
      front: new vendor.MeshBasicMaterial(),
      base: new vendor.MeshBasicMaterial(),
      link: new vendor.LineMaterial({ linewidth: 1.8 }),
    };
    this.head = new vendor.Group();
    const assumed = [{ centre: [0, 0, -0.02], size: [0.06, 0.06, 0.09] }];
    const parts = data.parts.length ? data.parts : assumed;
    parts.forEach(({ centre, size }, k) => {
      const part = box(size, k > 0 ? this.materials.second : this.materials.head);
      part.position.set(...centre);
      this.head.add(part);
    });
    // The scan plane of a laser at the origin of the head, as a band about the first part.
    this.head.add(box([1.04 * parts[0].size[0], 1.04 * parts[0].size[1], 0.008], this.materials.front));
    this.base = box([0.036, 0.036, 0.13], this.materials.base);
    const link = (spec) => new (spec.foot ? Spring : Cord)(spec, this.materials.link);
    this.links = data.links.map(link);
    scene.add(this.head, this.base, ...this.links.map((each) => each.line));
  }

  // Moves everything to time t and returns the pose of the head, or null.
  update(t) {
    const [headPose, basePose] = [truth.at(t) ?? estimate.at(t), base.at(t)];
    this.head.visible = Boolean(headPose);
    this.base.visible = Boolean(basePose);
    if (headPose) {
      this.head.position.copy(headPose.position);
      this.head.quaternion.copy(headPose.quaternion);
    }
    if (basePose) {
      const below = new vendor.Vector3(0, 0, -0.065).applyQuaternion(basePose.quaternion);
      this.base.position.copy(basePose.position).add(below);
      this.base.quaternion.copy(basePose.quaternion);
    }
    this.links.forEach((link) => {
      link.line.visible = Boolean(headPose && basePose);
      if (link.line.visible) link.update(basePose, headPose);
    });
    return headPose && { head: headPose, base: basePose };
  }
}
