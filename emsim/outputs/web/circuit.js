// The circuit (schematic/picture.py) at the clock's time: voltages colour its wires, currents move dots along them. What is touched
// tells its values, a click puts its signal among the waves; couplings light up in the machine too.
"use strict";

const SVG = "http://www.w3.org/2000/svg", DOTS = 14, FASTEST = 90, FAINT = 1e-6;

function svg(tag, attributes, parent) {
  const e = document.createElementNS(SVG, tag);
  for (const [k, v] of Object.entries(attributes)) e.setAttribute(k, v);
  parent?.append(e);
  return e;
}

class Circuit {
  // run.circuit: {pictures, volts, currents, uses, time, channels: [{name, unit, values}]}
  constructor(run, host, clock, waves, machine) {
    Object.assign(this, { run, host, clock, waves, machine, inside: "", phases: [], gone: new AbortController() });
    const { volts } = run.circuit;
    this.columns = new Map(run.columns.map((c) => [c.name, { time: run.time, values: c.values, unit: c.unit }]));
    for (const c of run.circuit.channels) if (!this.columns.has(c.name) && c.values) this.columns.set(c.name, { time: run.circuit.time, values: c.values, unit: c.unit });
    this.top = Math.max(1e-12, ...Object.values(volts).map((name) => this.largest(name)));
    this.tops = new Map();
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
  get moving() { return this.host.querySelector("#flows").checked && !document.hidden && this.wires.length > 0; }
  close() { this.gone.abort(); this.machine?.light(null); }

  // ---- values ----

  largest(name) {
    const c = this.columns.get(name);
    if (!c) return 0;
    if (c.largest === undefined) {
      const sizes = Float64Array.from(c.values, Math.abs).filter(Number.isFinite).sort();
      c.largest = sizes.length ? sizes[Math.floor(0.995 * (sizes.length - 1))] : 0;
    }
    return c.largest;
  }
  value(name, t, rate) {
    const c = this.columns.get(name);
    if (!c) return NaN;
    if (!rate) return valueAt(c.time, c.values, t);
    const k = Math.min(before(c.time, t), c.time.length - 2), span = c.time[k + 1] - c.time[k];
    return span > 0 ? (c.values[k + 1] - c.values[k]) / span : 0;
  }
  sum(terms, t) { return terms?.length ? terms.reduce((s, [factor, name, rate]) => s + factor * this.value(name, t, rate), 0) : NaN; }
  volt(net, t) { return net === "0" ? 0 : this.value(this.run.circuit.volts[net], t); }
  // into a pin of a part; NaN where nobody knows it
  terms(part, pin) {
    const { currents, uses } = this.run.circuit, [name, terminal] = part.sources[pin];
    if (!uses[part.name] || part.kind === "transformer") return currents[name]?.[terminal];
    const net = part.pins[pin][2], last = part.pins.map((p) => p[2]).lastIndexOf(net);
    return last === pin ? uses[part.name][net] : [];
  }
  current(part, pin, t) { const terms = this.terms(part, pin); return terms && !terms.length && this.run.circuit.uses[part.name] ? 0 : this.sum(terms, t); }
  along(wire, t) {
    const { parts } = this.picture, sum = (pins) => pins.reduce((s, [p, k]) => s + this.current(parts[p], k, t), 0);
    const there = sum(wire.flow);
    return Number.isNaN(there) ? -sum(wire.rest) : there;
  }

  // ---- the picture ----

  draw() {
    const picture = (this.picture = this.run.circuit.pictures[this.inside]), { parts, wires } = picture;
    const root = svg("svg", { viewBox: `0 0 ${picture.width} ${picture.height}`, role: "group", "aria-label": "circuit diagram" });
    root.style.maxHeight = this.machine ? "40vh" : "62vh";
    root.style.maxWidth = `${1.35 * picture.width}px`;
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
        this.wires.push({ part, dots });
      }
      for (const s of part.strokes) {
        if (s[0] === "line" || s[0] === "fill") svg("path", { d: line(s[1]) + (s[0] === "fill" ? "Z" : ""), class: s[0] }, g);
        else svg("circle", { cx: s[1], cy: s[2], r: s[3], class: s[0] }, g);
      }
      for (const [x, y, anchor, words] of part.texts) svg("text", { x, y: y + 4, "text-anchor": anchor }, g).textContent = words;
      return { part, g };
    });
    for (const [x, y, anchor, words] of picture.names) svg("text", { x, y: y + 4, "text-anchor": anchor, class: "name" }, root).textContent = words;
    this.root?.remove();
    this.root = root;
    this.host.querySelector(".picture").append(root);
    this.phases = this.wires.map(() => 0);
    this.touch();
    this.host.querySelector("#within").textContent = picture.note || "";
    this.show();
  }
  colour(v) {
    if (!Number.isFinite(v)) return "var(--edge)";
    const share = Math.min(1, Math.sqrt(Math.abs(v) / this.top));
    return share < 0.02 ? "var(--edge)" : `color-mix(in oklab, var(--${v > 0 ? "over" : "under"}) ${Math.round(100 * share)}%, var(--edge))`;
  }
  show() {
    const { t } = this.clock, coloured = this.host.querySelector("#volts").checked;
    const of = new Map();
    const paint = (net) => { if (!of.has(net)) of.set(net, coloured ? this.colour(this.volt(net, t)) : "var(--edge)"); return of.get(net); };
    for (const w of this.wires) if (w.line) w.line.style.stroke = paint(w.net);
    for (const j of this.joints) j.dot.style.fill = paint(j.net);
    this.wires.forEach((w) => { w.now = w.part ? this.current(w.part, 0, t) : this.along(w, t); });
    this.scale();
    if (this.told) this.tell(this.told);
  }
  // dots move as fast as the root of the current, the largest of the drawing over the run fastest
  scale() {
    if (!this.tops.has(this.inside)) {
      const { time } = this.run, most = Math.min(60, time.length);
      let top = 0;
      for (let k = 0; k < most; k++) {
        const t = time[0] + (time[time.length - 1] - time[0]) * k / most;
        for (const w of this.wires) if (w.part) { const i = Math.abs(this.current(w.part, 0, t)); if (Number.isFinite(i)) top = Math.max(top, i); }
      }
      this.tops.set(this.inside, top);
    }
    const top = this.tops.get(this.inside);
    for (const w of this.wires) {
      const share = top > 0 && Number.isFinite(w.now) ? w.now / top : 0;
      w.speed = Math.abs(share) < FAINT ? 0 : Math.sign(share) * Math.min(1, Math.sqrt(Math.abs(share))) * FASTEST;
      w.dots.style.opacity = w.speed && this.host.querySelector("#flows").checked ? Math.min(1, 0.35 + Math.abs(w.speed) / FASTEST) : 0;
    }
  }
  step(seconds) {
    this.wires.forEach((w, k) => {
      if (!w.speed) return;
      this.phases[k] += w.speed * Math.min(seconds, 0.1);
      w.dots.style.strokeDashoffset = -this.phases[k] % DOTS;
    });
  }

  // ---- touching ----

  touch() {
    const { signal } = this.gone;
    for (const { part, g } of this.parts) {
      const over = () => this.light(part.name), off = () => this.light(null);
      g.addEventListener("pointerenter", over, { signal });
      g.addEventListener("focus", over, { signal });
      g.addEventListener("pointerleave", off, { signal });
      g.addEventListener("blur", off, { signal });
      g.addEventListener("click", () => this.pick(part), { signal });
      g.addEventListener("dblclick", () => this.open(part.name), { signal });
      g.addEventListener("keydown", (e) => { if (e.key === "Enter") { e.preventDefault(); this.run.circuit.pictures[part.name] ? this.open(part.name) : this.pick(part); } }, { signal });
    }
    this.machine?.canvas.addEventListener("pointermove", (e) => {
      if (e.buttons) return;
      const r = e.target.getBoundingClientRect(), name = this.machine.coupling(e.clientX - r.left, e.clientY - r.top);
      if (name !== this.pointed) { this.pointed = name; this.light(name); }
    }, { signal });
    for (const w of this.wires.filter((w) => w.grip)) {
      w.grip.addEventListener("pointerenter", () => this.tell({ net: w.net }), { signal });
      w.grip.addEventListener("pointerleave", () => this.tell(null), { signal });
      w.grip.addEventListener("click", () => this.add(this.run.circuit.volts[w.net]), { signal });
    }
  }
  // of the machine or of the circuit: what is one thing in both worlds
  light(name) {
    for (const { part, g } of this.parts) g.classList.toggle("lit", part.name === name);
    const found = this.parts.find(({ part }) => part.name === name);
    this.machine?.light(found?.part.card ? name : null);
    this.tell(found ? { part: found.part } : null);
  }
  tell(what) {
    this.told = what;
    const { t } = this.clock, box = this.host.querySelector(".told"), lines = [];
    if (what?.net !== undefined) lines.push([`v(${what.net})`, this.volt(what.net, t), "V"]);
    if (what?.part) {
      const { part } = what, two = part.pins.length === 2, v = part.pins.map(([, , net]) => this.volt(net, t)), i = part.pins.map((_, k) => this.current(part, k, t));
      if (two) lines.push(["v", v[0] - v[1], "V"], ["i", i[0], "A"], ["p", (v[0] - v[1]) * i[0], "W"]);
      else part.pins.forEach(([, , net], k) => lines.push([`v(${net})`, v[k], "V"], ["i", i[k], "A"]));
    }
    const said = lines.filter(([, value]) => Number.isFinite(value)).map(([name, value, unit]) => `${name} = ${written(value, unit)}`).join("   ");
    const opens = what?.part && this.run.circuit.pictures[what.part.name] ? "   (double click: inside)" : "";
    box.textContent = what ? `${what.part ? what.part.name + ":   " : ""}${said}${opens}` : "touch a part or a wire";
  }
  pick(part) {
    const terms = this.terms(part, 0);
    if (terms?.length) this.add(terms.length === 1 && terms[0][0] === 1 && !terms[0][2] ? terms[0][1] : `i(${part.name})`, terms);
    else if (part.pins.length === 1) this.add(this.run.circuit.volts[part.pins[0][2]]);
  }
  // a signal among the waves, or no more; one that the run does not have is made of those that the drawing has
  add(name, terms = [[1, name, 0]]) {
    if (!name) return;
    const { run, waves } = this;
    if (!run.columns.some((c) => c.name === name)) {
      const values = Float32Array.from(run.time, (t) => this.sum(terms, t));
      run.columns.push({ name, unit: this.columns.get(terms[0][1])?.unit === "A" || terms[0][2] || terms.length > 1 || name[0] === "i" ? "A" : "V", values });
    }
    if (!waves.shown.delete(name)) waves.shown.add(name);
    waves.build();
    chips(run, waves);
  }
  open(name) {
    if (!this.run.circuit.pictures[name]) return;
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
      <label><input type="checkbox" id="volts" checked> voltages</label> <label><input type="checkbox" id="flows" checked> currents</label>
      <button id="large" aria-pressed="false" title="over the whole width">large</button></div>
      <div class="picture"></div><div class="told">touch a part or a wire</div><div id="within"></div></section>`;
    left.append($("stage"));
    $("flows").checked = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    $("volts").onchange = $("flows").onchange = () => window.emsim?.circuit?.show();
    $("large").onclick = (e) => { e.target.setAttribute("aria-pressed", document.querySelector("main").classList.toggle("large")); dispatchEvent(new Event("resize")); };
  }
  const host = $("circuit");
  host.hidden = !run.circuit;
  left.hidden = !run.circuit && !run.scene;
  const refused = run.circuit?.refused;
  host.querySelector(".picture").replaceChildren();
  for (const part of host.querySelectorAll(".picture, .tools, .told")) part.hidden = Boolean(refused);
  $("within").textContent = refused ? `not drawn: ${refused}` : "";
  return run.circuit && !refused ? new Circuit(run, host, clock, waves, machine) : null;
}
