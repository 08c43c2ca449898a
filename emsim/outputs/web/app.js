// The page: one clock for the machine and the waves, transport, sheets below.
"use strict";

const $ = (id) => document.getElementById(id), SWEEP = 10;

class Clock {
  // `log`: equal ratios are equal distances, and all of them pass in SWEEP seconds
  constructor(first, last, log = false) { Object.assign(this, { first, last, log: log && first > 0, t: first, playing: false, speed: 1, listeners: [] }); }
  get share() { return this.log ? Math.log(this.t / this.first) / Math.log(this.last / this.first) : (this.t - this.first) / (this.last - this.first || 1); }
  at(share) { return this.log ? this.first * (this.last / this.first) ** share : this.first + share * (this.last - this.first); }
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
      const seconds = (now - then) / 1000 * this.speed, t = this.log ? this.at(this.share + seconds / SWEEP) : this.t + seconds;
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

// What is drawn beside a run: one machine and circuit, or those of each run of a deck with .step, behind one another from row
// to row of the table.
async function unpackedDrawings(run, pictures, meshes) {
  run.runs ??= run.scene || run.circuit ? [{ first: 0, rows: Infinity, scene: run.scene, circuit: run.circuit }] : [];
  await Promise.all(run.runs.map(async ({ scene, circuit }) => {
    const [moves, flows] = await Promise.all([scene, circuit].map((part) => part?.rows && unpackAll(part)));
    if (moves) {
      [scene.time] = moves;
      scene.channels.forEach((c, k) => (c.values = moves[k + 1]));
      scene.meshes = await Promise.all(scene.meshes.map((k) => unpackMesh(meshes[k])));
      meshed(scene.shapes, scene.meshes);
    }
    if (!flows) return;
    [circuit.time] = flows;
    const each = circuit.complex ? 2 : 1;
    circuit.own.forEach((k, j) => [circuit.channels[k].values, circuit.channels[k].imag] = flows.slice(1 + each * j, 1 + each * (j + 1)));
    circuit.pictures = JSON.parse(new TextDecoder().decode(await inflate(pictures[circuit.pictures])));
  }));
  run.scene = run.runs.find((one) => one.scene)?.scene ?? null;
  run.circuit = run.runs.find((one) => one.circuit)?.circuit ?? null;
}

// Which of its runs a run is in at the clock's place, and where in that one; NaN where it is not drawn.
function whereIn(run, t) {
  if (run.runs.length < 2) return [0, t];
  const row = run.over ? Math.max(0, Math.min(run.rows - 1, t)) : nearest(run.time, t), n = Math.max(0, run.runs.findLastIndex((one) => one.first <= row));
  const { first, rows } = run.runs[n], over = run.over && run.columns.find((c) => c.name === run.over).values;
  return [n, row >= first + rows ? NaN : over ? valueAt(run.time, over, Math.min(row, first + rows - 1)) : 0];
}

// The clock's place in words: of several courses which one, and where in it.
function placeOf(run, t) {
  if (!run.over) return written(t, run.axisUnit, 6);
  const row = Math.round(t), course = run.courses[[0, ...run.blocks].findLastIndex((first) => first <= row)], over = run.columns.find((c) => c.name === run.over);
  return `${course ? course + ", " : ""}${written(over.values[row], over.unit, 5)}`;
}

// A run's columns as arrays: its signals, what moves the drawings, the energies over time. All are unpacked at once.
async function unpacked(run) {
  if (run.columns) return;
  if (!run.rows) {
    // one point
    run.columns = (run.names ?? []).map((name, k) => ({ name, unit: run.units[k], values: [run.point?.[k]?.[0] ?? NaN] }));
    run.time = [0];
    return unpackedDrawings(run, run.pictures, run.meshes);
  }
  const parts = [run, run.energy].map((part) => part?.rows && unpackAll(part));
  const [own, energies] = await Promise.all([...parts, unpackedDrawings(run, run.pictures, run.meshes)]);
  [run.time] = own;
  let at = 1;
  run.columns = run.names.flatMap((name, k) => (run.complex[k] ? partsOf(name, run.units[k], own[at++], own[at++]) : [{ name, unit: run.units[k], values: own[at++] }]));
  run.columns.forEach((c, k) => (c.extremes = !!run.packed[k]?.extremes)); // complex ones, of which there are more, are never thinned so
  const complex = new Set(run.names.filter((_, k) => run.complex[k]));
  run.shown = run.shown.flatMap((n) => (complex.has(n) ? [`db(${n})`, `ph(${n})`] : [n]));
  if (run.blocks.length) {
    // several courses over one axis: rows have a number, and the axis is a signal that the others are drawn over
    run.columns.unshift({ name: run.axisName, unit: run.axisUnit, values: run.time });
    Object.assign(run, { over: run.axisName, overLog: run.axisLog, time: run.time.map((_, k) => k), axisName: "row", axisUnit: "", axisLog: false });
  }
  run.complexNames = complex;
  run.names = run.columns.map((c) => c.name);
  if (energies) Object.assign(run.energy, { time: energies[0], columns: energies.slice(1) });
}

// Every run of the page goes through here: one, or in a live page one after the other. Then what the reader has set up
// stays, and nothing on the page changes before the new run is at hand.
async function show(run) {
  await unpacked(run);
  analyses(run);
  const old = window.emsim, field = $("expression"), typed = field && { text: field.value, busy: document.activeElement === field };
  $("title").textContent = run.title;
  document.title = run.title;
  $("facts").textContent = run.facts + (run.thinned ? ` \u00b7 curves thinned, right to ${+(100 * run.thinned).toPrecision(2)} % of their range` : "");
  $("error").hidden = !run.error;
  $("error").textContent = run.error || "";
  sheets(run);
  const playing = old?.clock.playing;
  leave();
  $("panels").replaceChildren();
  $("stage").hidden = !run.scene;
  document.body.classList.toggle("still", !run.rows);
  const bare = !run.rows && !run.scene && !run.circuit;
  document.body.classList.toggle("bare", bare);
  $("below").role = bare ? "main" : "region"; // what is above is hidden then
  if (!run.rows) return point(run);
  const clock = new Clock(run.time[0], run.full?.[1] ?? run.time[run.time.length - 1], run.axisLog), waves = new Waves(run, $("panels"), clock);
  const { scene } = run, machine = scene ? new Machine(run, $("machine"), clock) : null;
  if (machine) {
    options($("trace"), ["", ...scene.points.map((p) => p.name)]);
    $("trace").value = old?.machine ? old.machine.trace || "" : scene.view.trace || "";
    machine.trace = $("trace").value || null;
    machine.arrows = $("arrows").checked;
    machine.labels = $("labels").checked;
    depicted(machine, old?.machine ? undefined : scene.view.solid === "yes");
  }
  window.emsim = { run, clock, waves, machine, circuit: circuit(run, clock, waves, machine) };
  const span = clock.log ? 10 : clock.last - clock.first, speeds = [];
  for (let s = 10 ** Math.ceil(Math.log10(span / 100)); s <= span * 2; s *= 10) speeds.push(s, 2 * s, 5 * s);
  // rows of several runs pass in seconds, as a run does
  const wanted = old?.clock.speed || (run.over ? span / 5 / run.runs.length : Number(run.scene?.view?.speed)) || (clock.log ? 1 : Math.min(1, span / 5 || 1));
  const nearest = [1, ...speeds].reduce((a, b) => (Math.abs(Math.log(b / wanted)) < Math.abs(Math.log(a / wanted)) ? b : a));
  options($("speed"), [...new Set([1, ...speeds])].sort((a, b) => a - b).map((s) => [s, `${+s.toPrecision(2)} x`]));
  $("speed").value = clock.speed = nearest;
  options($("xaxis"), [["", run.axisName], ...(run.complexNames.size ? [[NYQUIST, "Nyquist"]] : []), ...(run.axisName === "time" ? Object.keys(WINDOWS).map((w) => [FFT + w, `spectrum, window ${w}`]) : []), ...run.names.map((n) => [n, n])]);
  waves.watchers.push(() => cursorSheet(run, waves, clock), () => keepState(window.emsim)); // hidden, the sheet waits until it is chosen
  if (old) carry(old, window.emsim); else restoreState(window.emsim);
  reflect(window.emsim);
  clock.listen(() => {
    $("scrub").value = clock.share;
    $("clock").textContent = placeOf(run, clock.t);
    waves.readout();
  });
  waves.build();
  chips(run, waves);
  if (typed) {
    $("expression").value = typed.text;
    if (typed.busy) $("expression").focus();
  }
  energySheet(run, clock);
  clock.set(clock.t);
  if (playing || (!old && opensPlaying(run))) clock.play(true);
}

// A page by itself begins to play where there is something to be seen moving, unless its reader wants no motion.
function opensPlaying(run) {
  const moves = run.scene || (run.circuit && !run.circuit.refused), whole = ours() && window.top === window && !document.hidden;
  return Boolean(moves && whole && ["time", "mode"].includes(run.axisName) && !matchMedia("(prefers-reduced-motion: reduce)").matches);
}

// Several analyses of a deck: each is a run of its own with the sheets of all.
function analyses(run) {
  const all = (run.all ??= [run, ...(run.others ?? []).map((o) => ({ ...run, scene: null, circuit: null, runs: undefined, energy: undefined, sheets: run.sheets.filter(([name]) => name !== "energy"), ...o }))]);
  for (const one of all) one.all = all;
  const select = $("analysis");
  select.hidden = all.length < 2;
  $("facts").hidden = all.length > 1;
  options(select, all.map((one, k) => [k, one.facts]));
  select.value = all.indexOf(run);
  select.onchange = () => {
    leave();
    forgetState();
    return show(all[select.value]);
  };
}

const NYQUIST = "nyquist ", FFT = "fft ";

// the controls as the views are
function reflect({ waves, machine }) {
  $("xaxis").value = waves.fft ? FFT + waves.fft : waves.nyquist ? NYQUIST : waves.xname || "";
  $("layout").value = waves.layout;
  $("logx").checked = waves.logx;
  $("degrees").checked = waves.degrees;
  if (machine) $("follow").checked = machine.follow;
}

// The reader's clock, zoom, cursors, signals, expressions, x axis and view, from the run before.
function carry(old, { run, clock, waves, machine }) {
  clock.t = Math.max(clock.first, Math.min(old.clock.t, clock.last));
  for (const c of old.run.columns) if (c.computed) try { run.columns.push(computed(run, c.name)); } catch { /* its signals are gone */ }
  const names = new Set(run.columns.map((c) => c.name)), kept = [...old.waves.shown].filter((name) => names.has(name));
  if (kept.length || !old.waves.shown.size) {
    // an edit of .print counts; without one, what moves is no choice of anybody's
    const added = run.shown.filter((n) => (run.printed ? !old.run.shown.includes(n) : !old.run.names.includes(n)));
    const removed = run.printed ? old.run.shown.filter((n) => !run.shown.includes(n)) : [];
    waves.shown = new Set([...kept.filter((n) => !removed.includes(n)), ...added]);
  }
  const { range, full } = old.waves, from = Math.max(clock.first, range[0]), to = Math.min(clock.last, range[1]);
  if (to > from && (range[0] > full[0] || range[1] < full[1])) waves.range = [from, to];
  const { marks, degrees, layout, logx, logy, heights, nyquist, fft } = old.waves;
  Object.assign(waves, { marks, degrees, layout, logx, logy, heights, nyquist: nyquist && run.complexNames.size > 0, fft: run.axisName === "time" ? fft : null, xname: names.has(old.waves.xname) ? old.waves.xname : null });
  if (machine && old.machine) machine.keep(old.machine);
}

// the analysis that a link speaks of
function chosen(run) {
  const k = ours() && new URLSearchParams(location.hash.slice(1)).get("analysis");
  analyses(run);
  return run.all[k] ?? run;
}

function options(select, items) {
  select.replaceChildren(...items.map((item) => {
    const [value, text] = Array.isArray(item) ? item : [item, item || "none"];
    return new Option(text, value);
  }));
}

// how a machine is shown: one in the plane as solids too
function depicted(machine, chosen) {
  $("solid").parentElement.hidden = !machine.planar;
  if (chosen !== undefined) $("solid").checked = chosen;
  machine.solidify($("solid").checked);
  $("perspective").parentElement.hidden = machine.planar;
  machine.perspective = !machine.planar && $("perspective").checked;
}

// what is on the page goes
function leave() {
  for (const old of [window.emsim, window.still]) if (old) { old.clock.play(false); old.waves?.close(); old.machine?.close(); old.circuit?.close(); }
  window.emsim = window.still = undefined;
}

// an operating point: a table of its values, machine and circuit as they are there; poles and zeros: their picture too
function point(run) {
  const table = document.createElement("table"), box = $("sheet-signals"), clock = new Clock(0, 0);
  table.className = "numbers";
  const machine = run.scene ? new Machine(run, $("machine"), clock) : null;
  if (machine) Object.assign(machine, { arrows: $("arrows").checked, labels: $("labels").checked });
  if (machine) depicted(machine, run.scene.view.solid === "yes");
  window.still = { run, clock, waves: null, machine, circuit: circuit(run, clock, null, machine) };
  clock.set(0);
  if (run.roots) {
    for (const [name, places] of run.roots) for (const [re, im, k] of places) {
      const row = table.insertRow();
      row.insertCell().textContent = run.courses[k] ? `${name}, ${run.courses[k]}` : name;
      row.insertCell().textContent = written(re, "1/s", 6) + (im ? ` ${im < 0 ? "\u2212" : "+"} j ${written(Math.abs(im), "1/s", 6)}` : "");
      row.insertCell().textContent = written(Math.hypot(re, im) / (2 * Math.PI), "Hz", 5);
    }
    box.replaceChildren(rootsPicture(run, box.clientWidth), table);
    return;
  }
  run.names.forEach((name, k) => {
    const row = table.insertRow(), [re, im] = run.point?.[k] ?? [null, 0];
    row.insertCell().textContent = name;
    row.insertCell().textContent = re === null ? "" : written(re, run.units[k], 6) + (run.complex[k] ? ` + j ${written(im, run.units[k], 6)}` : "");
  });
  box.replaceChildren(table);
}

// Poles as crosses, zeros as rings over the complex plane, a colour a step.
function rootsPicture(run, room) {
  const canvas = document.createElement("canvas"), ratio = devicePixelRatio, width = Math.max(280, Math.min(760, room || innerWidth - 40)), height = Math.round(0.62 * width), ctx = canvas.getContext("2d");
  Object.assign(canvas, { width: width * ratio, height: height * ratio, className: "roots" });
  canvas.style.width = width + "px";
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", "poles and zeros in the complex plane");
  const all = run.roots.flatMap(([, places]) => places), style = getComputedStyle(document.documentElement);
  const reach = (k) => padded(null, Math.min(0, ...all.map((p) => p[k])), Math.max(0, ...all.map((p) => p[k])));
  const [x0, x1] = reach(0), tall = Math.max(...all.map((p) => Math.abs(p[1]))), [y0, y1] = tall ? [-1.15 * tall, 1.15 * tall] : [(x0 - x1) * 0.31, (x1 - x0) * 0.31];
  const left = 92, bottom = height - 34, X = (v) => left + (v - x0) / (x1 - x0) * (width - left - 12), Y = (v) => bottom - (v - y0) / (y1 - y0) * (bottom - 10);
  ctx.scale(ratio, ratio);
  ctx.font = "12px system-ui";
  ctx.fillStyle = style.getPropertyValue("--soft");
  ctx.strokeStyle = style.getPropertyValue("--line");
  ctx.textAlign = "center";
  for (const v of ticks(x0, x1, width / 130)) { line(ctx, X(v), 10, X(v), bottom); ctx.fillText(written(v, "1/s"), X(v), bottom + 15); }
  ctx.textAlign = "right";
  for (const v of ticks(y0, y1, height / 60)) { line(ctx, left, Y(v), width - 12, Y(v)); ctx.fillText(written(v, "1/s"), left - 6, Y(v) + 4); }
  // the axes: left of the upright one a system is stable
  ctx.strokeStyle = style.getPropertyValue("--ink");
  line(ctx, X(0), 10, X(0), bottom);
  line(ctx, left, Y(0), width - 12, Y(0));
  ctx.lineWidth = 2;
  for (const [name, places] of run.roots) for (const [re, im, k] of places) {
    const x = X(re), y = Y(im);
    ctx.strokeStyle = colourOf(k);
    if (name.startsWith("pole")) { line(ctx, x - 5, y - 5, x + 5, y + 5); line(ctx, x - 5, y + 5, x + 5, y - 5); } else { ctx.beginPath(); ctx.arc(x, y, 5.5, 0, 7); ctx.stroke(); }
  }
  run.courses.slice(0, NAMED).forEach((name, k) => { ctx.fillStyle = colourOf(k); ctx.fillText(name, width - 16, 24 + 15 * k); });
  return canvas;
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
  const filter = Object.assign(document.createElement("input"), { type: "text", id: "filter", placeholder: "filter", value: $("filter")?.value ?? "" });
  filter.setAttribute("aria-label", "show signals whose names contain");
  filter.oninput = () => {
    const words = filter.value.toLowerCase().split(/\s+/);
    for (const line of lines) {
      for (const chip of line.querySelectorAll(".chip")) chip.hidden = !words.every((w) => chip.textContent.toLowerCase().includes(w));
      line.hidden = ![...line.querySelectorAll(".chip")].some((chip) => !chip.hidden);
    }
  };
  const form = document.createElement("form"), said = document.createElement("span");
  form.innerHTML = '<input type="text" id="expression" size="32" placeholder="an expression, such as v(a)-v(b)" aria-label="expression"> <button>draw</button> ';
  form.append(said);
  form.onsubmit = (e) => {
    e.preventDefault();
    try {
      const text = $("expression").value.trim();
      if (!run.columns.some((c) => c.name === text)) run.columns.push(computed(run, text));
      waves.shown.add(text);
      waves.build();
      chips(run, waves);
    } catch (error) { said.textContent = error.message; }
  };
  box.replaceChildren(...(run.columns.length > 12 ? [filter] : []), ...lines, form);
  filter.oninput();
}

// A column by an expression of others. Throws Error with what is wrong.
function computed(run, text) {
  const f = compileExpression(text, (name) => {
    if (name === run.axisName) return run.time;
    if (run.complexNames.has(name)) throw new Error(`${name} is complex: db(), ph(), mag(), re() or im() of it is a signal`);
    return run.columns.find((c) => c.name.replace(/\s/g, "") === name)?.values;
  }, { x: run.over ? run.columns.find((c) => c.name === run.over).values : run.time, starts: [0, ...run.blocks] });
  return { name: text, unit: "", computed: true, values: Float64Array.from({ length: run.rows }, (_, k) => f(k)) };
}

// A sheet's HTML may travel deflated.
const PACKED = "deflate:";
async function unpackedSheet(html) { return html.startsWith(PACKED) ? new TextDecoder().decode(await inflate(html.slice(PACKED.length))) : html; }

// the sheets below: signals, energy, equations, the deck, what was said
function sheets(run) {
  const made = [["signals", "Signals", ""], ...(run.rows ? [["cursors", "Cursors", ""]] : []), ...run.sheets], tabs = $("tabs"), box = $("sheets"), kept = tabs.querySelector("[aria-selected=true]")?.dataset.sheet;
  tabs.replaceChildren();
  box.replaceChildren();
  const pick = (name) => {
    for (const b of tabs.children) {
      b.setAttribute("aria-selected", b.dataset.sheet === name);
      b.tabIndex = b.dataset.sheet === name ? 0 : -1;
    }
    for (const s of box.children) s.hidden = s.id !== "sheet-" + name;
    if (name === "cursors" && window.emsim) cursorSheet(window.emsim.run, window.emsim.waves, window.emsim.clock);
  };
  for (const [name, title, html] of made) {
    const button = Object.assign(document.createElement("button"), { textContent: title, onclick: () => pick(name) });
    button.dataset.sheet = name;
    button.role = "tab";
    button.id = "tab-" + name;
    button.setAttribute("aria-controls", "sheet-" + name);
    const packed = html.startsWith(PACKED), sheet = document.createElement("div");
    Object.assign(sheet, { id: "sheet-" + name, className: "sheet", innerHTML: packed ? "" : html });
    if (packed) unpackedSheet(html).then((text) => (sheet.innerHTML = text));
    sheet.role = "tabpanel";
    sheet.tabIndex = 0;
    sheet.setAttribute("aria-labelledby", button.id);
    tabs.append(button);
    box.append(sheet);
  }
  tabs.onkeydown = (e) => {
    const all = [...tabs.children], by = { ArrowLeft: -1, ArrowRight: 1 }[e.key], at = all.indexOf(document.activeElement);
    const to = by ? all.at((at + by) % all.length) : e.key === "Home" ? all[0] : e.key === "End" ? all.at(-1) : null;
    if (!to) return;
    e.preventDefault();
    e.stopPropagation();
    to.focus();
    to.click();
  };
  pick(made.some(([name]) => name === kept) ? kept : "signals");
  window.bench.refresh();
}

function step(rows) {
  const { clock, waves } = window.emsim, span = (waves.range[1] - waves.range[0]) / 200;
  if (window.engine?.running?.step(rows)) return;
  clock.play(false);
  clock.set(clock.t + rows * span);
}

function wire() {
  const now = () => window.emsim, shown = () => window.emsim ?? window.still;
  const dark = (on) => { document.documentElement.classList.toggle("dark", on); now()?.waves.build(); shown()?.machine?.draw(); };
  dark(matchMedia("(prefers-color-scheme: dark)").matches);
  $("theme").onclick = () => dark(!document.documentElement.classList.contains("dark"));
  $("help").onclick = () => $("keys").showModal();
  $("play").onclick = () => now()?.clock.play();
  $("back").onclick = () => step(-1);
  $("forward").onclick = () => step(1);
  $("scrub").oninput = (e) => { const { clock } = now(); clock.play(false); clock.set(clock.at(+e.target.value)); };
  $("speed").onchange = (e) => (now().clock.speed = +e.target.value);
  $("trace").onchange = (e) => { now().machine.trace = e.target.value; now().machine.draw(); };
  $("arrows").onchange = (e) => { shown().machine.arrows = e.target.checked; shown().machine.draw(); };
  $("labels").onchange = (e) => { shown().machine.labels = e.target.checked; shown().machine.draw(); };
  $("fit").onclick = () => { shown()?.machine?.fit(); shown()?.machine?.draw(); };
  $("follow").onchange = (e) => { now().machine.follow = e.target.checked; now().machine.fit(); now().machine.draw(); };
  $("perspective").onchange = (e) => { shown().machine.perspective = e.target.checked; shown().machine.draw(); };
  $("solid").onchange = (e) => { shown().machine.solidify(e.target.checked); shown().machine.draw(); };
  $("whole").onclick = () => now().waves.whole();
  $("degrees").onchange = (e) => { now().waves.degrees = e.target.checked; now().waves.build(); };
  $("xaxis").onchange = (e) => {
    const { value } = e.target, nyquist = value === NYQUIST, fft = value.startsWith(FFT) ? value.slice(FFT.length) : null;
    Object.assign(now().waves, { nyquist, fft, xname: nyquist || fft ? now().waves.xname : value || null });
    now().waves.build();
  };
  $("layout").onchange = (e) => { now().waves.layout = e.target.value; now().waves.heights.clear(); now().waves.build(); };
  $("logx").onchange = (e) => { now().waves.logx = e.target.checked; now().waves.build(); };
  for (const which of ["a", "b"]) $("mark-" + which).onclick = () => now().waves.mark(which, now().clock.t);
  $("unmark").onclick = () => { now().waves.mark("a", null); now().waves.mark("b", null); };
  for (const button of document.querySelectorAll("[data-save]")) button.onclick = () => now() && save(button.dataset.save, now());
  document.addEventListener("keydown", (e) => {
    if ($("keys").open) return; // its keys are its own: Esc closes it
    if (!now() || /INPUT|SELECT|TEXTAREA/.test(e.target.tagName) && e.target.id !== "scrub" || e.target.isContentEditable || e.ctrlKey || e.metaKey || e.altKey) return;
    if (e.key === " " && /BUTTON|SUMMARY/.test(e.target.tagName)) return; // presses it
    if (window.bench.key(e.key)) return void e.preventDefault();
    const { clock, waves, machine } = now();
    const keys = {
      " ": () => clock.play(), ArrowLeft: () => step(e.shiftKey ? -10 : -1), ArrowRight: () => step(e.shiftKey ? 10 : 1),
      Home: () => waves.whole(), f: () => $("fit").click(), "+": () => waves.about(clock.t, 0.7), "-": () => waves.about(clock.t, 1.4),
      a: () => waves.mark("a", clock.t), b: () => waves.mark("b", clock.t), Escape: () => { waves.mark("a", null); waves.mark("b", null); },
      d: () => $("theme").click(), r: () => $("restart")?.click(), "?": () => $("help").click(),
    };
    if (keys[e.key]) { e.preventDefault(); keys[e.key](); }
  });
}

window.bench = new Bench();
wire();
const first = JSON.parse($("run").textContent);
show(chosen(first)).then(() => { if (first.engine) window.engine = new Engine(first.engine, $("engine-code").textContent, first); });
