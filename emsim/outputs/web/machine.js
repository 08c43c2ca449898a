// The moving machine: every card's shapes (assemble/drawing.py) on a canvas, at the clock's time.
"use strict";

class Machine {
  // of a run, or of the runs of a deck with .step: the one that the clock is in is drawn.
  // scene: {planar, bodies, shapes, points, channels: [{name, unit, values}], time}
  constructor(run, canvas, clock) {
    Object.assign(this, { run, scene: run.scene, canvas, clock, arrows: true, labels: true, trace: null, yaw: -0.6, pitch: 0.45 });
    this.scenes = run.runs.map((one) => one.scene).filter((scene) => scene?.rows);
    this.largest = run.scene.channels.map((_, k) => Math.max(...this.scenes.map(({ channels }) => channels[k]?.values.reduce((m, v) => Math.max(m, Math.abs(v)), 0) ?? 0)));
    this.measure();
    this.fit();
    clock.listen(() => this.draw());
    this.sizes = new ResizeObserver(() => { if (this.width !== this.room()) { this.fit(); this.draw(); } });
    this.sizes.observe(canvas.parentElement);
    this.gone = new AbortController();
    this.mouse();
  }
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
  at(ref, t) {
    if (typeof ref !== "string") return ref;
    const k = +ref.slice(1), v = valueAt(this.scene.time, this.scene.channels[k].values, t);
    return Math.abs(v) < 1e-9 * this.largest[k] ? 0 : v; // rounding noise
  }
  share(ref, t) { return typeof ref === "string" ? this.at(ref, t) / (this.largest[+ref.slice(1)] || 1) : Math.sign(ref); }

  // body pose at t: origin and rotation by rows
  pose(k, t) {
    const p = this.scene.bodies[k].at.map((ref) => this.at(ref, t));
    if (!this.scene.planar) return { o: p.slice(0, 3), r: p.slice(3) };
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
    const cy = Math.cos(this.yaw), sy = Math.sin(this.yaw), cp = Math.cos(this.pitch), sp = Math.sin(this.pitch);
    const x = cy * p[0] + sy * p[2], z = -sy * p[0] + cy * p[2];
    return [x, cp * p[1] + sp * z];
  }
  screen(p) { const [x, y] = this.flat(p); return [this.centre[0] + (x - this.middle[0]) * this.scale, this.centre[1] - (y - this.middle[1]) * this.scale]; }

  // the box that the machine sweeps
  measure() {
    const box = [Infinity, Infinity, -Infinity, -Infinity], poses = [0, 0];
    for (const scene of this.scenes) this.measureOne(scene, box, poses);
    this.scene = this.run.scene;
    this.largestPose = poses;
    this.box = Number.isFinite(box[0]) ? box : [-1, -1, 1, 1];
    this.size = Math.max(this.box[2] - this.box[0], this.box[3] - this.box[1]) || 1e-3;
    // what would be lost in the room that it crosses: the camera goes with it
    this.follow ??= Math.max(...poses) > 0 && Math.max(...poses) < 0.15 * this.size;
  }
  measureOne(scene, box, largest) {
    this.scene = scene;
    const { time, shapes } = scene, places = [];
    for (const s of shapes) {
      const [w, h = w] = s.sizes || [];
      if (s.kind === "rod") places.push([s.at, 0, 0], [[s.at[0], s.at[1] + w, s.at[2], s.at[3]], 0, 0]);
      else if (s.kind === "box") for (const i of [-0.5, 0.5]) for (const j of [-0.5, 0.5]) places.push([[s.at[0], s.at[1] + i * w, s.at[2] + j * h, s.at[3]], 0, 0]);
      else if (s.kind === "disc") places.push([s.at, w, w]);
      else for (const key of ["at", "a", "b", "p", "q_"]) if (Array.isArray(s[key])) places.push([s[key], 0, 0]);
      if (s.to) for (const p of s.to) places.push([p, 0, 0]);
      if (s.spin) places.push([s.at, 1.5 * s.spin, 1.5 * s.spin]);
    }
    // a linear pot lies along its axis in A
    for (const s of shapes) if ((s.kind === "pot" || s.kind === "stop") && s.joint === "slide") for (const v of (s.range || s.ends.filter((v) => v !== null))) places.push([s.a.map((x, i) => (i ? x + (v + s.zero) * s.axis[i - 1] : x)), 0, 0]);
    scene.places = places;
    const stride = Math.max(1, Math.floor(time.length / 240));
    let wide = 0, tall = 0;
    for (let k = 0; k < time.length; k += stride) {
      const now = this.boxAt(time[k]);
      for (const i of [0, 1]) { box[i] = Math.min(box[i], now[i]); box[i + 2] = Math.max(box[i + 2], now[i + 2]); }
      if (now[2] >= now[0]) { wide = Math.max(wide, now[2] - now[0]); tall = Math.max(tall, now[3] - now[1]); }
    }
    largest[0] = Math.max(largest[0], wide);
    largest[1] = Math.max(largest[1], tall);
    // what ties a slide to its wall is drawn from behind the joint
    const far = 0.25 * Math.max(box[2] - box[0], box[3] - box[1]);
    for (const s of shapes) if ((s.kind === "spring" || s.kind === "damper") && s.joint === "slide" && far > 0) {
      const pose = this.pose(s.a[0], time[0]), [x, y] = this.flat(this.world(s.a, { [s.a[0]]: pose })), [dx, dy] = this.flat(this.turned(pose, s.axis));
      box[0] = Math.min(box[0], x - far * dx); box[1] = Math.min(box[1], y - far * dy);
      box[2] = Math.max(box[2], x - far * dx); box[3] = Math.max(box[3], y - far * dy);
    }
  }
  // the box of all places at an instant
  boxAt(t) {
    const box = [Infinity, Infinity, -Infinity, -Infinity], poses = this.scene.bodies.map((_, b) => this.pose(b, t));
    for (const [place, w, h] of this.scene.places) {
      const [x, y] = this.flat(this.world(place, poses));
      if (!Number.isFinite(x + y)) continue;
      box[0] = Math.min(box[0], x - w); box[1] = Math.min(box[1], y - h);
      box[2] = Math.max(box[2], x + w); box[3] = Math.max(box[3], y + h);
    }
    return box;
  }
  fit() {
    const { canvas } = this, width = this.room();
    const [x0, y0, x1, y1] = this.box, margin = 46;
    let w = Math.max(x1 - x0, 0.25 * this.size), h = Math.max(y1 - y0, 0.25 * this.size);
    if (this.follow) {
      const most = Math.max(...this.largestPose) || this.size;
      w = h = 2.5 * most;
    }
    const height = Math.max(220, Math.min(0.68 * innerHeight, width * Math.max(0.5, Math.min(1.15, h / w)) + 30));
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
        this.turn(0.01 * dx, 0.01 * dy);
      } else if (e.pointerType !== "touch") this.drag(dx, dy);
    }, { signal });
    c.addEventListener("keydown", (e) => {
      const by = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] }[e.key];
      if (!by || this.scene.planar || !e.shiftKey) return;
      e.preventDefault();
      e.stopPropagation();
      this.turn(...by);
    }, { signal });
  }
  turn(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = Math.max(-1.5, Math.min(1.5, this.pitch + pitch));
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
    ctx.lineJoin = ctx.lineCap = "round";
    ctx.font = "12px system-ui";
    const poses = this.scene.bodies.map((_, k) => this.pose(k, t));
    this.poses = poses;
    this.wanted = []; // labels: written last, where there is room for them
    this.taken = []; // boxes [left, top, right, bottom] on which no label may lie
    if (this.follow) {
      const [x0, y0, x1, y1] = this.boxAt(t);
      if (x1 >= x0) {
        const now = [(x0 + x1) / 2, (y0 + y1) / 2];
        // what the reader has dragged stays beside the machine
        this.middle = this.moved && this.followed ? this.middle.map((m, i) => m + now[i] - this.followed[i]) : now;
        this.followed = now;
      }
      this.paper(ctx);
    }
    this.grid(ctx);
    this.drawTrace(ctx, t);
    for (const layer of [0, 1, 2]) for (const s of this.scene.shapes) if (GLYPHS[s.kind] && GLYPHS[s.kind].layer === layer) this.glyph(ctx, s, t);
    this.write(ctx);
  }
  // what is touched in the circuit stands in light
  glyph(ctx, s, t) {
    ctx.save();
    if (this.lit && s.name === this.lit) Object.assign(ctx, { shadowColor: this.colour("accent"), shadowBlur: 18 * devicePixelRatio });
    GLYPHS[s.kind].draw(this, ctx, s, t);
    ctx.restore();
  }
  light(name) { if (this.lit !== name) { this.lit = name; this.draw(); } }
  // the name of the coupling at a place of the canvas, or null
  coupling(x, y) {
    const far = (s) => { const at = s.kind === "transducer" ? s.b : s.a; return at ? Math.hypot(...this.place(at).map((v, i) => v - [x, y][i])) : Infinity; };
    const found = this.scene.shapes.filter((s) => ["motor", "pot", "transducer"].includes(s.kind)).sort((a, b) => far(a) - far(b))[0];
    return found && far(found) < 30 ? found.name : null;
  }
  // lines that stand still behind a camera that moves
  paper(ctx) {
    const ten = 10 ** Math.floor(Math.log10(80 / this.scale)), step = [10, 5, 2].find((m) => m * ten * this.scale >= 40) * ten || 10 * ten;
    ctx.strokeStyle = this.colour("line");
    ctx.lineWidth = 1;
    const [x, y] = this.middle, w = this.width / this.scale / 2, h = this.height / this.scale / 2;
    for (let k = Math.ceil((x - w) / step); k * step <= x + w; k++) { const px = this.centre[0] + (k * step - x) * this.scale; line(ctx, px, 0, px, this.height); }
    for (let k = Math.ceil((y - h) / step); k * step <= y + h; k++) { const py = this.centre[1] - (k * step - y) * this.scale; line(ctx, 0, py, this.width, py); }
  }
  grid(ctx) {
    const metres = 110 / this.scale, ten = 10 ** Math.floor(Math.log10(metres));
    const step = [5, 2, 1].find((m) => m * ten <= metres) * ten, px = step * this.scale;
    ctx.strokeStyle = ctx.fillStyle = this.colour("ground");
    ctx.lineWidth = 1.5;
    const y = this.height - 12;
    line(ctx, 12, y, 12 + px, y);
    line(ctx, 12, y - 4, 12, y + 4);
    line(ctx, 12 + px, y - 4, 12 + px, y + 4);
    ctx.textAlign = "left";
    ctx.fillText(written(step, "m"), 16, y - 5);
    const g = this.scene.gravity, size = Math.hypot(g[0], g[1]);
    if (this.scene.planar && size > 0) {
      const x = this.width - 16, y0 = 14 + (g[1] > 0 ? 22 : 0);
      arrow(ctx, x - (g[0] > 0 ? 22 : 0), y0, x - (g[0] > 0 ? 22 : 0) + 22 * g[0] / size, y0 - 22 * g[1] / size, 6);
      ctx.textAlign = "right";
      ctx.fillText("g", x - 7, 26);
    }
  }
  drawTrace(ctx, t) {
    const point = this.scene.points.find((p) => p.name === this.trace);
    if (!point) return;
    const { time } = this.scene, k = before(time, t), stride = Math.max(1, Math.floor(time.length / 1500));
    ctx.strokeStyle = this.colour("accent");
    ctx.lineWidth = 1.2;
    ctx.beginPath();
    for (let i = 0; i <= k; i += stride) ctx.lineTo(...this.pointAt(point.at, time[i]));
    ctx.lineTo(...this.pointAt(point.at, t));
    ctx.stroke();
  }
  pointAt(place, t) { const poses = []; poses[place[0]] = this.pose(place[0], t); return this.screen(this.world(place, poses)); }
  label(ctx, x, y, text, colour = "ink") { if (this.labels) this.wanted.push([x, y, text, colour]); }
  // what acts first, then the names of bodies: of these, those for which there is no room are left out
  write(ctx) {
    const acting = (l) => l[3] !== "soft";
    for (const [x0, y0, text, colour] of [...this.wanted.filter(acting), ...this.wanted.filter((l) => !acting(l))]) {
      const width = ctx.measureText(text).width, inside = (x) => Math.max(4, Math.min(x, this.width - width - 4));
      const box = ([x, y]) => [x - 1, y - 11, x + width + 1, y + 2], apart = (a, b) => a[2] <= b[0] || b[2] <= a[0] || a[3] <= b[1] || b[3] <= a[1];
      // a name that lies farther off tells nothing
      const places = [0, 13, -13, ...(colour === "soft" ? [] : [26, -26, 39, 52])].flatMap((dy) => [0, -width - 22, 24].map((dx) => [inside(x0 + dx), y0 + dy]));
      const free = places.find((p) => p[1] > 11 && p[1] < this.height - 2 && this.taken.every((b) => apart(box(p), b)));
      if (!free && colour === "soft") continue;
      const [x, y] = free ?? places[0];
      this.taken.push(box([x, y]));
      ctx.textAlign = "left";
      ctx.lineWidth = 3;
      ctx.strokeStyle = this.colour("panel");
      ctx.strokeText(text, x, y);
      ctx.fillStyle = this.colour(colour);
      ctx.fillText(text, x, y);
    }
  }
  // a round thing that labels keep off
  keepOff(x, y, r) { this.taken.push([x - r, y - r, x + r, y + r]); }
  place(p) { return this.screen(this.world(p, this.poses)); }
  // a joint's axis on the screen, as an angle
  axisAngle(s) {
    const o = this.place(s.a), d = this.turned(this.poses[s.a[0]], s.axis), tip = this.world(s.a, this.poses).map((v, i) => v + d[i] * this.size * 0.1);
    const q = this.screen(tip);
    return Math.atan2(q[1] - o[1], q[0] - o[0]);
  }
}

function arrow(ctx, x0, y0, x1, y1, head = 9) {
  const angle = Math.atan2(y1 - y0, x1 - x0);
  line(ctx, x0, y0, x1, y1);
  ctx.beginPath();
  ctx.moveTo(x1, y1);
  for (const side of [2.7, -2.7]) ctx.lineTo(x1 + head * Math.cos(angle + side), y1 + head * Math.sin(angle + side));
  ctx.closePath();
  ctx.fill();
}

// an arc with a head: counter-clockwise for a positive share
function turnArrow(ctx, x, y, r, share) {
  if (Math.abs(share) < 0.01) return;
  const start = -Math.PI / 2, end = start - share * 1.6 * Math.PI;
  ctx.beginPath();
  ctx.arc(x, y, r, start, end, share > 0);
  ctx.stroke();
  const side = share > 0 ? -1 : 1, hx = x + r * Math.cos(end), hy = y + r * Math.sin(end), along = end + side * Math.PI / 2;
  ctx.beginPath();
  for (const [a, d] of [[0, 7], [2.5, 6], [-2.5, 6]]) ctx.lineTo(hx + d * Math.cos(along + a), hy + d * Math.sin(along + a));
  ctx.closePath();
  ctx.fill();
}

// a coil or a piston between two points of the screen
function between(ctx, x0, y0, x1, y1, kind) {
  const length = Math.hypot(x1 - x0, y1 - y0), angle = Math.atan2(y1 - y0, x1 - x0);
  ctx.save();
  ctx.translate(x0, y0);
  ctx.rotate(angle);
  ctx.beginPath();
  if (kind === "spring") {
    const lead = Math.min(10, 0.15 * length), turns = 9;
    ctx.moveTo(0, 0);
    ctx.lineTo(lead, 0);
    for (let k = 1; k < 2 * turns; k++) ctx.lineTo(lead + (length - 2 * lead) * k / (2 * turns), k % 2 ? -7 : 7);
    ctx.lineTo(length - lead, 0);
    ctx.lineTo(length, 0);
  } else {
    const m = 0.5 * length;
    ctx.moveTo(0, 0); ctx.lineTo(m, 0);
    ctx.moveTo(m, -6); ctx.lineTo(m, 6);
    ctx.moveTo(m + 8, -8); ctx.lineTo(m - 10, -8); ctx.moveTo(m + 8, 8); ctx.lineTo(m - 10, 8);
    ctx.moveTo(m + 8, -8); ctx.lineTo(m + 8, 8);
    ctx.moveTo(m + 8, 0); ctx.lineTo(length, 0);
  }
  ctx.stroke();
  ctx.restore();
}

function ground(m, ctx, x, y, tall = 15) {
  ctx.strokeStyle = m.colour("ground");
  ctx.lineWidth = 1.5;
  ctx.beginPath();
  ctx.moveTo(x, y); ctx.lineTo(x - 9, y + tall); ctx.lineTo(x + 9, y + tall); ctx.closePath();
  ctx.stroke();
  line(ctx, x - 14, y + tall, x + 14, y + tall);
  for (let k = -12; k <= 12; k += 6) line(ctx, x + k, y + tall, x + k - 4, y + tall + 5);
}

// what a spring or a damper hangs on
function anchor(m, ctx, place) {
  const [x, y] = m.place(place);
  if (place[0] === 0) ground(m, ctx, x, y, 9);
  ctx.beginPath();
  ctx.arc(x, y, 3.2, 0, 7);
  filled(m, ctx, "panel");
}

const GLYPHS = {
  rod: { layer: 0, draw(m, ctx, s) {
    const [l, w = 0] = s.sizes, a = m.place(s.at), b = m.place([s.at[0], s.at[1] + l, s.at[2], s.at[3]]);
    for (const [colour, extra] of [["edge", 2.4], ["body", 0]]) {
      ctx.strokeStyle = m.colour(colour);
      ctx.lineWidth = Math.max(7, w * m.scale) + extra;
      line(ctx, ...a, ...b);
    }
    m.label(ctx, (a[0] + b[0]) / 2 + 9, (a[1] + b[1]) / 2 - 7, s.name, "soft");
  } },
  box: { layer: 0, draw(m, ctx, s) {
    const [w, h = w] = s.sizes;
    ctx.beginPath();
    for (const [i, j] of [[-1, -1], [1, -1], [1, 1], [-1, 1]]) ctx.lineTo(...m.place([s.at[0], s.at[1] + i * w / 2, s.at[2] + j * h / 2, s.at[3]]));
    ctx.closePath();
    filled(m, ctx);
    m.label(ctx, m.place(s.at)[0] + 8, m.place(s.at)[1] - 8, s.name, "soft");
  } },
  disc: { layer: 0, draw(m, ctx, s) {
    const [x, y] = m.place(s.at), r = Math.max(4, s.sizes[0] * m.scale), rim = m.place([s.at[0], s.at[1] + s.sizes[0], s.at[2], s.at[3]]);
    ctx.beginPath();
    ctx.arc(x, y, r, 0, 7);
    filled(m, ctx);
    line(ctx, x, y, ...rim);
    if (r > 30) m.label(ctx, x - r, y - 0.8 * r, s.name, "soft"); else m.label(ctx, x + 8, y - 8, s.name, "soft");
  } },
  bones: { layer: 0, draw(m, ctx, s) {
    const c = m.place(s.at);
    if (s.spin) {
      // nothing but an inertia: a wheel with a mark
      const r = s.spin * m.scale;
      ctx.beginPath();
      ctx.arc(...c, r, 0, 7);
      filled(m, ctx);
      line(ctx, ...c, ...m.place([s.at[0], s.at[1] + s.spin, s.at[2], s.at[3]]));
      return m.label(ctx, c[0] - r, c[1] - r - 5, s.name, "soft");
    }
    if (s.to.every((p) => p.every((v, i) => v === s.at[i]))) {
      // nothing but a mass
      ctx.beginPath();
      ctx.rect(c[0] - 16, c[1] - 11, 32, 22);
      filled(m, ctx);
      return m.label(ctx, c[0] - 14, c[1] - 15, s.name, "soft");
    }
    for (const [colour, extra] of [["edge", 2.4], ["body", 0]]) {
      ctx.strokeStyle = m.colour(colour);
      ctx.lineWidth = 6 + extra;
      for (const p of s.to) line(ctx, ...c, ...m.place(p));
    }
    ctx.beginPath();
    ctx.arc(...c, 6, 0, 7);
    filled(m, ctx);
    m.label(ctx, c[0] + 8, c[1] - 8, s.name, "soft");
  } },
  joint: { layer: 1, draw(m, ctx, s) {
    const [x, y] = m.place(s.b), [xa, ya] = m.place(s.a);
    if (s.joint === "none") return;
    if (s.joint === "slide") {
      // a rail of the frame goes from edge to edge, one on a body to its slider and beyond
      const angle = m.axisAngle(s), reach = 2 * (m.width + m.height), along = (x - xa) * Math.cos(angle) + (y - ya) * Math.sin(angle);
      ctx.strokeStyle = m.colour("ground");
      ctx.lineWidth = 1.5;
      ctx.setLineDash(s.a[0] === 0 ? [] : [4, 4]);
      const from = s.a[0] === 0 ? -reach : Math.min(-40, along - 24), to = s.a[0] === 0 ? reach : Math.max(40, along + 24);
      line(ctx, xa + from * Math.cos(angle), ya + from * Math.sin(angle), xa + to * Math.cos(angle), ya + to * Math.sin(angle));
      ctx.setLineDash([]);
      ctx.save();
      ctx.translate(x, y);
      ctx.rotate(angle);
      ctx.beginPath();
      ctx.rect(-7, -4, 14, 8);
      filled(m, ctx, "panel");
      ctx.restore();
      return;
    }
    if (s.joint === "rod") {
      ctx.strokeStyle = m.colour("edge");
      ctx.lineWidth = 3;
      line(ctx, xa, ya, x, y);
    }
    if (s.a[0] === 0 && s.joint === "pin") ground(m, ctx, xa, ya, s.below ? 27 : 15);
    if (s.b[0] === 0 && s.joint === "pin") ground(m, ctx, x, y, s.below ? 27 : 15);
    ctx.beginPath();
    if (s.joint === "weld") ctx.rect(x - 4, y - 4, 8, 8); else ctx.arc(x, y, 4.5, 0, 7);
    filled(m, ctx, "panel");
  } },
  motor: { layer: 2, draw(m, ctx, s, t) {
    const [x, y] = m.place(s.a), share = m.share(s.current, t), current = m.at(s.current, t);
    const shape = (r) => { ctx.beginPath(); if (s.joint === "pin") ctx.arc(x, y, r, 0, 7); else ctx.rect(x - r, y - 0.8 * r, 2 * r, 1.6 * r); };
    shape(18);
    filled(m, ctx, "panel");
    // its ring tells the current
    ctx.globalAlpha = 0.2 + 0.8 * Math.abs(share);
    ctx.strokeStyle = m.colour(share < 0 ? "force" : "motor");
    ctx.lineWidth = 5;
    shape(14.5);
    ctx.stroke();
    // its phases, as spokes between stator and rotor
    for (let k = 0; s.poles > 1 && k < s.poles; k++) {
      const c = Math.cos(2 * Math.PI * k / s.poles), d = Math.sin(2 * Math.PI * k / s.poles);
      line(ctx, x + 8 * c, y - 8 * d, x + 12 * c, y - 12 * d);
    }
    ctx.globalAlpha = 1;
    ctx.textAlign = "center";
    ctx.fillStyle = m.colour("ink");
    ctx.font = "bold 13px system-ui";
    ctx.fillText("M", x, y + 4.5);
    ctx.font = "12px system-ui";
    m.keepOff(x, y, 19);
    if (m.arrows) effort(m, ctx, s, t, x, y, 26, "motor");
    m.label(ctx, x + 30, y + 26, `${s.name} ${written(current, "A", 3)}`, "motor");
  } },
  pot: { layer: 2, draw(m, ctx, s, t) {
    const [x, y] = m.place(s.a), q = m.at(s.q, t) + s.zero, [from, to] = s.range.map((v) => v + s.zero);
    ctx.strokeStyle = m.colour("wiper");
    ctx.fillStyle = m.colour("wiper");
    ctx.lineWidth = 3;
    if (s.joint === "pin") {
      const base = m.poses[s.a[0]].angle || 0, r = 36 + 11 * s.rings;
      ctx.beginPath();
      ctx.arc(x, y, r, -(base + Math.min(from, to)), -(base + Math.max(from, to)), true);
      ctx.stroke();
      const held = Math.max(Math.min(from, to), Math.min(Math.max(from, to), q)) + base;
      m.keepOff(x, y, r);
      arrow(ctx, x + (r - 16) * Math.cos(held), y - (r - 16) * Math.sin(held), x + r * Math.cos(held), y - r * Math.sin(held), 7);
      m.label(ctx, x + r + 4, y - 22, `${s.name} ${written(m.at(s.wiper, t), "V", 3)}`, "wiper");
      return;
    }
    const angle = m.axisAngle(s), end = (v) => [x + v * m.scale * Math.cos(angle) - 16 * Math.sin(angle), y + v * m.scale * Math.sin(angle) + 16 * Math.cos(angle)];
    line(ctx, ...end(from), ...end(to));
    const w = end(q);
    arrow(ctx, w[0] + 10 * Math.sin(angle), w[1] - 10 * Math.cos(angle), ...w, 7);
    m.label(ctx, end(to)[0] + 6, end(to)[1] + 4, `${s.name} ${written(m.at(s.wiper, t), "V", 3)}`, "wiper");
  } },
  spring: { layer: 1, draw(m, ctx, s, t) { elastic(m, ctx, s, t, "spring"); } },
  damper: { layer: 1, draw(m, ctx, s, t) { elastic(m, ctx, s, t, "damper"); } },
  force: { layer: 2, draw(m, ctx, s, t) {
    if (!m.arrows) return;
    const [x, y] = m.place(s.at), f = s.vector.map((ref) => m.at(ref, t)), top = Math.hypot(...s.vector.map((ref) => typeof ref === "string" ? m.largest[+ref.slice(1)] : ref));
    const [dx, dy] = m.flat(f), size = Math.hypot(...f);
    if (!(size > 1e-6 * top)) return;
    ctx.strokeStyle = ctx.fillStyle = m.colour("force");
    ctx.lineWidth = 2.5;
    arrow(ctx, x - 60 * dx / top, y + 60 * dy / top, x, y);
    m.label(ctx, x - 60 * dx / top + 6, y + 60 * dy / top - 6, `${s.name} ${written(size, "N", 3)}`, "force");
  } },
  torque: { layer: 2, draw(m, ctx, s, t) {
    if (m.arrows) effort(m, ctx, s, t, ...m.place(s.a), 22, "force", s.name);
  } },
  gear: { layer: 1, draw(m, ctx, s) {
    const a = m.place(s.first.a), b = m.place(s.second.a);
    ctx.strokeStyle = m.colour("soft");
    ctx.lineWidth = 1.5;
    if (s.radii) {
      // wheels that mesh; those that turn the same way have one between them
      const [r, q] = s.radii.map((v) => v * m.scale), far = Math.hypot(b[0] - a[0], b[1] - a[1]), angle = Math.atan2(b[1] - a[1], b[0] - a[0]);
      const wheels = [[a, r], [b, q]], way = (far + r - q) / 2;
      if (!s.meshed) wheels.push([[a[0] + way * Math.cos(angle), a[1] + way * Math.sin(angle)], (far - r - q) / 2]);
      for (const [at, radius] of wheels) {
        ctx.lineWidth = 1.5;
        ctx.beginPath();
        ctx.arc(...at, radius, 0, 7);
        ctx.stroke();
        ctx.lineWidth = 2.5;
        const count = Math.max(8, Math.round(2 * Math.PI * radius / 9));
        for (let k = 0; k < count; k++) {
          const c = Math.cos(2 * Math.PI * k / count), d = Math.sin(2 * Math.PI * k / count);
          line(ctx, at[0] + (radius - 2) * c, at[1] + (radius - 2) * d, at[0] + (radius + 2) * c, at[1] + (radius + 2) * d);
        }
      }
    } else {
      ctx.setLineDash([5, 4]);
      line(ctx, ...a, ...b);
      ctx.setLineDash([]);
    }
    m.label(ctx, (a[0] + b[0]) / 2 - 6, (a[1] + b[1]) / 2 + 16, `${s.name} ${+(+s.ratio).toPrecision(4)}`, "soft");
  } },
  belt: { layer: 1, draw(m, ctx, s, t) {
    const a = m.place(s.first.a), b = m.place(s.second.a), [ra, rb] = s.radii.map((r) => r * m.scale);
    const d = Math.hypot(b[0] - a[0], b[1] - a[1]), way = Math.atan2(b[1] - a[1], b[0] - a[0]);
    ctx.strokeStyle = m.colour("edge");
    ctx.lineWidth = 1.5;
    for (const [at, r] of [[a, ra], [b, rb]]) { ctx.beginPath(); ctx.arc(...at, r, 0, 7); ctx.stroke(); }
    const open = Math.acos(Math.max(-1, Math.min(1, (s.cross ? ra + rb : ra - rb) / (d || 1))));
    [-open, open].forEach((turn, k) => {
      const share = Math.abs(m.share(s.tensions[k], t)), c = Math.cos(way + turn), f = Math.sin(way + turn), far = s.cross ? -rb : rb;
      ctx.strokeStyle = m.colour(share > 0.01 ? "force" : "soft");
      ctx.lineWidth = 1.2 + 3 * share;
      ctx.setLineDash(share > 0 ? [] : [5, 4]);
      line(ctx, a[0] + ra * c, a[1] + ra * f, b[0] + far * c, b[1] + far * f);
    });
    ctx.setLineDash([]);
    m.label(ctx, (a[0] + b[0]) / 2 + 6, (a[1] + b[1]) / 2 + 4, `${s.name} ${written(m.at(s.effort, t), "N", 3)}`, "soft");
  } },
  cam: { layer: 1, draw(m, ctx, s, t) {
    const a = m.place(s.first.b), b = m.place(s.second.a), share = Math.abs(m.share(s.effort, t));
    const turn = (m.poses[s.second.a[0]].angle || 0) + m.at(s.second.q, t) + s.second.zero, r = 18;
    ctx.strokeStyle = m.colour(share > 0.01 ? "force" : "edge");
    ctx.lineWidth = 1.5 + 2.5 * share;
    ctx.beginPath();
    ctx.arc(b[0] + 0.45 * r * Math.cos(turn), b[1] - 0.45 * r * Math.sin(turn), r, 0, 7);
    ctx.stroke();
    ctx.setLineDash([5, 4]);
    line(ctx, ...a, ...b);
    ctx.setLineDash([]);
    m.label(ctx, b[0] + 1.6 * r, b[1] + r, s.name, "soft");
  } },
  stop: { layer: 1, draw(m, ctx, s, t) {
    const [x, y] = m.place(s.a), base = m.poses[s.a[0]].angle || 0, angle = m.axisAngle(s), share = Math.abs(m.share(s.effort, t));
    const c = Math.cos(angle), d = Math.sin(angle), turns = s.joint === "pin";
    let at = [x, y];
    ctx.strokeStyle = m.colour(share > 0.01 ? "force" : "edge");
    ctx.lineWidth = 2.5 + 3 * share;
    for (const end of s.ends) if (end !== null) {
      const turn = base + end + s.zero, far = (end + s.zero) * m.scale;
      if (turns) line(ctx, x + 16 * Math.cos(turn), y - 16 * Math.sin(turn), x + 34 * Math.cos(turn), y - 34 * Math.sin(turn));
      else line(ctx, x + far * c - 14 * d, y + far * d + 14 * c, x + far * c + 14 * d, y + far * d - 14 * c);
      at = turns ? [x + 34 * Math.cos(turn), y - 34 * Math.sin(turn)] : [x + far * c + 14 * d, y + far * d - 14 * c];
    }
    m.label(ctx, at[0] + 5, at[1] - 4, s.name, "soft");
  } },
  contact: { layer: 1, draw(m, ctx, s, t) {
    const p = m.place(s.p), q = m.place(s.q_), share = Math.abs(m.share(s.effort, t)), far = 70 / m.scale;
    ctx.strokeStyle = m.colour(share > 0.01 ? "force" : "edge");
    ctx.lineWidth = 1.5 + 2.5 * share;
    if (s.along) line(ctx, ...m.place(s.q_.map((v, i) => (i ? v - far * s.along[i - 1] : v))), ...m.place(s.q_.map((v, i) => (i ? v + far * s.along[i - 1] : v))));
    for (const [at, r] of [[p, s.r], [q, s.rq]]) if (r) {
      ctx.beginPath();
      ctx.arc(...at, Math.abs(r) * m.scale, 0, 7);
      ctx.stroke();
    }
    m.label(ctx, q[0] + 8, q[1] + 14, s.name, "soft");
  } },
  friction: { layer: 1, draw(m, ctx, s, t) {
    const [x, y] = m.place(s.joint === "pin" ? s.a : s.b), angle = m.axisAngle(s), share = Math.abs(m.share(s.effort, t));
    const c = Math.cos(angle), d = Math.sin(angle);
    ctx.strokeStyle = m.colour("wiper");
    ctx.lineWidth = 1.6 + 3 * (m.arrows ? share : 0);
    for (const side of [-1, 1]) {
      ctx.beginPath();
      if (s.joint === "pin") ctx.arc(x, y, 11, side * 1.57 - 0.6, side * 1.57 + 0.6);
      else { ctx.moveTo(x - 12 * c - side * 8 * d, y - 12 * d + side * 8 * c); ctx.lineTo(x + 12 * c - side * 8 * d, y + 12 * d + side * 8 * c); }
      ctx.stroke();
    }
    m.label(ctx, x + 12, y - 12, s.name, "wiper");
  } },
  drive: { layer: 2, draw(m, ctx, s) {
    const [x, y] = m.place(s.a);
    ctx.strokeStyle = m.colour("accent");
    ctx.lineWidth = 2;
    ctx.beginPath();
    ctx.arc(x, y, 13, 0.4, 5.6);
    ctx.stroke();
    m.label(ctx, x + 18, y + 20, `${s.name} (prescribed)`, "accent");
  } },
  transducer: { layer: 2, draw(m, ctx, s, t) {
    const [x, y] = m.place(s.b), share = m.share(s.volts, t);
    ctx.strokeStyle = m.colour("coil");
    ctx.lineWidth = 2 + 3 * Math.abs(share);
    if (s.form === "c") { line(ctx, x - 4, y - 22, x - 4, y - 8); line(ctx, x + 4, y - 22, x + 4, y - 8); }
    else { ctx.beginPath(); for (let k = 0; k < 3; k++) ctx.arc(x - 8 + 8 * k, y - 14, 4, Math.PI, 0); ctx.stroke(); }
    if (m.arrows) effort(m, ctx, s, t, x, y - 14, 20, "coil");
    m.label(ctx, x + 12, y - 20, `${s.name} ${written(m.at(s.volts, t), s.of || "V", 3)}`, "coil");
  } },
};

function filled(m, ctx, colour = "body") {
  ctx.fillStyle = m.colour(colour);
  ctx.strokeStyle = m.colour("edge");
  ctx.lineWidth = 1.4;
  ctx.fill();
  ctx.stroke();
}

// the arrow of a torque, or of a force along a slide
function effort(m, ctx, s, t, x, y, r, colour, name) {
  const share = m.share(s.effort, t);
  ctx.strokeStyle = ctx.fillStyle = m.colour(colour);
  ctx.lineWidth = 2.2;
  if (s.joint === "slide") {
    const angle = m.axisAngle(s);
    if (Math.abs(share) > 0.01) arrow(ctx, x, y, x + 55 * share * Math.cos(angle), y + 55 * share * Math.sin(angle), 8);
  } else turnArrow(ctx, x, y, r, share);
  if (name) m.label(ctx, x + r + 4, y + r, `${name} ${written(m.at(s.effort, t), s.joint === "slide" ? "N" : "N m", 3)}`, colour);
}

function elastic(m, ctx, s, t, kind) {
  const colour = kind === "spring" ? "coil" : "ground", share = Math.abs(m.share(s.effort, t));
  ctx.strokeStyle = m.colour(colour);
  ctx.lineWidth = 1.4 + 1.6 * (m.arrows ? share : 0);
  if (s.p) {
    const p = m.place(s.p), q = m.place(s.q_);
    between(ctx, ...p, ...q, kind);
    anchor(m, ctx, s.p);
    anchor(m, ctx, s.q_);
    return m.label(ctx, (p[0] + q[0]) / 2 + 10, (p[1] + q[1]) / 2, s.name, colour);
  }
  const a = m.place(s.a), b = m.place(s.b);
  if (s.joint === "pin" && Math.hypot(a[0] - b[0], a[1] - b[1]) > 20) {
    between(ctx, ...a, ...b, kind);
    return m.label(ctx, (a[0] + b[0]) / 2 - 10, a[1] - 14, s.name, colour);
  }
  if (s.joint === "slide") {
    // from a wall on the far side of the joint's range, so that it has a length to change
    const angle = m.axisAngle(s), back = 0.3 * Math.min(m.width, m.height), off = kind === "spring" ? -11 : 11;
    const shift = [-off * Math.sin(angle), off * Math.cos(angle)];
    const wall = [a[0] - back * Math.cos(angle) + shift[0], a[1] - back * Math.sin(angle) + shift[1]];
    between(ctx, ...wall, b[0] + shift[0], b[1] + shift[1], kind);
    line(ctx, wall[0] + 9 * Math.sin(angle), wall[1] - 9 * Math.cos(angle), wall[0] - 9 * Math.sin(angle), wall[1] + 9 * Math.cos(angle));
    return m.label(ctx, wall[0] + 6, wall[1] + (kind === "spring" ? -10 : 22), s.name, colour);
  }
  ctx.beginPath();
  const turn = m.at(s.q, t), end = 4 * Math.PI + turn;
  for (let k = 0; k <= 80; k++) {
    const f = k / 80, r = 6 + 10 * f, angle = f * end;
    ctx.lineTo(b[0] + r * Math.cos(angle), b[1] - r * Math.sin(angle));
  }
  if (kind === "spring") ctx.stroke();
  else { ctx.beginPath(); ctx.arc(b[0], b[1], 11, 0.3, 2.8); ctx.stroke(); }
  m.label(ctx, b[0] + 14, b[1] + 14, s.name, colour);
}
