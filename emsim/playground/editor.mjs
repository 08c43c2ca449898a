// The playground's editor: CodeMirror with the colours of decks, marks at lines with what mends them as buttons, and the completion and
// the help of the language server, which a worker answers. build.sh bundles it; outputs/web/playground.js uses it.
import { autocompletion, completionKeymap } from "@codemirror/autocomplete";
import { defaultKeymap, history, historyKeymap, indentWithTab } from "@codemirror/commands";
import { HighlightStyle, StreamLanguage, syntaxHighlighting } from "@codemirror/language";
import { lintGutter, lintKeymap, setDiagnostics } from "@codemirror/lint";
import { EditorState, StateEffect, StateField } from "@codemirror/state";
import {
  Decoration, EditorView, drawSelection, highlightActiveLine, highlightActiveLineGutter, hoverTooltip, keymap, lineNumbers,
} from "@codemirror/view";
import { tags } from "@lezer/highlight";

const KINDS = { card: "class", dot: "keyword", key: "property", word: "constant", function: "function", option: "property", model: "type", param: "variable" };

// `cards`: pattern of a line that is a machine card, its word as the first group, as editor/textmate.py has them
function language(cards) {
  const patterns = cards.map((text) => new RegExp(text.replace("(?i)", ""), "i"));
  const wave = /^(?:pulse|sin|exp|pwl|sffm|am)\b(?=\s*\()/i, number = /^[+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?[a-z\u00b5\u03bc%\u00b0]*(?![\w.])/i;
  function begin(stream, state) {
    const line = stream.string;
    if (!state.titled) { state.titled = true; stream.skipToEnd(); return "heading"; }
    if (stream.match(/^\s*\*.*/)) return "comment";
    if (stream.match(/^\s*\.\w+/)) return "keyword";
    if (stream.match(/^\s*\+/)) return "operator";
    const card = patterns.map((p) => p.exec(line)).find(Boolean);
    if (card) {
      stream.pos = line.search(/\S/) + card[1].length;
      state.named = true;
      return "typeName";
    }
    if (stream.match(/^\s*[a-z][^\s=(){},;"']*/i)) return "variableName";
    return null;
  }
  return StreamLanguage.define({
    name: "deck",
    startState: () => ({ titled: false, named: false }),
    token(stream, state) {
      if (stream.sol()) {
        state.named = false;
        const found = begin(stream, state);
        if (found) return found;
      }
      if (stream.eatSpace()) return null;
      if (state.named && stream.match(/^[^\s=(){},;"']+/)) { state.named = false; return "className"; }
      if (stream.match(/^(?:;|\$ ).*/)) return "comment";
      if (stream.match(wave)) return "atom";
      if (stream.match(/^[a-z_][\w.]*(?=\s*=(?!=))/i)) return "propertyName";
      if (stream.match(/^[a-z_][\w.]*(?=\()/i)) return "atom";
      const before = stream.string[stream.pos - 1];
      if ((!before || !/[\w.#$]/.test(before)) && stream.match(number)) return "number";
      if (stream.match(/^"[^"]*"/)) return "string";
      if (stream.match(/^[\w.#]+/)) return null;
      stream.next();
      return null;
    },
  });
}

const colours = HighlightStyle.define([
  { tag: tags.heading, fontWeight: "600" },
  { tag: tags.comment, color: "var(--soft)" },
  { tag: tags.keyword, color: "var(--word)" },
  { tag: tags.typeName, color: "var(--machine)", fontWeight: "600" },
  { tag: tags.className, color: "var(--machine)" },
  { tag: tags.variableName, color: "var(--part)" },
  { tag: tags.propertyName, color: "var(--key)" },
  { tag: tags.atom, color: "var(--word)" },
  { tag: tags.number, color: "var(--number)" },
  { tag: tags.string, color: "var(--number)" },
]);

function look() {
  const plain = { color: "var(--ink)", backgroundColor: "var(--back)" };
  return EditorView.theme({
    "&": { ...plain, height: "100%", fontSize: "calc(13px * var(--letters, 1))" },
    ".cm-scroller": { fontFamily: "ui-monospace, monospace", lineHeight: "1.5" },
    ".cm-content": { caretColor: "var(--ink)" },
    ".cm-cursor": { borderLeftColor: "var(--ink)" },
    ".cm-gutters": { backgroundColor: "var(--back)", color: "var(--soft)", border: "none" },
    ".cm-activeLine, .cm-activeLineGutter": { backgroundColor: "color-mix(in srgb, var(--accent) 7%, transparent)" },
    "&.cm-focused > .cm-scroller > .cm-selectionLayer .cm-selectionBackground, .cm-selectionBackground": { backgroundColor: "color-mix(in srgb, var(--accent) 25%, transparent)" },
    ".cm-tooltip": { backgroundColor: "var(--panel)", color: "var(--ink)", border: "1px solid var(--line)", borderRadius: "5px", maxWidth: "min(38em, 90vw)" },
    ".cm-tooltip-autocomplete ul li[aria-selected]": { backgroundColor: "var(--accent)", color: "var(--back)" },
    ".cm-lit": { backgroundColor: "color-mix(in srgb, var(--accent) 20%, transparent)" },
    ".cm-diagnosticText": { whiteSpace: "pre-wrap" },
    ".cm-diagnosticAction": { backgroundColor: "var(--accent)", color: "var(--back)" },
    ".cm-help": { padding: ".3em .6em", whiteSpace: "pre-wrap", maxHeight: "40vh", overflow: "auto" },
  });
}

// place of (line from 1, column from 1), within the text as it is now
function placeOf(state, line, col) {
  if (line > state.doc.lines) return state.doc.length;
  const { from, to } = state.doc.line(Math.max(1, line));
  return Math.min(to, from + col - 1);
}

// lines that something outside points at
const lit = StateEffect.define(), lighted = StateField.define({
  create: () => Decoration.none,
  update(found, { changes, effects, state }) {
    const told = effects.find((e) => e.is(lit));
    if (!told) return found.map(changes);
    return Decoration.set(told.value.filter((k) => k <= state.doc.lines).map((k) => Decoration.line({ class: "cm-lit" }).range(state.doc.line(k).from)));
  },
  provide: (field) => EditorView.decorations.from(field),
});

// `changed(text)` after every edit; `ask(what, row, col)` promises what the language server says there; `pointed(line)`: the mouse is
// over that line, or over none; `saved()`: ctrl-s
export function open(parent, { text, cards, changed, ask, pointed = () => {}, saved = null }) {
  const at = (state, pos) => { const line = state.doc.lineAt(pos); return [line.number - 1, pos - line.from]; };
  async function completed(context) {
    const word = context.matchBefore(/[\w.]+/);
    if (!context.explicit && !word && !/[.(={]/.test(context.state.sliceDoc(context.pos - 1, context.pos))) return null;
    const found = await ask("complete", ...at(context.state, context.pos));
    if (!found?.length) return null;
    const own = found.some(({ label }) => label.startsWith(".")) ? word : context.matchBefore(/\w+/);
    const options = found.map(({ kind, label, detail, text, insert }) => ({ label, detail, apply: insert, type: KINDS[kind] ?? "variable", info: text || undefined }));
    return { from: own ? own.from : context.pos, options, validFor: /^[\w.]*$/ };
  }
  const help = hoverTooltip(async (view, pos) => {
    const said = await ask("hover", ...at(view.state, pos));
    return said ? { pos, create: () => ({ dom: Object.assign(document.createElement("div"), { className: "cm-help", textContent: said }) }) } : null;
  }, { hoverTime: 500 });
  const view = new EditorView({
    parent,
    state: EditorState.create({
      doc: text,
      extensions: [
        lineNumbers(), highlightActiveLineGutter(), history(), drawSelection(), highlightActiveLine(), lintGutter(), help, look(),
        language(cards), syntaxHighlighting(colours), autocompletion({ override: [completed], maxRenderedOptions: 60 }),
        lighted,
        EditorView.domEventHandlers({
          mousemove(e, view) { const pos = view.posAtCoords({ x: e.clientX, y: e.clientY }); pointed(pos === null ? null : view.state.doc.lineAt(pos).number); },
          mouseleave() { pointed(null); },
        }),
        keymap.of([...(saved ? [{ key: "Mod-s", run: () => { saved(); return true; } }] : []), ...defaultKeymap, ...historyKeymap, ...completionKeymap, ...lintKeymap, indentWithTab]),
        EditorView.contentAttributes.of({ "aria-label": "the deck's text", spellcheck: "false", autocapitalize: "off" }),
        EditorView.updateListener.of((update) => update.docChanged && changed(update.state.doc.toString())),
      ],
    }),
  });
  return {
    view,
    text: () => view.state.doc.toString(),
    put(whole) { view.dispatch({ changes: { from: 0, to: view.state.doc.length, insert: whole }, selection: { anchor: 0 }, scrollIntoView: true }); },
    // another text, of which only what differs is put in: the cursor stays where it was
    follow(whole) {
      const old = view.state.doc.toString();
      let from = 0, end = 0;
      while (from < Math.min(old.length, whole.length) && old[from] === whole[from]) from++;
      while (end < Math.min(old.length, whole.length) - from && old.at(-1 - end) === whole.at(-1 - end)) end++;
      view.dispatch({ changes: { from, to: old.length - end, insert: whole.slice(from, whole.length - end) } });
    },
    // a line's text, from 1
    line(number, fresh) { const { from, to } = view.state.doc.line(number); view.dispatch({ changes: { from, to, insert: fresh } }); },
    // `marks`: {severity, message, line, col, end, fixes: [{label, line, col, old, text}]}
    mark(marks) {
      const found = marks.map(({ severity, message, line, col, end, fixes }) => {
        const from = placeOf(view.state, line, col), to = Math.max(from, placeOf(view.state, line, end));
        const actions = fixes.map((fix) => ({ name: fix.label, apply: () => mend(view, fix) }));
        return { from, to, severity: severity === "note" ? "info" : severity, message, actions };
      });
      view.dispatch(setDiagnostics(view.state, found.sort((a, b) => a.from - b.from)));
    },
    light(lines) { view.dispatch({ effects: [lit.of(lines), ...(lines.length && !view.dom.matches(":hover") ? [EditorView.scrollIntoView(placeOf(view.state, lines[0], 1), { y: "nearest", yMargin: 60 })] : [])] }); },
    mend: (fix) => mend(view, fix),
    show(line) { view.dispatch({ selection: { anchor: placeOf(view.state, line, 1) }, scrollIntoView: true }); view.focus(); },
  };
}

// false where another text stands there by now
function mend(view, { line, col, old, text }) {
  const from = placeOf(view.state, line, col);
  if (view.state.sliceDoc(from, from + old.length) !== old) return false;
  view.dispatch({ changes: { from, to: from + old.length, insert: text } });
  view.focus();
  return true;
}
