// The page: one clock for the machine and the waves, transport, sheets below.
"use strict";

const $ = (id) => document.getElementById(id);

class Clock {
  constructor(first, last) { Object.assign(this, { first, last, t: first, playing: false, speed: 1, listeners: [] }); }
  listen(f) { this.listeners.push(f); }
  set(t) {
    this.t = Math.max(this.first, Math.min(this.last, t));
    if (!this.waiting) {
      this.waiting = true;
      requestAnimationFrame(() => { this.waiting = false; this.listeners.forEach((f) => f()); });
    }
  }
  play(on = !this.playing) {
    this.playing = on;
    if (on && this.t >= this.last) this.t = this.first;
    let then = performance.now();
    const frame = (now) => {
      if (!this.playing) return;
      const t = this.t + (now - then) / 1000 * this.speed;
      then = now;
      this.set(t);
      if (t >= this.last) this.playing = false;
      $("play").innerHTML = this.playing ? "&#10074;&#10074;" : "&#9654;";
      requestAnimationFrame(frame);
    };
    $("play").innerHTML = on ? "&#10074;&#10074;" : "&#9654;";
    if (on) requestAnimationFrame(frame);
  }
}

async function columnsOf(packed, rows) { return Promise.all(packed.map((c) => unpack(c, rows, 4))); }

// Every run of the page (one; a live page brings more) goes through here.
async function show(run) {
  $("title").textContent = run.title;
  document.title = run.title;
  $("facts").textContent = run.facts;
  $("error").hidden = !run.error;
  $("error").textContent = run.error || "";
  sheets(run);
  if (!run.rows) return;
  run.time = await unpack(run.axis, run.rows, 8);
  const values = await columnsOf(run.packed, run.rows);
  run.columns = run.names.map((name, k) => ({ name, unit: run.units[k], values: values[k] }));
  const old = window.emsim, clock = new Clock(run.time[0], run.time[run.time.length - 1]);
  const waves = new Waves(run, $("panels"), clock);
  let machine = null;
  $("stage").hidden = !run.scene;
  if (run.scene) {
    const { scene } = run;
    scene.time = await unpack(scene.axis, scene.rows, 8);
    const moves = await columnsOf(scene.packed, scene.rows);
    scene.channels.forEach((c, k) => (c.values = moves[k]));
    machine = new Machine(scene, $("machine"), clock);
    options($("trace"), ["", ...scene.points.map((p) => p.name)]);
    $("trace").value = machine.trace = old?.machine?.trace || scene.view.trace || "";
  }
  if (old) {
    old.clock.play(false);
    if (same(old.run.names, run.names)) { waves.shown = old.waves.shown; waves.degrees = old.waves.degrees; }
    clock.t = Math.min(old.clock.t, clock.last);
    $("panels").replaceChildren();
  }
  window.emsim = { run, clock, waves, machine };
  const span = clock.last - clock.first, speeds = [];
  for (let s = 10 ** Math.ceil(Math.log10(span / 100)); s <= span * 2; s *= 10) speeds.push(s, 2 * s, 5 * s);
  const wanted = Number(run.scene?.view?.speed) || Math.min(1, span / 5 || 1);
  const nearest = [1, ...speeds].reduce((a, b) => (Math.abs(Math.log(b / wanted)) < Math.abs(Math.log(a / wanted)) ? b : a));
  options($("speed"), [...new Set([1, ...speeds])].sort((a, b) => a - b).map((s) => [s, `${+s.toPrecision(2)} x`]));
  $("speed").value = clock.speed = nearest;
  options($("xaxis"), [["", run.axisName], ...run.names.map((n) => [n, n])]);
  clock.listen(() => {
    $("scrub").value = (clock.t - clock.first) / (span || 1);
    $("clock").textContent = written(clock.t, run.axisUnit, 6);
    waves.readout();
  });
  waves.build();
  chips(run, waves);
  await energySheet(run, clock);
  clock.set(clock.t);
}

const same = (a, b) => a.length === b.length && a.every((v, k) => v === b[k]);

function options(select, items) {
  select.replaceChildren(...items.map((item) => {
    const [value, text] = Array.isArray(item) ? item : [item, item || "none"];
    return new Option(text, value);
  }));
}

// which signals are drawn, and new ones by expression
function chips(run, waves) {
  const box = $("sheet-signals");
  if (!box) return;
  const rows = new Map();
  for (const c of run.columns) {
    if (!rows.has(c.unit)) rows.set(c.unit, []);
    rows.get(c.unit).push(c);
  }
  const lines = [...rows].map(([unit, columns]) => {
    const line = document.createElement("div");
    line.className = "signals";
    line.append(Object.assign(document.createElement("span"), { className: "unit", textContent: unit || "1" }));
    for (const c of columns) {
      const chip = Object.assign(document.createElement("button"), { className: "chip", textContent: c.name });
      chip.setAttribute("aria-pressed", waves.shown.has(c.name));
      chip.onclick = () => {
        if (!waves.shown.delete(c.name)) waves.shown.add(c.name);
        chip.setAttribute("aria-pressed", waves.shown.has(c.name));
        waves.build();
      };
      line.append(chip);
    }
    return line;
  });
  const form = document.createElement("form"), said = document.createElement("span");
  form.innerHTML = '<input type="text" id="expression" size="32" placeholder="an expression, such as v(a)-v(b)" aria-label="expression"> <button>draw</button> ';
  form.append(said);
  form.onsubmit = (e) => {
    e.preventDefault();
    try {
      const text = $("expression").value, found = (name) => run.columns.find((c) => c.name.replace(/\s/g, "") === name)?.values;
      const f = compileExpression(text, found), values = Float32Array.from({ length: run.rows }, (_, k) => f(k));
      run.columns.push({ name: text, unit: "", values });
      waves.shown.add(text);
      waves.build();
      chips(run, waves);
    } catch (error) { said.textContent = error.message; }
  };
  box.replaceChildren(...lines, form);
}

// the sheets below: signals, energy, equations, the deck, what was said
function sheets(run) {
  const made = [["signals", "Signals", ""], ...run.sheets], tabs = $("tabs"), box = $("sheets"), kept = tabs.querySelector("[aria-selected=true]")?.dataset.sheet;
  tabs.replaceChildren();
  box.replaceChildren();
  const pick = (name) => {
    for (const b of tabs.children) b.setAttribute("aria-selected", b.dataset.sheet === name);
    for (const s of box.children) s.hidden = s.id !== "sheet-" + name;
  };
  for (const [name, title, html] of made) {
    const button = Object.assign(document.createElement("button"), { textContent: title, onclick: () => pick(name) });
    button.dataset.sheet = name;
    button.role = "tab";
    const sheet = Object.assign(document.createElement("div"), { id: "sheet-" + name, className: "sheet", innerHTML: html });
    tabs.append(button);
    box.append(sheet);
  }
  pick(made.some(([name]) => name === kept) ? kept : "signals");
}

function step(rows) {
  const { clock, run, waves } = window.emsim, span = (waves.range[1] - waves.range[0]) / 200;
  clock.play(false);
  clock.set(clock.t + rows * span);
}

function wire() {
  const now = () => window.emsim;
  const dark = (on) => { document.documentElement.classList.toggle("dark", on); now()?.waves.build(); now()?.machine?.draw(); };
  dark(matchMedia("(prefers-color-scheme: dark)").matches);
  $("theme").onclick = () => dark(!document.documentElement.classList.contains("dark"));
  $("help").onclick = () => $("keys").showModal();
  $("play").onclick = () => now()?.clock.play();
  $("back").onclick = () => step(-1);
  $("forward").onclick = () => step(1);
  $("scrub").oninput = (e) => { const { clock } = now(); clock.play(false); clock.set(clock.first + e.target.value * (clock.last - clock.first)); };
  $("speed").onchange = (e) => (now().clock.speed = +e.target.value);
  $("trace").onchange = (e) => { now().machine.trace = e.target.value; now().machine.draw(); };
  $("arrows").onchange = (e) => { now().machine.arrows = e.target.checked; now().machine.draw(); };
  $("labels").onchange = (e) => { now().machine.labels = e.target.checked; now().machine.draw(); };
  $("fit").onclick = () => { now().machine.fit(); now().machine.draw(); };
  $("whole").onclick = () => now().waves.zoom(...now().waves.full);
  $("degrees").onchange = (e) => { now().waves.degrees = e.target.checked; now().waves.build(); };
  $("xaxis").onchange = (e) => { now().waves.xname = e.target.value || null; now().waves.build(); };
  document.addEventListener("keydown", (e) => {
    if (!now() || /INPUT|SELECT|TEXTAREA/.test(e.target.tagName) && e.target.id !== "scrub" || e.ctrlKey || e.metaKey) return;
    const { clock, waves, machine } = now();
    const keys = {
      " ": () => clock.play(), ArrowLeft: () => step(e.shiftKey ? -10 : -1), ArrowRight: () => step(e.shiftKey ? 10 : 1),
      Home: () => waves.zoom(...waves.full), f: () => $("fit").click(), "+": () => waves.about(clock.t, 0.7), "-": () => waves.about(clock.t, 1.4),
      a: () => waves.mark("a", clock.t), b: () => waves.mark("b", clock.t), Escape: () => { waves.mark("a", null); waves.mark("b", null); },
      d: () => $("theme").click(), "?": () => $("help").click(),
    };
    if (keys[e.key]) { e.preventDefault(); keys[e.key](); }
  });
}

wire();
show(JSON.parse($("run").textContent));
