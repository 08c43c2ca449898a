// The engine in the page (engine/src/page.rs): what the reader moves is computed here, in a worker, with no server.
"use strict";

// Runs in the worker. {wasm, model}: the engine begins; {set}: [[input, value]..], then the whole run anew.
function engineWorker() {
  let e, width;
  const text = () => new TextDecoder().decode(new Uint8Array(e.memory.buffer, e.page_text(), e.page_text_length()).slice());
  async function begin({ wasm, model }) {
    e = (await WebAssembly.instantiate(wasm, {})).instance.exports;
    const room = e.page_room(model.length);
    new Uint8Array(e.memory.buffer, room, model.length).set(model);
    width = e.page_open(room, model.length);
    if (width < 0) throw new Error(text());
  }
  function run({ set, columns }) {
    for (const [input, value] of set) if (!e.page_set(input, value)) throw new Error(text());
    const began = performance.now(), rows = e.page_run(), seconds = (performance.now() - began) / 1000, said = text();
    const data = new Float64Array(e.memory.buffer, e.page_rows(), rows * width);
    const found = Array.from({ length: 1 + columns }, (_, c) => { const values = new Float64Array(rows); for (let k = 0, at = c; k < rows; k++, at += width) values[k] = data[at]; return values; });
    postMessage({ found, said, seconds }, found.map((values) => values.buffer));
  }
  // in the order in which they came
  let last = Promise.resolve();
  onmessage = ({ data }) => { last = last.then(() => (data.wasm ? begin(data) : run(data))).catch(failed); };
  function failed(error) {
    let said = String(error.message ?? error);
    try { said = text() || said; } catch { /* the engine is not there */ }
    postMessage({ said, found: null });
  }
}

class Engine {
  // `deck`: {model, inputs: [[name, unit, start, what]..], columns: [name..], scene, circuit}; `base`: the run as it was recorded
  constructor(deck, wasm, base) {
    Object.assign(this, { deck, wasm, base, wishes: new Map(), values: new Map(), busy: false, rows: [] });
    this.channels = [deck.scene, deck.circuit].flatMap((part) => part?.channels ?? []);
    this.knobs();
  }
  async begin() {
    this.worker = new Worker(URL.createObjectURL(new Blob([`(${engineWorker})()`], { type: "text/javascript" })));
    this.worker.onmessage = ({ data }) => this.came(data);
    const [wasm, model] = await Promise.all([inflate(this.wasm), inflate(this.deck.model)]);
    this.worker.postMessage({ wasm, model });
  }
  // one value or several; at most one run is under way, the newest wishes follow it
  async wish(pairs) {
    for (const [input, value] of pairs) { this.wishes.set(input, value); this.values.set(input, value); }
    if (this.busy) return;
    this.busy = true;
    if (!this.worker) await this.begin();
    this.send();
  }
  send() {
    const set = [...this.wishes];
    this.wishes.clear();
    this.worker.postMessage({ set, columns: this.deck.columns.length + this.channels.length });
  }
  async came({ found, said, seconds }) {
    if (found === null || !found[0].length) {
      // the deck is opened anew, with the values as they are, when it is asked again
      this.tell(said, true);
      if (found === null) { this.worker.terminate(); this.worker = null; this.values.forEach((v, k) => this.wishes.set(k, v)); }
      this.busy = false;
      return;
    }
    await this.shown(found, said);
    this.tell(said ? `${said}` : `computed here in ${written(seconds, "s", 2)}`, Boolean(said));
    if (this.wishes.size) this.send(); else this.busy = false;
  }
  // the run as one of the page, the one before pale below it
  async shown([time, ...columns], said) {
    const { base, deck } = this, own = new Map(deck.columns.map((name, k) => [name, columns[k]])), moves = columns.slice(deck.columns.length);
    const changed = [...this.values].filter(([k, v]) => v !== deck.inputs[k][2]);
    const run = { ...base, time, rows: time.length, thinned: undefined, all: undefined, energy: undefined, blocks: [], error: said || null };
    run.facts = changed.length ? `Transient Analysis \u00b7 ${time.length} points \u00b7 ${changed.map(([k, v]) => `${deck.inputs[k][0]} = ${+v.toPrecision(6)}`).join(", ")}` : base.facts;
    run.sheets = base.sheets.filter(([name]) => !["energy", "measures", "harmonics"].includes(name) || !changed.length);
    run.columns = base.columns.filter((c) => own.has(c.name)).map((c) => ({ ...c, extremes: false, inDegrees: undefined, values: own.get(c.name) }));
    for (const c of base.columns) if (!own.has(c.name) && !c.computed) try { run.columns.push({ ...computed(run, c.name), unit: c.unit, computed: false }); } catch { /* not of these signals */ }
    run.names = run.columns.map((c) => c.name);
    let at = 0;
    const drawn = (part, before) => before && part && { ...before, ...part, time, rows: time.length, channels: part.channels.map((c) => ({ ...c, values: moves[at++] })) };
    run.scene = drawn(deck.scene, base.scene);
    if (!run.scene && deck.scene) at = deck.scene.channels.length;
    run.circuit = drawn(deck.circuit, base.circuit) ?? base.circuit;
    run.runs = [{ first: 0, rows: Infinity, scene: run.scene, circuit: run.circuit }];
    const before = window.emsim, ghosts = before && before.run !== run ? [ghostOf(before)] : [];
    await show(run);
    if (window.emsim) { window.emsim.waves.ghosts = ghosts; window.emsim.waves.build(); }
  }
  tell(text, wrong = false) {
    this.told.textContent = text;
    this.told.className = wrong ? "wrong" : "";
  }
  // ---- sliders ----
  knobs() {
    this.told = made("span", { id: "computing" });
    this.told.setAttribute("role", "status");
    const box = made("div", { className: "knobs", hidden: true }), fold = made("button", {}), section = made("section", { id: "knobs" });
    const opened = () => { fold.textContent = `${box.hidden ? "\u25b8" : "\u25be"} Values to move`; fold.setAttribute("aria-expanded", !box.hidden); };
    fold.onclick = () => { box.hidden = !box.hidden; opened(); };
    opened();
    section.setAttribute("aria-label", "values");
    section.append(made("div", { className: "head" }, fold, this.told), box);
    this.deck.inputs.forEach(([name, unit, start, what], k) => box.append(this.knob(k, name, unit, start, what)));
    document.querySelector("main").before(section);
  }
  knob(k, name, unit, start, what) {
    const like = Math.abs(start) >= 1e-3 && Math.abs(start) < 1e6 ? "1" : "1k", text = spelled(+start.toPrecision(9), like);
    const slider = made("input", { type: "range", step: "any", title: "double click: as it was" }), field = made("input", { type: "text", value: text, spellcheck: false, size: 8 });
    const back = made("button", { textContent: "\u21ba", title: `back to ${text}` }), row = made("div", { className: "knob" }, made("label", { textContent: name, title: unit ? `${what} [${unit}]` : what }), slider, field, back);
    slider.setAttribute("aria-label", name);
    field.setAttribute("aria-label", `${name}, as text`);
    back.setAttribute("aria-label", `${name} as in the deck`);
    placeSlider(slider, start, start);
    const wish = (value) => { row.classList.toggle("set", value !== start); this.wish([[k, value]]); };
    const reset = () => { field.value = text; placeSlider(slider, start, start); wish(start); };
    slider.oninput = () => { const value = slid(slider); field.value = spelled(value, like); wish(value); };
    slider.ondblclick = back.onclick = reset;
    field.onchange = () => {
      const value = numberOf(field.value);
      if (value === null) return reset();
      placeSlider(slider, start, value);
      wish(value);
    };
    return row;
  }
}
