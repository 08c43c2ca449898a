// The moving machine: every card's shapes (assemble/drawing.py) on a canvas, at the clock's time. What shapes look like is
// `drawn`, made of outputs/glyphs/; it asks the machine for value, share, top, place, flat, axis_angle.
"use strict";

class Machine {
  // of a run, or of the runs of a deck with .step: the one that the clock is in is drawn.
  // scene: {planar, bodies, shapes, points, channels: [{name, unit, values}], time}
  constructor(run, canvas, clock) {
    Object.assign(this, { run, scene: run.scene, canvas, clock, arrows: true, labels: true, trace: null, yaw: -0.6, pitch: -0.45, perspective: false });
    this.scenes = run.runs.map((one) => one.scene).filter((scene) => scene?.rows);
    this.largest = run.scene.channels.map((_, k) => Math.max(...this.scenes.map(({ channels }) => channels[k]?.values.reduce((m, v) => Math.max(m, Math.abs(v)), channels[k].top ?? 0) ?? 0)));
    this.hush();
    this.upright = !this.planar && Math.abs(this.gravity[2]) > Math.hypot(this.gravity[0], this.gravity[1]);
    this.measure();
    this.fit();
    if (!this.planar) this.solids = Object.assign(new Solids(this.scene.shapes, this.reach, false), { ground: this.ground() });
    clock.listen(() => this.draw());
    this.sizes = new ResizeObserver(() => { if (this.width !== this.room()) { this.fit(); this.draw(); } });
    this.sizes.observe(canvas.parentElement);
    this.gone = new AbortController();
    this.mouse();
  }
  // one in the plane has thickness or has none; it is seen straight on
  solidify(on) { if (this.planar) this.solids = on ? (this.solids ?? new Solids(this.scene.shapes, this.reach, true)) : null; }
  // another run takes the place
  close() { this.gone.abort(); this.sizes.disconnect(); }
  // the view of the run before, where this one's machine fits into it: what grows is seen to grow
  keep(old) {
    const [x0, y0, x1, y1] = this.box, [a0, b0, a1, b1] = old.box, slack = 0.05 * old.size;
    Object.assign(this, { yaw: old.yaw, pitch: old.pitch, follow: old.follow });
    if (this.follow) this.fit();
    if (x0 < a0 - slack || y0 < b0 - slack || x1 > a1 + slack || y1 > b1 + slack || this.size < 0.4 * old.size) return;
    Object.assign(this, { box: old.box, size: old.size });
    this.fit();
    if (old.moved) Object.assign(this, { middle: old.middle, scale: old.scale, moved: true, followed: old.followed });
  }
  // rounding beside the largest of a unit: a force is nothing beside the forces of the others
  hush() {
    const { channels } = this.scene, most = {};
    channels.forEach(({ unit }, k) => { most[unit] = Math.max(most[unit] ?? 0, this.largest[k]); });
    this.noise = channels.map(({ unit }) => 1e-9 * most[unit]);
  }
  at(ref, t) {
    if (typeof ref !== "string") return ref;
    const k = +ref.slice(1), v = valueAt(this.scene.time, this.scene.channels[k].values, t);
    return Math.abs(v) < this.noise[k] ? 0 : v;
  }
  // at the instant that is drawn
  value(ref) { return this.at(ref, this.t); }
  share(ref) { return typeof ref === "string" ? this.value(ref) / (this.largest[+ref.slice(1)] || 1) : Math.sign(ref); }
  top(ref) { return typeof ref === "string" ? this.largest[+ref.slice(1)] : Math.abs(ref); }
  get planar() { return this.scene.planar; }
  get shapes() { return this.scene.shapes; }
  get gravity() { return this.scene.gravity; }

  // body pose at t: origin and rotation by rows
  pose(k, t) {
    const p = this.scene.bodies[k].at.map((ref) => this.at(ref, t));
    if (!this.scene.planar) return { o: p.slice(0, 3), r: p.slice(3), angle: 0 };
    const c = Math.cos(p[2]), s = Math.sin(p[2]);
    return { o: [p[0], p[1], 0], r: [c, -s, 0, s, c, 0, 0, 0, 1], angle: p[2] };
  }
  turned(pose, v) { const { r } = pose; return [0, 3, 6].map((i) => r[i] * v[0] + r[i + 1] * v[1] + r[i + 2] * (v[2] || 0)); }
  world(place, poses) {
    const pose = poses[place[0]], d = this.turned(pose, place.slice(1));
    return [0, 1, 2].map((i) => pose.o[i] + d[i]);
  }
  // world metres to metres on the screen's plane
  flat(p) {
    if (this.scene.planar) return [p[0], p[1]];
    const { right, up } = this.view();
    return [right[0] * p[0] + right[1] * p[1] + right[2] * p[2], up[0] * p[0] + up[1] * p[1] + up[2] * p[2]];
  }
  // the picture's axes in the world: to the right, upwards, towards the eye. What gravity pulls down is below: y is up, or z.
  view() {
    if (this.planar) return { right: [1, 0, 0], up: [0, 1, 0], towards: [0, 0, 1] };
    const cy = Math.cos(this.yaw), sy = Math.sin(this.yaw), cp = Math.cos(this.pitch), sp = Math.sin(this.pitch);
    const [right, up, towards] = [[cy, 0, sy], [-sp * sy, cp, sp * cy], [-cp * sy, -sp, cp * cy]].map(([x, y, z]) => (this.upright ? [x, -z, y] : [x, y, z]));
    return { right, up, towards };
  }
  near(p) { const { towards } = this.view(); return towards[0] * p[0] + towards[1] * p[1] + towards[2] * p[2]; }
  // of what is in the picture [m]
  get reach() { return (this.follow && 2.5 * Math.max(...this.largestPose)) || this.size; }
  // in perspective the eye is this far from the scene's middle [m]
  get far() { return 2.2 * this.size; }
  eye() {
    if (!this.perspective) return null;
    const { right, up, towards } = this.view(), deep = this.deep + this.far;
    return [0, 1, 2].map((i) => right[i] * this.middle[0] + up[i] * this.middle[1] + towards[i] * deep);
  }
  // place on the canvas [px], and a number that grows towards the eye and is linear over the picture
  project(p) {
    const [x, y] = this.flat(p), deep = this.near(p) - this.deep, f = this.perspective ? this.far / Math.max(0.05 * this.far, this.far - deep) : 1;
    return [this.centre[0] + (x - this.middle[0]) * this.scale * f, this.centre[1] - (y - this.middle[1]) * this.scale * f, this.perspective ? f : deep / this.size];
  }
  bias() { return BIAS; }
  screen(p) { return this.project(p).slice(0, 2); }

  // the box that the machine sweeps
  measure() {
    // a run that goes on begins as the one before it was seen
    const like = this.run.like?.machine;
    this.scenes.forEach((scene) => (scene.places = drawn.extents(scene.shapes)));
    if (like) {
      Object.assign(this, { box: [...like.box], size: like.size, deep: like.deep, follow: like.follow, largestPose: like.largestPose, largest: [...like.largest] });
      this.hush();
      return;
    }
    const box = [Infinity, Infinity, -Infinity, -Infinity], poses = [0, 0];
    for (const scene of this.scenes) this.measureOne(scene, box, poses);
    this.scene = this.run.scene;
    this.beside(box);
    this.largestPose = poses;
    this.box = Number.isFinite(box[0]) ? box : [-1, -1, 1, 1];
    this.size = Math.max(this.box[2] - this.box[0], this.box[3] - this.box[1]) || 1e-3;
    this.measureDepth();
    // what would be lost in the room that it crosses: the camera goes with it
    this.follow ??= Math.max(...poses) > 0 && Math.max(...poses) < 0.15 * this.size;
  }
  measureOne(scene, box, largest) {
    this.scene = scene;
    const { time, shapes } = scene;
    const stride = Math.max(1, Math.floor(time.length / 240));
    let wide = 0, tall = 0;
    for (let k = 0; k < time.length; k += stride) {
      const now = this.boxAt(time[k]);
      for (const i of [0, 1]) { box[i] = Math.min(box[i], now[i]); box[i + 2] = Math.max(box[i + 2], now[i + 2]); }
      const whole = this.boxAt(time[k], (one) => one.length < 3 || one[2] === 1);
      if (whole[2] >= whole[0]) { wide = Math.max(wide, whole[2] - whole[0]); tall = Math.max(tall, whole[3] - whole[1]); }
    }
    largest[0] = Math.max(largest[0], wide);
    largest[1] = Math.max(largest[1], tall);
    // what ties a slide to its wall is drawn from behind the joint
    const far = 0.25 * Math.max(box[2] - box[0], box[3] - box[1]);
    for (const s of shapes) if (drawn.walled(s) && far > 0) {
      const pose = this.pose(s.a[0], time[0]), [x, y] = this.flat(this.world(s.a, { [s.a[0]]: pose })), [dx, dy] = this.flat(this.turned(pose, s.axis)).map((d) => (s.ahead ? -d : d));
      box[0] = Math.min(box[0], x - far * dx); box[1] = Math.min(box[1], y - far * dy);
      box[2] = Math.max(box[2], x - far * dx); box[3] = Math.max(box[3], y - far * dy);
    }
  }
  // of what stands still and goes on, as much as stands beside the rest
  beside(box) {
    const still = this.boxAt(this.scene.time[0], (one) => one.length > 2), room = 0.4 * Math.max(box[2] - box[0], box[3] - box[1]);
    if (!Number.isFinite(box[0]) || !Number.isFinite(still[0])) { still.forEach((v, i) => { if (!Number.isFinite(box[i])) box[i] = v; }); return; }
    for (const i of [0, 1]) { box[i] = Math.min(box[i], Math.max(still[i], box[i] - room)); box[i + 2] = Math.max(box[i + 2], Math.min(still[i + 2], box[i + 2] + room)); }
  }
  // where the middle of what is seen lies towards the eye [m]
  measureDepth() {
    this.deep = 0;
    if (this.planar) return;
    const { time, places } = this.scene, poses = (this.follow && this.poses) || this.scene.bodies.map((_, b) => this.pose(b, time[0])), all = places.map(([place]) => this.near(this.world(place, poses))).filter(Number.isFinite);
    if (all.length) this.deep = (Math.min(...all) + Math.max(...all)) / 2;
  }
  // the floor below all that it sweeps: its middle, its normal, two directions in it; null where nothing pulls
  ground() {
    if (!(Math.hypot(...this.gravity) > 0)) return null;
    const above = unitary(this.gravity.map((g) => -g)), u = drawn.across(above), v = drawn.cross(above, u), low = [0, 0, 0].map(() => Infinity), high = low.map(() => -Infinity);
    for (const { time, places, bodies } of this.scenes) {
      for (let k = 0; k < time.length; k += Math.max(1, Math.floor(time.length / 60))) {
        const poses = bodies.map((_, b) => this.pose(b, time[k]));
        for (const [place, about] of places) {
          const at = this.world(place, poses);
          if (at.every(Number.isFinite)) [u, v, above].forEach((e, i) => { low[i] = Math.min(low[i], dot(e, at) - about); high[i] = Math.max(high[i], dot(e, at) + about); });
        }
      }
    }
    const [x, y, z] = [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2] - 0.02 * this.reach];
    return Number.isFinite(x) ? { at: above.map((e, i) => x * u[i] + y * v[i] + z * e), above, u, v, size: this.size } : null;
  }
  // the box of all places at an instant
  boxAt(t, of = (one) => one.length < 3) {
    const box = [Infinity, Infinity, -Infinity, -Infinity], poses = this.scene.bodies.map((_, b) => this.pose(b, t));
    for (const [place, about] of this.scene.places.filter(of)) {
      const [x, y] = this.flat(this.world(place, poses));
      if (!Number.isFinite(x + y)) continue;
      box[0] = Math.min(box[0], x - about); box[1] = Math.min(box[1], y - about);
      box[2] = Math.max(box[2], x + about); box[3] = Math.max(box[3], y + about);
    }
    return box;
  }
  fit() {
    const { canvas } = this, width = this.room();
    const [x0, y0, x1, y1] = this.box, margin = 46 * letters();
    let w = Math.max(x1 - x0, 0.25 * this.size), h = Math.max(y1 - y0, 0.25 * this.size);
    if (this.follow) {
      const most = Math.max(...this.largestPose) || this.size;
      w = h = 2.5 * most;
    }
    const height = Math.max(220, Math.min(tallest(this.run), width * Math.max(0.5, Math.min(1.15, h / w)) + 30));
    canvas.width = width * devicePixelRatio;
    canvas.height = height * devicePixelRatio;
    canvas.style.height = height + "px";
    this.centre = [width / 2, height / 2];
    this.middle = [(x0 + x1) / 2, (y0 + y1) / 2];
    this.scale = Math.min((width - 2 * margin) / w, (height - 2 * margin) / h) * (Number(this.scene.view.scale) || 1);
    Object.assign(this, { width, height, moved: false });
  }
  room() { return Math.max(160, this.canvas.parentElement.clientWidth); }
  // the wheel alone scrolls the page; with ctrl, which is what a trackpad's pinch sends too, it zooms. A mouse drags, or turns
  // what is spatial; one finger turns it and scrolls the page otherwise, two pinch and drag.
  mouse() {
    const c = this.canvas, { signal } = this.gone, held = new Map();
    c.addEventListener("wheel", (e) => {
      if (!(e.ctrlKey || e.metaKey)) return;
      e.preventDefault();
      const r = c.getBoundingClientRect();
      this.zoom(Math.exp(-0.005 * e.deltaY), e.clientX - r.left, e.clientY - r.top);
    }, { passive: false, signal });
    c.addEventListener("pointerdown", (e) => { held.set(e.pointerId, [e.clientX, e.clientY]); c.setPointerCapture(e.pointerId); }, { signal });
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) c.addEventListener(end, (e) => held.delete(e.pointerId), { signal });
    c.addEventListener("pointermove", (e) => {
      const last = held.get(e.pointerId), at = [e.clientX, e.clientY];
      if (!last) return;
      held.set(e.pointerId, at);
      const dx = at[0] - last[0], dy = at[1] - last[1], other = [...held].find(([id]) => id !== e.pointerId)?.[1];
      if (other) {
        const r = c.getBoundingClientRect(), far = (p) => Math.hypot(p[0] - other[0], p[1] - other[1]);
        this.drag(dx / 2, dy / 2);
        if (far(last) > 8) this.zoom(far(at) / far(last), (at[0] + other[0]) / 2 - r.left, (at[1] + other[1]) / 2 - r.top);
      } else if (!this.scene.planar && !e.shiftKey) {
        this.turn(0.01 * dx, -0.01 * dy);
      } else if (e.pointerType !== "touch") this.drag(dx, dy);
    }, { signal });
    c.addEventListener("keydown", (e) => {
      const by = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[e.key];
      if (!by || this.scene.planar || !e.shiftKey) return;
      e.preventDefault();
      e.stopPropagation();
      this.turn(...by);
    }, { signal });
  }
  turn(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = Math.max(-1.5, Math.min(1.5, this.pitch + pitch));
    this.measureDepth();
    this.draw();
  }
  drag(dx, dy) {
    this.middle[0] -= dx / this.scale;
    this.middle[1] += dy / this.scale;
    this.moved = true;
    this.draw();
  }
  // about a place of the canvas
  zoom(factor, px, py) {
    const x = px - this.centre[0], y = py - this.centre[1];
    this.middle[0] += x / this.scale * (1 - 1 / factor);
    this.middle[1] -= y / this.scale * (1 - 1 / factor);
    this.scale *= factor;
    this.moved = true;
    this.draw();
  }

  draw() {
    const ctx = this.canvas.getContext("2d"), style = getComputedStyle(document.documentElement), [n, t] = whereIn(this.run, this.clock.t);
    this.colour = (name) => style.getPropertyValue("--" + name).trim();
    ctx.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
    ctx.clearRect(0, 0, this.width, this.height);
    this.scene = this.run.runs[n].scene ?? this.run.scene;
    if (!Number.isFinite(t)) return; // of this run nothing was kept
    this.t = t;
    this.poses = this.scene.bodies.map((_, k) => this.pose(k, t));
    if (this.follow) {
      const [x0, y0, x1, y1] = this.boxAt(t);
      if (x1 >= x0) {
        const now = [(x0 + x1) / 2, (y0 + y1) / 2];
        // what the reader has dragged stays beside the machine
        this.middle = this.moved && this.followed ? this.middle.map((m, i) => m + now[i] - this.followed[i]) : now;
        this.followed = now;
        this.measureDepth();
      }
    }
    const pen = (this.pen = new Pen(ctx, this.colour, this.labels));
    drawn.paper(this, pen);
    this.solids?.show(this, ctx);
    this.drawTrace(pen, t);
    for (const layer of [0, 1, 2]) for (const s of this.scene.shapes) if (drawn.GLYPHS[s.kind]?.[0] === layer && !(this.solids && drawn.is_solid(s))) this.glyph(ctx, pen, s);
    if (this.solids) drawn.called(this, pen);
    if (this.held) this.hold(pen);
    pen.close(this.width, this.height);
  }
  // what is touched in the circuit stands in light
  glyph(ctx, pen, s) {
    ctx.save();
    if (this.lit && s.name === this.lit) Object.assign(ctx, { shadowColor: this.colour("accent"), shadowBlur: 18 * devicePixelRatio });
    drawn.GLYPHS[s.kind][1](this, pen, s);
    ctx.restore();
  }
  // a hand: from the point that it has to where it pulls
  hold(pen) {
    const { place, to } = this.held, a = this.place(place), b = this.screen(to);
    pen.line([a, b], "accent", 2, 5);
    pen.circle(a, 4, "accent", "accent", 1);
    pen.circle(b, 7, null, "accent", 2);
  }
  light(name) { if (this.lit !== name) { this.lit = name; this.draw(); } }
  // the name of the coupling at a place of the canvas, or null
  coupling(x, y) {
    const far = (s) => { const at = s.kind === "transducer" ? s.b : s.a; return at ? Math.hypot(...this.place(at).map((v, i) => v - [x, y][i])) : Infinity; };
    const found = this.scene.shapes.filter((s) => ["motor", "pot", "transducer"].includes(s.kind)).sort((a, b) => far(a) - far(b))[0];
    return found && far(found) < 30 ? found.name : null;
  }
  drawTrace(pen, t) {
    const point = this.scene.points.find((p) => p.name === this.trace), { time } = this.scene;
    if (!point) return;
    const points = [], stride = Math.max(1, Math.floor(time.length / 1500));
    for (let i = 0; i <= before(time, t); i += stride) points.push(this.pointAt(point.at, time[i]));
    pen.line([...points, this.pointAt(point.at, t)], "accent", 1.2);
  }
  pointAt(place, t) { const poses = []; poses[place[0]] = this.pose(place[0], t); return this.screen(this.world(place, poses)); }
  place(p) { return this.screen(this.world(p, this.poses)); }
  // a joint's axis on the screen, as an angle
  axis_angle(s) {
    const o = this.place(s.a), d = this.turned(this.poses[s.a[0]], s.axis), tip = this.world(s.a, this.poses).map((v, i) => v + d[i] * this.size * 0.1);
    const q = this.screen(tip);
    return Math.atan2(q[1] - o[1], q[0] - o[0]);
  }
}
