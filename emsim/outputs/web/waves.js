// Waveforms: a panel a unit, or two units, or a signal; all on one range of the axis; cursors A and B; any signal as x axis.
"use strict";

// both lists have a contrast of at least 4.5 to the page behind them
const COLOURS = ["#0b62c4", "#c8374d", "#1e7f3a", "#8a4fb8", "#a85f00", "#007575", "#b5367a", "#5b6b2f"];
const ON_DARK = ["#6cb0ff", "#ff8494", "#5ccb7e", "#c79aeb", "#f0a63a", "#3cc8c8", "#ff86c0", "#b4c878"];
const colourOf = (k) => (document.documentElement.classList.contains("dark") ? ON_DARK : COLOURS)[k % COLOURS.length];

const RIGHT = 84; // px of an axis, of ordinary letters

// phases over a frequency are read in degrees
const inDegrees = (run) => (run.over ?? run.axisName) === "frequency";

class Waves {
  // run: {time, columns: [{name, unit, values}]}; clock: {t, set(t), onchange}
  constructor(run, box, clock) {
    Object.assign(this, { run, box, clock, panels: [], marks: { a: null, b: null }, degrees: inDegrees(run), xname: run.over || null });
    // logy, heights: of panels by their key; ghosts: earlier runs; watchers: told when marks, range or signals change
    Object.assign(this, { layout: "unit", logx: run.axisLog, logy: new Set(), heights: new Map(), nyquist: false, fft: null, ghosts: [], watchers: [] });
    this.full = run.full ?? [run.time[0], run.time[run.time.length - 1]];
    this.range = [...this.full];
    this.shown = new Set(run.shown);
    // spectral densities span decades
    for (const c of run.columns) if (c.unit.endsWith("/sqrt(Hz)")) this.logy.add(c.unit);
    clock.listen(() => this.panels.forEach((p) => (p.plot ? this.place(p.plot) : p.draw())));
    this.sizes = new ResizeObserver(() => this.resize());
    this.sizes.observe(box);
    this.gone = new AbortController();
    box.addEventListener("wheel", (e) => this.wheel(e), { passive: false, signal: this.gone.signal });
    this.fingers(box, this.gone.signal);
  }
  // another run takes the place
  close() {
    this.gone.abort();
    this.sizes.disconnect();
    this.panels.forEach((p) => p.plot && p.plot.destroy());
    this.panels = [];
  }
  changed() { this.watchers.forEach((f) => f()); }
  unit(c) { return this.degrees ? c.unit.replace("rad", "\u00b0") : c.unit; }
  scaled(c) {
    if (!this.degrees || !c.unit.startsWith("rad")) return c.values;
    return (c.inDegrees ??= c.values.map((v) => v * 180 / Math.PI));
  }
  inView() { return this.run.columns.filter((c) => this.shown.has(c.name)); }
  // [key, units, columns] of each panel
  groups() {
    const found = new Map();
    for (const c of this.inView()) {
      const unit = this.unit(c), key = this.layout === "signal" ? c.name : c.of && c.of !== "V" ? `${unit} of ${c.of}` : unit;
      if (!found.has(key)) found.set(key, [key, [unit], []]);
      found.get(key)[2].push(c);
    }
    const each = [...found.values()];
    if (this.layout !== "two" || this.xname) return each;
    // two units share a panel, one has its scale on the right
    const pairs = [];
    for (let k = 0; k < each.length; k += 2) {
      const [first, second] = each.slice(k, k + 2);
      if (second && first[1][0] === second[1][0]) { pairs.push(first); k--; continue; } // two scales of one unit are read wrong
      pairs.push(second ? [`${first[0]}|${second[0]}`, [...first[1], ...second[1]], [...first[2], ...second[2]]] : first);
    }
    return pairs;
  }
  build() {
    this.panels.forEach((p) => p.plot && p.plot.destroy());
    this.box.replaceChildren();
    this.drawn = this.width();
    if (this.fft) this.panels = spectraPanels(this); else if (this.nyquist) this.circles(); else this.curves();
    this.readout();
    this.changed();
  }
  holder(label) {
    const holder = document.createElement("div"), legend = document.createElement("div");
    holder.className = "panel";
    holder.setAttribute("role", "group");
    holder.setAttribute("aria-label", label);
    legend.className = "legend";
    this.box.append(holder);
    return [holder, legend];
  }
  // Nyquist's picture: the imaginary part over the real one, a curve a complex signal
  circles() {
    const style = getComputedStyle(document.documentElement), height = Math.max(300, 0.55 * innerHeight), of = (fn, name) => this.run.columns.find((c) => c.name === `${fn}(${name})`);
    const names = [...this.run.complexNames], wanted = names.filter((n) => this.inView().some((c) => c.name.endsWith(`(${n})`)));
    const [holder, legend] = this.holder("Nyquist plot"), columns = (wanted.length ? wanted : names.slice(0, 1)).map((n) => ({ ...of("im", n), over: of("re", n) }));
    const p = new Portrait(this, holder, columns, columns[0]?.unit ?? "", height, { ink: style.getPropertyValue("--soft"), line: style.getPropertyValue("--line") });
    holder.append(legend);
    this.panels = [Object.assign(p, { legend })];
  }
  curves() {
    const groups = this.groups(), style = getComputedStyle(document.documentElement);
    const ink = style.getPropertyValue("--soft"), line = style.getPropertyValue("--line");
    const size = letters(), axisSize = Math.round(RIGHT * size), presents = document.body.dataset.present === "curves";
    const height = Math.max(130, Math.min(presents ? Infinity : 260 * size, ((presents ? 0.86 : 0.62) * innerHeight) / Math.max(1, groups.length) - (presents ? 34 * size : 0)));
    this.panels = groups.map(([key, units, columns], k) => {
      const [holder, legend] = this.holder(`waveforms of ${columns.map((c) => c.name).join(", ")}`), unit = units[0];
      const last = k === groups.length - 1;
      if (this.xname) {
        const p = new Portrait(this, holder, columns, unit, height, { ink, line }, key);
        holder.append(legend);
        return Object.assign(p, { legend, units, key });
      }
      const axis = { stroke: ink, font: `${12 * size}px system-ui`, space: (u, k) => (k ? 30 : 50) * size, grid: { stroke: line, width: 1 }, ticks: { stroke: line, width: 1 } };
      const scales = { x: { time: false, range: () => this.shownRange(), distr: this.logx ? 3 : 1 } }, axes = [
        { ...axis, ...(this.logx ? LOG : {}), size: last ? 30 * size : 0, ticks: { show: last, stroke: line }, values: (u, ticks) => (last ? ticks.map((v) => (v === null ? "" : written(v, this.run.axisUnit, 6))) : []) },
      ];
      units.forEach((own, n) => {
        const scale = `y${n || ""}`, log = this.logy.has(key);
        scales[scale] = { distr: log ? 3 : 1, range: (u, low, high) => this.heights.get(key)?.[n] ?? this.roomy(u, low, high, columns.filter((c) => this.unit(c) === own), log) };
        axes.push({ ...axis, ...(log ? LOG : {}), scale, side: n ? 1 : 3, size: axisSize, grid: { ...axis.grid, show: !n }, values: (u, ticks) => ticks.map((v) => (v === null ? "" : written(v, own, 4))) });
      });
      const plot = new uPlot({
        width: this.width(), height: height + (last ? 26 * size : 0), padding: [6, units.length > 1 ? 0 : this.layout === "two" ? axisSize : 26 * size, 0, 0], // all panels have one width
        pxAlign: 0, // points rounded to pixels make stairs of a straight line
        scales, axes,
        series: [{}, ...columns.map((c, i) => ({ label: c.name, scale: this.unit(c) === unit ? "y" : "y1", stroke: () => colourOf(i), width: 1.5 * size, points: { show: false }, dash: this.unit(c) === unit ? [] : [7, 3] }))],
        cursor: { sync: { key: "emsim" }, drag: { setScale: false, x: true, y: true, uni: 14 }, points: { size: 6 } },
        legend: { show: false },
        hooks: {
          drawAxes: [(u) => this.earlier(u, columns, unit)],
          draw: [(u) => this.marksOn(u)],
          setSelect: [(u) => this.selected(u, key)],
          setCursor: [(u) => this.hovered(u)],
        },
      }, this.data(columns, key), holder);
      plot.ctx.canvas.setAttribute("role", "img");
      plot.ctx.canvas.setAttribute("aria-label", `${columns.map((c) => c.name).join(", ")} over ${this.run.axisName}`);
      plot.over.append(Object.assign(document.createElement("div"), { className: "now" }));
      this.place(plot);
      plot.over.addEventListener("click", (e) => this.clicked(plot, e));
      plot.over.addEventListener("dblclick", () => this.whole());
      holder.append(legend);
      return { plot, columns, unit, units, key, legend };
    });
  }
  // the range of a scale: what is drawn, and the earlier runs of it
  roomy(u, low, high, columns, log) {
    for (const ghost of this.ghosts) for (const c of columns) {
      const span = ghost.spans.get(c.name);
      if (!span) continue;
      const [a, b] = this.degrees && c.unit.startsWith("rad") ? span.map((v) => v * 180 / Math.PI) : span;
      low = low === null ? a : Math.min(low, a);
      high = high === null ? b : Math.max(high, b);
    }
    if (!log) return padded(u, low, high);
    // rounding noise about zero has no end downwards
    return high > 0 ? [Math.max(low > 0 ? low / 1.15 : 0, high / 1e9), high * 1.15] : [0.1, 1];
  }
  // the axis as it is drawn: a logarithm begins above zero
  shownRange() {
    const [from, to] = this.range;
    return this.logx && from <= 0 ? [this.run.time.find((t) => t > 0) ?? to / 1000, to] : [from, to];
  }
  whole() {
    this.heights.clear();
    this.zoom(...this.full);
  }
  width() { return Math.max(200, this.box.clientWidth); }
  // what lies off the scale is a gap in the curve, and is said below it
  inScale(c) {
    const values = this.scaled(c), { count, off } = (c.offScale ??= offScale(c.values));
    if (!count) return values;
    const key = values === c.values ? "kept" : "keptInDegrees";
    return (c[key] ??= values.map((v, k) => (off[k] ? NaN : v)));
  }
  data(columns, key) {
    const [from, to] = this.shownRange(), log = this.logy.has(key);
    const [axis, ...shown] = visible(this.run.time, columns.map((c) => this.inScale(c)), from, to, this.width(), this.logx);
    const gap = (v) => Number.isNaN(v) || (log && v <= 0);
    return [axis, ...shown.map((c) => (c.some(gap) ? Array.from(c, (v) => (gap(v) ? null : v)) : c))];
  }
  fresh(p) { return p.fresh ? p.fresh() : this.data(p.columns, p.key); }
  redraw() { this.panels.forEach((p) => (p.plot ? p.plot.setData(this.fresh(p)) : p.draw())); }
  resize() {
    const width = this.width();
    if (width === this.drawn) return;
    this.drawn = width;
    for (const p of this.panels) {
      if (!p.plot) { p.draw(); continue; }
      p.plot.setSize({ width, height: p.plot.height });
      p.plot.setData(this.fresh(p));
    }
  }
  zoom(from, to) {
    const [first, last] = this.full, least = 1e-9 * (last - first);
    if (!(to - from > least)) return;
    this.range = [Math.max(first, from), Math.min(last, to)];
    this.redraw();
    this.readout();
    this.changed();
  }
  about(t, factor) { this.zoom(t - (t - this.range[0]) * factor, t + (this.range[1] - t) * factor); }
  // the wheel alone scrolls the page; with ctrl, which is what a trackpad's pinch sends too, it zooms
  wheel(e) {
    const panel = this.panels.find((p) => p.plot && !p.fresh && p.plot.over.matches(":hover"));
    if (!panel || !(e.ctrlKey || e.metaKey || e.shiftKey)) return;
    e.preventDefault();
    const [from, to] = this.range, turn = e.deltaY || e.deltaX;
    if (e.shiftKey) return this.zoom(from + 0.001 * turn * (to - from), to + 0.001 * turn * (to - from));
    const box = panel.plot.over.getBoundingClientRect();
    this.about(panel.plot.posToVal(e.clientX - box.left, "x"), Math.exp(0.005 * turn));
  }
  // one finger along the curves moves the clock, two pinch and move them; up and down scrolls the page
  fingers(box, signal) {
    const held = new Map();
    box.addEventListener("pointerdown", (e) => { if (e.pointerType === "touch" && e.target.closest(".u-over")) held.set(e.pointerId, e.clientX); }, { signal });
    for (const end of ["pointerup", "pointercancel"]) addEventListener(end, (e) => held.delete(e.pointerId), { signal });
    addEventListener("pointermove", (e) => {
      const plot = this.panels.find((p) => p.plot && !p.fresh)?.plot;
      if (!held.has(e.pointerId) || !plot) return;
      const { left } = plot.over.getBoundingClientRect(), at = (x) => plot.posToVal(x - left, "x");
      const others = [...held].filter(([id]) => id !== e.pointerId), x0 = held.get(e.pointerId);
      held.set(e.pointerId, e.clientX);
      if (!others.length) { this.clock.play(false); return this.clock.set(at(e.clientX)); }
      // both fingers keep the instants they are on
      const [[, other]] = others;
      if (Math.abs(e.clientX - other) < 12 || Math.abs(x0 - other) < 12) return;
      const fixed = at(other);
      this.about(fixed, (x0 - other) / (e.clientX - other));
    }, { signal });
  }
  selected(u, key) {
    const { left, top, width, height } = u.select;
    if (width < 4 || height < 4) return;
    const full = (along, size) => size >= u.over[along] - 1;
    const across = !full("clientWidth", width) && [u.posToVal(left, "x"), u.posToVal(left + width, "x")];
    if (!full("clientHeight", height)) this.heights.set(key, ["y", "y1"].map((scale) => (u.scales[scale] ? [u.posToVal(top + height, scale), u.posToVal(top, scale)] : null)));
    u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    this.dragged = true;
    if (across) this.zoom(...across); else this.redraw();
  }
  hovered(u) {
    if (this.clock.playing || u.cursor.left < 0 || !u.over.matches(":hover") || u.select.width > 3) return;
    this.clock.set(u.posToVal(u.cursor.left, "x"));
  }
  clicked(u, e) {
    if (this.dragged) { this.dragged = false; return; }
    const t = u.posToVal(e.offsetX, "x");
    // a finger has no shift: it moves the clock, and the buttons set the cursors there
    if (e.pointerType === "touch") return this.clock.set(t);
    this.mark(e.shiftKey ? "b" : "a", t);
  }
  mark(which, t) {
    this.marks[which] = t;
    this.panels.forEach((p) => (p.plot ? p.plot.redraw(false, false) : p.draw()));
    this.readout();
    this.changed();
  }
  // the runs before this one, in grey below its curves
  earlier(u, columns, unit) {
    const { ctx, bbox } = u, [from, to] = this.shownRange();
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.setLineDash([]);
    ctx.lineWidth = devicePixelRatio;
    columns.forEach((c, i) => this.ghosts.forEach((ghost, n) => {
      const values = ghost.columns.get(c.name);
      if (!values) return;
      const [axis, y] = visible(ghost.time, [values], from, to, this.width(), this.logx), scale = this.unit(c) === unit ? "y" : "y1", factor = this.degrees && c.unit.startsWith("rad") ? 180 / Math.PI : 1;
      ctx.strokeStyle = colourOf(i);
      ctx.globalAlpha = 0.15 + 0.35 * (n + 1) / this.ghosts.length;
      ctx.beginPath();
      axis.forEach((t, k) => Number.isFinite(y[k]) && ctx.lineTo(u.valToPos(t, "x", true), u.valToPos(factor * y[k], scale, true)));
      ctx.stroke();
    }));
    ctx.restore();
  }
  // the clock's line lies above the canvas: a film needs no curve drawn anew
  place(u) {
    const now = u.over.querySelector(".now"), { t } = this.clock;
    if (!now) return; // its panel is being made
    now.hidden = t < this.range[0] || t > this.range[1];
    now.style.transform = `translateX(${u.valToPos(t, "x")}px)`;
  }
  marksOn(u) {
    this.place(u);
    const lines = [[this.marks.a, "--accent", "A"], [this.marks.b, "--wiper", "B"]];
    const style = getComputedStyle(document.documentElement), { ctx, bbox } = u;
    ctx.save();
    ctx.setLineDash([]);
    for (const [t, colour, name] of lines) {
      if (t === null || t < this.range[0] || t > this.range[1]) continue;
      const x = Math.round(u.valToPos(t, "x", true)) + 0.5;
      ctx.strokeStyle = ctx.fillStyle = style.getPropertyValue(colour);
      ctx.lineWidth = devicePixelRatio;
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
      ctx.font = `${11 * letters() * devicePixelRatio}px system-ui`;
      if (name) ctx.fillText(name, x + 3 * devicePixelRatio, bbox.top + 11 * devicePixelRatio);
    }
    ctx.restore();
  }
  // a row is told by itself: what other rows hold, a pole among them, rounds nothing
  said(c, v) { return written(v, this.unit(c)); }
  // values at the clock, at the cursors and between them
  readout() {
    const { time } = this.run, { a, b } = this.marks, t = this.clock.t, near = this.range[1] - this.range[0] < 0.1 * (this.full[1] - this.full[0]);
    for (const p of this.panels) {
      if (p.peaks) {
        p.legend.replaceChildren(...p.columns.map((c, i) => {
          const item = Object.assign(document.createElement("span"), { textContent: `${c.name}: largest ${written(p.peaks[i][1], this.unit(c))} at ${written(p.peaks[i][0], "Hz", 5)}` });
          item.style.setProperty("--c", colourOf(i));
          return item;
        }));
        continue;
      }
      const items = p.columns.map((c, i) => {
        const item = document.createElement("span"), values = this.scaled(c), at = (t) => this.said(c, valueAt(time, values, t));
        item.style.setProperty("--c", colourOf(i));
        const { count, worst } = (c.offScale ??= offScale(c.values));
        let text = `${c.name} = ${at(t)}`;
        if (a !== null) text += `  A ${at(a)}`;
        if (b !== null) text += `  B ${at(b)}`;
        if (a !== null && b !== null) text += `  \u0394 ${this.said(c, valueAt(time, values, b) - valueAt(time, values, a))}`;
        if (count) text += `  (${count} ${count > 1 ? "rows" : "row"} off the scale, ${this.said(c, values[worst])} at ${written(time[worst], this.run.axisUnit, 6)})`;
        if (c.extremes && near) text += `  (thinned: of ${this.run.parts} parts of the run its extremes, not its course)`;
        item.textContent = text;
        return item;
      });
      if (p.key !== null && p.units) p.log ??= this.logButton(p);
      p.legend.replaceChildren(...(p.log ? [p.log] : []), ...items);
    }
    const delta = document.getElementById("delta"), unit = this.run.axisUnit;
    delta.textContent = a === null && b === null ? "" : a === null ? `B ${written(b, unit, 6)}` : b === null ? `A ${written(a, unit, 6)}`
      : `A ${written(a, unit, 6)}  B ${written(b, unit, 6)}  \u0394 ${written(b - a, unit, 6)}` + (unit === "s" && b !== a ? `  1/\u0394 ${written(1 / Math.abs(b - a), "Hz", 5)}` : "");
  }
  // a panel's scale, linear or logarithmic
  logButton(p) {
    const button = Object.assign(document.createElement("button"), { className: "log", textContent: "log", title: "logarithmic scale; what is not positive is left out" });
    button.setAttribute("aria-pressed", this.logy.has(p.key));
    button.setAttribute("aria-label", `log: logarithmic scale of ${p.units.join(", ") || "numbers"}`);
    button.onclick = () => {
      if (!this.logy.delete(p.key)) this.logy.add(p.key);
      this.heights.delete(p.key);
      this.build();
    };
    return button;
  }
}

function padded(u, low, high) {
  if (low === null) return [0, 1];
  // what differs by the rounding of a float32 stands still
  const pad = high - low > 1e-7 * Math.max(Math.abs(low), Math.abs(high)) ? 0.06 * (high - low) : Math.abs(high) * 0.1 || 1;
  return [low - pad, high + pad];
}

const NAMED = 10; // courses that a legend names

// Signals over another signal: a phase portrait. The clock is a dot on each curve.
class Portrait {
  constructor(waves, holder, columns, unit, height, colours, key = null) {
    Object.assign(this, { waves, columns, unit, height: Math.max(240, height), colours, key });
    this.canvas = holder.appendChild(document.createElement("canvas"));
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", columns.map((c) => `${c.name} over ${c.over?.name ?? waves.xname}`).join(", "));
    // the clock goes with the mouse: over the axis of several courses within the one it is in, to another one by a click
    const to = (e, anywhere) => {
      const row = this.row?.(e.offsetX, e.offsetY, anywhere);
      if (row !== undefined && !waves.clock.playing) waves.clock.set(waves.run.time[row]);
    };
    this.canvas.addEventListener("pointermove", (e) => !e.buttons && to(e, false));
    this.canvas.addEventListener("click", (e) => { waves.clock.play(false); to(e, true); });
    this.draw();
  }
  draw() {
    const { waves, canvas } = this, { run } = waves, ratio = devicePixelRatio, width = waves.width(), height = this.height;
    canvas.width = width * ratio;
    canvas.height = height * ratio;
    canvas.style.width = width + "px";
    // each curve over its own signal, or all over one
    const ctx = canvas.getContext("2d"), xcs = this.columns.map((c) => c.over ?? run.columns.find((x) => x.name === waves.xname)), xc = xcs[0], nyquist = waves.nyquist;
    ctx.scale(ratio, ratio);
    const first = before(run.time, waves.range[0]), last = before(run.time, waves.range[1]);
    const span = (columns, f = (v) => v) => {
      let low = Infinity, high = -Infinity;
      for (const c of columns) for (let k = first; k <= last; k++) { const v = f(c[k]); if (v < low) low = v; if (v > high) high = v; }
      return padded(null, low <= high ? low : null, high);
    };
    // over the axis of a sweep within sweeps, which may be logarithmic
    const log = run.overLog && waves.xname === run.over && !nyquist, place = log ? Math.log10 : (v) => v;
    const xss = xcs.map((c) => waves.inScale(c)), ys = this.columns.map((c) => waves.inScale(c)), courses = [0, ...run.blocks], names = run.courses || [];
    // what is not positive has no logarithm
    const logY = waves.logy.has(this.key), rise = logY ? (v) => (v > 0 ? Math.log10(v) : NaN) : (v) => v;
    let [x0, x1] = span(xss, place), [y0, y1] = span(ys, rise);
    ctx.font = `${12 * letters()}px system-ui`;
    const heights = logY ? decades(y0, y1) : ticks(y0, y1, height / 40), bottom = height - 34;
    const left = Math.max(66, 12 + Math.max(0, ...heights.map((v) => ctx.measureText(written(v, this.unit)).width))), across = width - left - 10, up = bottom - 8;
    if (nyquist || (xc && waves.unit(xc) === "m" && this.unit === "m")) {
      // what is round stays round
      const scale = Math.max((x1 - x0) / across, (y1 - y0) / up), x = (x0 + x1) / 2, y = (y0 + y1) / 2;
      [x0, x1, y0, y1] = [x - scale * across / 2, x + scale * across / 2, y - scale * up / 2, y + scale * up / 2];
    }
    const X = (v) => left + (place(v) - x0) / (x1 - x0) * across, Y = (v) => bottom - (rise(v) - y0) / (y1 - y0) * up;
    ctx.fillStyle = this.colours.ink;
    ctx.strokeStyle = this.colours.line;
    ctx.textAlign = "center";
    const marks = log ? decades(x0, x1) : ticks(x0, x1, width / 110);
    for (const v of marks) { line(ctx, X(v), 8, X(v), bottom); ctx.fillText(written(v, waves.unit(xc)), X(v), bottom + 14); }
    ctx.fillText(nyquist ? "real part" : waves.xname, (left + width) / 2, height - 5);
    ctx.textAlign = "right";
    for (const v of heights.filter((v) => Y(v) < bottom + 1 && Y(v) > 7)) { line(ctx, left, Y(v), width - 10, Y(v)); ctx.fillText(written(v, this.unit), left - 5, Y(v) + 4); }
    ctx.save();
    ctx.beginPath();
    ctx.rect(left, 8, across, up);
    ctx.clip();
    if (nyquist) {
      // the axes, the unit circle, and -1 that a loop must not enclose
      ctx.strokeStyle = ctx.fillStyle = this.colours.ink;
      line(ctx, X(0), 8, X(0), bottom);
      line(ctx, left, Y(0), width - 10, Y(0));
      ctx.setLineDash([4, 4]);
      ctx.beginPath();
      ctx.arc(X(0), Y(0), X(1) - X(0), 0, 7);
      ctx.stroke();
      ctx.setLineDash([]);
      line(ctx, X(-1) - 5, Y(0) - 5, X(-1) + 5, Y(0) + 5);
      line(ctx, X(-1) - 5, Y(0) + 5, X(-1) + 5, Y(0) - 5);
      ctx.fillText("\u22121", X(-1) - 7, Y(0) - 6);
    }
    const stride = Math.max(1, Math.floor((last - first) / 40000));
    this.row = (px, py, anywhere) => {
      const along = !anywhere && run.over && waves.xname === run.over && !nyquist, at = before(run.time, waves.clock.t);
      const own = along ? courses.findLastIndex((row) => row <= at) : 0, from = along ? courses[own] : first, to = along ? (courses[own + 1] ?? run.rows) - 1 : last;
      let best, least = Infinity;
      for (let k = from; k <= to; k += along ? 1 : stride) for (let i = 0; i < ys.length; i++) {
        const far = along ? Math.abs(X(xss[i][k]) - px) : Math.hypot(X(xss[i][k]) - px, Y(ys[i][k]) - py);
        if (far < least) { least = far; best = k; }
      }
      return best;
    };
    // a colour a course, where there are several
    const colour = (i, n) => colourOf(i + n * ys.length);
    ys.forEach((y, i) => {
      const xs = xss[i];
      ctx.lineWidth = 1.3;
      courses.forEach((begin, n) => {
        const end = Math.min(last, (courses[n + 1] ?? Infinity) - 1);
        ctx.strokeStyle = colour(i, n);
        ctx.beginPath();
        let pen = false;
        for (let k = Math.max(first, begin); k <= end; k = k < end ? Math.min(end, k + stride) : end + 1) {
          const known = Number.isFinite(xs[k]) && Number.isFinite(rise(y[k]));
          if (known && pen) ctx.lineTo(X(xs[k]), Y(y[k])); else if (known) ctx.moveTo(X(xs[k]), Y(y[k]));
          pen = known;
        }
        ctx.stroke();
      });
      ctx.fillStyle = colour(i, courses.findLastIndex((row) => row <= waves.clock.t));
      ctx.beginPath();
      ctx.arc(X(valueAt(run.time, xs, waves.clock.t)), Y(valueAt(run.time, y, waves.clock.t)), 4.5, 0, 7);
      ctx.fill();
    });
    ctx.restore();
    ctx.textAlign = "right";
    names.slice(0, NAMED).forEach((name, n) => {
      ctx.fillStyle = colour(0, n);
      ctx.fillText(n === NAMED - 1 && names.length > NAMED ? `and ${names.length - n} more` : name, width - 14, 22 + 15 * n);
    });
  }
}

// uPlot's own marks of a logarithm never end beside rounding noise
const LOG = { splits: (u, axis, low, high) => {
  const few = Math.log10(high / low) < 2.5, found = few ? [] : decades(Math.log10(low), Math.log10(high));
  if (few) for (let e = Math.floor(Math.log10(low)); e <= Math.log10(high); e++) for (const m of [1, 2, 5]) if (m * 10 ** e >= low && m * 10 ** e <= high) found.push(+(m * 10 ** e).toPrecision(3));
  return found;
}, filter: (u, splits) => splits };

// powers of ten between two logarithms, or both ends where there is none
function decades(low, high) {
  const found = [], by = Math.max(1, Math.ceil((high - low) / 12));
  for (let e = Math.ceil(low); e <= high; e += by) found.push(10 ** e);
  return found.length > 1 ? found : [10 ** low, 10 ** high];
}

function line(ctx, x0, y0, x1, y1) { ctx.beginPath(); ctx.moveTo(x0, y0); ctx.lineTo(x1, y1); ctx.stroke(); }

function ticks(low, high, count) {
  const rough = (high - low) / Math.max(1, count), size = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((m) => m * size).find((s) => s >= rough), found = [];
  for (let v = Math.ceil(low / step) * step; v <= high; v += step) found.push(+v.toPrecision(12));
  return found;
}
