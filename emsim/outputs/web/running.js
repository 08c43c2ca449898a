// A run that goes on for ever: led step by step as the clock of the wall goes, its newest rows in the curves. States stay when
// something is moved. The worker computes a frame ahead of the picture at most; where it does not keep up the clock is slower, and says so.
"use strict";

const FRAME = 1 / 60, BUDGET = 25; // s, ms

class Running {
  constructor(engine) {
    const { base, deck } = engine, before = window.emsim;
    Object.assign(this, { engine, playing: false, waiting: false, wanted: 0, like: before, width: null });
    this.span = base.time[base.time.length - 1] - base.time[0] || 1;
    this.least = this.span / 1e4;
    this.speed = before?.clock.speed;
    this.back = made("button", { id: "restart", textContent: "\u27f2", title: "from the start (r)", onclick: () => this.restart() });
    this.back.setAttribute("aria-label", "from the start");
    $("back").before(this.back);
    this.columns = 1 + deck.columns.length + engine.channels.length + Object.keys(deck.switches).length;
  }
  close() {
    this.closed = true;
    this.stop();
    this.back.remove();
  }
  stop() { this.playing = this.waiting = false; this.sign(); }
  sign() { $("play").innerHTML = this.playing ? "&#10074;&#10074;" : "&#9654;"; }
  // the engine at the start of the deck, with the values as they are
  async restart() {
    const { engine } = this;
    // it may be in the middle of something long, or have failed
    if (this.waiting || this.failed) engine.forget();
    Object.assign(this, { failed: false, waiting: true, wanted: 0, rate: null });
    engine.values.forEach((v, k) => engine.wishes.set(k, v));
    await engine.ask({ start: true });
  }
  // ---- rows ----
  // room for the columns; older rows than a window of the run are dropped
  room(more) {
    const { store, end } = this;
    if (store && end + more <= store[0].length) return;
    const from = store ? Math.max(0, before(store[0].subarray(0, end), this.t - this.span) - 1) : 0, kept = store ? end - from : 0;
    const size = Math.max(4096, 2 * (kept + more));
    this.store = Array.from({ length: this.columns }, (_, c) => {
      const values = new Float64Array(size);
      if (store) values.set(store[c].subarray(from, end));
      return values;
    });
    Object.assign(this, { first: 0, end: kept });
  }
  append(data) {
    const { columns } = this, rows = data.length / columns;
    this.room(rows);
    for (let c = 0; c < columns; c++) { const values = this.store[c]; for (let k = 0, at = c; k < rows; k++, at += columns) values[this.end + k] = data[at]; }
    this.end += rows;
    if (rows) this.t = this.store[0][this.end - 1];
    this.first = Math.max(0, before(this.store[0].subarray(0, this.end), this.t - this.span) - 1);
  }
  views() { return this.store.map((values) => values.subarray(this.first, this.end)); }
  // ---- what the worker says ----
  async came({ led, said, started }) {
    if (this.closed) return;
    this.waiting = false;
    if (started) {
      if (!led.length) { this.failed = true; this.stop(); return this.engine.tell(said, true); }
      Object.assign(this, { store: null, end: 0, t: led[0] });
      this.append(led);
      await this.open();
      this.play(true);
      return;
    }
    const was = this.t;
    this.append(led);
    this.refresh();
    if (said) {
      this.failed = true;
      this.stop();
      return this.engine.tell(`${said}; it stands there`, true);
    }
    this.pace(this.t - was);
  }
  // how fast the clock goes beside what was asked for, over half a second or so
  pace(h) {
    const now = performance.now(), wall = (now - (this.then ?? now)) / 1000;
    this.then = now;
    if (!this.playing || !(wall > 0)) return;
    const share = Math.min(1, 2 * wall), rate = h / wall;
    this.rate = this.rate === null ? rate : this.rate + share * (rate - this.rate);
    const { speed } = this.clock, slow = this.rate < 0.8 * speed;
    if (now - (this.told ?? 0) < 400) return;
    this.told = now;
    this.engine.tell(slow ? `runs at ${+this.rate.toPrecision(2)} x: as fast as it is computed here` : "runs on");
  }
  // ---- the page ----
  async open() {
    const { engine } = this, old = window.emsim;
    old?.clock.play(false);
    const full = [this.t, this.t + this.span], { base } = engine;
    const sheets = base.sheets.filter(([name]) => !["energy", "measures", "harmonics", "messages"].includes(name)).map((sheet) => engine.sheet(null, ...sheet));
    this.run = engine.made(this.views(), { facts: engine.facts(0), full, like: this.like, sheets });
    await show(this.run);
    const { clock, waves, machine } = (this.view = window.emsim);
    this.clock = clock;
    if (this.speed) { clock.speed = this.speed; $("speed").value = this.speed; }
    engine.hands.mark();
    clock.play = (on = !this.playing) => this.play(on);
    Object.assign(waves, { range: [...full], full: [...full] });
    this.whole = true;
    this.like = machine ? window.emsim : this.like;
    this.refresh();
  }
  play(on) {
    if (on && this.failed) return this.restart();
    if (on && window.emsim !== this.view) return;
    this.playing = on;
    this.sign();
    this.then = undefined;
    if (!on) return;
    let then = performance.now();
    const frame = (now) => {
      if (!this.playing || this.closed) return;
      if (window.emsim !== this.view) return this.stop();
      // what could not be computed in time is not caught up with
      this.wanted = Math.min(this.wanted + (now - then) / 1000, 4 * FRAME);
      then = now;
      this.go();
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }
  go() {
    if (this.waiting || !(this.wanted > 0) || document.hidden) return;
    const step = this.wanted * this.clock.speed;
    this.wanted = 0;
    this.waiting = true;
    this.speed = this.clock.speed;
    this.engine.ask({ step, budget: BUDGET, least: this.least });
  }
  // one step of the picture; behind the newest row the clock alone moves
  step(rows) {
    this.play(false);
    const { clock } = this;
    if (rows < 0 || clock.t < this.t) return false;
    this.wanted = rows * FRAME;
    this.go();
    return true;
  }
  // something was moved: it acts with the next step
  wished(pairs) {
    if (this.view) $("facts").textContent = this.engine.facts(0);
    if (window.emsim === this.view && pairs.some(([k]) => k < this.engine.deck.inputs.length)) this.view?.circuit?.reword();
    if (pairs.some(([k]) => k >= this.engine.behind)) this.engine.tell("the machine starts there when it is begun anew (\u27f2)");
  }
  // all that is drawn has the newest rows
  refresh() {
    const { run, view } = this, columns = this.views(), { waves, clock, machine, circuit } = view, [time] = columns, { deck } = this.engine;
    if (window.emsim !== view) return;
    Object.assign(run, { time, rows: time.length });
    let at = 1;
    const own = new Map(deck.columns.map((name) => [name, columns[at++]]));
    for (const part of [[deck.scene, run.scene], [deck.circuit, run.circuit]]) for (let k = 0; k < (part[0]?.channels.length ?? 0); k++, at++) if (part[1]?.channels) part[1].channels[k].values = columns[at];
    for (const part of [run.scene, run.circuit]) if (part?.channels) Object.assign(part, { time, rows: time.length });
    for (const name of Object.keys(run.closed)) run.closed[name] = columns[at++];
    for (const c of run.columns) {
      if (own.has(c.name)) c.values = own.get(c.name);
      else if (waves.shown.has(c.name)) try { c.values = computed(run, c.name).values; } catch { c.values = Float64Array.from(time, () => NaN); }
      Object.assign(c, { inDegrees: undefined, offScale: ALL_ON_SCALE });
    }
    // the window goes along; one that the reader made shorter stays as short
    const begun = time[0], width = Math.min(waves.range[1] - waves.range[0], this.span), fresh = this.t < this.span * 0.999;
    waves.full = fresh && width > 0.999 * this.span ? [begun, begun + this.span] : [begun, this.t];
    waves.range = waves.full[1] > this.t ? [...waves.full] : [Math.max(begun, this.t - width), this.t];
    Object.assign(clock, { first: begun, last: this.t });
    if (machine) this.grow(machine);
    if (circuit && performance.now() - (this.scaled ?? 0) > 500) { circuit.measure(); this.scaled = performance.now(); }
    waves.redraw();
    clock.set(this.t);
  }
  // what leaves the picture is followed by it
  grow(machine) {
    // arrows are as long as they are of the largest so far
    machine.scene.channels.forEach(({ values }, k) => { machine.largest[k] = Math.max(machine.largest[k], Math.abs(values[values.length - 1])); });
    machine.hush();
    if (machine.follow || machine.moved) return;
    const [a, b, c, d] = machine.boxAt(this.t), { box } = machine;
    if (!(a < box[0] || b < box[1] || c > box[2] || d > box[3]) || !Number.isFinite(a + b + c + d)) return;
    machine.box = [Math.min(a, box[0]), Math.min(b, box[1]), Math.max(c, box[2]), Math.max(d, box[3])];
    machine.fit();
  }
}

const ALL_ON_SCALE = { off: new Uint8Array(0), count: 0, worst: -1 };
