// Where every joule went: the sums over time, and every owner's account.
"use strict";

function energySheet(run, clock) {
  const box = document.getElementById("sheet-energy"), { energy } = run;
  if (!box || !energy) return;
  const chart = document.createElement("div"), table = document.createElement("table");
  table.className = "numbers";
  const most = Math.max(1e-300, ...energy.accounts.flatMap((a) => [a.supplied, a.dissipated, a.stored].map(Math.abs)));
  const cell = (v) => `<td>${v ? written(v, "J") : ""}</td><td><span class="bar" style="width:${(90 * Math.abs(v) / most).toFixed(1)}px;opacity:${v < 0 ? 0.4 : 1}"></span></td>`;
  const row = (name, a) => `<tr><td>${name}</td>${cell(a.supplied)}${cell(a.dissipated)}${cell(a.stored)}</tr>`;
  const safe = (s) => s.replace(/[&<>]/g, (c) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;" })[c]);
  table.innerHTML = "<tr><td></td><th>supplied</th><td></td><th>dissipated</th><td></td><th>stored</th><td></td></tr>"
    + energy.accounts.map((a) => row(`${safe(a.card)} ${safe(a.name)}`, a)).join("") + row("sum", energy);
  const words = document.createElement("p");
  words.textContent = energy.summary;
  box.replaceChildren(words, chart, table);
  if (!energy.rows) return;
  const { time, columns } = energy;
  const style = getComputedStyle(document.documentElement), ink = style.getPropertyValue("--soft"), line = style.getPropertyValue("--line");
  const axis = { stroke: ink, grid: { stroke: line, width: 1 }, ticks: { stroke: line, width: 1 } }, names = ["supplied", "dissipated", "stored", "unexplained"];
  const width = () => Math.max(300, Math.min(1100, box.clientWidth || innerWidth - 40));
  const plot = new uPlot({
    width: width(), height: 230, scales: { x: { time: false } },
    series: [{ label: "time", value: (u, v) => (v === null ? "" : written(v, run.axisUnit, 6)) }, ...names.map((label, i) => ({ label, stroke: () => colourOf(i), width: 1.5, points: { show: false }, value: (u, v) => (v === null ? "" : written(v, "J")) }))],
    axes: [{ ...axis, values: (u, t) => t.map((v) => written(v, run.axisUnit, 6)) }, { ...axis, size: 84, values: (u, t) => t.map((v) => written(v, "J")) }],
    hooks: { setCursor: [(u) => { if (u.cursor.left >= 0 && u.over.matches(":hover") && !clock.playing) clock.set(u.posToVal(u.cursor.left, "x")); }] },
  }, visible(time, columns, time[0], time[time.length - 1], width()), chart);
  plot.ctx.canvas.setAttribute("role", "img");
  plot.ctx.canvas.setAttribute("aria-label", "energies over time");
  new ResizeObserver(() => box.clientWidth && plot.setSize({ width: width(), height: 230 })).observe(box);
}

// The ledger of a run that was computed in the page (reports/energy.py): `found` are the engine's accounts (page_accounts), `book`
// says whose they are.
function ledgerOf(book, found) {
  const [powers, energies, devices] = found, at = { n: 3 }, take = (n) => found.subarray(at.n, (at.n += n));
  const sums = take(powers), heats = take(2 * devices), moved = take(powers + devices), swing = take(energies), first = take(energies), last = take(energies), trace = found.subarray(at.n);
  const lines = new Map(), line = (name, card) => { if (!lines.has(name)) lines.set(name, { name, card, supplied: 0, dissipated: 0, stored: 0 }); return lines.get(name); };
  const [own, held] = book.entries, kinds = [...own.map((e) => e[2]), ...Array(devices).fill("dissipated")], changes = Array.from(last, (v, k) => v - first[k]);
  own.forEach(([name, card, kind], k) => (line(name, card)[kind] += sums[k]));
  held.forEach(([name, card, kind], k) => (line(name, card)[kind] += changes[k] ?? 0));
  for (let k = 0; k < devices; k++) {
    const name = book.devices[k], account = line(name, name.split(".").at(-1)[0].toUpperCase());
    account.dissipated += heats[2 * k];
    account.stored += heats[2 * k + 1];
  }
  const accounts = [...lines.values()], total = (kind) => accounts.reduce((sum, a) => sum + a[kind], 0), energy = { accounts, supplied: total("supplied"), dissipated: total("dissipated"), stored: total("stored") };
  const residual = energy.stored - energy.supplied + energy.dissipated, through = { supplied: 0, dissipated: 0, stored: 0 }, size = (values) => values.reduce((sum, v) => sum + Math.abs(v), 0);
  kinds.forEach((kind, k) => (through[kind] += moved[k] ?? 0));
  const turnover = Math.max(...Object.values(through), size(changes), swing.reduce((a, b) => a + b, 0), first.reduce((sum, v, k) => sum + Math.max(Math.abs(v), Math.abs(last[k] ?? 0)), 0)), said = (v) => `${+v.toPrecision(4)} J`;
  const rest = book.open.length ? `not accounted for: ${book.open.join(", ")}` : `${said(residual)} unexplained (${(turnover > 0 ? Math.abs(residual) / turnover : 0).toExponential(1)} of what was turned over)`;
  const summary = `energy: ${said(energy.supplied)} supplied, ${said(energy.dissipated)} dissipated, ${said(energy.stored)} stored; ${rest}`;
  const width = 1 + powers + 2 * devices + energies, rows = Math.floor(trace.length / width), time = new Float64Array(rows), columns = Array.from({ length: 4 }, () => new Float64Array(rows)), place = { supplied: 0, dissipated: 1, stored: 2 };
  for (let r = 0; r < rows; r++) {
    const row = trace.subarray(r * width, (r + 1) * width);
    time[r] = row[0];
    own.forEach(([, , kind], k) => (columns[place[kind]][r] += row[1 + k]));
    for (let k = 0; k < devices; k++) { columns[1][r] += row[1 + powers + 2 * k]; columns[2][r] += row[2 + powers + 2 * k]; }
    held.forEach(([, , kind], k) => { const c = 1 + powers + 2 * devices + k; columns[place[kind]][r] += row[c] - trace[c]; });
    columns[3][r] = columns[2][r] - columns[0][r] + columns[1][r];
  }
  return { ...energy, residual, summary, rows, time, columns };
}
