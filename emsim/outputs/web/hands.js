// What a hand does on the page of a deck that computes: bodies that can move are taken hold of in the drawing, and switches are
// turned in the circuit. Where the whole run is computed anew a body is set where it starts; while the run goes on it is pulled, by a
// spring between pointer and point that stands in the equations (assemble/hands.py).
"use strict";

const FAR_BEYOND = 1e9; // what is added to a switch's control [V or A]: no threshold lies there
const NEAR = { mouse: 10, touch: 22 }, LATCH = 350; // px, ms
// The spring: the machine's mass swings on it so often in a second of the wall, and its weight moves it by so much of the picture at most.
const SWINGS = 1.5, SAG = 0.05, DAMPED = 0.7;

class Hands {
  constructor(engine) {
    const { deck } = engine;
    Object.assign(this, { engine, deck, turned: new Map(), hold: null, end: new AbortController() });
    if (deck.scene) this.machine($("machine"));
    if (Object.keys(deck.switches).length) { this.circuit(document.getElementById("circuit")); this.mark(); }
  }
  close() {
    if (this.hold) this.loose();
    this.end.abort();
  }
  input(name) { return this.deck.hands[`hand ${name}`]; }
  // can a hand do anything with this body now?
  grips(k) {
    const { deck, engine } = this;
    return engine.running ? this.input(`on ${deck.scene.bodies[k].name}`) !== undefined : deck.grips[k] !== undefined;
  }
  // ---- bodies ----
  machine(canvas) {
    const at = (e) => { const r = canvas.getBoundingClientRect(); return [e.clientX - r.left, e.clientY - r.top]; };
    // before the machine's own listeners, which drag and turn the view
    const take = (e) => {
      if (e.button || this.hold || !this.mine()) return;
      const found = this.touched(at(e), NEAR[e.pointerType] ?? NEAR.mouse);
      if (!found) return;
      e.stopImmediatePropagation();
      canvas.setPointerCapture(e.pointerId);
      this.take(found, e.pointerId);
    };
    canvas.addEventListener("pointerdown", take, { capture: true, signal: this.end.signal });
    canvas.addEventListener("pointermove", (e) => {
      if (this.hold?.pointer === e.pointerId) { e.stopImmediatePropagation(); return this.pull(at(e)); }
      if (!e.buttons && this.mine()) canvas.style.cursor = this.touched(at(e), NEAR.mouse) ? "grab" : "";
    }, { capture: true, signal: this.end.signal });
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) canvas.addEventListener(end, (e) => this.hold?.pointer === e.pointerId && this.loose(), { capture: true, signal: this.end.signal });
    // a finger on a body does not scroll the page
    canvas.addEventListener("touchstart", (e) => {
      const [finger] = e.changedTouches;
      if (this.hold || (this.mine() && this.touched(at(finger), NEAR.touch))) e.preventDefault();
    }, { passive: false, signal: this.end.signal });
  }
  // is what is drawn of the engine?
  mine() {
    const { view } = this.engine.running ?? {}, now = window.emsim;
    return now?.machine && (this.engine.running ? now === view : now.run.all[0] === now.run && now.run.runs.length === 1);
  }
  touched(at, near) { return bodyAt(window.emsim.machine, at, near, (k) => this.grips(k)); }
  take({ body, deep, x, y }, pointer) {
    const { machine, clock } = window.emsim, { running } = this.engine;
    if (!running) { clock.play(false); clock.set(clock.first); machine.draw(); }
    // seen at the start, it may stand elsewhere: the hand has the body's own nearest place then
    const pose = machine.poses[body], to = this.world([x, y], deep), d = [0, 1, 2].map((i) => to[i] - pose.o[i]), { r } = pose;
    const local = [0, 1, 2].map((j) => r[j] * d[0] + r[3 + j] * d[1] + r[6 + j] * d[2]);
    this.hold = { body, pointer, local, deep, to };
    machine.canvas.style.cursor = "grabbing";
    if (running) this.engine.want([[this.input(`on ${this.deck.scene.bodies[body].name}`), 1]]);
    this.pull([x, y]);
  }
  // a place of the canvas in the world, at a depth
  world([x, y], deep) {
    const { machine } = window.emsim, px = (x - machine.centre[0]) / machine.scale, py = (machine.centre[1] - y) / machine.scale;
    if (machine.planar) return [machine.middle[0] + px, machine.middle[1] + py, 0];
    const { right, up, towards } = machine.view(), f = machine.perspective ? deep : 1;
    const near = machine.deep + (machine.perspective ? machine.far * (1 - 1 / f) : deep * machine.size), u = machine.middle[0] + px / f, v = machine.middle[1] + py / f;
    return [0, 1, 2].map((i) => right[i] * u + up[i] * v + towards[i] * near);
  }
  pull(at) {
    const { hold, engine, deck } = this, { machine } = window.emsim, { local, body } = hold, to = (hold.to = this.world(at, hold.deep)), aside = deck.scene.bodies[body].aside ?? 0;
    const target = [to[0] - aside, to[1], to[2]];
    machine.held = { place: [body, ...local], to };
    if (engine.running) {
      const [k, c] = this.spring(), values = { x: target[0], y: target[1], z: target[2], px: local[0], py: local[1], pz: local[2], k, c };
      engine.want(Object.entries(values).flatMap(([name, value]) => (this.input(name) === undefined ? [] : [[this.input(name), value]])));
      if (!engine.running.playing) machine.draw();
      return;
    }
    machine.draw();
    this.next = { local, target: to };
    this.aim();
  }
  spring() {
    const { machine, clock } = window.emsim, g = Math.hypot(...deckGravity(this.deck)), swing = 2 * Math.PI * SWINGS / clock.speed;
    const square = Math.max(swing * swing, g / (SAG * machine.size)), { mass } = this.deck;
    return [mass * square, 2 * DAMPED * mass * Math.sqrt(square)];
  }
  // the coordinates of the body that bring its point there, by the equations; then the run from there
  aim() {
    const { engine, deck, hold } = this;
    if (!this.next || this.aiming || engine.busy || engine.running) return;
    const { machine } = window.emsim, { local, target } = this.next, own = deck.grips[hold.body], numbers = own.map((j) => engine.behind + j);
    const axes = machine.planar ? [[1, 0, 0], [0, 1, 0]] : [machine.view().right, machine.view().up];
    const at = deck.scene.bodies[hold.body].at.map((ref) => (typeof ref === "string" ? [1 + deck.columns.length + +ref.slice(1)] : ref));
    this.next = null;
    this.aiming = numbers;
    engine.ask({ aim: { unknowns: own.map((j) => deck.places[j][4]), values: numbers.map((k) => engine.values.get(k) ?? engine.start(k)), at, local, target, axes } });
  }
  async aimed(values) {
    const { engine, aiming } = this;
    this.aiming = null;
    aiming.forEach((k, j) => engine.put(k, values[j]));
    await engine.wish(aiming.map((k, j) => [k, values[j]]));
  }
  // a run has come: the hand is on what is drawn now, and goes on
  came() {
    if (this.hold && window.emsim?.machine) window.emsim.machine.held = { place: [this.hold.body, ...this.hold.local], to: this.hold.to };
    if (this.hold) window.emsim.machine?.draw();
    this.aim();
  }
  loose() {
    const { body } = this.hold, machine = window.emsim?.machine;
    if (this.engine.running) this.engine.want([[this.input(`on ${this.deck.scene.bodies[body].name}`), 0]]);
    else if (this.next) this.aim();
    this.hold = null;
    if (!machine) return;
    machine.held = null;
    machine.canvas.style.cursor = "";
    machine.draw();
  }
  // ---- switches ----
  // A click turns a switch against its control, another one lets it go; one that is held down is let go with the finger.
  circuit(host) {
    const of = (e) => { const name = e.target.closest?.(".part")?.dataset.part; return this.deck.switches[name] ? name : null; };
    let pressed = null;
    host.addEventListener("pointerdown", (e) => {
      const name = of(e);
      if (!name || e.button || !this.shows()) return;
      pressed = { name, at: performance.now(), was: this.turned.has(name) };
      if (pressed.was) this.free(name); else this.turn(name);
    }, { capture: true, signal: this.end.signal });
    addEventListener("pointerup", () => {
      if (pressed && !pressed.was && performance.now() - pressed.at > LATCH) this.free(pressed.name);
      pressed = null;
    }, { signal: this.end.signal });
    host.addEventListener("click", (e) => of(e) && this.shows() && e.stopPropagation(), { capture: true, signal: this.end.signal });
    host.addEventListener("keydown", (e) => {
      const name = of(e);
      if (!name || (e.key !== "Enter" && e.key !== " ") || !this.shows()) return;
      e.preventDefault();
      e.stopPropagation();
      if (this.turned.has(name)) this.free(name); else this.turn(name);
    }, { capture: true, signal: this.end.signal });
  }
  shows() { return window.emsim?.circuit && window.emsim.run.runs.length === 1; }
  // against what it is at the clock's instant; a run as it was recorded does not tell that, and is computed first
  async turn(name) {
    if (!window.emsim.run.closed) await this.engine.computed();
    const { run, clock } = window.emsim;
    this.set(name, run.closed[name][before(run.time, clock.t)] > 0.5 ? -1 : 1);
  }
  free(name) { this.set(name, 0); }
  set(name, way) {
    if (way) this.turned.set(name, way); else this.turned.delete(name);
    this.engine.wish([[this.deck.switches[name][0], way * FAR_BEYOND]]);
    this.mark();
  }
  held() { return [...this.turned].map(([name, way]) => `${name} held ${way > 0 ? "closed" : "open"}`); }
  hint(name) {
    if (!this.deck.switches[name]) return "";
    const way = this.turned.get(name);
    return way ? `held ${way > 0 ? "closed" : "open"} by hand: a click lets it go` : "a click turns it and holds it there, a long one while it is held down";
  }
  // said beside it
  mark() {
    const { circuit } = window.emsim ?? {};
    if (circuit && this.shows()) circuit.hint = (name) => this.hint(name);
    circuit?.say(new Map([...this.turned].map(([name, way]) => [name, way > 0 ? "closed" : "open"])));
  }
}

function deckGravity({ scene }) { return scene.gravity ?? [0, 0, 0]; }
