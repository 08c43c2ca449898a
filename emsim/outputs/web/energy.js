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
