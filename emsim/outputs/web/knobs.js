// Values that a reader moves: numbers as SPICE writes them, and how far a slider goes.
"use strict";

function made(tag, properties = {}, ...inside) {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...inside);
  return element;
}

const SCALES = { t: 12, g: 9, meg: 6, k: 3, m: -3, u: -6, "\u00b5": -6, "\u03bc": -6, n: -9, p: -12, f: -15, a: -18 };
const FORM = /^([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)(meg|mil|[tgkmun\u00b5\u03bcpfa])?(.*)$/i;

function numberOf(text) {
  const found = FORM.exec(text.trim());
  if (!found) return null;
  const scale = (found[2] || "").toLowerCase();
  return scale === "mil" ? found[1] * 25.4e-6 : scale ? Number(`${+found[1]}e${SCALES[scale]}`) : Number(found[1]);
}

// with a scale suffix where the deck has one, and with the deck's letters behind it: 4.7kohm -> 5.2kohm
function spelled(value, like) {
  const [, , scale, letters] = FORM.exec(like.trim()), size = Math.abs(value);
  if (!scale && (size === 0 || (size >= 1e-3 && size < 1e6))) return `${value}${letters}`;
  const power = size === 0 ? 0 : Math.max(-18, Math.min(12, 3 * Math.floor(Math.log10(size) / 3 + 1e-9)));
  const suffix = power === 0 ? "" : Object.keys(SCALES).find((key) => SCALES[key] === power);
  const [digits, exponent = 0] = `${value}`.split("e"); // 2e-8 as it is written
  return suffix === undefined ? `${value}` : `${+`${digits}e${exponent - power}`}${suffix}${letters}`;
}

function nice(rough) {
  const ten = 10 ** Math.floor(Math.log10(rough));
  return ([5, 2, 1].find((m) => m * ten <= rough * 1.000001) || 1) * ten;
}

// from nothing to twice the deck's value, or to what was typed
function placeSlider(slider, base, value) {
  const ends = [base > 0 ? 0 : base < 0 ? 2 * base : -1, base < 0 ? 0 : base > 0 ? 2 * base : 1];
  slider.min = Math.min(ends[0], value);
  slider.max = Math.max(ends[1], value);
  slider.value = value;
}

// to both sides of the deck's value by so much, or to what was typed
function placeAbout(slider, base, value, reach) {
  slider.min = Math.min(base - reach, value);
  slider.max = Math.max(base + reach, value);
  slider.value = value;
}

// where a slider stands, rounded to what its length can show
function slid(slider) {
  const step = nice((slider.max - slider.min) / 200);
  return +(Math.round(slider.value / step) * step).toPrecision(9);
}

// A run as it stays below the curves of the next one: paler, in their colours.
function ghostOf({ run, waves }) {
  const span = (v) => { let low = Infinity, high = -Infinity; for (const x of v) if (Number.isFinite(x)) { low = Math.min(low, x); high = Math.max(high, x); } return [low, high]; };
  const spans = new Map(run.columns.filter((c) => waves.shown.has(c.name)).map((c) => [c.name, span(c.values)]));
  return { time: run.time, columns: new Map(run.columns.map((c) => [c.name, c.values])), spans };
}

// Where a deck's text says a value that was moved, by its name: `v1`, `kp` of .param, `arm(m)`; [line, column, length], or null where
// it is said in no one place, or nowhere. Lines of subcircuits are others' too.
const WRITTEN = String.raw`[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?(?:[a-z\u00b0\u00b5\u03bc][\w\u00b0/*^.]*)?`;
function placeIn(lines, name) {
  const [, card, key] = /^([^()]+)\(([^()]+)\)$/.exec(name) ?? [], safe = (s) => s.replace(/[^\w]/g, "\\$&");
  const own = card ? [`^\\s*[a-z]+\\s+${safe(card)}\\s.*?(?<![\\w.(,])${safe(key)}\\s*=\\s*`] : [`^\\s*${safe(name)}\\s+[^\\s=]+\\s+[^\\s=]+\\s+(?:dc\\s*=?\\s*)?`, `^\\s*\\.param\\s(?:.*\\s)?${safe(name)}\\s*=\\s*`];
  const found = [];
  let inside = 0;
  lines.forEach((line, k) => {
    if (/^\s*\.(subckt|macro|control)\b/i.test(line)) inside++;
    if (/^\s*\.(ends|eom|endc)\b/i.test(line)) inside--;
    if (k && !inside) for (const before of own) {
      const hit = new RegExp(`(${before})(${WRITTEN})(?=\\s|$|;)`, "i").exec(line);
      if (hit) found.push([k, hit[1].length, hit[2].length]);
    }
  });
  return found.length === 1 ? found[0] : null;
}

// The line of a JOINT with another ic=: of one coordinate, whose name is angle(joint) or the like.
function startIn(lines, name, value) {
  const of = /^\w+\((.*)\)$/.exec(name)?.[1], k = lines.findIndex((line) => new RegExp(`^\\s*JOINT\\s+${of?.replace(/[^\w]/g, "\\$&")}\\s`, "i").test(line));
  if (k < 0) return null;
  const speed = /\bic\s*=\s*\([^,()]*,([^,()]*)\)/i.exec(lines[k])?.[1], text = `ic=${speed ? `(${value},${speed})` : value}`;
  return [k, /\bic\s*=/i.test(lines[k]) ? lines[k].replace(/\bic\s*=\s*(\([^()]*\)|\S+)/i, text) : `${lines[k].trimEnd()} ${text}`];
}
