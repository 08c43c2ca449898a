// Runs the extension in node, with a stand-in for VS Code's own module, against the real server. argv: emsim, deck.
"use strict";
const Module = require("module");
const fs = require("fs");
const path = require("path");
const { pathToFileURL, fileURLToPath } = require("url");

class Plain { constructor(...args) { this.args = args; } }
const named = (...names) => Object.fromEntries(names.map((n) => [n, class extends Plain {}]));
const [, , extension, program, deck] = process.argv;
const providers = {}, listeners = {}, shown = [], errors = [], commands = {};
const uri = (text) => ({ toString: () => text, fsPath: text.startsWith("file:") ? fileURLToPath(text) : text });
const document = {
  languageId: "emsim", version: 1, text: fs.readFileSync(deck, "utf8"),
  uri: uri(pathToFileURL(deck).toString()), getText() { return this.text; },
};
const provider = (name) => (_, object) => { providers[name] = Object.values(object)[0]; return {}; };
const event = (name) => (listener) => { listeners[name] = listener; return {}; };
const vscode = {
  ...named("Hover", "MarkdownString", "Location", "DiagnosticRelatedInformation", "TextEdit", "DocumentSymbol"),
  Position: class { constructor(line, character) { Object.assign(this, { line, character }); } },
  Range: class { constructor(start, end) { Object.assign(this, { start, end }); } },
  Diagnostic: class { constructor(range, message, severity) { Object.assign(this, { range, message, severity }); } },
  CompletionItem: class { constructor(label, kind) { Object.assign(this, { label, kind }); } },
  Uri: { parse: uri, file: (name) => uri(pathToFileURL(name).toString()) },
  languages: {
    createDiagnosticCollection: () => ({ set: (_, list) => shown.push(list) }),
    registerHoverProvider: provider("hover"), registerCompletionItemProvider: provider("completion"),
    registerDefinitionProvider: provider("definition"), registerDocumentSymbolProvider: provider("symbols"),
    registerDocumentFormattingEditProvider: provider("formatting"),
  },
  workspace: {
    textDocuments: [document], workspaceFolders: [{ uri: uri(pathToFileURL(path.dirname(deck)).toString()) }],
    getConfiguration: () => ({ get: () => program }),
    onDidOpenTextDocument: event("open"), onDidChangeTextDocument: event("change"),
    onDidSaveTextDocument: event("save"), onDidCloseTextDocument: event("close"),
  },
  window: { showErrorMessage: (text) => errors.push(text) },
  commands: { registerCommand: (name, run) => { commands[name] = run; return {}; } },
};
const load = Module._load;
Module._load = (name, ...rest) => (name === "vscode" ? vscode : load(name, ...rest));
const client = require(extension);
const until = async (done) => {
  for (let k = 0; k < 600 && !done(); k++) await new Promise((resolve) => setTimeout(resolve, 100));
};
const change = async (text) => {
  const before = shown.length;
  Object.assign(document, { text, version: document.version + 1 });
  listeners.change({ document, contentChanges: [{}] });
  await until(() => shown.length > before || errors.length);
  return shown[shown.length - 1];
};

(async () => {
  const found = {};
  await client.activate({ subscriptions: [] });
  await until(() => shown.length || errors.length);
  found.errors = [...errors];
  if (!errors.length) {
    const text = document.text;
    const at = (mark) => {
      const row = text.split("\n").findIndex((line) => line.includes(mark));
      return new vscode.Position(row, text.split("\n")[row].indexOf(mark));
    };
    found.first = shown[0];
    found.wrong = await change(text.replace("hinge k", "hnge k"));
    found.right = await change(text);
    found.hover = (await providers.hover(document, at("MOTOR"))).args[0].args[0];
    found.nothing = await providers.hover(document, new vscode.Position(0, 0));
    found.definition = (await providers.definition(document, at("hinge k"))).args[1].start.line;
    found.completion = (await providers.completion(document, at("hinge k"))).map((item) => item.label);
    found.symbols = (await providers.symbols(document)).map((symbol) => symbol.args[0]);
    found.edits = (await providers.formatting(document)).map((edit) => edit.args[1]);
    const before = shown.length;
    await commands["emsim.restart"]();
    await until(() => shown.length > before);
    found.again = shown[shown.length - 1];
  }
  await client.deactivate();
  found.errors = errors;
  console.log(JSON.stringify(found));
})();
