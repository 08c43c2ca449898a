"""The language server: what document, hover and complete know, said in the Language Server Protocol over stdin and stdout.

The only file that imports pygls. Diagnostics are sent a moment after the last keystroke; everything else is answered from
the text as it is.
"""

from __future__ import annotations

import asyncio
from typing import Protocol

from lsprotocol import types as lsp
from pygls.exceptions import JsonRpcInvalidParams
from pygls.lsp.server import LanguageServer
from pygls.uris import from_fs_path

from .complete import complete
from .document import Document
from .hover import definition, hover
from .layout import formatted
from .signature import signature
from .uses import NotRenamed, rename, symbol_under, uses

TYPE_CHECKING = False
if TYPE_CHECKING:
    from pygls.workspace import TextDocument

    from ..diagnostics import Diagnostic, Fix, Span
    from .document import Symbol

PAUSE = 0.15  # of the keyboard, before a deck is read again [s]
SEVERITIES = {
    "error": lsp.DiagnosticSeverity.Error,
    "warning": lsp.DiagnosticSeverity.Warning,
    "note": lsp.DiagnosticSeverity.Information,
}
_K, _S = lsp.CompletionItemKind, lsp.SymbolKind
COMPLETIONS = {
    "card": _K.Class, "dot": _K.Keyword, "key": _K.Property, "word": _K.EnumMember, "function": _K.Function,
    "option": _K.Property, "param": _K.Constant, "func": _K.Function, "subckt": _K.Module, "model": _K.Struct,
    "element": _K.Field, "node": _K.Variable, "body": _K.Class, "joint": _K.Interface, "point": _K.Reference,
}  # fmt: skip
SYMBOLS = {
    "param": _S.Constant, "func": _S.Function, "subckt": _S.Module, "model": _S.Struct, "element": _S.Field,
    "body": _S.Class, "joint": _S.Interface, "point": _S.Key, "card": _S.Object,
}  # fmt: skip


class At(Protocol):
    """Of requests about a place."""

    text_document: lsp.TextDocumentIdentifier
    position: lsp.Position


class Decks(LanguageServer):
    """The open decks by their address."""

    def __init__(self, version: str) -> None:
        super().__init__("emsim", version)
        self.known: dict[str, tuple[int | None, Document]] = {}
        self.waiting: dict[str, asyncio.Task[None]] = {}

    def open(self, uri: str) -> Document:
        """The deck of a text; read anew where the text has changed."""
        text = self.workspace.get_text_document(uri)
        before = self.known.get(uri)
        if before is None or before[0] != text.version:
            source = text.source.replace("\r\n", "\n").replace("\r", "\n")
            document = Document(source, text.path, before[1] if before else None)
            self.known[uri] = (text.version, document)
        return self.known[uri][1]

    def text(self, uri: str) -> TextDocument:
        return self.workspace.get_text_document(uri)

    def place(self, params: At) -> tuple[Document, int, int]:
        uri = params.text_document.uri
        document, text = self.open(uri), self.text(uri)
        at = text.position_codec.position_from_client_units(document.lines, params.position)
        return document, at.line, at.character

    def range_of(self, uri: str, span: Span) -> lsp.Range:
        """A span of any file in the client's units; at least one character wide where there is one."""
        lines = [span.file.text_line(span.line)]
        codec = self.text(uri).position_codec
        first, last = (
            codec.position_to_client_units(lines, lsp.Position(0, max(0, min(col - 1, len(lines[0])))))
            for col in (span.col, max(span.end, span.col + 1))
        )
        return lsp.Range(
            lsp.Position(span.line - 1, first.character), lsp.Position(span.line - 1, last.character)
        )

    def columns(self, uri: str, row: int, start: int, end: int) -> lsp.Range:
        """A stretch of a row of the open text, in the client's units."""
        text = self.text(uri)
        lines = self.open(uri).lines
        places = (
            text.position_codec.position_to_client_units(lines, lsp.Position(row, c)) for c in (start, end)
        )
        return lsp.Range(*places)

    # ---- diagnostics ----

    async def soon(self, uri: str) -> None:
        await asyncio.sleep(PAUSE)
        self.publish(uri)

    def publish(self, uri: str) -> None:
        document = self.open(uri)
        found = [self.diagnostic(uri, document, d) for d in document.diagnostics]
        version = self.text(uri).version
        self.text_document_publish_diagnostics(lsp.PublishDiagnosticsParams(uri, found, version))

    def diagnostic(self, uri: str, document: Document, d: Diagnostic) -> lsp.Diagnostic:
        """What is wrong in an included file stands at the line that includes it."""
        span, message = d.span, d.message
        related = [
            lsp.DiagnosticRelatedInformation(self.location(uri, s), text) for s, text in d.labels if text
        ]
        while span is not None and span.file is not document.file:
            related.insert(0, lsp.DiagnosticRelatedInformation(self.location(uri, span), d.message))
            message = f"{span.file.name}:{span.line}: {d.message}"
            span = span.file.included_from
        if d.hint:
            message += f"\nhelp: {d.hint}"
        where = (
            lsp.Range(lsp.Position(0, 0), lsp.Position(0, 0)) if span is None else self.range_of(uri, span)
        )
        return lsp.Diagnostic(
            where,
            message,
            severity=SEVERITIES[d.severity],
            code=d.code,
            source="emsim",
            related_information=related,
        )

    def actions(self, uri: str, where: lsp.Range) -> list[lsp.CodeAction]:
        """What mends the messages that stand on the lines of a range; the edits are the messages' own (`Diagnostic.fixes`)."""
        document = self.open(uri)
        found = []
        for d in document.diagnostics:
            said = self.diagnostic(uri, document, d)
            if (
                d.fixes
                and said.range.start.line <= where.end.line
                and said.range.end.line >= where.start.line
            ):
                found += [self.action(uri, said, fix) for fix in d.fixes]
        return found

    def action(self, uri: str, said: lsp.Diagnostic, fix: Fix) -> lsp.CodeAction:
        place = self.location(uri, fix.span)
        if fix.span.end == fix.span.col:
            place.range.end = place.range.start  # it is put in before what stands there
        edit = lsp.WorkspaceEdit(changes={place.uri: [lsp.TextEdit(place.range, fix.text)]})
        return lsp.CodeAction(fix.label, kind=lsp.CodeActionKind.QuickFix, diagnostics=[said], edit=edit)

    def location(self, uri: str, span: Span) -> lsp.Location:
        known = self.known.get(uri)
        if known is None or span.file is not known[1].file:
            uri_of_file = from_fs_path(span.file.path) if span.file.path else None
            return lsp.Location(uri_of_file or uri, self.range_of(uri, span))
        return lsp.Location(uri, self.range_of(uri, span))


def make(version: str) -> Decks:
    """The server with its features; `start_io()` runs it."""
    server = Decks(version)

    @server.feature(lsp.TEXT_DOCUMENT_DID_OPEN)
    def did_open(ls: Decks, params: lsp.DidOpenTextDocumentParams) -> None:
        ls.publish(params.text_document.uri)

    @server.feature(lsp.TEXT_DOCUMENT_DID_CHANGE)
    async def did_change(ls: Decks, params: lsp.DidChangeTextDocumentParams) -> None:
        uri = params.text_document.uri
        if uri in ls.waiting:
            ls.waiting[uri].cancel()
        ls.waiting[uri] = asyncio.create_task(ls.soon(uri))

    @server.feature(lsp.TEXT_DOCUMENT_DID_SAVE)
    def did_save(ls: Decks, params: lsp.DidSaveTextDocumentParams) -> None:
        # a file that others include may have changed
        for uri in list(ls.known):
            del ls.known[uri]
            ls.publish(uri)

    @server.feature(lsp.TEXT_DOCUMENT_DID_CLOSE)
    def did_close(ls: Decks, params: lsp.DidCloseTextDocumentParams) -> None:
        uri = params.text_document.uri
        ls.known.pop(uri, None)
        if (task := ls.waiting.pop(uri, None)) is not None:
            task.cancel()
        ls.text_document_publish_diagnostics(lsp.PublishDiagnosticsParams(uri, []))

    @server.feature(lsp.TEXT_DOCUMENT_HOVER)
    def on_hover(ls: Decks, params: lsp.HoverParams) -> lsp.Hover | None:
        said = hover(*ls.place(params))
        return None if said is None else lsp.Hover(lsp.MarkupContent(lsp.MarkupKind.Markdown, said))

    @server.feature(
        lsp.TEXT_DOCUMENT_COMPLETION, lsp.CompletionOptions(trigger_characters=[".", "(", "=", "{"])
    )
    def on_completion(ls: Decks, params: lsp.CompletionParams) -> lsp.CompletionList:
        items = [
            lsp.CompletionItem(
                item.label, kind=COMPLETIONS.get(item.kind), detail=item.detail or None,
                documentation=lsp.MarkupContent(lsp.MarkupKind.Markdown, item.text) if item.text else None,
                insert_text=item.insert,
            )
            for item in complete(*ls.place(params))
        ]  # fmt: skip
        return lsp.CompletionList(is_incomplete=False, items=items)

    @server.feature(lsp.TEXT_DOCUMENT_DEFINITION)
    def on_definition(ls: Decks, params: lsp.DefinitionParams) -> lsp.Location | None:
        symbol = definition(*ls.place(params))
        return None if symbol is None else ls.location(params.text_document.uri, symbol.span)

    @server.feature(
        lsp.TEXT_DOCUMENT_CODE_ACTION, lsp.CodeActionOptions(code_action_kinds=[lsp.CodeActionKind.QuickFix])
    )
    def on_code_action(ls: Decks, params: lsp.CodeActionParams) -> list[lsp.CodeAction]:
        return ls.actions(params.text_document.uri, params.range)

    @server.feature(lsp.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    def on_symbols(ls: Decks, params: lsp.DocumentSymbolParams) -> list[lsp.DocumentSymbol]:
        return outline(ls, params.text_document.uri)

    @server.feature(lsp.TEXT_DOCUMENT_FORMATTING)
    def on_formatting(ls: Decks, params: lsp.DocumentFormattingParams) -> list[lsp.TextEdit]:
        document = ls.open(params.text_document.uri)
        new = formatted(document.file.text)
        if new == document.file.text:
            return []
        end = lsp.Position(len(document.lines), 0)
        return [lsp.TextEdit(lsp.Range(lsp.Position(0, 0), end), new)]

    _names(server)
    return server


def _names(server: Decks) -> None:
    """Features of names and of what they take."""

    @server.feature(lsp.TEXT_DOCUMENT_REFERENCES)
    def on_references(ls: Decks, params: lsp.ReferenceParams) -> list[lsp.Location]:
        document, row, col = ls.place(params)
        uri, symbol = params.text_document.uri, symbol_under(document, row, col)
        found = [lsp.Location(uri, ls.columns(uri, *use)) for use in uses(document, row, col)]
        if symbol is None or params.context.include_declaration:
            return found
        given = ls.location(uri, symbol.span)
        return [place for place in found if place != given]

    @server.feature(lsp.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT)
    def on_highlight(ls: Decks, params: lsp.DocumentHighlightParams) -> list[lsp.DocumentHighlight]:
        document, row, col = ls.place(params)
        uri = params.text_document.uri
        return [lsp.DocumentHighlight(ls.columns(uri, *use)) for use in uses(document, row, col)]

    @server.feature(lsp.TEXT_DOCUMENT_PREPARE_RENAME)
    def on_prepare_rename(ls: Decks, params: lsp.PrepareRenameParams) -> lsp.Range | None:
        document, row, col = ls.place(params)
        here = (u for u in uses(document, row, col) if u[0] == row and u[1] <= col <= u[2])
        return next((ls.columns(params.text_document.uri, *use) for use in here), None)

    @server.feature(lsp.TEXT_DOCUMENT_RENAME, lsp.RenameOptions(prepare_provider=True))
    def on_rename(ls: Decks, params: lsp.RenameParams) -> lsp.WorkspaceEdit:
        uri = params.text_document.uri
        try:
            found = rename(*ls.place(params), params.new_name)
        except NotRenamed as error:
            raise JsonRpcInvalidParams(str(error)) from None
        edits = [lsp.TextEdit(ls.columns(uri, *use), params.new_name) for use in found]
        return lsp.WorkspaceEdit(changes={uri: edits})

    @server.feature(
        lsp.TEXT_DOCUMENT_SIGNATURE_HELP, lsp.SignatureHelpOptions(trigger_characters=["(", ",", " "])
    )
    def on_signature(ls: Decks, params: lsp.SignatureHelpParams) -> lsp.SignatureHelp | None:
        found = signature(*ls.place(params))
        if found is None:
            return None
        about = [found.about if k == found.active else None for k in range(len(found.parts))]
        parts = [
            lsp.ParameterInformation(p, said or None) for p, said in zip(found.parts, about, strict=True)
        ]
        told = lsp.SignatureInformation(found.label, documentation=found.text, parameters=parts)
        return lsp.SignatureHelp([told], 0, found.active if found.active >= 0 else None)


def outline(ls: Decks, uri: str) -> list[lsp.DocumentSymbol]:
    """Names of the deck's own file, those of a subcircuit below it."""
    document = ls.open(uri)
    top: list[lsp.DocumentSymbol] = []
    inner: dict[tuple[str, ...], lsp.DocumentSymbol] = {}
    for symbol in document.symbols:
        if symbol.kind not in SYMBOLS or symbol.span.file is not document.file:
            continue
        entry = _entry(ls, uri, symbol)
        if symbol.kind == "subckt":
            inner[(*symbol.scope, symbol.name)] = entry
        above = inner.get(symbol.scope)
        if above is None:
            top.append(entry)
        else:
            above.children = [*(above.children or ()), entry]
            above.range = lsp.Range(above.range.start, max(above.range.end, entry.range.end))
    return top


def _entry(ls: Decks, uri: str, symbol: Symbol) -> lsp.DocumentSymbol:
    where = ls.range_of(uri, symbol.span)
    line = symbol.span.file.text_line(symbol.span.line)
    whole = lsp.Range(
        lsp.Position(where.start.line, 0), lsp.Position(where.start.line, max(len(line), where.end.character))
    )
    detail = getattr(symbol.card, "kind", symbol.kind)
    return lsp.DocumentSymbol(symbol.name, SYMBOLS[symbol.kind], whole, where, detail=detail)
