// The run inside the page: columns unpacked, numbers written, expressions of signals evaluated.
"use strict";

// Base64 of deflated bytes -> the bytes. Without a Blob, whose way through the browser's processes costs more than the rest.
async function inflate(text) {
  const letters = atob(text), packed = new Uint8Array(letters.length);
  for (let k = 0; k < letters.length; k++) packed[k] = letters.charCodeAt(k);
  const stream = new DecompressionStream("deflate"), writer = stream.writable.getWriter();
  writer.write(packed).then(() => writer.close());
  return new Uint8Array(await new Response(stream.readable).arrayBuffer());
}

// Columns are float32 or float64 as their length tells, bytes of equal significance side by side, deflated, base64.
async function unpack(text, rows, whole = false) {
  const planes = await inflate(text), width = planes.length / rows;
  const bytes = new Uint8Array(rows * width);
  for (let k = 0; k < width; k++) for (let i = 0; i < rows; i++) bytes[i * width + k] = planes[k * rows + i];
  return whole ? new Int32Array(bytes.buffer) : width === 8 ? new Float64Array(bytes.buffer) : new Float32Array(bytes.buffer);
}

// The numbers of a thinned column (outputs/thin.py): those of its kept rows.
async function unpackKept(c) {
  if (c.step === undefined) return unpack(c.packed, c.count);
  let sum = 0;
  return Float64Array.from(await unpack(c.packed, c.count, true), (k) => c.low + c.step * (c.sums ? (sum += k) : k));
}

// An axis and its columns; a thinned column is filled by the straight lines between its kept rows.
async function unpackAll({ axis, packed, rows }) {
  const time = await (typeof axis === "string" ? unpack(axis, rows) : unpackKept(axis));
  return [time, ...await Promise.all(packed.map(async (c) => {
    if (typeof c === "string") return unpack(c, rows);
    const [at, kept] = await Promise.all([unpack(c.at, c.count, true), unpackKept(c)]), values = new Float32Array(rows);
    let a = 0;
    at.forEach((ahead, k) => {
      const b = a + ahead, span = time[b] - time[a];
      for (let i = a + 1; i < b; i++) values[i] = span > 0 ? kept[k - 1] + (kept[k] - kept[k - 1]) * (time[i] - time[a]) / span : kept[k - 1];
      values[b] = kept[k];
      a = b;
    });
    return values;
  }))];
}

// A surface (outputs/html.py): its points [m], and its faces, numbers of points.
async function unpackMesh({ points, count, faces, corners, low, step }) {
  const [planes, ahead] = await Promise.all([inflate(points), unpack(faces, corners, true)]), n = 3 * count;
  const at = (axis, k) => low[axis] + step * (planes[axis * count + k] + 256 * planes[n + axis * count + k]);
  ahead.forEach((far, k) => (ahead[k] = far + (k < 3 ? 0 : ahead[k - 3])));
  const found = { points: Array.from({ length: count }, (_, k) => [at(0, k), at(1, k), at(2, k)]), faces: Array.from({ length: corners / 3 }, (_, f) => [...ahead.subarray(3 * f, 3 * f + 3)]) };
  return Object.assign(found, drawn.sewn(found.points, found.faces));
}
// of shapes that show one
function meshed(shapes, meshes) { for (const s of shapes) if (s.mesh !== undefined) Object.assign(s, meshes[s.mesh]); }

const PREFIXES = ["f", "p", "n", "\u00b5", "m", "", "k", "M", "G", "T"];
const UNSCALED = new Set(["", "rad", "\u00b0", "rad/s", "\u00b0/s", "rad/s^2", "deg", "deg/s", "rpm", "dB", "C", "1/s"]);

// 0.00574 A -> "5.74 mA"
function written(value, unit = "", digits = 4) {
  if (!Number.isFinite(value)) return Number.isNaN(value) ? "\u2013" : value > 0 ? "\u221e" : "-\u221e";
  const size = Math.abs(+value.toPrecision(digits)); // 0.99999 V is 1 V, not 1000 mV
  if (size === 0 || UNSCALED.has(unit) || size < 1e-16 || size >= 1e15) {
    const plain = size === 0 ? "0" : size < 1e-4 || size >= 1e6 ? value.toExponential(digits - 1).replace(/\.?0+e/, "e") : +value.toPrecision(digits) + "";
    return unit ? `${plain} ${unit}` : plain;
  }
  const step = Math.max(-5, Math.min(4, Math.floor(Math.log10(size) / 3 + 1e-12)));
  return `${+(value / 1000 ** step).toPrecision(digits)} ${PREFIXES[step + 5]}${unit}`;
}

function rounded(value, digits) { return String(+value.toPrecision(digits)); }

// Index of the last entry <= t of an ascending column.
function before(time, t) {
  let low = 0, high = time.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (time[middle] <= t) low = middle; else high = middle - 1;
  }
  return low;
}

// ... of the entry that is nearest to t
function nearest(time, t) {
  const k = before(time, t);
  return k + 1 < time.length && time[k + 1] - t < t - time[k] ? k + 1 : k;
}

function valueAt(time, column, t) {
  const k = before(time, t);
  if (k + 1 >= time.length || t <= time[k]) return column[k];
  const span = time[k + 1] - time[k];
  if (!(span > 0)) return column[k + 1];
  const value = column[k] + (column[k + 1] - column[k]) * (t - time[k]) / span;
  return Number.isFinite(value) ? value : column[k]; // beside an infinite value there is no line
}

// Which rows no scale shows beside the others: what is not finite, and a hundredth of the rows at most that is FAR times as
// distant from the middle as all else (panels.py has the same rule). `off`: their mark; `count`, `worst`: how many, which row.
const FAR = 1e6;
function offScale(values) {
  const finite = values.filter(Number.isFinite).sort();
  const off = new Uint8Array(values.length);
  if (!finite.length) return { off, count: 0, worst: -1 };
  const middle = finite[finite.length >> 1], far = finite.map((v) => Math.abs(v - middle)).sort();
  const rest = far[Math.floor(0.99 * (far.length - 1))], limit = rest > 0 && far.length > 2 ? FAR * rest : Infinity;
  let count = 0, worst = -1;
  values.forEach((v, k) => {
    if (Number.isFinite(v) && Math.abs(v - middle) <= limit) return;
    off[k] = 1;
    if (Number.isNaN(v)) return;
    count++;
    if (worst < 0 || Math.abs(v) > Math.abs(values[worst])) worst = k;
  });
  return { off, count, worst };
}

// A complex column as real ones: its size in dB, its phase, and its parts.
function partsOf(name, unit, re, im) {
  const made = (fn, unit, f) => ({ name: `${fn}(${name})`, unit, values: re.map((x, k) => f(x, im[k])) });
  return [
    // decibels of volts and of amperes have nothing to do with each other
    { ...made("db", "dB", (x, y) => 20 * Math.log10(Math.hypot(x, y))), of: unit }, made("ph", "rad", (x, y) => Math.atan2(y, x)),
    made("mag", unit, Math.hypot), made("re", unit, (x) => x), made("im", unit, (x, y) => y),
  ];
}

// What a screen can show of a column: the rows themselves, or the extremes of each pixel's rows, in their order.
function visible(time, columns, from, to, pixels, log = false) {
  const first = Math.max(0, before(time, from) - 1), last = Math.min(time.length - 1, before(time, to) + 2);
  if (last - first < 4 * pixels) {
    const cut = (c) => c.subarray(first, last + 1);
    return [cut(time), ...columns.map(cut)];
  }
  const edges = [first];
  for (let p = 1; p < pixels; p++) {
    const k = before(time, log ? from * (to / from) ** (p / pixels) : from + (to - from) * p / pixels);
    if (k > edges[edges.length - 1]) edges.push(k);
  }
  edges.push(last + 1);
  const buckets = edges.length - 1, axis = new Float64Array(2 * buckets);
  for (let p = 0; p < buckets; p++) {
    axis[2 * p] = time[edges[p]];
    axis[2 * p + 1] = time[Math.max(edges[p], edges[p + 1] - 1)];
  }
  const shown = columns.map((c) => {
    const out = new Float32Array(2 * buckets);
    for (let p = 0; p < buckets; p++) {
      let low = edges[p], high = low;
      for (let k = low + 1; k < edges[p + 1]; k++) {
        if (c[k] < c[low] || Number.isNaN(c[low])) low = k;
        if (c[k] > c[high] || Number.isNaN(c[high])) high = k;
      }
      out[2 * p] = c[Math.min(low, high)];
      out[2 * p + 1] = c[Math.max(low, high)];
    }
    return out;
  });
  return [axis, ...shown];
}

// as in decks: a power of something negative is that of its size
const POWER = (a, b) => Math.abs(a) ** b;

// a number as SPICE writes it: letters behind the scale suffix say nothing
const SUFFIXES = { t: 1e12, g: 1e9, meg: 1e6, k: 1e3, mil: 25.4e-6, m: 1e-3, u: 1e-6, "\u00b5": 1e-6, "\u03bc": 1e-6, n: 1e-9, p: 1e-12, f: 1e-15, a: 1e-18 };
const NUMBER = /^((?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:e[-+]?[0-9]+)?)(meg|mil|[tgkmun\u00b5\u03bcpfa])?[a-z]*/;

// what functions of a whole course are made of: (x, y) of its rows -> a value for all of them, or one a row
const SUM = (x, f) => { let s = 0; for (let k = 1; k < x.length; k++) s += (x[k] - x[k - 1]) * (f(k) + f(k - 1)) / 2; return s; };
const MEAN = (x, y) => x.length > 1 && x[x.length - 1] !== x[0] ? SUM(x, (k) => y[k]) / (x[x.length - 1] - x[0]) : y[0];
const SLOPE = (x, y) => y.map((_, k) => {
  const a = k > 0 && x[k - 1] !== x[k] ? k - 1 : k, b = k + 1 < x.length && x[k + 1] !== x[k] ? k + 1 : k;
  if (a === k || b === k) return a === b ? 0 : (y[b] - y[a]) / (x[b] - x[a]);
  const h = x[k] - x[a], g = x[b] - x[k], left = (y[k] - y[a]) / h, right = (y[b] - y[k]) / g;
  return (left * g + right * h) / (g + h);
});
const INTEGRAL = (x, y) => { let s = 0; return y.map((v, k) => (s += k ? (x[k] - x[k - 1]) * (v + y[k - 1]) / 2 : 0)); };
const UNWRAPPED = (x, y) => { let turns = 0; return y.map((v, k) => (turns -= k ? Math.round((v - y[k - 1]) / (2 * Math.PI)) : 0) * 2 * Math.PI + v); };

// FUNCTIONS and WHOLE are made of the table in functions.py.
// "v(out) - 2*i(m1)" -> a function of the row; `column(name)` finds signals. `course`: the axis x of all rows, and the row at
// which each course of a sweep begins. Throws Error with what is wrong.
function compileExpression(text, column, course = null) {
  const source = text.toLowerCase().replace(/\s+/g, "");
  let at = 0;
  const fail = (what) => { throw new Error(`${what} at ${at + 1} of ${text}`); };
  const take = (s) => source.startsWith(s, at) && ((at += s.length), true);
  function sum() {
    let left = product();
    for (;;) {
      if (take("+")) { const a = left, b = product(); left = (k) => a(k) + b(k); }
      else if (take("-")) { const a = left, b = product(); left = (k) => a(k) - b(k); }
      else return left;
    }
  }
  function product() {
    let left = power();
    for (;;) {
      if (take("*")) { const a = left, b = power(); left = (k) => a(k) * b(k); }
      else if (take("/")) { const a = left, b = power(); left = (k) => a(k) / b(k); }
      else return left;
    }
  }
  function power() {
    if (take("-")) { const a = power(); return (k) => -a(k); }
    let left = atom();
    while (take("^") || take("**")) { const a = left, minus = take("-"), b = atom(); left = (k) => POWER(a(k), minus ? -b(k) : b(k)); }
    return left;
  }
  function atom() {
    if (take("(")) { const a = sum(); if (!take(")")) fail("a ) is missing"); return a; }
    const number = NUMBER.exec(source.slice(at));
    if (number) { at += number[0].length; const v = Number(number[1]) * (SUFFIXES[number[2]] ?? 1); return () => v; }
    const word = /^[a-z_][a-z0-9_.#:]*/.exec(source.slice(at));
    if (!word) fail("a signal or number is missing");
    const name = word[0];
    at += name.length;
    if (source[at] === "(") {
      // a signal's name holds brackets of its own: v(out), x(pole(0.6,0))
      let depth = 0, end = at;
      do { depth += source[end] === "(" ? 1 : source[end] === ")" ? -1 : 0; end++; } while (depth > 0 && end < source.length);
      const whole = source.slice(at - name.length, end), values = column(whole);
      if (values) { at = end; return (k) => values[k]; }
      const [, a, b] = /^v\(([^(),]+),([^(),]+)\)$/.exec(whole) ?? [], between = a && [column(`v(${a})`), column(`v(${b})`)];
      if (between?.[0] && between[1]) { at = end; return (k) => between[0][k] - between[1][k]; }
      if (WHOLE[name] && course) {
        at++;
        const inner = sum(), y = Float64Array.from(course.x, (_, k) => inner(k)), found = new Float64Array(y.length);
        if (!take(")")) fail("a ) is missing");
        course.starts.forEach((a, k) => {
          const b = course.starts[k + 1] ?? y.length, got = WHOLE[name](course.x.slice(a, b), y.slice(a, b));
          typeof got === "number" ? found.fill(got, a, b) : found.set(got, a);
        });
        return (k) => found[k];
      }
      if (FUNCTIONS[name]) {
        const f = FUNCTIONS[name], given = [];
        at++;
        do given.push(sum()); while (take(","));
        if (!take(")")) fail("a ) is missing");
        return (k) => f(...given.map((g) => g(k)));
      }
      fail(`no signal ${whole}`);
    }
    if (name === "pi") return () => Math.PI;
    const values = column(name) || column(`v(${name})`);
    if (!values) fail(`no signal ${name}`);
    return (k) => values[k];
  }
  const result = sum();
  if (at < source.length) fail("this is not understood");
  return result;
}
