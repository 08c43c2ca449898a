// The sheet of the cursors: what the drawn signals do between A and B, or over the range that is drawn.
"use strict";

// Rows of a column between two places of the axis, with the values at both by straight lines.
function stretch(time, values, from, to) {
  const x = [from], y = [valueAt(time, values, from)];
  for (let k = before(time, from) + 1; k < time.length && time[k] < to; k++) {
    if (time[k] > from) { x.push(time[k]); y.push(values[k]); }
  }
  x.push(to);
  y.push(valueAt(time, values, to));
  return { x, y };
}

// A course without the rows that hold no number or lie off the scale; `left` of them are left out.
function known({ x, y }) {
  const kept = x.map((_, k) => k).filter((k) => Number.isFinite(y[k]));
  return { x: kept.map((k) => x[k]), y: kept.map((k) => y[k]), left: x.length - kept.length };
}

// Where a course passes a level: [place, upwards].
function crossings({ x, y }, level) {
  const found = [];
  for (let k = 1; k < x.length; k++) {
    const a = y[k - 1] - level, b = y[k] - level;
    if ((a < 0 && b >= 0) || (a >= 0 && b < 0)) found.push([b === a ? x[k] : x[k - 1] + (x[k] - x[k - 1]) * a / (a - b), b >= a]);
  }
  return found;
}

// Local maxima that stand out of their surroundings by a hundredth of the range: [place, value].
function peaks({ x, y }) {
  const range = y.reduce((m, v) => Math.max(m, v), -Infinity) - y.reduce((m, v) => Math.min(m, v), Infinity), found = [];
  let top = 0, low = 0, rising = true;
  for (let k = 1; k < y.length; k++) {
    if (rising) {
      if (y[k] > y[top]) top = k;
      else if (y[top] - y[k] > 0.01 * range) {
        if (top > 0) found.push([x[top], y[top]]);
        low = k;
        rising = false;
      }
    } else if (y[k] < y[low]) low = k;
    else if (y[k] - y[low] > 0.01 * range) { top = k; rising = true; }
  }
  return found;
}

// What the sheet says of a course. Mean and RMS weigh by the axis (trapezia; squares of straight lines exactly).
function measured(course) {
  const { x, y } = course, span = x[x.length - 1] - x[0];
  if (!x.length) return { mean: NaN, rms: NaN, low: [NaN, NaN], high: [NaN, NaN], period: null };
  let sum = 0, squares = 0, low = 0, high = 0;
  for (let k = 0; k < y.length; k++) {
    if (y[k] < y[low]) low = k;
    if (y[k] > y[high]) high = k;
    if (!k) continue;
    const h = x[k] - x[k - 1], a = y[k - 1], b = y[k];
    sum += h * (a + b) / 2;
    squares += h * (a * a + a * b + b * b) / 3;
  }
  const mean = sum / span, ups = crossings(course, (y[low] + y[high]) / 2).filter(([, up]) => up).map(([t]) => t);
  const period = ups.length > 1 && y[high] > y[low] ? (ups[ups.length - 1] - ups[0]) / (ups.length - 1) : null;
  return { mean, rms: Math.sqrt(squares / span), low: [x[low], y[low]], high: [x[high], y[high]], period };
}

const LISTED = 12; // places of peaks and crossings that are listed

function cursorSheet(run, waves, clock) {
  const box = document.getElementById("sheet-cursors");
  if (box?.hidden) return;
  if (!box || run.over) return box && (box.innerHTML = '<p class="note">A family of courses: its values are in the files that emsim writes.</p>');
  const { a, b } = waves.marks, both = a !== null && b !== null && a !== b, [from, to] = both ? [Math.min(a, b), Math.max(a, b)] : waves.range;
  const kept = { level: document.getElementById("level")?.value ?? "", signal: document.getElementById("of")?.value };
  const table = document.createElement("table"), axis = (t) => written(t, run.axisUnit, 6), drawn = waves.inView();
  const said = (c, v) => (v === null ? "\u2013" : waves.said(c, v)), go = (t, text) => Object.assign(document.createElement("button"), { textContent: text, title: `the clock to ${axis(t)}`, onclick: () => clock.set(t) });
  table.className = "numbers";
  const head = table.createTHead().insertRow();
  for (const word of ["signal", "A", "B", "B \u2212 A", "mean", "RMS", "lowest", "highest", "range", "period", "frequency"]) head.append(Object.assign(document.createElement("th"), { textContent: word, scope: "col" }));
  const body = table.createTBody(), gaps = [];
  for (const c of drawn) {
    const values = waves.inScale(c), course = known(stretch(run.time, values, from, to)), row = body.insertRow(), at = (t) => (t === null ? null : valueAt(run.time, waves.scaled(c), t));
    if (course.left) gaps.push(`${course.left} ${course.left > 1 ? "rows" : "row"} of ${c.name}`);
    const { mean, rms, low, high, period } = measured(course), difference = a === null || b === null ? null : at(b) - at(a);
    const name = Object.assign(document.createElement("th"), { textContent: c.name, scope: "row" });
    const cells = [said(c, at(a)), said(c, at(b)), said(c, difference), said(c, mean), said(c, rms), go(low[0], said(c, low[1])), go(high[0], said(c, high[1])), said(c, high[1] - low[1]),
      period === null ? "\u2013" : axis(period), period === null || run.axisUnit !== "s" ? "\u2013" : written(1 / period, "Hz", 5)];
    row.append(name);
    for (const cell of cells) row.insertCell().append(cell);
  }
  const note = Object.assign(document.createElement("p"), { className: "note", textContent: `${both ? "Between A and B" : "Over the range that is drawn"}: ${axis(from)} to ${axis(to)}.${gaps.length ? ` Left out, as they hold no number or lie off the scale: ${gaps.join(", ")}.` : ""}` });
  box.replaceChildren(note, table);
  if (!drawn.length) return;
  // where one signal passes a level, and its peaks
  const line = document.createElement("p"), of = document.createElement("select"), level = Object.assign(document.createElement("input"), { type: "text", id: "level", size: 8, value: kept.level, placeholder: "middle" });
  const places = Object.assign(document.createElement("div"), { className: "signals" });
  of.id = "of";
  of.append(...drawn.map((c) => new Option(c.name, c.name)));
  if (drawn.some((c) => c.name === kept.signal)) of.value = kept.signal;
  of.setAttribute("aria-label", "signal");
  level.setAttribute("aria-label", "level of the crossings");
  line.append("Peaks of ", of, " and where it passes ", level);
  const fill = () => {
    const c = drawn.find((c) => c.name === of.value), course = known(stretch(run.time, waves.inScale(c), from, to)), { low, high } = measured(course);
    let value = (low[1] + high[1]) / 2;
    if (level.value.trim()) try { value = compileExpression(level.value, () => null)(0); } catch (error) { return places.replaceChildren(error.message); }
    const found = [["peaks", peaks(course).map(([t, v]) => [t, `${said(c, v)} at ${axis(t)}`])], [`passes ${said(c, value)}`, crossings(course, value).map(([t, up]) => [t, `${up ? "\u2191" : "\u2193"} ${axis(t)}`])]];
    places.replaceChildren(...found.flatMap(([title, items]) => [
      Object.assign(document.createElement("span"), { className: "unit", textContent: `${title}: ${items.length || "none"}` }),
      ...items.slice(0, LISTED).map(([t, text]) => Object.assign(go(t, text), { className: "chip" })),
      ...(items.length > LISTED ? [`and ${items.length - LISTED} more`] : []),
    ]));
  };
  of.onchange = fill;
  level.onchange = fill;
  fill();
  box.append(line, places);
}
