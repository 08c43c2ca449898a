// The workbench: the deck's text at the left of its run; one light for a line, its part in the circuit and its body in the machine; a
// pane on the whole screen for those who present; letters that grow with the screen.
"use strict";

const WIDE = 2000, OPEN = 1600; // px of a screen: letters grow from here on; there is room for the text too
const PANES = [["deck", "the deck"], ["circuit", "the circuit"], ["machine", "the machine"], ["curves", "the curves"]];

// how large letters and signs are drawn, in parts of their ordinary size
function letters() {
  if (!document.body.classList.contains("present")) return Math.max(1, innerWidth / WIDE);
  return Math.max(1, Math.min(innerWidth / 1200, innerHeight / 720));
}

// how tall the machine may be [px]
function tallest(run) {
  const { present } = document.body.dataset, both = run.circuit && !run.circuit.refused;
  if (present === "machine") return innerHeight - $("transport").offsetHeight - 60 * letters();
  return (both ? 0.46 : 0.68) * innerHeight;
}

class Bench {
  constructor() {
    this.text = made("pre", { className: "deck", tabIndex: 0 });
    this.pane = made("section", { id: "pane", hidden: true }, this.text);
    this.pane.setAttribute("aria-label", "the deck");
    this.button = made("button", { id: "text-too", textContent: "deck", title: "the deck's text beside its run (t)", onclick: () => this.open(this.pane.hidden) });
    this.button.ariaPressed = "false";
    this.shows = made("button", { id: "presents", textContent: "present", title: "one pane on the whole screen (p; 1 deck, 2 circuit, 3 machine, 4 curves)", onclick: () => this.present(this.presents ? "" : "all") });
    $("theme").before(this.button, this.shows);
    document.querySelector("header").after(this.pane);
    this.choices = made("div", { id: "panes" }, ...[...PANES, ["all", "all panes"]].map(([name, title], k) => made("button", { textContent: name, title: `${title} (${(k + 1) % 5})`, value: name, onclick: () => this.present(name) })), made("button", { textContent: "\u2715", title: "back (Esc)", ariaLabel: "end the presentation", onclick: () => this.present("") }));
    this.choices.setAttribute("role", "group");
    this.choices.setAttribute("aria-label", "what is presented");
    document.querySelector("header").append(this.choices);
    document.addEventListener("pointerover", (e) => { const line = e.target.closest?.(".deck > span"); if (line || this.said) { this.light(line ? this.named([...line.parentElement.querySelectorAll(":scope > span")].indexOf(line)) : null); this.said = Boolean(line); } });
    $("machine").addEventListener("pointermove", (e) => {
      const { machine } = window.emsim ?? window.still ?? {};
      if (e.buttons || !machine) return;
      const r = e.target.getBoundingClientRect(), at = [e.clientX - r.left, e.clientY - r.top], body = bodyAt(machine, at, 6);
      this.light(machine.coupling(...at) ?? (body && machine.scene.bodies[body.body].name));
    });
    $("machine").addEventListener("pointerleave", () => this.light(null));
    addEventListener("resize", () => this.sized());
    this.sized();
  }

  // ---- the text ----

  // another text, or none, is in the sheets
  refresh() {
    if (this.edited) return;
    const spans = [...document.querySelectorAll("#sheet-deck .deck > span")];
    this.wrote(spans.map((span) => span.textContent).join("\n"));
    this.text.replaceChildren(...spans.map((span) => made("span", { textContent: span.textContent, className: span.className })));
    this.button.hidden = !spans.length;
    if (this.chosen === undefined && innerWidth >= OPEN) this.open(spans.length > 0, true);
    else if (!spans.length) this.open(false, true);
  }
  open(on, unasked = false) {
    if (this.edited) return;
    if (!unasked) this.chosen = on;
    if (this.pane.hidden !== on) return;
    this.pane.hidden = !on;
    this.button.ariaPressed = String(on);
    document.body.classList.toggle("bench", on);
    dispatchEvent(new Event("resize"));
  }
  // the text is edited, in what these elements are
  edits(...inside) {
    this.edited = this.button.hidden = true;
    this.pane.hidden = false;
    this.pane.replaceChildren(...inside);
    document.body.classList.add("bench");
  }
  // ... and is now another one
  wrote(text) {
    this.lines = text.split("\n");
    this.names = namesOf(this.lines);
  }

  // ---- one light ----

  // of the things that are drawn the one that a line is about
  named(line) {
    const { circuit, machine } = window.emsim ?? window.still ?? {}, { words = [], inside = false } = this.names?.[line] ?? {};
    const parts = circuit?.parts?.map(({ part }) => part.name) ?? [], things = machine ? [...machine.scene.shapes, ...machine.scene.bodies].map((s) => s.name) : [];
    for (const word of words) {
      const found = inside ? parts.find((name) => name.split(".").at(-1) === word && name.includes(".")) : [...parts, ...things].find((name) => name === word);
      if (found) return found;
    }
    return null;
  }
  // a line of the editor, from 1, or none
  pointed(line) { if (line || this.said) this.light(line ? this.named(line - 1) : null); this.said = Boolean(line); }
  light(name) {
    name ??= null;
    if (name === this.lit) return;
    this.lit = name;
    const { circuit, machine } = window.emsim ?? window.still ?? {}, lines = name === null ? [] : (this.names ?? []).flatMap((_, k) => (this.named(k) === name ? [k] : []));
    for (const text of document.querySelectorAll(".deck")) [...text.querySelectorAll(":scope > span")].forEach((span, k) => span.classList.toggle("lit", lines.includes(k)));
    const first = this.text.children[lines[0]];
    if (first && !this.pane.hidden && !this.said && !this.pane.matches(":hover")) this.pane.scrollTop = first.offsetTop - 0.4 * this.pane.clientHeight;
    this.editor?.light(lines.map((k) => k + 1));
    circuit?.light(name);
    machine?.light(name);
  }

  // ---- a pane on the whole screen ----

  get presents() { return document.body.dataset.present ?? ""; }
  present(pane) {
    const { classList, dataset } = document.body;
    if (pane === "deck" && !this.edited && this.button.hidden) return;
    if ((pane === "circuit" && !$("circuit")?.checkVisibility() && !this.presents) || (pane === "machine" && $("stage").hidden)) return;
    classList.toggle("present", Boolean(pane));
    if (pane) dataset.present = pane; else delete dataset.present;
    this.open(pane === "deck" || (!pane && Boolean(this.chosen ?? innerWidth >= OPEN)), true);
    for (const button of this.choices.children) if (button.value) button.ariaPressed = String(button.value === pane);
    scrollTo(0, 0);
    this.sized(true);
  }
  // letters, and what is drawn with them, where the screen or what is on it is another
  sized(anew = false) {
    const size = letters();
    if (size === this.size && !anew) return;
    this.size = size;
    document.documentElement.style.setProperty("--letters", size);
    const { machine, waves, circuit } = window.emsim ?? window.still ?? {};
    machine?.fit();
    machine?.draw();
    circuit?.sized();
    waves?.build();
  }
  key(key) {
    const k = "12340".indexOf(key), wanted = k < 0 ? null : k === 4 ? "all" : PANES[k][0];
    if (wanted) this.present(wanted === this.presents ? "" : wanted);
    else if (key === "p") this.present(this.presents ? "" : "all");
    else if (key === "t") this.button.hidden || this.button.click();
    else if (key === "Escape" && this.presents) this.present("");
    else return false;
    return true;
  }
}

// Of each line the words by which what it describes may be called, and whether it stands in a subcircuit. A line that goes on is
// about what the one before is about.
function namesOf(lines) {
  let inside = 0, last = [];
  return lines.map((line, k) => {
    if (/^\s*\.(subckt|macro|control)\b/i.test(line)) inside++;
    const here = inside > 0;
    if (/^\s*\.(ends|eom|endc)\b/i.test(line)) inside--;
    if (!/^\s*\+/.test(line)) last = k && !/^\s*[.*;]/.test(line) ? line.trim().toLowerCase().split(/[\s=(,]+/).slice(0, 2) : [];
    return { words: last, inside: here };
  });
}

// ---- what is touched in the machine ----

// the body at a place of the canvas: of those that are near the smallest, with the place of it there
function bodyAt(machine, [x, y], near, counts = () => true) {
  const { places } = machine.scene, found = [];
  if (!machine.poses) return null;
  machine.scene.bodies.forEach((_, k) => {
    if (!k || !counts(k)) return;
    const own = places.filter(([place]) => place[0] === k).map(([place, about]) => [machine.project(machine.world(place, machine.poses)), about * machine.scale]);
    if (!own.length) return;
    const hull = hullOf(own.map(([p]) => p)), off = Math.min(farFrom(hull, x, y), ...own.map(([p, r]) => Math.hypot(p[0] - x, p[1] - y) - r));
    if (off > near) return;
    const size = Math.max(...own.map(([p, r]) => Math.hypot(p[0] - own[0][0][0], p[1] - own[0][0][1]) + r));
    const [closest] = own.reduce((a, b) => (Math.hypot(b[0][0] - x, b[0][1] - y) < Math.hypot(a[0][0] - x, a[0][1] - y) ? b : a));
    found.push({ body: k, size, off: Math.max(0, off), deep: closest[2], x, y });
  });
  return found.sort((a, b) => a.off - b.off || a.size - b.size)[0] ?? null;
}

// the corners of the smallest convex polygon about points, in their order (Andrew's monotone chain)
function hullOf(points) {
  const sorted = points.map(([x, y]) => [x, y]).sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const half = (list) => {
    const chain = [];
    for (const p of list) {
      while (chain.length > 1 && turns(chain.at(-2), chain.at(-1), p) <= 0) chain.pop();
      chain.push(p);
    }
    return chain.slice(0, -1);
  };
  return sorted.length < 3 ? sorted : [...half(sorted), ...half(sorted.reverse())];
}
function turns(o, a, b) { return (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]); }

// how far a place lies outside of a convex polygon, 0 within it
function farFrom(hull, x, y) {
  const sides = hull.map((a, k) => [a, hull[(k + 1) % hull.length]]);
  if (hull.length > 2 && sides.every(([a, b]) => turns(a, b, [x, y]) >= 0)) return 0;
  return Math.min(...sides.map(([a, b]) => {
    const dx = b[0] - a[0], dy = b[1] - a[1], f = Math.max(0, Math.min(1, ((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy || 1)));
    return Math.hypot(a[0] + f * dx - x, a[1] + f * dy - y);
  }));
}
