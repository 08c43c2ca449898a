// What is drawn, as a file: CSV of its rows, SVG of its curves, PNG of machine and curves.
"use strict";

function save(kind, { run, waves, machine }) {
  const stem = (run.title || "emsim").replace(/[^\w.-]+/g, "_").slice(0, 60) || "emsim";
  const give = (blob) => {
    const url = URL.createObjectURL(blob), link = Object.assign(document.createElement("a"), { href: url, download: `${stem}.${kind}` });
    link.click();
    setTimeout(() => URL.revokeObjectURL(url), 10_000);
  };
  if (kind === "csv") give(new Blob([rowsAsCsv(run, waves)], { type: "text/csv" }));
  else if (kind === "svg") give(new Blob([curvesAsSvg(run, waves)], { type: "image/svg+xml" }));
  else pictureOf(waves, machine).toBlob(give);
}

// every row in the range; names quoted as needed, units behind them as in emsim's own CSV
function rowsAsCsv(run, waves) {
  const columns = waves.inView(), [from, to] = waves.range, quoted = (s) => (/[",\n]/.test(s) ? `"${s.replace(/"/g, '""')}"` : s);
  const title = (name, unit) => quoted(unit ? `${name} [${unit}]` : name), lines = [[title(run.axisName, run.axisUnit), ...columns.map((c) => title(c.name, waves.unit(c)))].join(",")];
  const values = columns.map((c) => waves.scaled(c));
  const number = (v, digits) => (Number.isFinite(v) ? +v.toPrecision(digits) : v > 0 ? "inf" : v < 0 ? "-inf" : "nan");
  run.time.forEach((t, k) => { if (t >= from && t <= to) lines.push([number(t, 15), ...values.map((v) => number(v[k], v instanceof Float32Array ? 8 : 15))].join(",")); });
  return lines.join("\n") + "\n";
}

// the panels as they are: axes, curves of what a screen can show, cursors, names
function curvesAsSvg(run, waves) {
  const style = getComputedStyle(document.documentElement), of = (name) => style.getPropertyValue("--" + name).trim(), width = waves.width();
  const text = (s) => String(s).replace(/[&<>]/g, (c) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;" })[c]), out = [];
  let top = 24;
  for (const p of waves.panels) {
    if (!p.plot) {
      // a curve over another signal is drawn once, on its canvas
      out.push(`<image x="0" y="${top}" width="${width}" height="${p.height}" href="${p.canvas.toDataURL()}"/>`);
      top += p.height + 22;
      continue;
    }
    const u = p.plot, r = devicePixelRatio, box = { left: u.bbox.left / r, top: u.bbox.top / r, width: u.bbox.width / r, height: u.bbox.height / r };
    const n = (v) => +v.toFixed(2), X = (v) => n(box.left + u.valToPos(v, "x")), Y = (v, scale) => n(top + box.top + u.valToPos(v, scale)), clip = `c${out.length}`;
    out.push(`<clipPath id="${clip}"><rect x="${box.left}" y="${top + box.top}" width="${box.width}" height="${box.height}"/></clipPath>`);
    u.axes.forEach((axis) => {
      const values = axis._values ?? [], splits = axis._splits ?? [];
      splits.forEach((v, k) => {
        if (v === null || !values[k]) return;
        if (axis.scale === "x") out.push(`<line x1="${X(v)}" x2="${X(v)}" y1="${n(top + box.top)}" y2="${n(top + box.top + box.height)}" stroke="${of("line")}"/><text x="${X(v)}" y="${n(top + box.top + box.height + 14)}" text-anchor="middle">${text(values[k])}</text>`);
        else {
          const left = axis.side === 3, y = Y(v, axis.scale);
          if (left) out.push(`<line x1="${box.left}" x2="${box.left + box.width}" y1="${y}" y2="${y}" stroke="${of("line")}"/>`);
          out.push(`<text x="${left ? box.left - 5 : box.left + box.width + 5}" y="${y + 4}" text-anchor="${left ? "end" : "start"}">${text(values[k])}</text>`);
        }
      });
    });
    u.series.slice(1).forEach((series, i) => {
      let pen = false, d = "";
      u.data[0].forEach((t, k) => {
        const v = u.data[i + 1][k];
        if (v === null || !Number.isFinite(v)) { pen = false; return; }
        d += `${pen ? "L" : "M"}${X(t)} ${Y(v, series.scale)}`;
        pen = true;
      });
      out.push(`<path d="${d}" fill="none" stroke="${colourOf(i)}" stroke-width="1.5" clip-path="url(#${clip})"/>`);
      out.push(`<text x="${n(box.left + 6 + i * 130)}" y="${n(top + box.top + box.height + 28)}" fill="${colourOf(i)}">${text(p.columns[i].name)}</text>`);
    });
    for (const [name, colour] of [["a", "accent"], ["b", "wiper"]]) {
      const t = waves.marks[name];
      if (t !== null && t >= waves.range[0] && t <= waves.range[1]) out.push(`<line x1="${X(t)}" x2="${X(t)}" y1="${n(top + box.top)}" y2="${n(top + box.top + box.height)}" stroke="${of(colour)}"/><text x="${X(t) + 3}" y="${n(top + box.top + 11)}" fill="${of(colour)}">${name.toUpperCase()}</text>`);
    }
    top += u.height + 22;
  }
  return `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${top}" viewBox="0 0 ${width} ${top}" font-family="system-ui, sans-serif" font-size="12" fill="${of("soft")}">`
    + `<rect width="${width}" height="${top}" fill="${of("back")}"/><text x="8" y="17" font-size="14" fill="${of("ink")}">${text(run.title)}</text>${out.join("")}</svg>`;
}

// machine above, curves below, each with its legend
function pictureOf(waves, machine) {
  const r = devicePixelRatio, style = getComputedStyle(document.documentElement), canvases = [...(machine ? [[machine.canvas, []]] : []), ...waves.panels.map((p) => [p.plot?.ctx.canvas ?? p.canvas, p.columns])];
  const whole = document.createElement("canvas"), ctx = whole.getContext("2d"), legend = 20 * r;
  whole.width = Math.max(...canvases.map(([c]) => c.width));
  whole.height = canvases.reduce((sum, [c]) => sum + c.height + legend, 0);
  ctx.fillStyle = style.getPropertyValue("--back");
  ctx.fillRect(0, 0, whole.width, whole.height);
  ctx.font = `${12 * r}px system-ui`;
  let y = 0;
  for (const [canvas, columns] of canvases) {
    ctx.drawImage(canvas, 0, y);
    y += canvas.height + legend;
    let x = 84 * r;
    columns.forEach((c, i) => {
      ctx.fillStyle = colourOf(i);
      ctx.fillText(c.name, x, y - 6 * r);
      x += ctx.measureText(c.name).width + 16 * r;
    });
  }
  return whole;
}
