// The engine in the page (engine/src/page.rs): what the reader moves is computed here, in a worker, with no server.
"use strict";

// Runs in the worker, one request after the other. {packed, model, places}: the engine begins. Others first set what is in `set`,
// [[input, value]..], and `place`, [[unknown, value]..]; then {whole}: the run anew; {start} and {step}: a run that is led, from its
// start and on by `step` seconds in no more than `budget` ms; {aim}: coordinates at the start that bring a point of a body to a place.
function engineWorker() {
  let e, width, pace = 0;
  const text = () => new TextDecoder().decode(new Uint8Array(e.memory.buffer, e.page_text(), e.page_text_length()).slice());
  const done = (ok) => { if (!ok) throw new Error(text()); };
  async function begin({ packed, model, places }) {
    e = (await WebAssembly.instantiate(unlzma(Uint8Array.from(atob(packed), (c) => c.charCodeAt(0))), {})).instance.exports;
    const room = e.page_room(model.length);
    new Uint8Array(e.memory.buffer, room, model.length).set(model);
    width = e.page_open(room, model.length);
    done(width >= 0);
    for (const [unknown, speed] of places) done(e.page_coordinate(unknown, speed));
  }
  function whole() {
    const began = performance.now(), rows = e.page_run(), seconds = (performance.now() - began) / 1000, said = text();
    const data = new Float64Array(e.memory.buffer, e.page_rows(), rows * width);
    const found = Array.from({ length: width }, (_, c) => { const values = new Float64Array(rows); for (let k = 0, at = c; k < rows; k++, at += width) values[k] = data[at]; return values; });
    const accounts = led(e.page_accounts());
    postMessage({ found, said, seconds, accounts }, found.map((values) => values.buffer));
  }
  const led = (count) => new Float64Array(e.memory.buffer, e.page_led(), count).slice();
  function start() {
    const count = e.page_start(), rows = led(count);
    pace = 0;
    postMessage({ led: rows, said: text(), started: true }, [rows.buffer]);
  }
  // in parts, so that an answer comes in time however slow the deck is: each about as long as half of what is left may take
  function step(h, budget, least) {
    const began = performance.now(), parts = [];
    let left = h, said = "", now = began;
    while (left > 0 && !said) {
      const part = Math.min(left, pace ? Math.max(0.5 * pace * (budget - (now - began)), least) : least);
      parts.push(led(e.page_step(left - part > 1e-3 * part ? part : left)));
      said = text();
      const then = performance.now();
      if (then > now) pace = part / (then - now);
      left = left - part > 1e-3 * part ? left - part : 0;
      now = then;
      if (now - began > 0.8 * budget) break;
    }
    const rows = new Float64Array(parts.reduce((n, part) => n + part.length, 0));
    let at = 0;
    for (const part of parts) { rows.set(part, at); at += part.length; }
    postMessage({ led: rows, said }, [rows.buffer]);
  }
  // Gauss and Newton: where the point is seen, along `axes`, by the coordinates; slopes by differences
  function aim({ unknowns, values, at, local, target, axes }) {
    const seen = () => {
      done(e.page_pose());
      const row = new Float64Array(e.memory.buffer, e.page_led(), width), p = at.map((v) => (Array.isArray(v) ? row[v[0]] : v));
      const r = p.length > 3 ? p.slice(3) : [Math.cos(p[2]), -Math.sin(p[2]), 0, Math.sin(p[2]), Math.cos(p[2]), 0, 0, 0, 1], z = p.length > 3 ? p[2] : 0;
      const from = [p[0], p[1], z].map((o, i) => o + r[3 * i] * local[0] + r[3 * i + 1] * local[1] + r[3 * i + 2] * local[2] - target[i]);
      return axes.map((a) => a[0] * from[0] + a[1] * from[1] + a[2] * from[2]);
    };
    const place = (q) => unknowns.every((u, k) => e.page_place(u, q[k]));
    let q = values;
    if (!place(q)) return values;
    let off = seen(), size = Math.hypot(...off);
    for (let again = 0; again < 12; again++) {
      const slopes = q.map((v, k) => {
        const h = 1e-6 * (1 + Math.abs(v)), moved = [...q];
        moved[k] += h;
        const there = place(moved) ? seen() : off;
        return there.map((v, i) => (v - off[i]) / h);
      });
      // the shortest way: (J J^T + a little) y = -off, dq = J^T y, J is 2 x n
      let [a, b, d] = [0, 0, 0];
      for (const [x, y] of slopes) { a += x * x; b += x * y; d += y * y; }
      const damp = 1e-6 * (a + d) + 1e-300, det = (a + damp) * (d + damp) - b * b, y0 = (b * off[1] - (d + damp) * off[0]) / det, y1 = (b * off[0] - (a + damp) * off[1]) / det;
      const way = slopes.map(([x, y]) => x * y0 + y * y1);
      let part = 1, better = false;
      for (; part > 1e-3 && !better; part /= 2) {
        const next = q.map((v, k) => v + part * way[k]);
        if (!place(next)) continue;
        const there = seen(), far = Math.hypot(...there);
        if (far < size) { better = size - far > 1e-6 * size; [q, off, size] = [next, there, far]; break; }
      }
      if (!better) break;
    }
    place(q);
    return q;
  }
  function answer(data) {
    for (const [input, value] of data.set ?? []) done(e.page_set(input, value));
    for (const [unknown, value] of data.place ?? []) done(e.page_place(unknown, value));
    if (data.whole) whole();
    else if (data.start) start();
    else if (data.step) step(data.step, data.budget, data.least);
    else if (data.aim) postMessage({ aimed: aim(data.aim) });
  }
  // in the order in which they came
  let last = Promise.resolve();
  onmessage = ({ data }) => { last = last.then(() => (data.packed ? begin(data) : answer(data))).catch(failed); };
  function failed(error) {
    let said = String(error.message ?? error);
    try { said = text() || said; } catch { /* the engine is not there */ }
    postMessage({ said, found: null });
  }
}

class Engine {
  // `deck`: as fmus/page.py has it; `base`: the run as it was recorded
  constructor(deck, packed, base) {
    Object.assign(this, { deck, packed, base, wishes: new Map(), values: new Map(), busy: false });
    this.channels = [deck.scene, deck.circuit].flatMap((part) => part?.channels ?? []);
    this.knobs();
    this.hands = new Hands(this);
  }
  // another run takes its place
  close() {
    this.closed = true;
    this.running?.close();
    this.worker?.terminate();
    this.section.remove();
    this.hands.close();
  }
  async begin() {
    this.worker = new Worker(URL.createObjectURL(new Blob([`${unlzma}\n(${engineWorker})()`], { type: "text/javascript" })));
    this.worker.onmessage = ({ data }) => (data.aimed ? this.hands.aimed(data.aimed) : data.led ? this.running?.came(data) : this.came(data));
    this.worker.onerror = () => this.came({ found: null, said: "the engine cannot be begun here" });
    this.worker.postMessage({ packed: this.packed, model: await inflate(this.deck.model), places: this.deck.places.map((place) => place.slice(4)) });
  }
  // what is moved goes by one number: inputs and hands, and behind these where coordinates start
  get behind() { return this.deck.inputs.length + Object.keys(this.deck.hands).length; }
  named(k) { return k < this.behind ? this.deck.inputs[k] : this.deck.places[k - this.behind]; }
  start(k) { return this.named(k)?.[2] ?? 0; }
  // a request to the worker, with what was wished since the last one
  async ask(what) {
    if (!this.worker) { await (this.beginning ??= this.begin()); this.beginning = null; }
    const set = [], place = [];
    for (const [k, value] of this.wishes) {
      if (k < this.behind) set.push([k, value]);
      else place.push([this.deck.places[k - this.behind][4], value === this.start(k) ? NaN : value]);
    }
    this.wishes.clear();
    this.worker.postMessage({ set, place, ...what });
  }
  want(pairs) {
    for (const [k, value] of pairs) { this.wishes.set(k, value); this.values.set(k, value); }
  }
  // one value or several; at most one run is under way, the newest wishes follow it
  async wish(pairs) {
    this.want(pairs);
    if (this.running) return this.running.wished(pairs);
    if (this.busy) return;
    this.busy = true;
    await this.ask({ whole: true });
  }
  // a run has come
  async computed() {
    const done = new Promise((resolve) => (this.resolve = resolve));
    await this.wish([]);
    await done;
  }
  // the engine is begun anew, with the values as they are, when it is asked again
  forget() {
    this.worker?.terminate();
    this.worker = null;
    this.values.forEach((v, k) => this.wishes.set(k, v));
  }
  async came({ found, said, seconds, accounts }) {
    if (this.closed) return;
    if (found === null) {
      this.forget();
      this.running?.stop();
    }
    if (found === null || !found[0].length) {
      this.tell(said, true);
      this.busy = false;
      return;
    }
    await this.shown(found, said, accounts);
    this.tell(said ? `${said}` : `computed here in ${written(seconds, "s", 2)}`, Boolean(said));
    if (this.wishes.size && !this.running) this.ask({ whole: true }); else this.busy = false;
    this.resolve?.();
    this.hands.came();
  }
  // a run of the page, of the columns of the engine's rows
  made(columns, more) {
    const { base, deck } = this, time = columns[0], own = new Map(deck.columns.map((name, k) => [name, columns[1 + k]]));
    const run = { ...base, time, rows: time.length, thinned: undefined, all: undefined, energy: undefined, blocks: [], error: null, ...more };
    run.columns = base.columns.filter((c) => own.has(c.name)).map((c) => ({ name: c.name, unit: c.unit, of: c.of, values: own.get(c.name) }));
    for (const c of base.columns) if (!own.has(c.name) && !c.computed) try { run.columns.push({ ...computed(run, c.name), unit: c.unit, computed: false, made: true }); } catch { /* not of these signals */ }
    run.names = run.columns.map((c) => c.name);
    let at = 1 + deck.columns.length;
    const drawn = (part, before) => {
      const channels = part?.channels.map((c) => ({ ...c, values: columns[at++] }));
      return before && part && !before.refused && { ...before, ...part, time, rows: time.length, channels };
    };
    run.scene = drawn(deck.scene, base.scene);
    if (run.scene) meshed(run.scene.shapes, run.scene.meshes);
    run.circuit = drawn(deck.circuit, base.circuit) || base.circuit;
    run.runs = [{ first: 0, rows: Infinity, scene: run.scene, circuit: run.circuit }];
    // labels of parts that say a value
    run.worded = (name, text) => {
      const k = deck.inputs.findIndex(([own]) => own === name), said = (v) => written(v, deck.inputs[k][1].replace("Ohm", "\u03a9"));
      return k >= 0 && text === said(this.start(k)) ? said(this.values.get(k) ?? this.start(k)) : text;
    };
    run.closed = Object.fromEntries(Object.entries(deck.switches).map(([name, [, column]]) => [name, columns[column]]));
    return run;
  }
  changed() { return [...this.values].filter(([k, v]) => this.named(k) && v !== this.start(k)); }
  facts(rows) {
    const moved = [...this.changed().map(([k, v]) => `${this.named(k)[0]} = ${+v.toPrecision(6)}`), ...this.hands.held()];
    return ["Transient Analysis", ...(rows ? [`${rows} points`] : []), ...(moved.length ? [moved.join(", ")] : [])].join(" \u00b7 ");
  }
  // the run as one of the page, the one before pale below it
  async shown(columns, said, accounts) {
    const { base } = this, changed = this.changed().length || this.hands.held().length;
    const run = this.made(columns, { error: said || null, facts: changed ? this.facts(columns[0].length) : base.facts });
    if (accounts?.length && this.deck.accounts) run.energy = ledgerOf(this.deck.accounts, accounts);
    run.sheets = base.sheets.map((sheet) => (changed || sheet[0] === "deck" ? this.sheet(run, ...sheet) : sheet));
    const before = window.emsim, ghosts = before && before.run !== run ? [ghostOf(before)] : [];
    await show(run);
    this.hands.mark();
    if (window.emsim) { window.emsim.waves.ghosts = ghosts; window.emsim.waves.build(); }
  }
  // what the sheets of the deck's run say of this one
  sheet(run, name, title, html) {
    if (name === "deck") return [name, title, this.written ? this.text() : html];
    if (name === "measures" && this.deck.measures.length) return measuredSheet(run, this.deck.measures, (word) => { const k = this.deck.inputs.findIndex(([n]) => n === word); return k < 0 ? undefined : this.values.get(k) ?? this.start(k); });
    if (!["energy", "measures", "harmonics", "messages"].includes(name)) return [name, title, html];
    return name === "energy" ? [name, title, ""] : [name, `${title} of the deck`, html];
  }
  tell(text, wrong = false) {
    this.told.textContent = text;
    this.told.className = wrong ? "wrong" : "";
  }
  // ---- sliders ----
  knobs() {
    this.told = made("span", { id: "computing" });
    this.told.setAttribute("role", "status");
    const box = made("div", { className: "knobs", hidden: true }), fold = made("button", { className: "fold" }), section = (this.section = made("section", { id: "knobs" }));
    const opened = () => { fold.textContent = `${box.hidden ? "\u25b8" : "\u25be"} Values to move`; fold.setAttribute("aria-expanded", !box.hidden); };
    fold.onclick = () => { box.hidden = !box.hidden; opened(); };
    opened();
    section.setAttribute("aria-label", "values");
    section.append(made("div", { className: "head" }, this.modes(), fold, this.told), box);
    const all = [...this.deck.inputs.keys(), ...this.deck.places.map((_, k) => this.behind + k)];
    this.rows = new Map(all.map((k) => [k, this.knob(k, ...this.named(k))]));
    box.append(...[...this.rows.values()].map(({ row }) => row));
    fold.hidden = !all.length;
    document.querySelector("main").before(section);
  }
  // the whole run anew, or a run that goes on for ever
  modes() {
    const words = [["whole run", "what is moved is computed from start to end, anew", () => this.stay()], ["runs on", "the clock runs on for ever; what is moved acts at once", () => this.goOn()]];
    const buttons = words.map(([textContent, title, onclick], k) => Object.assign(made("button", { textContent, title, onclick }), { ariaPressed: String(!k) }));
    this.pressed = (k) => buttons.forEach((button, j) => (button.ariaPressed = String(j === k)));
    const group = made("span", { className: "group modes" }, ...buttons);
    group.setAttribute("role", "group");
    group.setAttribute("aria-label", "how it is computed");
    return group;
  }
  async goOn() {
    if (this.running) return;
    this.pressed(1);
    this.running = new Running(this);
    await this.running.restart();
  }
  async stay() {
    if (!this.running) return;
    this.running.close();
    this.running = null;
    this.pressed(0);
    this.forget();
    this.busy = false;
    if (this.changed().length || this.hands.held().length) return this.wish([]);
    await show(this.base);
    this.hands.mark();
    this.tell("");
  }
  // a value into the text of the deck: its line is shown there, and copied
  write(k) {
    const lines = (this.lines ??= [...made("div", { innerHTML: this.base.sheets.find(([name]) => name === "deck")?.[2] ?? "" }).querySelectorAll(".deck span")].map((span) => span.textContent));
    const [name] = this.named(k), value = this.rows.get(k).field.value, found = k < this.behind ? placeIn(lines, name) : this.alone(name) && startIn(lines, name, value);
    if (!found) return this.tell(`${name} is said in no one place of the deck's text`, true);
    const [at, col, size] = found;
    lines[at] = typeof col === "string" ? col : lines[at].slice(0, col) + value + lines[at].slice(col + size);
    (this.written ??= new Set()).add(at);
    this.wrote?.(at, lines[at]);
    document.querySelector("#sheet-deck")?.replaceChildren(...made("div", { innerHTML: this.text() }).childNodes);
    window.bench.refresh();
    const copied = navigator.clipboard?.writeText(lines[at]) ?? Promise.reject();
    copied.then(() => " (copied)", () => "").then((said) => this.tell(`line ${at + 1} of the deck: ${lines[at].trim()}${said}`));
  }
  // is it the one coordinate of its joint?
  alone(name) { const of = name.slice(name.indexOf("(")); return this.deck.places.filter(([n]) => n.endsWith(of)).length === 1; }
  text() {
    const safe = (s) => s.replace(/[&<>]/g, (c) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;" })[c]);
    return `<pre class="deck">${this.lines.map((line, k) => `<span id="line-${k + 1}"${this.written.has(k) ? ' class="picked"' : ""}>${safe(line)}</span>`).join("")}</pre>`;
  }
  // a value that came from elsewhere than its slider
  put(k, value) { this.rows.get(k)?.put(value); }
  knob(k, name, unit, start, what) {
    const like = Math.abs(start) >= 1e-3 && Math.abs(start) < 1e6 ? "1" : "1k", text = spelled(+start.toPrecision(9), like);
    const label = k < this.behind ? name : `${name} at 0`;
    const slider = made("input", { type: "range", step: "any", title: "double click: as it was" }), field = made("input", { type: "text", value: text, spellcheck: false, size: 8 });
    const back = made("button", { textContent: "\u21ba", title: `back to ${text}` }), write = made("button", { textContent: "\u270e", title: "write it into the deck's text, and copy the line", onclick: () => this.write(k) });
    const row = made("div", { className: "knob" }, made("label", { textContent: label, title: unit ? `${what} [${unit}]` : what }), slider, field, back, write);
    write.setAttribute("aria-label", `${label} into the deck's text`);
    slider.setAttribute("aria-label", label);
    field.setAttribute("aria-label", `${label}, as text`);
    back.setAttribute("aria-label", `${label} as in the deck`);
    const placed = (value) => (k < this.behind ? placeSlider(slider, start, value) : placeAbout(slider, start, value, unit === "rad" ? Math.PI : window.emsim?.machine?.size ?? 1));
    placed(start);
    const mark = (value) => row.classList.toggle("set", value !== start);
    const wish = (value) => { mark(value); this.wish([[k, value]]); };
    const reset = () => { field.value = text; placed(start); wish(start); };
    slider.oninput = () => { const value = slid(slider); field.value = spelled(value, like); wish(value); };
    slider.ondblclick = back.onclick = reset;
    field.onchange = () => {
      const value = numberOf(field.value);
      if (value === null) return reset();
      placed(value);
      wish(value);
    };
    return { row, field, put: (value) => { field.value = spelled(+value.toPrecision(6), like); placed(value); mark(value); } };
  }
}
