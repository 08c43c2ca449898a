// The circuit (schematic/picture.py) at the clock's place, be it a time, a frequency, a swept value or one point: voltages colour
// its wires, currents move dots along them; of small signals these are sizes, and dots swing to and fro with the phase. What is
// touched tells its values, a click puts its signal among the waves; couplings light up in the machine too.
"use strict";

const SVG = "http://www.w3.org/2000/svg", DOTS = 14, FASTEST = 90, FAINT = 1e-6, SWING = Math.PI, REACH = 12; // rad/s, px

function svg(tag, attributes, parent) {
  const e = document.createElementNS(SVG, tag);
  for (const [k, v] of Object.entries(attributes)) e.setAttribute(k, v);
  parent?.append(e);
  return e;
}

// Of a part with several pins the lines of its symbol that begin at one: [pin, points from there on].
function leadsOf(part) {
  const at = (p, q) => Math.abs(p[0] - q[0]) < 0.6 && Math.abs(p[1] - q[1]) < 0.6;
  return part.pins.flatMap((pin, k) => {
    const found = part.strokes.find(([kind, points]) => kind === "line" && (at(points[0], pin) || at(points.at(-1), pin)) && points.length < 4);
    return found ? [[k, at(found[1][0], pin) ? found[1] : [...found[1]].reverse()]] : [];
  });
}

class Circuit {
  // of a run, or of the runs of a deck with .step: the one that the clock is in is drawn.
  // circuit: {pictures, volts, currents, uses, complex, time, channels: [{name, unit, values, imag}]}
  constructor(run, host, clock, waves, machine) {
    Object.assign(this, { run, host, clock, waves, machine, inside: "", phases: [], turn: 0, gone: new AbortController() });
    this.tables = run.runs.map(({ circuit }) => {
      if (!circuit || circuit.refused) return new Map();
      // rows may come while it is drawn
      const table = (of, c) => ({ unit: c.unit, imag: c.imag, get time() { return of.time; }, get values() { return c.values; } });
      const columns = new Map(run.runs.length > 1 || circuit.complex ? [] : run.columns.map((c) => [c.name, table(run, c)]));
      for (const c of circuit.channels) if (!columns.has(c.name) && c.values) columns.set(c.name, table(circuit, c));
      return columns;
    });
    this.measure();
    if (run.like?.circuit) Object.assign(this, { top: run.like.circuit.top, most: run.like.circuit.most });
    this.enter(whereIn(run, clock.t)[0]);
    this.draw();
    clock.listen(() => this.show());
    let then = performance.now();
    const frame = (now) => {
      if (this.gone.signal.aborted) return;
      if (this.moving && now - then > 30) { this.step((now - then) / 1000); then = now; }
      if (!this.moving) then = now;
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }
  // what is the brightest colour, and the fastest dot (`most`)
  measure() {
    this.top = 1e-12;
    this.most = new Map();
    this.run.runs.forEach(({ circuit }, k) => {
      this.columns = this.tables[k];
      for (const c of this.columns.values()) c.largest = undefined;
      for (const name of Object.values(circuit?.volts ?? {})) this.top = Math.max(this.top, this.largest(name));
    });
    if (this.n !== undefined) this.enter(this.n);
  }
  get moving() { return this.host.querySelector("#flows").checked && !document.hidden && this.wires.length > 0; }
  close() { this.gone.abort(); this.machine?.light(null); }
  // one of the runs
  enter(n) { Object.assign(this, { n, circuit: this.run.runs[n].circuit ?? this.run.circuit, columns: this.tables[n] }); }

  // ---- values ----

  largest(name) {
    const c = this.columns.get(name);
    if (!c) return 0;
    if (c.largest === undefined) {
      const sizes = Float64Array.from(c.values, (v, k) => Math.hypot(v, c.imag?.[k] ?? 0)).filter(Number.isFinite).sort();
      c.largest = sizes.length ? sizes[Math.floor(0.995 * (sizes.length - 1))] : 0;
    }
    return c.largest;
  }
  // `part`: 1 for the imaginary part of small signals, whose rate is j omega
  value(name, t, rate, part = 0) {
    const c = this.columns.get(name);
    if (!c || !Number.isFinite(t)) return NaN;
    if (c.imag && rate) return 2 * Math.PI * t * (part ? valueAt(c.time, c.values, t) : -valueAt(c.time, c.imag, t));
    if (part) return c.imag ? valueAt(c.time, c.imag, t) : 0;
    if (!rate) return valueAt(c.time, c.values, t);
    if (this.circuit.axisName !== "time") return 0; // a point of rest
    const k = Math.min(before(c.time, t), c.time.length - 2), span = c.time[k + 1] - c.time[k];
    return span > 0 ? (c.values[k + 1] - c.values[k]) / span : 0;
  }
  sum(terms, t, part) { return terms?.length ? terms.reduce((s, [factor, name, rate]) => s + factor * this.value(name, t, rate, part), 0) : NaN; }
  volt(net, t, part) { return net === "0" ? 0 : this.value(this.circuit.volts[net], t, 0, part); }
  // [size, phase] of a quantity f(part), signed and without one where it is real
  polar(f) { return this.circuit.complex ? [Math.hypot(f(0), f(1)), Math.atan2(f(1), f(0))] : [f(0), 0]; }
  // into a pin of a part; NaN where nobody knows it
  terms(part, pin) {
    if (!part.pins[pin]) return undefined; // a box of its own
    const { currents, uses } = this.circuit, [name, terminal] = part.sources[pin];
    if (!uses[part.name] || part.kind === "transformer") return currents[name]?.[terminal];
    const net = part.pins[pin][2], last = part.pins.map((p) => p[2]).lastIndexOf(net);
    return last === pin ? uses[part.name][net] : [];
  }
  current(part, pin, t, half) { const terms = this.terms(part, pin); return terms && !terms.length && this.circuit.uses[part.name] ? 0 : this.sum(terms, t, half); }
  along(wire, t, half) {
    const { parts } = this.picture, sum = (pins) => pins.reduce((s, [p, k]) => s + this.current(parts[p], k, t, half), 0);
    const there = sum(wire.flow);
    return Number.isNaN(there) ? -sum(wire.rest) : there;
  }

  // ---- the picture ----

  draw() {
    const picture = (this.picture = this.circuit.pictures[this.inside]), { parts, wires } = picture;
    const root = svg("svg", { viewBox: `0 0 ${picture.width} ${picture.height}`, role: "group", "aria-label": "circuit diagram" });
    const pinsOf = new Map();
    parts.forEach((p, k) => p.pins.forEach(([, , net], j) => pinsOf.set(net, [...(pinsOf.get(net) || []), [k, j]])));
    const line = (points) => "M" + points.map((p) => p.join(",")).join("L");
    this.wires = wires.map((w) => {
      const mine = new Set(w.flow.map(([p, k]) => `${p} ${k}`)), rest = (pinsOf.get(w.net) || []).filter(([p, k]) => !mine.has(`${p} ${k}`));
      const g = svg("g", { class: "wire", "data-net": w.net }, root);
      return { net: w.net, flow: w.flow, rest, line: svg("path", { d: line(w.points) }, g), dots: svg("path", { d: line(w.points), class: "dots" }, g), grip: svg("path", { d: line(w.points), class: "grip" }, g) };
    });
    this.joints = picture.dots.map(([x, y, net]) => ({ net, dot: svg("circle", { cx: x, cy: y, r: 2.6, class: "joint" }, root) }));
    this.parts = parts.map((part) => {
      const g = svg("g", { class: `part ${part.kind}`, "data-part": part.name, tabindex: 0, role: "button", "aria-label": `${part.kind} ${part.name}` }, root);
      const [x0, y0, x1, y1] = part.box;
      svg("rect", { x: x0 - 4, y: y0 - 4, width: x1 - x0 + 8, height: y1 - y0 + 8, rx: 5, class: "lamp" }, g);
      if (part.pins.length === 2) {
        const [a, b] = part.pins, dots = svg("path", { d: line([a.slice(0, 2), b.slice(0, 2)]), class: "dots" }, g);
        this.wires.push({ part, pin: 0, dots });
      } else for (const [pin, lead] of leadsOf(part)) this.wires.push({ part, pin, dots: svg("path", { d: line(lead), class: "dots" }, g) });
      for (const s of part.strokes) {
        if (s[0] === "line" || s[0] === "fill") svg("path", { d: line(s[1]) + (s[0] === "fill" ? "Z" : ""), class: s[0] }, g);
        else svg("circle", { cx: s[1], cy: s[2], r: s[3], class: s[0] }, g);
      }
      for (const [x, y, anchor, words] of part.texts) svg("text", { x, y: y + 4, "text-anchor": anchor }, g).textContent = this.run.worded?.(part.name, words) ?? words;
      return { part, g };
    });
    for (const [x, y, anchor, words] of picture.names) svg("text", { x, y: y + 4, "text-anchor": anchor, class: "name" }, root).textContent = words;
    this.label(root);
    this.root?.remove();
    this.root = root;
    this.host.querySelector(".picture").append(root);
    this.sized();
    this.phases = this.wires.map(() => 0);
    this.touch();
    this.host.querySelector("#within").textContent = picture.note || "";
    this.show();
  }
  sized() {
    const { style } = this.root, { width } = this.picture, size = letters();
    style.maxHeight = this.machine ? "40vh" : "62vh";
    style.maxWidth = `${1.35 * size * width}px`;
    style.minWidth = `${0.7 * width}px`; // what is longer scrolls: smaller, nobody could read it
  }
  colour(v) {
    if (!Number.isFinite(v)) return "var(--edge)";
    const share = Math.min(1, Math.sqrt(Math.abs(v) / this.top));
    return share < 0.02 ? "var(--edge)" : `color-mix(in oklab, var(--${v > 0 ? "over" : "under"}) ${Math.round(100 * share)}%, var(--edge))`;
  }
  // where values stand beside wires and parts: what has no room is not written
  label(root) {
    const { parts, wires, names, width, height } = this.picture, taken = [], said = (x, y, anchor, words, wide = 6) => {
      const w = wide * words.length, left = x - (anchor === "end" ? w : anchor === "middle" ? w / 2 : 0);
      return [left, y - wide, left + w, y + wide];
    };
    for (const p of parts) taken.push([...p.box], ...p.texts.map(([x, y, anchor, words]) => said(x, y, anchor, words)));
    for (const [x, y, anchor, words] of names) taken.push(said(x, y, anchor, words));
    const legs = wires.flatMap((w) => w.points.slice(1).map((b, k) => ({ net: w.net, a: w.points[k], b, far: Math.abs(b[0] - w.points[k][0]) + Math.abs(b[1] - w.points[k][1]) })));
    const strokes = parts.flatMap((p) => p.strokes.filter((s) => s[0] === "line").flatMap(([, points]) => points.slice(1).map((b, k) => ({ a: points[k], b }))));
    for (const { a, b } of [...legs, ...strokes]) taken.push([Math.min(a[0], b[0]) - 1, Math.min(a[1], b[1]) - 1, Math.max(a[0], b[0]) + 1, Math.max(a[1], b[1]) + 1]);
    const add = (tells, places) => {
      for (const [x, y, anchor] of places) {
        const box = said(x, y, anchor, "-1.23 mV", 4.8);
        if (box[0] < 0 || box[1] < 0 || box[2] > width || box[3] > height || taken.some((o) => box[0] < o[2] && o[0] < box[2] && box[1] < o[3] && o[1] < box[3])) continue;
        taken.push(box);
        return this.labels.push({ ...tells, text: svg("text", { x, y: y + 4, "text-anchor": anchor, class: tells.part ? "value flow" : "value" }, root) });
      }
    };
    this.labels = [];
    const ends = parts.flatMap((p) => p.pins.map(([x, y, net]) => ({ net, a: [x, y], b: [x, y], far: 0 })));
    for (const net of new Set(ends.map((e) => e.net).filter((net) => net !== "0"))) {
      const own = [...legs, ...ends].filter((l) => l.net === net).sort((l, r) => r.far - l.far), along = [0.5, 0.25, 0.75, 0, 1];
      add({ net }, own.flatMap(({ a, b }) => along.flatMap((f) => {
        const x = a[0] + f * (b[0] - a[0]), y = a[1] + f * (b[1] - a[1]);
        return a[1] === b[1] && a[0] !== b[0] ? [[x, y - 9, "middle"], [x, y + 9, "middle"]] : [[x + 5, y, "start"], [x - 5, y, "end"], [x + 4, y - 8, "start"], [x - 4, y - 8, "end"], [x + 4, y + 8, "start"], [x - 4, y + 8, "end"]];
      })));
    }
    for (const part of parts) {
      const [x0, y0, x1, y1] = part.box, last = part.texts.at(-1), x = (x0 + x1) / 2, y = (y0 + y1) / 2;
      add({ part }, [...(last ? [[last[0], last[1] + 12, last[2]]] : []), [x1 + 5, y, "start"], [x0 - 5, y, "end"], [x, y1 + 9, "middle"], [x, y0 - 9, "middle"], [x1 + 5, y1 - 6, "start"], [x0 - 5, y1 - 6, "end"]]);
    }
  }
  show() {
    const [n, t] = whereIn(this.run, this.clock.t);
    if (n !== this.n) {
      const before = this.circuit;
      this.enter(n);
      if (before.pictures !== this.circuit.pictures) { this.chosenRun(); return this.draw(); }
    }
    this.chosenRun();
    this.t = t;
    const coloured = this.host.querySelector("#volts").checked;
    const of = new Map();
    const paint = (net) => { if (!of.has(net)) of.set(net, coloured ? this.colour(this.polar((part) => this.volt(net, t, part))[0]) : "var(--edge)"); return of.get(net); };
    for (const w of this.wires) if (w.line) w.line.style.stroke = paint(w.net);
    for (const j of this.joints) j.dot.style.fill = paint(j.net);
    this.wires.forEach((w) => { [w.now, w.phase] = this.polar((half) => (w.part ? this.current(w.part, w.pin, t, half) : this.along(w, t, half))); });
    this.scale();
    const named = this.host.querySelector("#values").checked;
    for (const { net, part, text } of this.labels) {
      const [v] = named ? this.polar((half) => (part ? this.current(part, 0, t, half) : this.volt(net, t, half))) : [NaN];
      const held = part && this.said?.get(part.name);
      text.classList.toggle("held", Boolean(held));
      if (held) { text.textContent = held; continue; }
      text.textContent = Number.isFinite(v) ? written(v, part ? "A" : "V", 3) : "";
    }
    if (this.told) this.tell(this.told);
  }
  // labels that say values, as they are now
  reword() {
    for (const { part, g } of this.parts) [...g.querySelectorAll("text")].forEach((text, k) => part.texts[k] && (text.textContent = this.run.worded?.(part.name, part.texts[k][3]) ?? part.texts[k][3]));
  }
  // what stands beside parts in place of their currents: part -> words
  say(words) {
    this.said = words;
    for (const { part, g } of this.parts) g.classList.toggle("held", words.has(part.name));
    this.show();
  }
  // the control that tells which of the runs is drawn, and chooses another one
  chosenRun() {
    const select = this.host.querySelector("#course");
    select.parentElement.hidden = this.run.runs.length < 2;
    if (select.options.length !== this.run.runs.length) options(select, this.run.runs.map((_, k) => [k, this.run.courses[this.course(k)] ?? k + 1]));
    select.value = this.n;
  }
  course(k) { const { first } = this.run.runs[k]; return this.run.over ? [0, ...this.run.blocks].findLastIndex((row) => row <= first) : first; }
  // to another run, as far into it as we are
  go(k) {
    const { clock, run } = this, now = run.runs[this.n], then = run.runs[k];
    clock.play(false);
    clock.set(run.over ? then.first + (clock.t - now.first) / Math.max(1, now.rows - 1) * (then.rows - 1) : run.time[then.first]);
  }
  // dots move as fast as the root of the current, the largest of the drawing over the run fastest
  scale() {
    const key = `${this.n} ${this.inside}`;
    if (!this.most.has(key)) {
      const { time } = this.circuit, count = Math.min(60, time?.length ?? 0);
      let top = 0;
      for (let k = 0; k < count; k++) {
        const t = time[Math.floor(k * time.length / count)];
        for (const w of this.wires) if (w.part) { const i = Math.abs(this.polar((half) => this.current(w.part, w.pin, t, half))[0]); if (Number.isFinite(i)) top = Math.max(top, i); }
      }
      this.most.set(key, top);
    }
    const top = this.most.get(key);
    for (const w of this.wires) {
      const share = top > 0 && Number.isFinite(w.now) ? w.now / top : 0;
      w.speed = Math.abs(share) < FAINT ? 0 : Math.sign(share) * Math.min(1, Math.sqrt(Math.abs(share))) * FASTEST;
      w.dots.style.opacity = w.speed && this.host.querySelector("#flows").checked ? Math.min(1, 0.35 + Math.abs(w.speed) / FASTEST) : 0;
    }
  }
  step(seconds) {
    this.turn += SWING * Math.min(seconds, 0.1);
    this.wires.forEach((w, k) => {
      if (!w.speed) return;
      if (this.circuit.complex) { w.dots.style.strokeDashoffset = -REACH * w.speed / FASTEST * Math.sin(this.turn + w.phase); return; }
      this.phases[k] += w.speed * Math.min(seconds, 0.1);
      w.dots.style.strokeDashoffset = -this.phases[k] % DOTS;
    });
  }

  // ---- touching ----

  touch() {
    const { signal } = this.gone;
    for (const { part, g } of this.parts) {
      const over = () => window.bench.light(part.name), off = () => window.bench.light(null);
      g.addEventListener("pointerenter", over, { signal });
      g.addEventListener("focus", over, { signal });
      g.addEventListener("pointerleave", off, { signal });
      g.addEventListener("blur", off, { signal });
      g.addEventListener("click", () => this.pick(part), { signal });
      g.addEventListener("dblclick", () => this.open(part.name), { signal });
      g.addEventListener("keydown", (e) => { if (e.key === "Enter") { e.preventDefault(); this.circuit.pictures[part.name] ? this.open(part.name) : this.pick(part); } }, { signal });
    }
    for (const w of this.wires.filter((w) => w.grip)) {
      w.grip.addEventListener("pointerenter", () => this.tell({ net: w.net }), { signal });
      w.grip.addEventListener("pointerleave", () => this.tell(null), { signal });
      w.grip.addEventListener("click", () => this.add(this.circuit.volts[w.net]), { signal });
    }
  }
  // what is pointed at here, in the machine or in the text (bench.js)
  light(name) {
    for (const { part, g } of this.parts) g.classList.toggle("lit", part.name === name);
    const found = this.parts.find(({ part }) => part.name === name);
    this.tell(found ? { part: found.part } : null);
  }
  tell(what) {
    this.told = what;
    const { t } = this, box = this.host.querySelector(".told"), lines = [], { complex } = this.circuit;
    const tell = (name, unit, f) => lines.push([name, ...this.polar(f), unit]), volt = (net) => (half) => this.volt(net, t, half);
    if (what?.net !== undefined) tell(`v(${what.net})`, "V", volt(what.net));
    if (what?.part) {
      const { part } = what, current = (k) => (half) => this.current(part, k, t, half);
      if (part.pins.length === 2) {
        const [a, b] = part.pins.map(([, , net]) => volt(net)), across = (half) => a(half) - b(half);
        tell("v", "V", across);
        tell("i", "A", current(0));
        if (!complex) tell("p", "W", (half) => across(half) * current(0)(half));
      } else part.pins.forEach(([, , net], k) => { tell(`v(${net})`, "V", volt(net)); tell("i", "A", current(k)); });
    }
    const phase = (angle) => (complex ? ` \u2220 ${+(angle * 180 / Math.PI).toFixed(1)}\u00b0` : "");
    const said = lines.filter(([, value]) => Number.isFinite(value)).map(([name, value, angle, unit]) => `${name} = ${written(value, unit)}${phase(angle)}`).join("   ");
    const hand = what?.part && this.hint?.(what.part.name);
    const opens = what?.part && this.circuit.pictures[what.part.name] ? "   (double click: inside)" : "";
    box.textContent = what ? `${what.part ? what.part.name + ":   " : ""}${said}${opens}${hand ? `   (${hand})` : ""}` : "touch a part or a wire";
  }
  pick(part) {
    const terms = this.terms(part, 0);
    if (terms?.length) this.add(terms.length === 1 && terms[0][0] === 1 && !terms[0][2] ? terms[0][1] : `i(${part.name})`, terms);
    else if (part.pins.length === 1) this.add(this.circuit.volts[part.pins[0][2]]);
  }
  // a signal among the waves, or no more; one that the run does not have is made of those that the drawing has
  add(name, terms = [[1, name, 0]]) {
    const { run, waves } = this;
    if (!name || !waves) return;
    if (this.circuit.complex) return this.addSizes(name);
    if (!run.columns.some((c) => c.name === name)) {
      if (run.runs.length > 1) return; // it would be of one run alone
      const values = Float32Array.from(run.time, (t) => this.sum(terms, t));
      run.columns.push({ name, unit: this.columns.get(terms[0][1])?.unit === "A" || terms[0][2] || terms.length > 1 || name[0] === "i" ? "A" : "V", values });
    }
    if (!waves.shown.delete(name)) waves.shown.add(name);
    waves.build();
    chips(run, waves);
  }
  // of small signals: what the run has of that name
  addSizes(name) {
    const { waves, run } = this, own = [`db(${name})`, `ph(${name})`].filter((n) => run.columns.some((c) => c.name === n));
    for (const n of own) if (!waves.shown.delete(n)) waves.shown.add(n);
    if (own.length) { waves.build(); chips(run, waves); }
  }
  open(name) {
    if (!this.circuit.pictures[name]) return;
    this.inside = name;
    this.way();
    this.draw();
  }
  // from the whole circuit to where we are
  way() {
    const parts = this.inside ? this.inside.split(".") : [], box = this.host.querySelector(".way");
    const step = (text, name) => Object.assign(document.createElement("button"), { textContent: text, onclick: () => this.open(name) });
    box.replaceChildren(...(parts.length ? [step("circuit", ""), ...parts.map((p, k) => step(p, parts.slice(0, k + 1).join(".")))] : []));
  }
}

// The circuit's section beside the machine's; nothing where the run has none.
function circuit(run, clock, waves, machine) {
  let left = $("drawings");
  if (!left) {
    left = Object.assign(document.createElement("div"), { id: "drawings" });
    $("stage").before(left);
    left.innerHTML = `<section id="circuit" aria-label="the circuit"><div class="tools"><span class="way"></span>
      <label hidden>run <select id="course"></select></label>
      <label><input type="checkbox" id="volts" checked> voltages</label> <label><input type="checkbox" id="flows" checked> currents</label> <label><input type="checkbox" id="values"> values</label>
      <button id="large" aria-pressed="false" title="over the whole width">large</button></div>
      <div class="picture"></div><div class="told">touch a part or a wire</div><div id="within"></div></section>`;
    left.append($("stage"));
    $("flows").checked = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    $("volts").onchange = $("flows").onchange = $("values").onchange = () => (window.emsim ?? window.still)?.circuit?.show();
    $("course").onchange = (e) => (window.emsim ?? window.still).circuit.go(+e.target.value);
    $("large").onclick = (e) => { e.target.setAttribute("aria-pressed", document.querySelector("main").classList.toggle("large")); dispatchEvent(new Event("resize")); };
  }
  const host = $("circuit");
  host.hidden = !run.circuit;
  left.hidden = !run.circuit && !run.scene;
  const refused = run.circuit?.refused;
  // values that stand still are read
  if ($("values").dataset.of !== run.kind) Object.assign($("values"), { checked: run.circuit && run.circuit.axisName !== "time" }).dataset.of = run.kind;
  host.querySelector(".picture").replaceChildren();
  for (const part of host.querySelectorAll(".picture, .tools, .told")) part.hidden = Boolean(refused);
  $("within").textContent = refused ? `not drawn: ${refused}` : "";
  return run.circuit && !refused ? new Circuit(run, host, clock, waves, machine) : null;
}
