// The point cloud and the live scan.

// Duration of the live scan, s.
const LIVE_S = 0.05;
// Maximum number of beams of the live scan.
const MAX_BEAMS = 400;

const cloudMaterial = () =>
  new vendor.ShaderMaterial({
    uniforms: {
      lower: { value: new vendor.Vector3(...data.cloud.lower) },
      extent: { value: new vendor.Vector3(...data.cloud.upper.map((x, k) => x - data.cloud.lower[k])) },
      colours: { value: null },
      size: { value: 2 },
      slice: { value: [-1e9, 1e9] },
      latest: { value: 2 },
    },
    vertexShader: `
      attribute float code;
      attribute float time;
      uniform vec3 lower, extent;
      uniform float size, latest;
      uniform float slice[2];
      uniform sampler2D colours;
      varying vec3 colour;
      void main() {
        vec3 place = lower + position * extent;
        bool hidden = place.z < slice[0] || place.z > slice[1] || time > latest;
        colour = texture2D(colours, vec2((code * 255.0 + 0.5) / 256.0, 0.5)).rgb;
        gl_PointSize = size;
        gl_Position = hidden ? vec4(2.0, 2.0, 2.0, 1.0) : projectionMatrix * modelViewMatrix * vec4(place, 1.0);
      }`,
    fragmentShader: `
      varying vec3 colour;
      void main() {
        vec2 from = gl_PointCoord - 0.5;
        if (dot(from, from) > 0.25) discard;
        gl_FragColor = vec4(colour, 1.0);
      }`,
  });

const texture = (colours) => {
  const made = new vendor.DataTexture(colours, 256, 1, vendor.RGBAFormat);
  made.needsUpdate = true;
  return made;
};

class Cloud {
  constructor(scene) {
    const { cloud } = data;
    this.codes = shorts(cloud.position);
    this.times = shorts(cloud.time);
    const geometry = new vendor.BufferGeometry();
    geometry.setAttribute("position", new vendor.BufferAttribute(this.codes, 3, true));
    geometry.setAttribute("time", new vendor.BufferAttribute(this.times, 1, true));
    geometry.setAttribute("code", new vendor.BufferAttribute(channels.height.codes, 1, true));
    this.points = new vendor.Points(geometry, cloudMaterial());
    this.points.frustumCulled = false;
    this.points.visible = cloud.count > 0;

    const lines = new vendor.BufferGeometry();
    lines.setAttribute("position", new vendor.BufferAttribute(new Float32Array(6 * MAX_BEAMS), 3));
    this.beams = new vendor.LineSegments(lines, new vendor.LineBasicMaterial({ transparent: true, opacity: 0.45 }));
    this.beams.frustumCulled = false;
    scene.add(this.points, this.beams);
  }

  get uniforms() {
    return this.points.material.uniforms;
  }

  // Colours the points by a channel.
  colour(key) {
    const channel = channels[key];
    const colours = channel.scale ? table(SCALES[channel.scale]) : materialTable(channel.order);
    this.uniforms.colours.value?.dispose();
    this.uniforms.colours.value = texture(colours);
    this.points.geometry.setAttribute("code", new vendor.BufferAttribute(channel.codes, 1, true));
    showLegend(channel);
  }

  place(k) {
    const { lower, upper } = data.cloud;
    return [0, 1, 2].map((axis) => lower[axis] + (this.codes[3 * k + axis] / 65535) * (upper[axis] - lower[axis]));
  }

  // Draws the beams from the sensor to the points that it has measured just before time t.
  live(t, sensor) {
    const code = (seconds) => (seconds / data.cloud.duration) * 65535;
    const first = firstAfter(this.times, code(t - LIVE_S));
    const last = sensor ? Math.min(firstAfter(this.times, code(t)), first + MAX_BEAMS) : first;
    this.drawBeams(sensor, last - first, (k) => this.place(first + k));
  }

  // Draws beams from the sensor to a number of points.
  drawBeams(sensor, count, place) {
    const { position } = this.beams.geometry.attributes;
    for (let k = 0; k < count; k++) position.array.set([sensor.x, sensor.y, sensor.z, ...place(k)], 6 * k);
    position.needsUpdate = true;
    this.beams.geometry.setDrawRange(0, 2 * count);
  }
}
