// The client of `emsim lsp` for VS Code: JSON-RPC over the server's stdin and stdout, and a provider for each feature.
// Written out instead of taken from a package, so that the folder runs as it is.
"use strict";
const vscode = require("vscode");
const { spawn } = require("child_process");

const LANGUAGE = { language: "emsim" };

/** One server process. Requests are numbered promises; a server that ends rejects those that wait. */
class Server {
  constructor(command, folder, onNotification, onEnd) {
    this.waiting = new Map();
    this.number = 0;
    this.data = Buffer.alloc(0);
    this.onNotification = onNotification;
    this.process = spawn(command, ["lsp"], { cwd: folder, stdio: ["pipe", "pipe", "pipe"] });
    this.said = "";
    this.process.stderr.on("data", (data) => { this.said = (this.said + data).slice(-2000); });
    this.process.stdout.on("data", (data) => this.receive(data));
    this.process.stdin.on("error", () => {});
    const end = (why) => {
      for (const { reject } of this.waiting.values()) reject(new Error(why));
      this.waiting.clear();
      if (this.ended) return;
      this.ended = true;
      onEnd(why);
    };
    this.process.on("error", (error) => end(`${command}: ${error.message}`));
    this.process.on("exit", (code) => end(this.said || `${command} lsp ended with code ${code}`));
  }

  receive(data) {
    this.data = Buffer.concat([this.data, data]);
    for (;;) {
      const head = this.data.indexOf("\r\n\r\n");
      if (head < 0) return;
      const length = Number(/content-length: *(\d+)/i.exec(this.data.toString("latin1", 0, head))[1]);
      if (this.data.length < head + 4 + length) return;
      const message = JSON.parse(this.data.toString("utf8", head + 4, head + 4 + length));
      this.data = this.data.subarray(head + 4 + length);
      this.take(message);
    }
  }

  take(message) {
    if (message.method !== undefined && message.id !== undefined) {
      // what a server may ask of a client is optional
      this.write({ id: message.id, result: null });
    } else if (message.method !== undefined) {
      this.onNotification(message.method, message.params);
    } else if (this.waiting.has(message.id)) {
      const { resolve, reject } = this.waiting.get(message.id);
      this.waiting.delete(message.id);
      if (message.error) reject(new Error(message.error.message));
      else resolve(message.result);
    }
  }

  write(message) {
    if (this.ended) return;
    const body = Buffer.from(JSON.stringify({ jsonrpc: "2.0", ...message }), "utf8");
    this.process.stdin.write(`Content-Length: ${body.length}\r\n\r\n`);
    this.process.stdin.write(body);
  }

  tell(method, params) { this.write({ method, params }); }

  ask(method, params) {
    if (this.ended) return Promise.reject(new Error("the server has ended"));
    const id = ++this.number;
    return new Promise((resolve, reject) => {
      this.waiting.set(id, { resolve, reject });
      this.write({ id, method, params });
    });
  }

  /** Asks it to end, and sees to it. */
  async stop() {
    this.stopping = true;
    const patience = setTimeout(() => this.process.kill(), 2000);
    const gone = this.ended ? null : new Promise((resolve) => this.process.on("exit", resolve));
    await this.ask("shutdown", null).then(() => this.tell("exit", null), () => this.process.kill());
    await gone;
    clearTimeout(patience);
  }
}

// ---- from the protocol to VS Code; both count lines and UTF-16 units from 0 ----

const position = (p) => new vscode.Position(p.line, p.character);
const range = (r) => new vscode.Range(position(r.start), position(r.end));
const location = (l) => new vscode.Location(vscode.Uri.parse(l.uri), range(l.range));

function diagnostic(d) {
  // the protocol's severities begin with 1, VS Code's with 0
  const found = new vscode.Diagnostic(range(d.range), d.message, d.severity - 1);
  found.code = d.code;
  found.source = d.source;
  found.relatedInformation = (d.relatedInformation || []).map(
    (r) => new vscode.DiagnosticRelatedInformation(location(r.location), r.message));
  return found;
}

function completion(item) {
  const found = new vscode.CompletionItem(item.label, item.kind - 1);
  found.detail = item.detail;
  found.insertText = item.insertText;
  if (item.documentation) found.documentation = new vscode.MarkdownString(item.documentation.value);
  return found;
}

function symbol(s) {
  const found = new vscode.DocumentSymbol(s.name, s.detail || "", s.kind - 1, range(s.range), range(s.selectionRange));
  found.children = (s.children || []).map(symbol);
  return found;
}

// ---- the extension ----

let server = null;
let diagnostics = null;
const isDeck = (document) => document.languageId === "emsim";
const folder = () => (vscode.workspace.workspaceFolders || []).map((f) => f.uri.fsPath)[0];

function command() {
  const set = vscode.workspace.getConfiguration("emsim").get("command") || "emsim";
  return set.replace("${workspaceFolder}", folder() || ".");
}

async function start() {
  const own = new Server(command(), folder(), (method, params) => {
    if (method === "textDocument/publishDiagnostics") {
      diagnostics.set(vscode.Uri.parse(params.uri), params.diagnostics.map(diagnostic));
    }
  }, (why) => {
    if (server === own) server = null;
    if (!own.stopping) vscode.window.showErrorMessage(`emsim: ${why.trim()}`);
  });
  server = own;
  const capabilities = { textDocument: { publishDiagnostics: { relatedInformation: true } } };
  const root = folder() ? vscode.Uri.file(folder()).toString() : null;
  try {
    await own.ask("initialize", { processId: process.pid, rootUri: root, capabilities });
  } catch (error) {
    return; // said by onEnd
  }
  own.tell("initialized", {});
  vscode.workspace.textDocuments.forEach(opened);
}

function opened(document) {
  if (!server || !isDeck(document)) return;
  const { version } = document;
  const textDocument = { uri: document.uri.toString(), languageId: "emsim", version, text: document.getText() };
  server.tell("textDocument/didOpen", { textDocument });
}

function changed({ document, contentChanges }) {
  if (!server || !isDeck(document) || !contentChanges.length) return;
  const textDocument = { uri: document.uri.toString(), version: document.version };
  server.tell("textDocument/didChange", { textDocument, contentChanges: [{ text: document.getText() }] });
}

function told(method) {
  return (document) => {
    if (server && isDeck(document)) server.tell(method, { textDocument: { uri: document.uri.toString() } });
  };
}

/** A provider's answer: what the server says, made into VS Code's own; nothing while there is no server. */
function asked(method, convert) {
  return async (document, at) => {
    if (!server) return undefined;
    const params = { textDocument: { uri: document.uri.toString() } };
    if (at && at.line !== undefined) params.position = { line: at.line, character: at.character };
    if (method === "textDocument/formatting") params.options = { tabSize: 2, insertSpaces: true };
    const found = await server.ask(method, params).catch(() => null);
    return found === null ? undefined : convert(found);
  };
}

function view() {
  const editor = vscode.window.activeTextEditor;
  if (!editor || !isDeck(editor.document)) return;
  spawn(command(), ["view", editor.document.uri.fsPath], { cwd: folder(), stdio: "ignore", detached: true })
    .on("error", (error) => vscode.window.showErrorMessage(`emsim: ${error.message}`)).unref();
}

async function restart() {
  const old = server;
  server = null;
  if (old) await old.stop();
  await start();
}

async function activate(context) {
  const { languages, workspace, commands } = vscode;
  diagnostics = languages.createDiagnosticCollection("emsim");
  const hover = (h) => new vscode.Hover(new vscode.MarkdownString(h.contents.value));
  const edits = (list) => list.map((e) => new vscode.TextEdit(range(e.range), e.newText));
  context.subscriptions.push(
    diagnostics,
    workspace.onDidOpenTextDocument(opened),
    workspace.onDidChangeTextDocument(changed),
    workspace.onDidSaveTextDocument(told("textDocument/didSave")),
    workspace.onDidCloseTextDocument(told("textDocument/didClose")),
    languages.registerHoverProvider(LANGUAGE, { provideHover: asked("textDocument/hover", hover) }),
    languages.registerCompletionItemProvider(LANGUAGE, {
      provideCompletionItems: asked("textDocument/completion", (list) => list.items.map(completion)),
    }, ".", "(", "=", "{"),
    languages.registerDefinitionProvider(LANGUAGE, { provideDefinition: asked("textDocument/definition", location) }),
    languages.registerDocumentSymbolProvider(LANGUAGE, {
      provideDocumentSymbols: asked("textDocument/documentSymbol", (list) => list.map(symbol)),
    }),
    languages.registerDocumentFormattingEditProvider(LANGUAGE, {
      provideDocumentFormattingEdits: asked("textDocument/formatting", edits),
    }),
    commands.registerCommand("emsim.view", view),
    commands.registerCommand("emsim.restart", restart),
  );
  if (workspace.isTrusted !== false) await start();
  else context.subscriptions.push(workspace.onDidGrantWorkspaceTrust(start));
}

async function deactivate() {
  if (server) await server.stop();
}

module.exports = { activate, deactivate };
