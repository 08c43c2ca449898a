// Waveforms: one panel a unit, all on one range of the axis; cursors A and B; any signal as x axis.
"use strict";

const COLOURS = ["#0b62c4", "#d1495b", "#2a9d4a", "#8a4fb8", "#c77700", "#008b8b", "#b5367a", "#5b6b2f"];

class Waves {
  // run: {time, columns: [{name, unit, values}]}; clock: {t, set(t), onchange}
  constructor(run, box, clock) {
    Object.assign(this, { run, box, clock, panels: [], marks: { a: null, b: null }, degrees: run.axisName === "frequency", xname: run.over || null });
    this.full = [run.time[0], run.time[run.time.length - 1]];
    this.range = [...this.full];
    this.shown = new Set(run.shown);
    clock.listen(() => this.panels.forEach((p) => (p.plot ? this.place(p.plot) : p.draw())));
    this.sizes = new ResizeObserver(() => this.resize());
    this.sizes.observe(box);
    this.gone = new AbortController();
    box.addEventListener("wheel", (e) => this.wheel(e), { passive: false, signal: this.gone.signal });
  }
  // another run takes the place
  close() {
    this.gone.abort();
    this.sizes.disconnect();
    this.panels.forEach((p) => p.plot && p.plot.destroy());
    this.panels = [];
  }
  unit(c) { return this.degrees ? c.unit.replace("rad", "\u00b0") : c.unit; }
  scaled(c) {
    if (!this.degrees || !c.unit.startsWith("rad")) return c.values;
    return (c.inDegrees ??= c.values.map((v) => v * 180 / Math.PI));
  }
  groups() {
    const found = new Map();
    for (const c of this.run.columns) {
      if (!this.shown.has(c.name)) continue;
      const unit = this.unit(c);
      if (!found.has(unit)) found.set(unit, []);
      found.get(unit).push(c);
    }
    return [...found];
  }
  build() {
    this.panels.forEach((p) => p.plot && p.plot.destroy());
    this.box.replaceChildren();
    this.drawn = this.width();
    const groups = this.groups(), style = getComputedStyle(document.documentElement);
    const ink = style.getPropertyValue("--soft"), line = style.getPropertyValue("--line");
    const height = Math.max(130, Math.min(260, (0.62 * innerHeight) / Math.max(1, groups.length)));
    this.panels = groups.map(([unit, columns], k) => {
      const holder = document.createElement("div"), legend = document.createElement("div");
      holder.className = "panel";
      legend.className = "legend";
      this.box.append(holder);
      const last = k === groups.length - 1;
      if (this.xname) {
        const p = new Portrait(this, holder, columns, unit, height, { ink, line });
        holder.append(legend);
        return Object.assign(p, { columns, unit, legend });
      }
      const axis = { stroke: ink, grid: { stroke: line, width: 1 }, ticks: { stroke: line, width: 1 } };
      const plot = new uPlot({
        width: this.width(), height: height + (last ? 26 : 0), padding: [6, 26, 0, 0],
        pxAlign: 0, // points rounded to pixels make stairs of a straight line
        scales: { x: { time: false, range: () => this.range, distr: this.run.axisLog ? 3 : 1 }, y: { range: padded } },
        series: [{}, ...columns.map((c, i) => ({ label: c.name, stroke: COLOURS[i % COLOURS.length], width: 1.5, points: { show: false } }))],
        axes: [
          { ...axis, size: last ? 30 : 0, ticks: { show: last, stroke: line }, values: (u, ticks) => (last ? ticks.map((v) => (v === null ? "" : written(v, this.run.axisUnit, 6))) : []) },
          { ...axis, size: 84, values: (u, ticks) => ticks.map((v) => written(v, unit, 4)) },
        ],
        cursor: { sync: { key: "emsim" }, drag: { setScale: false, x: true, y: false }, points: { size: 6 } },
        legend: { show: false },
        hooks: {
          draw: [(u) => this.marksOn(u)],
          setSelect: [(u) => this.selected(u)],
          setCursor: [(u) => this.hovered(u)],
        },
      }, this.data(columns), holder);
      plot.over.append(Object.assign(document.createElement("div"), { className: "now" }));
      this.place(plot);
      plot.over.addEventListener("click", (e) => this.clicked(plot, e));
      plot.over.addEventListener("dblclick", () => this.zoom(...this.full));
      holder.append(legend);
      return { plot, columns, unit, legend };
    });
    this.readout();
  }
  width() { return Math.max(200, this.box.clientWidth); }
  // what lies off the scale is a gap in the curve, and is said below it
  inScale(c) {
    const values = this.scaled(c), { count, off } = (c.offScale ??= offScale(c.values));
    if (!count) return values;
    const key = values === c.values ? "kept" : "keptInDegrees";
    return (c[key] ??= values.map((v, k) => (off[k] ? NaN : v)));
  }
  data(columns) {
    const [axis, ...shown] = visible(this.run.time, columns.map((c) => this.inScale(c)), this.range[0], this.range[1], this.width(), this.run.axisLog);
    return [axis, ...shown.map((c) => (c.some(Number.isNaN) ? Array.from(c, (v) => (Number.isNaN(v) ? null : v)) : c))];
  }
  resize() {
    const width = this.width();
    if (width === this.drawn) return;
    this.drawn = width;
    for (const p of this.panels) {
      if (!p.plot) { p.draw(); continue; }
      p.plot.setSize({ width, height: p.plot.height });
      p.plot.setData(this.data(p.columns));
    }
  }
  zoom(from, to) {
    const [first, last] = this.full, least = 1e-9 * (last - first);
    if (!(to - from > least)) return;
    this.range = [Math.max(first, from), Math.min(last, to)];
    this.panels.forEach((p) => (p.plot ? p.plot.setData(this.data(p.columns)) : p.draw()));
  }
  about(t, factor) { this.zoom(t - (t - this.range[0]) * factor, t + (this.range[1] - t) * factor); }
  wheel(e) {
    const panel = this.panels.find((p) => p.plot && p.plot.over.matches(":hover"));
    if (!panel) return;
    e.preventDefault();
    const [from, to] = this.range, turn = e.deltaY || e.deltaX;
    if (e.shiftKey) return this.zoom(from + 0.001 * turn * (to - from), to + 0.001 * turn * (to - from));
    const box = panel.plot.over.getBoundingClientRect();
    this.about(panel.plot.posToVal(e.clientX - box.left, "x"), Math.exp(0.002 * turn));
  }
  selected(u) {
    if (u.select.width < 4) return;
    const from = u.posToVal(u.select.left, "x"), to = u.posToVal(u.select.left + u.select.width, "x");
    u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    this.dragged = true;
    this.zoom(from, to);
  }
  hovered(u) {
    if (this.clock.playing || u.cursor.left < 0 || !u.over.matches(":hover") || u.select.width > 3) return;
    this.clock.set(u.posToVal(u.cursor.left, "x"));
  }
  clicked(u, e) {
    if (this.dragged) { this.dragged = false; return; }
    this.mark(e.shiftKey ? "b" : "a", u.posToVal(e.offsetX, "x"));
  }
  mark(which, t) {
    this.marks[which] = t;
    this.panels.forEach((p) => (p.plot ? p.plot.redraw(false, false) : p.draw()));
    this.readout();
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
    for (const [t, colour, name] of lines) {
      if (t === null || t < this.range[0] || t > this.range[1]) continue;
      const x = Math.round(u.valToPos(t, "x", true)) + 0.5;
      ctx.strokeStyle = ctx.fillStyle = style.getPropertyValue(colour);
      ctx.lineWidth = devicePixelRatio;
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
      ctx.font = `${11 * devicePixelRatio}px system-ui`;
      if (name) ctx.fillText(name, x + 3 * devicePixelRatio, bbox.top + 11 * devicePixelRatio);
    }
    ctx.restore();
  }
  // values at the clock, and between the cursors
  readout() {
    const { time } = this.run, { a, b } = this.marks, t = this.clock.t;
    for (const p of this.panels) {
      p.legend.replaceChildren(...p.columns.map((c, i) => {
        const item = document.createElement("span"), values = this.scaled(c);
        item.style.setProperty("--c", COLOURS[i % COLOURS.length]);
        // rounding noise beside the signal's own size is nothing
        const { off, count, worst } = (c.offScale ??= offScale(c.values));
        const noise = 1e-9 * (c.largest ??= c.values.reduce((m, v, k) => (off[k] ? m : Math.max(m, Math.abs(v))), 0));
        const say = (v) => written(Math.abs(v) < noise ? 0 : v, p.unit);
        let text = `${c.name} = ${say(valueAt(time, values, t))}`;
        if (a !== null && b !== null) text += `  \u0394 ${say(valueAt(time, values, b) - valueAt(time, values, a))}`;
        else if (a !== null) text += `  A ${say(valueAt(time, values, a))}`;
        if (count) text += `  (${count} ${count > 1 ? "rows" : "row"} off the scale, ${say(values[worst])} at ${written(time[worst], this.run.axisUnit, 6)})`;
        if (c.extremes && this.range[1] - this.range[0] < 0.1 * (this.full[1] - this.full[0])) text += `  (thinned: of ${this.run.parts} parts of the run its extremes, not its course)`;
        item.textContent = text;
        return item;
      }));
    }
    const delta = document.getElementById("delta"), unit = this.run.axisUnit;
    delta.textContent = a === null ? "" : b === null ? `A ${written(a, unit, 6)}`
      : `A ${written(a, unit, 6)}  B ${written(b, unit, 6)}  \u0394 ${written(b - a, unit, 6)}` + (unit === "s" && b !== a ? `  1/\u0394 ${written(1 / Math.abs(b - a), "Hz", 5)}` : "");
  }
}

function padded(u, low, high) {
  if (low === null) return [0, 1];
  const pad = high > low ? 0.06 * (high - low) : Math.abs(high) * 0.1 || 1;
  return [low - pad, high + pad];
}

const NAMED = 10; // courses that a legend names

// Signals over another signal: a phase portrait. The clock is a dot on each curve.
class Portrait {
  constructor(waves, holder, columns, unit, height, colours) {
    Object.assign(this, { waves, columns, unit, height: Math.max(240, height), colours });
    this.canvas = holder.appendChild(document.createElement("canvas"));
    this.draw();
  }
  draw() {
    const { waves, canvas } = this, { run } = waves, ratio = devicePixelRatio, width = waves.width(), height = this.height;
    canvas.width = width * ratio;
    canvas.height = height * ratio;
    canvas.style.width = width + "px";
    const ctx = canvas.getContext("2d"), xc = run.columns.find((c) => c.name === waves.xname), xs = waves.scaled(xc);
    ctx.scale(ratio, ratio);
    const first = before(run.time, waves.range[0]), last = before(run.time, waves.range[1]);
    const span = (columns, f = (v) => v) => {
      let low = Infinity, high = -Infinity;
      for (const c of columns) for (let k = first; k <= last; k++) { const v = f(c[k]); if (v < low) low = v; if (v > high) high = v; }
      return padded(null, low <= high ? low : null, high);
    };
    // over the axis of a sweep within sweeps, which may be logarithmic
    const log = run.overLog && waves.xname === run.over, place = log ? Math.log10 : (v) => v;
    const ys = this.columns.map((c) => waves.inScale(c)), [x0, x1] = span([waves.inScale(xc)], place), [y0, y1] = span(ys);
    const courses = [0, ...run.blocks], names = run.courses || [];
    const left = 66, bottom = height - 34, X = (v) => left + (place(v) - x0) / (x1 - x0) * (width - left - 10), Y = (v) => bottom - (v - y0) / (y1 - y0) * (bottom - 8);
    ctx.font = "12px system-ui";
    ctx.fillStyle = this.colours.ink;
    ctx.strokeStyle = this.colours.line;
    ctx.textAlign = "center";
    const marks = log ? decades(x0, x1) : ticks(x0, x1, width / 110);
    for (const v of marks) { line(ctx, X(v), 8, X(v), bottom); ctx.fillText(written(v, waves.unit(xc)), X(v), bottom + 14); }
    ctx.fillText(waves.xname, (left + width) / 2, height - 5);
    ctx.textAlign = "right";
    for (const v of ticks(y0, y1, height / 40)) { line(ctx, left, Y(v), width - 10, Y(v)); ctx.fillText(written(v, this.unit), left - 5, Y(v) + 4); }
    const stride = Math.max(1, Math.floor((last - first) / 40000));
    // a colour a course, where there are several
    const colour = (i, n) => COLOURS[(i + n * ys.length) % COLOURS.length];
    ys.forEach((y, i) => {
      ctx.strokeStyle = ctx.fillStyle = colour(i, 0);
      ctx.lineWidth = 1.3;
      courses.forEach((begin, n) => {
        const end = Math.min(last, (courses[n + 1] ?? Infinity) - 1);
        ctx.strokeStyle = colour(i, n);
        ctx.beginPath();
        let pen = false;
        for (let k = Math.max(first, begin); k <= end; k = k < end ? Math.min(end, k + stride) : end + 1) {
          const known = Number.isFinite(xs[k]) && Number.isFinite(y[k]);
          if (known && pen) ctx.lineTo(X(xs[k]), Y(y[k])); else if (known) ctx.moveTo(X(xs[k]), Y(y[k]));
          pen = known;
        }
        ctx.stroke();
      });
      ctx.beginPath();
      ctx.arc(X(valueAt(run.time, xs, waves.clock.t)), Y(valueAt(run.time, y, waves.clock.t)), 4.5, 0, 7);
      ctx.fill();
    });
    ctx.textAlign = "right";
    names.slice(0, NAMED).forEach((name, n) => {
      ctx.fillStyle = colour(0, n);
      ctx.fillText(n === NAMED - 1 && names.length > NAMED ? `and ${names.length - n} more` : name, width - 14, 22 + 15 * n);
    });
  }
}

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
