// The live page (emsim view --live): runs as they come, parameters as sliders, what is wrong at its line.
"use strict";

(() => {
  const token = location.hash.slice(1);
  document.body.dataset.live = "";
  const status = made("span", { id: "live", role: "status" }), bar = made("div", { id: "share" });
  const said = made("section", { id: "said", hidden: true }), knobs = made("section", { id: "knobs", hidden: true });
  knobs.setAttribute("aria-label", "parameters");
  $("facts").after(status);
  document.querySelector("header").after(bar, said);
  document.querySelector("main").before(knobs);
  document.body.classList.add("empty");

  function tell(kind, text) {
    status.className = kind;
    status.textContent = text;
  }

  // ---- what the server says, a line of JSON each ----

  async function listen() {
    if (!token) return tell("lost", "open the address that emsim printed, with all that stands behind #");
    for (;;) {
      try {
        const answer = await fetch("/events", { headers: { "X-Emsim-Token": token } });
        if (answer.status === 403) return tell("lost", "this page is of an emsim that has ended: open the address that the new one printed");
        const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();
        let parts = [];
        for (;;) {
          const { value, done } = await reader.read();
          if (done) break;
          parts.push(value);
          if (!value.includes("\n")) continue;
          const lines = parts.join("").split("\n");
          parts = [lines.pop()];
          for (const line of lines) if (line) await take(JSON.parse(line));
        }
      } catch (error) {
        if (!(error instanceof TypeError)) throw error; // that is how fetch says that nobody answers
      }
      tell("lost", "emsim has ended; this page waits for it");
      document.body.classList.add("stale");
      await new Promise((done) => setTimeout(done, 1000));
    }
  }

  async function take(message) {
    if (message.kind === "run") {
      // the equations come later: until then those of the run before keep their place
      message.run.sheets.splice(message.run.sheets[0]?.[0] === "energy" ? 1 : 0, 0, ...explained);
      document.body.classList.remove("empty"); // what is hidden has no width to draw for
      const ghosts = earlier(), first = !window.emsim;
      await show(message.run);
      if (window.emsim) {
        if (first && (message.run.scene || message.run.circuit) && message.run.axisName === "time" && !matchMedia("(prefers-reduced-motion: reduce)").matches) window.emsim.clock.play(true);
        window.emsim.waves.ghosts = ghosts;
        if (ghosts.length) window.emsim.waves.build();
      }
      for (const [name] of explained) $("sheet-" + name).classList.add("before");
    } else if (message.kind === "sheets") await equations(message.sheets);
    else if (message.kind === "state") state(message);
    else if (message.kind === "busy") {
      document.body.classList.toggle("busy", message.share !== null);
      bar.style.width = `${100 * (message.share || 0)}%`;
    }
  }

  // ---- the runs before, in the curves' own colours and paler, as many as are asked for ----

  const KEPT = 6, family = made("input", { type: "checkbox", id: "family" });
  document.querySelector("#waves .tools").append(made("label", { title: `the last ${KEPT} runs stay below the curves` }, family, " earlier runs"));
  family.onchange = () => {
    if (!window.emsim) return;
    window.emsim.waves.ghosts = [];
    window.emsim.waves.build();
  };

  function earlier() {
    const now = window.emsim;
    if (!family.checked || !now) return [];
    return [...now.waves.ghosts, ghostOf(now)].slice(-KEPT);
  }

  // what comes after its run
  let explained = [["equations", "Equations", "<p>The equations are being written.</p>"]];

  async function equations(fresh) {
    explained = await Promise.all(fresh.map(async ([name, title, html]) => [name, title, await unpackedSheet(html)]));
    for (const [name, , html] of explained) {
      const sheet = $("sheet-" + name);
      if (sheet) sheet.innerHTML = html;
      sheet?.classList.remove("before");
    }
  }

  function state(m) {
    const { classList } = document.body;
    classList.toggle("stale", !m.ok && !m.drawn);
    const name = m.deck.split(/[\\/]/).pop(), first = m.lines[0]?.[0];
    if (m.ok) tell("ok", `live \u00b7 ${name} \u00b7 ${written(m.seconds, "s", 3)}`);
    else tell("wrong", first ? `${name}, line ${first}` : name);
    said.hidden = m.ok;
    if (!m.ok) wrong(m, first);
    if (document.title === "emsim") document.title = name;
    parameters(m);
    patience(m);
    source(m);
  }

  // the messages as on the terminal; the deck as it is now, with each message below its line
  function wrong(m, first) {
    const kept = m.drawn ? "the run is shown up to where it came" : "the last good run is shown";
    const text = made("pre", {}, ...m.said.map(([kind, text]) => (kind ? made("span", { className: kind, textContent: text }) : text)));
    const head = made("p", {}, first ? `line ${first} of the deck` : "the deck", $("panels").children.length ? ` \u00b7 ${kept} ` : " ");
    if (first) head.append(made("button", { textContent: "show the line", onclick: () => shown(first) }));
    said.replaceChildren(head, ...mendings(m), text);
    if (code) return;
    if (!$("sheet-deck")) sheets({ sheets: [["deck", "Deck", ""]] });
    $("sheet-deck").innerHTML = m.sheet;
    // the last first: several messages of one line stay in their order
    for (const [line, message] of m.lines.toReversed()) $(`line-${line}`)?.after(made("em", { textContent: message }));
  }

  // ---- the deck, edited here: written to its file, as an editor does ----

  let was = null;
  const editor = made("textarea", { id: "deck-text", spellcheck: false, wrap: "off", hidden: true }), writes = made("button", { textContent: "save", title: "ctrl-s", hidden: true }), edits = made("button", { textContent: "edit" }), told = made("span", { role: "status" });
  editor.setAttribute("aria-label", "the deck's text");
  const offered = made("span"), desk = made("div", { id: "desk" }, edits, writes, offered, told, editor);
  const editing = (on) => { editor.hidden = writes.hidden = !on; edits.textContent = on ? "close" : "edit"; };
  function unfolded() {
    editor.value = was;
    editor.rows = Math.min(40, was.split("\n").length + 2);
    editing(true);
    told.textContent = "";
    editor.focus();
  }
  edits.onclick = () => (editor.hidden ? unfolded() : editing(false));

  // ---- what messages carry to mend the deck: put into the text of the editor, to be looked at and saved ----

  function mendings(m) {
    return m.fixes.map((fix) => made("button", { className: "mend", textContent: `line ${fix.line}: ${fix.label}`, onclick: () => mend(fix) }));
  }

  function mend(fix) {
    if (was === null) return;
    if (code) return void (told.textContent = code.mend(fix) ? "save keeps it" : `line ${fix.line} is another by now`);
    document.querySelector("#tabs [data-sheet=deck]")?.click();
    if (editor.hidden) unfolded();
    const lines = editor.value.split("\n"), start = lines.slice(0, fix.line - 1).reduce((sum, line) => sum + line.length + 1, 0) + fix.col - 1;
    if (editor.value.slice(start, start + fix.old.length) !== fix.old) return void (told.textContent = `line ${fix.line} is another by now`);
    editor.setRangeText(fix.text, start, start + fix.old.length, "select");
    editor.focus();
    told.textContent = "save keeps it";
  }
  writes.onclick = async () => {
    const text = code ? code.text() : editor.value;
    const answer = await fetch("/deck", { method: "POST", headers: { "X-Emsim-Token": token, "Content-Type": "application/json" }, body: JSON.stringify({ text, was }) }).catch(() => null);
    told.textContent = answer?.status === 204 ? "saved" : answer ? await answer.text() : "emsim has ended";
    if (answer?.status === 204) was = text;
    if (code) dirty();
  };
  editor.onkeydown = (e) => {
    if ((e.ctrlKey || e.metaKey) && e.key === "s") { e.preventDefault(); writes.click(); }
  };

  function source(m) {
    if (window.emsimEditor) return coded(m);
    offered.replaceChildren(...mendings(m));
    if (m.source === null || m.source === undefined) return;
    if (editor.hidden || was === null) was = m.source;
    else if (m.source !== was) told.textContent = "the deck's file was changed elsewhere; close and edit again to see it";
    desked();
  }

  // the sheets are made anew with every run
  function desked() {
    const sheet = $("sheet-deck");
    if (!sheet || desk.parentElement === sheet) return;
    sheet.prepend(desk);
    if (held) editor.focus({ preventScroll: true });
  }
  let held = false;
  document.addEventListener("focusin", (e) => (held = e.target === editor));
  new MutationObserver(desked).observe($("sheets"), { childList: true, subtree: true });

  // ---- ... or in the editor at the left, where this emsim has it ----

  let code = null;
  const dirty = () => (writes.disabled = code.text() === was);
  async function helped(what, row, col) {
    const body = JSON.stringify({ what, text: code.text(), row, col });
    const answer = await fetch("/help", { method: "POST", headers: { "X-Emsim-Token": token, "Content-Type": "application/json" }, body }).catch(() => null);
    return answer?.ok ? answer.json() : null;
  }
  function coded(m) {
    const { source } = m;
    if (source === null || source === undefined) return;
    if (!code) {
      const desk = made("div", { id: "text" }), { cards } = JSON.parse($("run").textContent);
      window.bench.edits(made("div", { className: "tools" }, writes, told), desk, said);
      writes.hidden = false;
      code = window.bench.editor = emsimEditor.open(desk, { text: source, cards, changed: (text) => { window.bench.wrote(text); dirty(); }, ask: helped, pointed: (line) => window.bench.pointed(line), saved: () => writes.click() });
      window.bench.wrote(was = source);
      dispatchEvent(new Event("resize"));
    } else if (code.text() === was || code.text() === source) {
      if (code.text() !== source) code.follow(source);
      if (source !== was) told.textContent = "";
      was = source;
    } else if (source !== was) {
      const take = made("button", { textContent: "take it", onclick: () => { was = source; code.follow(source); told.textContent = ""; dirty(); } });
      told.replaceChildren("the deck's file was changed elsewhere ", take);
    }
    if (code.text() === source) code.mark(m.marks);
    dirty();
  }

  function shown(line) {
    if (code) return code.show(line);
    document.querySelector("#tabs [data-sheet=deck]").click();
    $(`line-${line}`)?.scrollIntoView({ block: "center" });
  }

  // ---- parameters ----

  const rows = new Map(), wishes = new Map(), sent = new Map();
  const box = made("div", { className: "knobs", id: "params" }), kept = made("div", { id: "written" });
  // without the page's own value: the command line's (-D), else the deck's
  const text = (p) => (p.given !== null && numberOf(p.given) !== null ? p.given : p.text);
  const fold = made("button", { onclick: () => { box.hidden = !box.hidden; opened(); } });
  const opened = () => { fold.textContent = `${box.hidden ? "\u25b8" : "\u25be"} Parameters`; fold.setAttribute("aria-expanded", !box.hidden); };
  opened();
  // numbers of cards, folded away at first: there may be many
  const cardBox = made("div", { className: "knobs", hidden: true });
  const cardFold = made("button", { onclick: () => { cardBox.hidden = !cardBox.hidden; cardsOpened(); } });
  const cardsOpened = () => { cardFold.textContent = `${cardBox.hidden ? "\u25b8" : "\u25be"} Values`; cardFold.setAttribute("aria-expanded", !cardBox.hidden); };
  cardsOpened();
  knobs.append(made("div", { className: "head" }, fold, cardFold, kept), box, cardBox);

  function parameters(m) {
    const literal = [...m.params, ...m.values].filter((p) => p.literal && numberOf(p.text) !== null), others = m.params.filter((p) => !literal.includes(p));
    if (m.read || !rows.size) {
      for (const [name, row] of rows) if (!literal.some((p) => p.name === name && p.text === row.p.text)) rows.delete(name);
      for (const p of literal) {
        if (rows.has(p.name)) rows.get(p.name).p = p; else rows.set(p.name, knob(p));
      }
      const others_ = others.map((p) => made("div", { className: "computed" }, `${p.shown} = ${p.text} = ${p.value === null ? "?" : +p.value.toPrecision(6)}`));
      const wanted = [...literal.filter((p) => !p.card).map((p) => rows.get(p.name).row), ...others_], cards = literal.filter((p) => p.card).map((p) => rows.get(p.name).row);
      // a row that stays is not moved: it may be in somebody's hand
      for (const [into, all] of [[box, wanted], [cardBox, cards]]) {
        [...into.children].forEach((child) => all.includes(child) || child.remove());
        all.forEach((row, k) => into.children[k] !== row && into.insertBefore(row, into.children[k] || null));
      }
      cardFold.hidden = !cards.length;
      knobs.hidden = false;
      if (!wanted.length) box.replaceChildren(made("p", { className: "computed", textContent: "No .param in this deck. With  .param m=0.2  and  m={m}  on a card, m is a slider here; numbers of cards are below Values." }));
    }
    for (const [name, { p, slider, field, back, row }] of rows) {
      const own = m.set[name];
      row.classList.toggle("set", own !== undefined);
      back.disabled = own === undefined;
      if (wishes.has(name)) continue;
      sent.set(name, own ?? null);
      if (document.activeElement !== field) field.value = own ?? text(p);
      const value = own === undefined ? numberOf(text(p)) : m.read && p.value !== null ? p.value : numberOf(own);
      if (value !== null && !slider.matches(":active")) placeSlider(slider, numberOf(text(p)), value);
    }
    lines(m);
  }

  function knob(p) {
    const slider = made("input", { type: "range", step: "any", title: "double click: as it was" }), field = made("input", { type: "text", value: text(p), spellcheck: false, size: 8 });
    const back = made("button", { textContent: "\u21ba", title: `back to ${text(p)}`, disabled: true });
    slider.setAttribute("aria-label", p.shown);
    field.setAttribute("aria-label", `${p.shown}, as text`);
    back.setAttribute("aria-label", `${p.shown} as in the deck`);
    placeSlider(slider, numberOf(text(p)), numberOf(text(p)));
    const row = made("div", { className: "knob" }, made("label", { textContent: p.shown, title: `${p.file}, line ${p.line}` }), slider, field, back);
    const reset = () => { field.value = text(p); placeSlider(slider, numberOf(text(p)), numberOf(text(p))); wish(p.name, null, true); };
    slider.oninput = () => {
      field.value = spelled(slid(slider), text(p));
      wish(p.name, field.value, false);
    };
    slider.onchange = () => send();
    slider.ondblclick = reset;
    field.onchange = () => { const given = field.value.trim(); if (given) wish(p.name, given, true); else reset(); };
    field.onkeydown = (e) => { if (e.key === "Escape") { field.value = sent.get(p.name) ?? text(p); field.blur(); } };
    back.onclick = reset;
    return { p, row, slider, field, back };
  }

  // ---- wishes: at most one under way while a slider is moved, the newest at once when it rests ----

  let waiting = null, expiry, rest, seconds = 0.1, chain = Promise.resolve();

  function wish(name, value, now) {
    wishes.set(name, value);
    clearTimeout(rest);
    if (now || waiting === null) send(); else rest = setTimeout(send, 250);
  }

  function send() {
    clearTimeout(rest);
    const set = {};
    for (const [name, value] of wishes) if ((sent.get(name) ?? null) !== value) set[name] = value;
    wishes.clear();
    if (!Object.keys(set).length) return;
    for (const name in set) sent.set(name, set[name]);
    const number = (waiting = Math.floor(2 ** 40 * Math.random()));
    clearTimeout(expiry);
    expiry = setTimeout(() => { waiting = null; send(); }, 500 + 3000 * seconds);
    const request = { method: "POST", headers: { "X-Emsim-Token": token, "Content-Type": "application/json" }, body: JSON.stringify({ set, number }) };
    chain = chain.then(() => fetch("/set", request)).catch(() => {}); // whoever listens learns that nobody answers
  }

  function patience(m) {
    if (m.asked !== waiting) return;
    seconds = m.seconds;
    waiting = null;
    clearTimeout(expiry);
    send();
  }

  // ---- what to write in the deck ----

  function lines(m) {
    const places = new Map();
    for (const { p } of rows.values()) {
      if (m.set[p.name] === undefined) continue;
      const key = `${p.file}, line ${p.line}`;
      if (!places.has(key)) places.set(key, []);
      places.get(key).push(p);
    }
    const found = [...places].map(([where, params]) => {
      const { source } = params[0], code = made("code");
      let at = 0;
      for (const p of params.sort((a, b) => a.col - b.col)) {
        code.append(source.slice(at, p.col - 1), made("mark", { textContent: m.set[p.name] }));
        at = p.end - 1;
      }
      code.append(source.slice(at));
      const copy = made("button", { textContent: "copy", onclick: () => navigator.clipboard.writeText(code.textContent).then(() => (copy.textContent = "copied")) });
      // into the file itself, where the lines are the deck's own
      const own = params.every((p) => was?.split("\n")[p.line - 1] === p.source), write = made("button", { textContent: "write", title: "into the deck's file", hidden: !own });
      write.onclick = () => {
        for (const p of [...params].reverse()) mend({ line: p.line, col: p.col, old: source.slice(p.col - 1, p.end - 1), text: m.set[p.name] });
        writes.click();
      };
      return made("div", {}, made("span", { textContent: `to keep it, ${where}:` }), code, copy, write);
    });
    if (found.length) {
      const all = made("button", { textContent: "reset all", onclick: () => { for (const { back } of rows.values()) if (!back.disabled) back.click(); } });
      found.at(-1).append(all);
    }
    kept.replaceChildren(...found);
  }

  listen();
})();
