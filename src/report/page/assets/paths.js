// Paths of head and base, and the time of the view.

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
