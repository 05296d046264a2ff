// The head, the base, and the elements between them.

// Points of a coil, and around the wire, in the drawing of a spring.
const POINTS_PER_COIL = 20;
const POINTS_AROUND = 8;
// Thickness of the plate at the foot of a spring, and size of the block at the end of a cord, m.
const PLATE_M = 0.004;
const ANCHOR_M = 0.008;
// Handle below the base, or above it if the head hangs: size, m.
const HANDLE_M = [0.036, 0.036, 0.13];

// A line with a width in pixels; positions are x, y, z for each point.
const wideLine = (positions, material) => {
  const line = new vendor.Line2(new vendor.LineGeometry(), material);
  if (positions.length) line.geometry.setPositions(positions);
  line.frustumCulled = false;
  return line;
};

// A material of one colour, lit from the camera's upper right.
const shaded = () =>
  new vendor.ShaderMaterial({
    uniforms: { colour: { value: new vendor.Vector3() } },
    vertexShader: `
      varying vec3 facing;
      void main() {
        facing = normalMatrix * normal;
        gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
      }`,
    fragmentShader: `
      uniform vec3 colour;
      varying vec3 facing;
      void main() {
        float light = 0.78 + 0.34 * dot(normalize(facing), normalize(vec3(0.4, 0.55, 0.73)));
        gl_FragColor = vec4(colour * light, 1.0);
      }`,
  });

const box = (size, material) => new vendor.Mesh(new vendor.BoxGeometry(...size), material);

// A pose of seven numbers within another pose.
const within = (pose, seven) => ({
  position: new vendor.Vector3().fromArray(seven, 0).applyQuaternion(pose.quaternion).add(pose.position),
  quaternion: pose.quaternion.clone().multiply(new vendor.Quaternion().fromArray(seven, 3)),
});

const moveTo = (object, pose) => {
  object.position.copy(pose.position);
  object.quaternion.copy(pose.quaternion);
};

// A spring as a wire along a helix whose centre line is a cubic from the foot to the top, tangent to both axes.
class Spring {
  constructor(link, materials) {
    this.link = link;
    this.count = Math.max(2, Math.round(link.coils * POINTS_PER_COIL)) + 1;
    this.places = Array.from({ length: this.count }, () => new vendor.Vector3());
    this.outward = Array.from({ length: this.count }, () => new vendor.Vector3());
    const geometry = new vendor.BufferGeometry();
    for (const name of ["position", "normal"]) {
      geometry.setAttribute(name, new vendor.BufferAttribute(new Float32Array(3 * POINTS_AROUND * this.count), 3));
    }
    geometry.setIndex(new vendor.BufferAttribute(this.triangles(), 1));
    this.object = new vendor.Mesh(geometry, materials.link);
    this.object.frustumCulled = false;
  }

  triangles() {
    const corners = [];
    for (let k = 0; k + 1 < this.count; k++) {
      for (let j = 0; j < POINTS_AROUND; j++) {
        const [a, b] = [k * POINTS_AROUND + j, k * POINTS_AROUND + ((j + 1) % POINTS_AROUND)];
        corners.push(a, b, a + POINTS_AROUND, b, b + POINTS_AROUND, a + POINTS_AROUND);
      }
    }
    return new Uint32Array(corners);
  }

  // A plate that the foot is fastened to, in the base.
  mount(material) {
    const { foot, radius } = this.link;
    const plate = box([3 * radius, 3 * radius, PLATE_M], material);
    const pose = within({ position: new vendor.Vector3(), quaternion: new vendor.Quaternion() }, foot);
    const below = new vendor.Vector3(0, 0, -PLATE_M / 2).applyQuaternion(pose.quaternion);
    moveTo(plate, { position: pose.position.add(below), quaternion: pose.quaternion });
    return plate;
  }

  update(basePose, headPose) {
    this.wind(within(basePose, this.link.foot), within(headPose, this.link.top));
    this.thicken();
  }

  // Computes the centre of the wire, and the direction away from the centre line there.
  wind(foot, top) {
    const { link, count } = this;
    const length = foot.position.distanceTo(top.position);
    const axis = (end) => new vendor.Vector3(0, 0, length).applyQuaternion(end.quaternion);
    const [fromFoot, fromTop, turned] = [axis(foot), axis(top), new vendor.Quaternion()];
    for (let k = 0; k < count; k++) {
      const s = k / (count - 1);
      const angle = 2 * Math.PI * link.coils * s;
      turned.copy(foot.quaternion).slerp(top.quaternion, s);
      const outward = this.outward[k].set(Math.cos(angle), Math.sin(angle), 0).applyQuaternion(turned);
      const place = this.places[k].copy(outward).multiplyScalar(link.radius);
      place.addScaledVector(foot.position, 1 + s * s * (2 * s - 3)).addScaledVector(top.position, s * s * (3 - 2 * s));
      place.addScaledVector(fromFoot, s * (1 - s) * (1 - s)).addScaledVector(fromTop, s * s * (s - 1));
    }
  }

  // Computes the surface of the wire.
  thicken() {
    const { places, outward, count, link } = this;
    const { position, normal } = this.object.geometry.attributes;
    const [along, across, facing] = [new vendor.Vector3(), new vendor.Vector3(), new vendor.Vector3()];
    for (let k = 0; k < count; k++) {
      along.subVectors(places[Math.min(k + 1, count - 1)], places[Math.max(k - 1, 0)]);
      across.crossVectors(along, outward[k]).normalize();
      for (let j = 0; j < POINTS_AROUND; j++) {
        const angle = (2 * Math.PI * j) / POINTS_AROUND;
        facing.copy(outward[k]).multiplyScalar(Math.cos(angle)).addScaledVector(across, Math.sin(angle));
        facing.toArray(normal.array, 3 * (k * POINTS_AROUND + j));
        facing.multiplyScalar(link.wire / 2).add(places[k]).toArray(position.array, 3 * (k * POINTS_AROUND + j));
      }
    }
    position.needsUpdate = normal.needsUpdate = true;
  }
}

class Cord {
  constructor(link, materials) {
    this.link = link;
    this.object = wideLine(new Float32Array(6), materials.cord);
  }

  // A block that the cord is fastened to, in the base.
  mount(material) {
    const block = box([ANCHOR_M, ANCHOR_M, ANCHOR_M], material);
    block.position.set(...this.link.from);
    return block;
  }

  update(basePose, headPose) {
    const { from, to } = this.link;
    const place = (pose, point) => new vendor.Vector3(...point).applyQuaternion(pose.quaternion).add(pose.position);
    this.object.geometry.setPositions([...place(basePose, from), ...place(headPose, to)]);
  }
}

// Head, base and what connects them.
class Head {
  constructor(scene, { parts, links }) {
    this.materials = {
      head: shaded(),
      second: shaded(),
      front: shaded(),
      base: shaded(),
      link: shaded(),
      cord: new vendor.LineMaterial({ linewidth: 1.8 }),
    };
    const { materials } = this;
    this.head = new vendor.Group();
    const assumed = [{ centre: [0, 0, -0.02], size: [0.06, 0.06, 0.09] }];
    const known = parts.length ? parts : assumed;
    known.forEach(({ centre, size }, k) => {
      const part = box(size, k > 0 ? materials.second : materials.head);
      part.position.set(...centre);
      this.head.add(part);
    });
    // The scan plane of a laser at the origin of the head, as a band about the first part.
    this.head.add(box([1.04 * known[0].size[0], 1.04 * known[0].size[1], 0.008], materials.front));
    this.links = links.map((link) => new (link.foot ? Spring : Cord)(link, materials));
    this.base = new vendor.Group();
    this.links.forEach((link) => this.base.add(link.mount(materials.base)));
    scene.add(this.head, this.base, ...this.links.map((link) => link.object));
  }

  // Draws a handle, on the side of the base that is away from the head.
  addHandle() {
    this.handle = box(HANDLE_M, this.materials.base);
    this.base.add(this.handle);
  }

  // Moves everything; a pose that is not known is null.
  place(headPose, basePose) {
    this.head.visible = Boolean(headPose);
    this.base.visible = Boolean(basePose);
    if (headPose) moveTo(this.head, headPose);
    if (basePose) moveTo(this.base, basePose);
    const isKnown = Boolean(headPose && basePose);
    if (this.handle) {
      const isHanging = isKnown && headPose.position.z < basePose.position.z;
      this.handle.position.z = (isHanging ? 0.5 : -0.5) * HANDLE_M[2];
    }
    this.links.forEach((link) => {
      link.object.visible = isKnown;
      if (isKnown) link.update(basePose, headPose);
    });
  }

  // Takes the colours of the theme.
  paint() {
    const names = { head: "soft", second: "part", front: "second", base: "soft", link: "soft" };
    for (const [key, name] of Object.entries(names)) this.materials[key].uniforms.colour.value = shaderColour(name);
    this.materials.cord.color.set(themeColour("ink"));
  }
}
