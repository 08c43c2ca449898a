// What the reader has set up, in the page's address behind #: a link shows the same. Not in a live page, whose address
// holds its key there.
"use strict";

const ours = () => document.body.dataset.live === undefined;

// browsers forbid more than a few changes a second
let keeping;
function keepState(now) {
  clearTimeout(keeping);
  keeping = setTimeout(() => now && now === window.emsim && writeState(now), 200);
}

function writeState(now) {
  if (!ours()) return;
  const { run, waves } = now, said = new URLSearchParams(), number = (v) => String(+v.toPrecision(9));
  if (run.all.indexOf(run)) said.set("analysis", run.all.indexOf(run));
  const same = waves.shown.size === run.shown.length && run.shown.every((n) => waves.shown.has(n));
  if (!same) for (const name of waves.shown) said.append("show", name);
  if (waves.range[0] > waves.full[0] || waves.range[1] < waves.full[1]) said.set("range", waves.range.map(number).join(","));
  for (const which of ["a", "b"]) if (waves.marks[which] !== null) said.set(which, number(waves.marks[which]));
  if (waves.fft) said.set("fft", waves.fft);
  if (waves.nyquist) said.set("nyquist", "1");
  else if (waves.xname && waves.xname !== run.over) said.set("over", waves.xname);
  if (waves.layout !== "unit") said.set("panels", waves.layout);
  if (waves.logx !== run.axisLog) said.set("logx", +waves.logx);
  for (const key of waves.logy) said.append("logy", key);
  for (const [key, spans] of waves.heights) said.append("height", `${key}=${spans.map((s) => (s ? s.map(number).join(",") : "")).join(";")}`);
  if (waves.degrees !== inDegrees(run)) said.set("degrees", +waves.degrees);
  try {
    // a page within a notebook has no address of its own
    history.replaceState(null, "", said.size ? "#" + said : location.pathname + location.search);
  } catch { /* then there is no link */ }
}

function restoreState({ run, waves }) {
  if (!ours() || location.hash.length < 2) return;
  const said = new URLSearchParams(location.hash.slice(1)), known = (name) => run.columns.some((c) => c.name === name);
  const wanted = said.getAll("show");
  for (const name of wanted) if (!known(name)) try { run.columns.push(computed(run, name)); } catch { /* another deck's */ }
  if (wanted.some(known)) waves.shown = new Set(wanted.filter(known));
  const numbers = (text) => text.split(",").map(Number), sound = (pair) => pair.length === 2 && pair.every(Number.isFinite) && pair[1] > pair[0];
  const range = numbers(said.get("range") ?? "");
  if (sound(range) && range[0] < waves.full[1] && range[1] > waves.full[0]) waves.range = [Math.max(range[0], waves.full[0]), Math.min(range[1], waves.full[1])];
  for (const which of ["a", "b"]) if (said.has(which) && Number.isFinite(+said.get(which))) waves.marks[which] = +said.get(which);
  if (known(said.get("over"))) waves.xname = said.get("over");
  waves.nyquist = said.has("nyquist") && run.complexNames.size > 0;
  if (run.axisName === "time" && WINDOWS[said.get("fft")]) waves.fft = said.get("fft");
  if (["two", "signal"].includes(said.get("panels"))) waves.layout = said.get("panels");
  if (said.has("logx")) waves.logx = said.get("logx") === "1";
  waves.logy = new Set(said.getAll("logy"));
  for (const text of said.getAll("height")) {
    const at = text.lastIndexOf("="), spans = text.slice(at + 1).split(";").map((s) => (s ? numbers(s) : null));
    if (spans.every((s) => !s || sound(s))) waves.heights.set(text.slice(0, at), spans);
  }
  if (said.has("degrees")) waves.degrees = said.get("degrees") === "1";
}

// another analysis has another axis and other signals
function forgetState() {
  if (ours()) try { history.replaceState(null, "", location.pathname + location.search); } catch { /* no address of its own */ }
}
