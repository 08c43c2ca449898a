// The playground: a deck at the left, its run at the right, computed here by emsim itself (playground-worker.js). The page opens with the
// run of its first deck, recorded, while Python is being loaded. The deck stands in the address: #deck=, deflated, base64url.
"use strict";

const PAUSE = 350, PATIENT = 3000; // ms without a key before a deck is run; that a run may take when a newer deck waits
const EMPTY = { title: "emsim", facts: "", error: null, rows: 0, names: [], units: [], shown: [], axisName: "", axisUnit: "", sheets: [], scene: null };

const linked = () => new URLSearchParams(location.hash.slice(1)).get("deck");

async function packedText(text) {
  const bytes = new Uint8Array(await new Response(new Blob([text]).stream().pipeThrough(new CompressionStream("deflate-raw"))).arrayBuffer());
  return btoa(Array.from(bytes, (b) => String.fromCharCode(b)).join("")).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

async function textOf(packed) {
  const bytes = Uint8Array.from(atob(packed.replaceAll("-", "+").replaceAll("_", "/")), (c) => c.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"))).text();
}

// emsim in its worker; `ask` promises an answer, which is undefined where the worker was ended meanwhile
class Emsim {
  constructor() {
    Object.assign(this, { told: () => {}, count: 0 });
    this.begin();
  }
  begin() {
    this.worker?.terminate();
    this.asked?.forEach((done) => done(undefined));
    Object.assign(this, { asked: new Map(), ready: false, worker: new Worker("worker.js", { type: "module" }) });
    this.worker.onmessage = ({ data }) => {
      if (data.id === undefined) {
        this.ready ||= Boolean(data.ready);
        return this.told(data);
      }
      this.asked.get(data.id)?.(data.failed ? { failed: data.failed } : JSON.parse(data.answer));
      this.asked.delete(data.id);
    };
    this.worker.onerror = () => this.told({ failed: "Python cannot be begun in this browser" });
  }
  ask(what, ...args) {
    const id = ++this.count;
    return new Promise((done) => {
      this.asked.set(id, done);
      this.worker.postMessage({ id, what, args });
    });
  }
}

class Playground {
  constructor({ emsim, text, cards, failed }) {
    document.body.classList.add("playground");
    Object.assign(this, { emsim, shown: null, next: null, busy: false });
    this.status = made("span", { id: "live", role: "status" });
    $("facts").after(this.status);
    this.bar = made("div", { id: "share" });
    document.querySelector("header").after(this.bar);
    this.menu = made("select", { title: "a deck to begin with" });
    this.menu.setAttribute("aria-label", "templates");
    this.link = made("button", { textContent: "copy link", title: "the address of this page with the deck in it", onclick: () => this.copy() });
    this.file = made("button", { textContent: "save", title: "the deck as a file", onclick: () => this.save() });
    this.halt = made("button", { textContent: "stop", hidden: true, onclick: () => this.stop() });
    this.said = made("section", { id: "said", hidden: true });
    this.said.setAttribute("aria-label", "messages");
    const desk = made("div", { id: "text" });
    window.bench.edits(made("div", { className: "tools" }, this.menu, this.link, this.file, this.halt), desk, this.said);
    this.editor = emsimEditor.open(desk, { text, cards, changed: (fresh) => this.changed(fresh), ask: (what, row, col) => this.helped(what, row, col), pointed: (line) => window.bench.pointed(line) });
    window.bench.editor = this.editor;
    window.bench.wrote(text);
    emsim.told = (data) => this.heard(data);
    this.tell(emsim.ready ? "ok" : "", emsim.ready ? "ready" : "Python is being loaded");
    this.templates();
    if (failed) this.tell("wrong", failed);
    addEventListener("hashchange", () => this.fromLink());
  }
  tell(kind, text) {
    this.status.className = kind;
    this.status.textContent = text;
  }
  heard({ ready, share, failed }) {
    if (ready && !this.busy) this.tell("ok", "ready");
    if (failed) this.tell("wrong", failed);
    if (share !== undefined) this.bar.style.width = `${100 * share}%`;
  }
  // behind a run that is short, not behind one that takes long
  helped(what, row, col) { return this.emsim.ready && !(this.busy && performance.now() - this.since > PAUSE) ? this.emsim.ask(what, this.editor.text(), row, col) : null; }
  // ---- the deck ----
  async templates() {
    const decks = await (await fetch("decks.json")).json(), groups = Map.groupBy ? Map.groupBy(decks, (deck) => deck.group) : new Map([["decks", decks]]);
    this.menu.append(new Option("open \u2026", ""));
    for (const [label, own] of groups) this.menu.append(made("optgroup", { label }, ...own.map((deck) => new Option(`${deck.name}: ${deck.text.split("\n")[0]}`, decks.indexOf(deck)))));
    this.menu.onchange = () => {
      const deck = decks[this.menu.value];
      this.menu.value = "";
      if (deck) this.open(deck.text);
    };
  }
  open(text) {
    this.fresh = true;
    this.editor.put(text);
    this.run(text);
  }
  changed(text) {
    window.bench.wrote(text);
    clearTimeout(this.rest);
    this.rest = setTimeout(() => this.run(text), PAUSE);
  }
  async fromLink() {
    const packed = linked();
    if (!packed || packed === this.address) return;
    try { this.open(await textOf(packed)); } catch { this.tell("wrong", "the link holds no deck"); }
  }
  async address_(text) {
    this.address = await packedText(text);
    try { history.replaceState(null, "", `#deck=${this.address}`); } catch { /* no address of its own */ }
  }
  async copy() {
    await this.address_(this.editor.text());
    const done = await navigator.clipboard?.writeText(location.href).then(() => true, () => false);
    this.tell("ok", done ? "the link is copied" : "the link is this page's address");
  }
  save() {
    const where = made("a", { href: URL.createObjectURL(new Blob([this.editor.text()])), download: "deck.cir" });
    where.click();
    setTimeout(() => URL.revokeObjectURL(where.href), 1000);
  }
  // ---- runs ----
  stop() {
    this.next = null;
    this.again();
    this.tell("wrong", "stopped; any edit runs it again");
  }
  // a run that is on its way is ended with the Python that it runs in
  again() {
    this.emsim.begin();
    this.bar.style.width = "0";
  }
  async run(text) {
    clearTimeout(this.rest);
    this.address_(text);
    if (this.busy) {
      this.next = text;
      if (this.emsim.ready && performance.now() - this.since > PATIENT) this.again();
      return;
    }
    this.busy = true;
    this.next = text;
    while (this.next !== null) {
      const now = this.next;
      this.next = null;
      this.since = performance.now();
      await this.carry(now);
    }
    this.busy = false;
  }
  async carry(text) {
    document.body.classList.add("busy");
    if (this.emsim.ready) this.tell("", "running");
    const halts = setTimeout(() => (this.halt.hidden = false), 1000);
    const found = await this.emsim.ask("run", text);
    clearTimeout(halts);
    this.halt.hidden = true;
    document.body.classList.remove("busy");
    this.bar.style.width = "0";
    if (!found) return;
    if (found.failed) { this.tell("wrong", "emsim has failed; it begins anew"); this.again(); return this.words([["error", found.failed]], []); }
    if (this.editor.text() === text) this.editor.mark(found.marks);
    this.words(found.ok ? [] : found.said, found.marks);
    if (found.run) await this.show(found.run);
    document.body.classList.toggle("stale", !found.run);
    this.tell(found.ok ? "ok" : "wrong", found.ok ? written(found.seconds, "s", 2) : this.first(found.marks));
    if (!found.ok || this.next !== null) return;
    // what takes longer comes behind the run: first what it computes with, then its equations
    const engine = await this.emsim.ask("engine");
    if (this.next !== null || !engine || engine.failed) return;
    this.engine(engine);
    const sheets = await this.emsim.ask("explain");
    if (this.next === null && sheets && !sheets.failed) await this.sheets(sheets);
  }
  first(marks) {
    const wrong = marks.find((mark) => mark.severity === "error");
    return wrong ? `line ${wrong.line}` : "it fails";
  }
  words(pieces, marks) {
    const mendings = marks.flatMap((mark) => mark.fixes).map((fix) => made("button", { className: "mend", textContent: `line ${fix.line}: ${fix.label}`, onclick: () => this.editor.mend(fix) }));
    const lines = [...new Set(marks.filter((mark) => mark.severity === "error").map((mark) => mark.line))].map((line) => made("button", { textContent: `line ${line}`, onclick: () => this.editor.show(line) }));
    this.said.hidden = !pieces.length;
    this.said.replaceChildren(made("p", {}, ...lines, ...mendings), made("pre", {}, ...pieces.map(([kind, text]) => (kind ? made("span", { className: kind, textContent: text }) : text))));
  }
  async show(run) {
    const old = window.emsim, was = this.fresh ? undefined : old, on = Boolean(window.engine?.running);
    window.engine?.close();
    window.engine = undefined;
    if (this.fresh) { leave(); this.fresh = false; }
    this.on = on;
    document.body.classList.remove("empty");
    // the equations come later: until then the others keep their place
    await show(run);
    this.shown = run;
    const now = window.emsim, moves = now && (run.scene || (run.circuit && !run.circuit.refused)) && run.axisName === "time";
    if (moves && (!was || was.clock.playing || was.clock.t >= was.clock.last) && !matchMedia("(prefers-reduced-motion: reduce)").matches) now.clock.play(true);
  }
  engine(data) {
    if (!window.emsim || this.shown !== window.emsim.run) return;
    window.engine = new Engine(data, $("engine-code").textContent, this.shown);
    this.writes();
    if (this.on) window.engine.goOn();
  }
  // a slider's value goes into the text
  writes() {
    window.engine.wrote = (at, line) => this.editor.line(at + 1, line);
  }
  async sheets(more) {
    const run = window.engine?.base ?? this.shown, own = new Set(more.map(([name]) => name)), at = run.sheets[0]?.[0] === "energy" ? 1 : 0;
    run.sheets = run.sheets.filter(([name]) => !own.has(name)).toSpliced(at, 0, ...more);
    if (window.emsim) sheets(window.emsim.run === run ? run : Object.assign(window.emsim.run, { sheets: run.sheets }));
    if (window.emsim) { chips(window.emsim.run, window.emsim.waves); energySheet(window.emsim.run, window.emsim.clock); }
  }
}

// before the page's last script shows what it opens with
document.body.dataset.live = "";
const opening = JSON.parse(document.getElementById("run").textContent), fromLink = linked();
if (fromLink) {
  document.getElementById("run").textContent = JSON.stringify(EMPTY);
  document.body.classList.add("empty");
}
(async () => {
  const emsim = new Emsim(); // the longest part of the way
  let { text } = opening, failed = null;
  if (fromLink) try { text = await textOf(fromLink); } catch { failed = "the link holds no deck"; }
  await new Promise((done, wrong) => document.head.append(Object.assign(document.createElement("script"), { src: "editor.js", onload: done, onerror: wrong })));
  window.playground = new Playground({ emsim, text, cards: opening.cards, failed });
  const { playground } = window;
  if (fromLink || failed) {
    playground.fresh = true;
    playground.run(text);
    return;
  }
  // as soon as what the page opens with is shown
  const shown = () => {
    if (!window.engine) return requestAnimationFrame(shown);
    playground.shown = window.engine.base;
    playground.writes();
    if (!matchMedia("(prefers-reduced-motion: reduce)").matches) window.emsim.clock.play(true);
  };
  shown();
})();
