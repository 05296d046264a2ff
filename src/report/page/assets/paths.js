// Paths of head and base, their lines and markers, and the time of the view.

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

// A path as a line that nothing hides; the truth is dashed and in front. The casing of the other one separates it from points and
// surfaces of a similar colour.
const pathLine = (path, isDashed) => {
  const options = { linewidth: isDashed ? 1.6 : 3, depthTest: false, depthWrite: false, transparent: true };
  const positions = pathPositions(path);
  const dashes = { dashed: true, dashSize: dashLength(positions), gapSize: dashLength(positions) };
  const line = wideLine(positions, new vendor.LineMaterial(isDashed ? { ...options, ...dashes } : options));
  if (isDashed && positions.length) line.computeLineDistances();
  line.renderOrder = isDashed ? 3 : 2;
  if (isDashed) return line;
  line.casing = new vendor.Line2(line.geometry, new vendor.LineMaterial({ ...options, linewidth: 6, opacity: 0.8 }));
  line.casing.frustumCulled = false;
  line.casing.renderOrder = 1;
  return line.add(line.casing);
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

const estimate = new Path(data.estimate);
const truth = new Path(data.truth);
const base = new Path(data.base);
// On the page of a run that is not complete it grows.
let duration = Math.max(estimate.end, truth.end, data.cloud.count ? data.cloud.duration : 0, 1e-3);

// The time of the view; each listener is called when it changes.
const timer = {
  t: 0,
  listeners: [],
  set(t) {
    this.t = Math.min(Math.max(t, 0), duration);
    this.listeners.forEach((listener) => listener(this.t));
  },
};
