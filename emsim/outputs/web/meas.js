// The deck's .meas (measures/) of a run that was computed in the page. Between rows signals are straight lines here, and an extreme is
// that of the parabola through three rows; on the command line they are the method's own polynomials.
"use strict";

const KEPT_WORDS = { avg: 1, rms: 1, integ: 1, pp: 1, min: 1, max: 1, min_at: 1, max_at: 1 };

class NotThere extends Error {}

// A measurement in a run: {value, more}. `card`: {name, clauses: [{word, body, level, values: {key: text}}]}; `known(name)`: what an
// expression reads beside signals, a number or undefined.
class Meas {
  constructor(run, known) { Object.assign(this, { run, known, time: run.time, first: run.time[0], last: run.time[run.time.length - 1] }); }
  curve(text) {
    const { run } = this, f = compileExpression(text, (name) => {
      const number = this.known(name);
      if (number !== undefined) return Float64Array.from(run.time, () => number);
      return name === run.axisName ? run.time : run.columns.find((c) => c.name.replace(/\s/g, "") === name)?.values;
    }, { x: run.time, starts: [0] });
    return Float64Array.from(run.time, (_, k) => f(k));
  }
  number(text) {
    const values = this.curve(text);
    if (Math.max(...values) - Math.min(...values) > 1e-9 * Math.max(...values.map(Math.abs))) throw new NotThere(`${text} is no one number`);
    return values[0];
  }
  window({ values }) {
    let [begin, end] = [this.first, this.last];
    if (values.from) begin = Math.max(begin, this.number(values.from));
    if (values.td) begin = Math.max(begin, this.number(values.td));
    if (values.to) end = Math.min(end, this.number(values.to));
    if (begin > end) throw new NotThere("nothing lies there");
    return [begin, end];
  }
  crossing(clause) {
    const { values } = clause;
    if (values.at) {
      const at = this.number(values.at);
      if (at < this.first || at > this.last) throw new NotThere("outside the run");
      return at;
    }
    const y = this.curve(clause.body), level = this.curve(clause.level ?? values.val), [begin, end] = this.window(clause);
    const d = y.map((v, k) => v - level[k]), size = 64 * 2 ** -52 * y.reduce((m, v, k) => Math.max(m, Math.abs(v), Math.abs(level[k])), 0);
    const word = ["rise", "fall", "cross"].find((w) => values[w]), way = { rise: 1, fall: -1 }[word] ?? 0, count = !word ? 1 : values[word] === "last" ? -1 : this.number(values[word]);
    const found = [], side = d.map((v) => (Math.abs(v) <= size ? 0 : Math.sign(v))), leaves = side.findIndex((s) => s), flat = level.every((v) => v === level[0]);
    if (leaves > 0 && flat) found.push([this.time[leaves - 1], side[leaves]]);
    for (let k = Math.max(1, leaves); k < d.length; k++) if (side[k - 1] && side[k] !== side[k - 1]) found.push([this.time[k - 1] + (this.time[k] - this.time[k - 1]) * d[k - 1] / (d[k - 1] - d[k]), -side[k - 1]]);
    const own = found.filter(([t, s]) => t >= begin && t <= end && (!way || s === way)), one = own.at(count > 0 ? count - 1 : count);
    if (!one) throw new NotThere(`crossed ${own.length} times`);
    return one[0];
  }
  find({ clauses }) {
    const [clause] = clauses, { word } = clause, other = (w) => clauses.find((c, k) => k && c.word === w);
    if (word === "param") return this.number(clause.body);
    if (word === "trig" || word === "targ") return this.crossing(clauses.find((c) => c.word === "targ")) - this.crossing(clauses.find((c) => c.word === "trig"));
    if (word === "when") return this.crossing(clause);
    if (word === "find" || word === "deriv") {
      const when = other("when");
      const at = this.crossing(when ? { ...when, values: { ...clause.values, ...when.values } } : clause), y = this.curve(clause.body);
      if (word === "find") return valueAt(this.time, y, at);
      return valueAt(this.time, SLOPE(this.time, y), at);
    }
    if (!KEPT_WORDS[word]) throw new Error(word);
    let [begin, end] = this.window(clause);
    if (other("trig")) begin = this.crossing(other("trig"));
    if (other("targ")) end = this.crossing(other("targ"));
    if (begin > end) throw new NotThere("it ends before it begins");
    return this.statistic(word, stretch(this.time, this.curve(clause.body), begin, end));
  }
  statistic(word, course) {
    const { mean, rms } = measured(course), span = course.x.at(-1) - course.x[0];
    if (word === "avg") return span ? mean : course.y[0];
    if (word === "rms") return span ? rms : Math.abs(course.y[0]);
    if (word === "integ") return span ? mean * span : 0;
    const [high, low] = [1, -1].map((sign) => extremeOf(course, sign));
    return { pp: high[1] - low[1], max: high[1], min: low[1], max_at: high[0], min_at: low[0] }[word];
  }
}

// The largest (sign 1) or smallest value: of the parabola through three rows, where it turns between them.
function extremeOf({ x, y }, sign) {
  let k = 0;
  for (let j = 1; j < y.length; j++) if (sign * y[j] > sign * y[k]) k = j;
  if (k > 0 && k < y.length - 1 && x[k] > x[k - 1] && x[k + 1] > x[k]) {
    const h = x[k] - x[k - 1], g = x[k + 1] - x[k], left = (y[k] - y[k - 1]) / h, right = (y[k + 1] - y[k]) / g, bend = (right - left) / (h + g), slope = (left * g + right * h) / (h + g);
    const by = -slope / (2 * bend);
    if (sign * bend < 0 && by > -h && by < g) return [x[k] + by, y[k] + slope * by + bend * by * by];
  }
  return [x[k], y[k]];
}

// The sheet of the measurements: as computed here, beside the deck's. `cards` with `unit` and what the deck's run found, `was`.
function measuredSheet(run, cards, value) {
  const found = new Map(), known = (name) => {
    const of = /^meas\((.*)\)$/.exec(name);
    if (of && typeof found.get(of[1]) !== "number") throw new NotThere(`it reads ${of[1]}`);
    return of ? found.get(of[1]) : name.startsWith("outside.") ? value(name.slice(8)) : undefined;
  };
  const safe = (s) => String(s).replace(/[&<>]/g, (c) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;" })[c]), meas = new Meas(run, known);
  const rows = cards.map((card) => {
    try {
      const got = meas.find(card);
      if (Number.isFinite(got)) found.set(card.name, got); else throw new NotThere("it has no value");
    } catch (error) { found.set(card.name, error instanceof NotThere ? `not found: ${error.message}` : "the deck's alone"); }
    const mine = found.get(card.name);
    return `<tr><td>${safe(card.name)}</td><td>${typeof mine === "number" ? +mine.toPrecision(6) : safe(mine)}</td><td>${safe(card.unit)}</td><td>${card.was === null ? "not found" : +card.was.toPrecision(6)}</td></tr>`;
  });
  return ["measures", "Measurements", `<table class="numbers"><tr><th>of this run</th><th>value</th><th>unit</th><th>of the deck</th></tr>${rows.join("")}</table><p class="note">Here signals are straight lines between the rows of the run.</p>`];
}
