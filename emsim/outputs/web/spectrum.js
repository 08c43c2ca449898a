// The spectrum of what is drawn, as spectrum.py has it: a sine in the middle of a line has its own amplitude there.
"use strict";

const WINDOWS = { hann: [0.5, 0.5], none: [1], hamming: [0.54, 0.46], blackman: [0.42, 0.5, 0.08], flattop: [0.21557895, 0.41663158, 0.277263158, 0.083578947, 0.006947368] };

// In place, of a power of two of numbers: radix 2.
function fourier(re, im) {
  const n = re.length;
  for (let i = 1, j = 0; i < n; i++) {
    let bit = n >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) { [re[i], re[j]] = [re[j], re[i]]; [im[i], im[j]] = [im[j], im[i]]; }
  }
  for (let size = 2; size <= n; size *= 2) {
    const half = size / 2, turn = -2 * Math.PI / size;
    for (let k = 0; k < half; k++) {
      const c = Math.cos(turn * k), s = Math.sin(turn * k);
      for (let a = k; a < n; a += size) {
        const b = a + half, x = re[b] * c - im[b] * s, y = re[b] * s + im[b] * c;
        re[b] = re[a] - x; im[b] = im[a] - y;
        re[a] += x; im[a] += y;
      }
    }
  }
}

// Frequencies and amplitudes of a course between two times.
function spectrumOf(time, values, from, to, shape) {
  const n = Math.min(Math.max(1024, 1 << Math.ceil(Math.log2(Math.max(2, before(time, to) - before(time, from))))), 1 << 17);
  const re = new Float64Array(n), im = new Float64Array(n), coefficients = WINDOWS[shape];
  let mean = 0, k = before(time, from);
  for (let i = 0; i < n; i++) {
    const t = from + (to - from) * i / n;
    while (k + 1 < time.length && time[k + 1] <= t) k++;
    const span = k + 1 < time.length ? time[k + 1] - time[k] : 0, v = span > 0 ? values[k] + (values[k + 1] - values[k]) * (t - time[k]) / span : values[k];
    const w = coefficients.reduce((sum, a, m) => sum + (m % 2 ? -a : a) * Math.cos(2 * Math.PI * m * i / n), 0);
    mean += w / n;
    re[i] = w * (Number.isFinite(v) ? v : 0);
  }
  fourier(re, im);
  const f = new Float64Array(n / 2 + 1), size = new Float64Array(n / 2 + 1);
  for (let m = 0; m <= n / 2; m++) {
    f[m] = m / (to - from);
    size[m] = Math.hypot(re[m], im[m]) * (m === 0 || m === n / 2 ? 1 : 2) / (n * mean);
  }
  return { f, size };
}

// Panels of spectra, a panel a unit, in dB of that unit over a logarithm of the frequency; of the range that is drawn.
function spectraPanels(waves) {
  const style = getComputedStyle(document.documentElement), ink = style.getPropertyValue("--soft"), rule = style.getPropertyValue("--line");
  const groups = waves.groups(), height = Math.max(180, Math.min(300, (0.62 * innerHeight) / Math.max(1, groups.length)));
  return groups.map(([key, units, columns]) => {
    const [holder, legend] = waves.holder(`spectra of ${columns.map((c) => c.name).join(", ")}`), panel = { key, units, columns, unit: units[0], legend };
    panel.fresh = () => {
      const found = columns.map((c) => spectrumOf(waves.run.time, waves.inScale(c), ...waves.range, waves.fft));
      panel.peaks = found.map(({ f, size }) => { let best = 1; for (let m = 2; m < size.length; m++) if (size[m] > size[best]) best = m; return [f[best], size[best]]; });
      const decibels = found.map(({ size }) => size.subarray(1).map((v) => Math.max(-400, 20 * Math.log10(v))));
      return visible(found[0].f.subarray(1), decibels, found[0].f[1], found[0].f[found[0].f.length - 1], waves.width(), true);
    };
    const data = panel.fresh(), axis = { stroke: ink, grid: { stroke: rule, width: 1 }, ticks: { stroke: rule, width: 1 } };
    const top = (u, low, high) => (high === null ? [-100, 0] : [Math.max(low, high - 160), high + 6]);
    panel.plot = new uPlot({
      width: waves.width(), height, padding: [6, 26, 0, 0], pxAlign: 0,
      scales: { x: { time: false, distr: 3, range: (u, low, high) => [low, high] }, y: { range: top } },
      axes: [{ ...axis, ...LOG, values: (u, all) => all.map((v) => written(v, "Hz", 4)) }, { ...axis, size: 84, values: (u, all) => all.map((v) => written(v, "dB", 4)) }],
      series: [{}, ...columns.map((c, i) => ({ label: c.name, stroke: () => colourOf(i), width: 1.2, points: { show: false } }))],
      cursor: { drag: { setScale: true, x: true, y: false } }, legend: { show: false },
    }, data, holder);
    panel.plot.ctx.canvas.setAttribute("role", "img");
    panel.plot.ctx.canvas.setAttribute("aria-label", `spectra of ${columns.map((c) => c.name).join(", ")}`);
    holder.append(legend);
    return panel;
  });
}
