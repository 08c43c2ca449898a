"""`emsim lsp` as an editor meets it: the real process, JSON-RPC over its stdin and stdout."""

from __future__ import annotations

import json
import queue
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from emsim.cli import main

DECK = """a servo
.param gain=8 limit={gain+4}
.gravity 9.81
BODY   arm    shape=rod(0.30) m=0.20
JOINT  hinge  0 arm pin zero=-90deg damp=2m
MOTOR  m1     drive 0 hinge kt=20m r=2 l=1m j=2u gear=30
Vset   set    0 1.5
Bamp   drive 0 V={min(max(gain*v(set), -limit), limit)}
.subckt filter in out
R1 in out 1k
C1 out 0 1u
.ends
Xf set out filter
D1 out 0 dm
.model dm D(is=1n tt=2n)
.tran 1m 1
.print tran angle(hinge) v(out)
.end
"""


class Editor:
    """A client: numbered requests, notifications, and the diagnostics that come by themselves."""

    def __init__(self, folder: Path) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "emsim", "lsp"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, cwd=folder
        )
        self.answers: queue.Queue[dict] = queue.Queue()
        self.published: queue.Queue[dict] = queue.Queue()
        self.number, self.version = 0, 1
        threading.Thread(target=self.listen, daemon=True).start()
        self.uri = (folder / "deck.cir").as_uri()
        root = {"processId": None, "rootUri": folder.as_uri(), "capabilities": {}}
        self.abilities = self.ask("initialize", root)["capabilities"]
        self.tell("initialized", {})

    def listen(self) -> None:
        assert self.process.stdout is not None
        while header := self.process.stdout.readline():
            length = int(header.split(b":")[1])
            while self.process.stdout.readline().strip():
                pass
            message = json.loads(self.process.stdout.read(length))
            if message.get("method") == "textDocument/publishDiagnostics":
                self.published.put(message["params"])
            elif "id" in message:
                self.answers.put(message)
        # the server has gone: nobody need wait
        self.answers.put({"id": None, "error": "the server ended"})
        self.published.put({"diagnostics": [{"message": "the server ended"}]})

    def send(self, **message: object) -> None:
        body = json.dumps({"jsonrpc": "2.0", **message}).encode()
        assert self.process.stdin is not None
        self.process.stdin.write(b"Content-Length: %d\r\n\r\n%s" % (len(body), body))
        self.process.stdin.flush()

    def next(self) -> int:
        """The next version of the text."""
        self.version += 1
        return self.version

    def tell(self, method: str, params: object) -> None:
        self.send(method=method, params=params)

    def ask(self, method: str, params: object):
        self.number += 1
        self.send(id=self.number, method=method, params=params)
        answer = self.answers.get(timeout=60)
        assert answer["id"] == self.number and "error" not in answer, answer
        return answer["result"]

    def open(self, text: str) -> list[dict]:
        document = {"uri": self.uri, "languageId": "emsim", "version": 1, "text": text}
        self.tell("textDocument/didOpen", {"textDocument": document})
        return self.diagnostics()

    def replace(self, text: str, version: int) -> list[dict]:
        changes = {"textDocument": {"uri": self.uri, "version": version}, "contentChanges": [{"text": text}]}
        self.tell("textDocument/didChange", changes)
        return self.diagnostics()

    def diagnostics(self) -> list[dict]:
        return self.published.get(timeout=60)["diagnostics"]

    def at(self, method: str, text: str, mark: str, inside: int = 0):
        """A request about the place where `mark` begins in the text."""
        row, line = next((k, line) for k, line in enumerate(text.split("\n")) if mark in line)
        place = {"line": row, "character": line.index(mark) + inside}
        return self.ask(method, {"textDocument": {"uri": self.uri}, "position": place})

    def hover(self, text: str, mark: str, inside: int = 0) -> str:
        found = self.at("textDocument/hover", text, mark, inside)
        return "" if found is None else found["contents"]["value"]

    def close(self) -> int:
        self.ask("shutdown", None)
        self.tell("exit", None)
        return self.process.wait(timeout=60)


@pytest.fixture(scope="module")
def editor(tmp_path_factory):
    editor = Editor(tmp_path_factory.mktemp("editor"))
    assert editor.open(DECK) == []
    yield editor
    assert editor.close() == 0


def test_what_it_offers(editor):
    offered = editor.abilities
    for feature in ("hover", "definition", "documentSymbol", "documentFormatting", "completion"):
        assert offered[f"{feature}Provider"]


WRONG = {
    "machine": DECK.replace("JOINT  hinge  0 arm pin", "JOINT  hinge  0 amr pin"),
    "text": DECK.replace("C1 out 0 1u", "C1 out 0").replace("1.5\n", "{nix}\n"),
    "notes": DECK.replace(".tran 1m 1", ".meas tran x max v(out)\nM1 a b c d e"),
    "right": DECK,
}


@pytest.mark.parametrize("name", WRONG)
def test_diagnostics_are_those_of_the_command_line(name, editor, capsys, scratch):
    found = editor.replace(WRONG[name], editor.next())
    (scratch / "wrong.cir").write_text(WRONG[name])
    main(["check", "wrong.cir", "--json"])
    told = json.loads(capsys.readouterr().out)["diagnostics"]
    assert len(found) == len(told) and bool(told) == (name != "right")
    for a, b in zip(found, told, strict=True):
        assert (a["code"], a["source"]) == (b["code"], "emsim") and a["message"].startswith(b["message"])
        assert a["severity"] == {"error": 1, "warning": 2, "note": 3}[b["severity"]]
        assert b["hint"] is None or b["hint"] in a["message"]
        start, end = a["range"]["start"], a["range"]["end"]
        assert (start["line"] + 1, start["character"] + 1) == (b["span"]["line"], b["span"]["col"])
        assert end["character"] + 1 == max(b["span"]["end"], b["span"]["col"] + 1)
    assert editor.replace(DECK, editor.next()) == []


def test_only_the_last_of_many_keystrokes_is_answered(editor):
    changes = {
        "textDocument": {"uri": editor.uri, "version": editor.next()},
        "contentChanges": [{"text": "t\nR1 a\n"}],
    }
    editor.tell("textDocument/didChange", changes)
    assert editor.replace(DECK, editor.next()) == []
    assert editor.published.empty()


@pytest.mark.parametrize(
    ("mark", "inside", "parts"),
    [
        ("MOTOR  m1", 0, ["direct-current motor", "MOTOR name n+ n- joint kt=", "| `kt` | N m/A"]),
        ("kt=20m", 0, ["**MOTOR kt=** [N m/A", "torque per ampere"]),
        ("20m r", 1, ["`20m` is 0.02 N m/A"]),
        ("-90deg", 2, ["is -1.5707963"]),
        ("limit={gain", 0, ["parameter", "= {gain+4}", "= 12"]),
        ("gain*v", 1, ["parameter = 8"]),
        ("arm pin", 1, ["BODY", "`m` = 0.2 kg"]),
        ("hinge kt", 0, ["JOINT", "terminals: 0 arm pin", "at the start: angle(hinge) = 0 rad"]),
        ("drive 0 hinge", 0, ["node", "at the start: v(drive) = 12 V"]),
        ("v(set)", 2, ["at the start: v(set) = 1.5 V"]),
        ("dm", 0, [".model d is=1e-09 tt=2e-09"]),
        ("tt=2n", 0, ["**tt=** [s] — transit time"]),
        ("out filter", 4, ["subcircuit", ".subckt filter in out"]),
        ("R1 in", 0, ["resistor of subcircuit filter", "between in out"]),
        ("Vset", 0, ["voltage source", "at the start: i(vset) = "]),
        ("angle(", 0, ["**angle(pin)", "[rad]"]),
        ("max(", 0, ["max(x,y,..)", "the greatest"]),
        (".tran", 0, [".tran tstep tstop"]),
    ],
)
def test_hover(editor, mark, inside, parts):
    said = editor.hover(DECK, mark, inside)
    for part in parts:
        assert part in said, said


def test_hover_says_nothing_where_there_is_nothing(editor):
    assert editor.hover(DECK, "a servo", 3) == "" and editor.hover(DECK, "Vset   set", 5) == ""


@pytest.mark.parametrize(
    ("mark", "inside", "line"),
    [
        ("gain*v", 0, ".param"), ("arm pin", 0, "BODY"), ("hinge kt", 0, "JOINT"), ("angle(hinge)", 6, "JOINT"),
        ("0 dm", 2, ".model"), ("out filter", 4, ".subckt"), ("limit), limit", 0, ".param"),
    ],
)  # fmt: skip
def test_definition(editor, mark, inside, line):
    found = editor.at("textDocument/definition", DECK, mark, inside)
    assert found["uri"] == editor.uri
    start, end = found["range"]["start"], found["range"]["end"]
    text = DECK.split("\n")[start["line"]]
    assert text.startswith(line)
    word = text[start["character"] : end["character"]].lower()
    row = next(row for row in DECK.split("\n") if mark in row)
    assert row[row.index(mark) + inside :].lower().startswith(word)


def labels(editor: Editor, text: str, mark: str, version: int) -> dict[str, dict]:
    """Completion at the mark `|` of a text that is not right yet."""
    changes = {
        "textDocument": {"uri": editor.uri, "version": version},
        "contentChanges": [{"text": text.replace("|", "")}],
    }
    editor.tell("textDocument/didChange", changes)
    row, line = next((k, line) for k, line in enumerate(text.split("\n")) if "|" in line)
    place = {"line": row, "character": line.index("|")}
    found = editor.ask("textDocument/completion", {"textDocument": {"uri": editor.uri}, "position": place})
    editor.diagnostics()
    return {item["label"]: item for item in found["items"]}


@pytest.mark.parametrize(
    ("line", "there", "absent"),
    [
        ("MO|", {"MOTOR", "BODY", ".tran"}, {"hinge"}),
        ("MOTOR m2 |", {"drive", "set", "out", "0"}, {"hinge", "arm", "kt"}),
        ("MOTOR m2 set 0 |", {"hinge"}, {"drive", "arm"}),
        ("MOTOR m2 set 0 hinge |", {"kt", "ke", "gear"}, {"drive"}),
        ("JOINT j2 |", {"arm", "0"}, {"drive"}),
        ("JOINT j2 0 arm |", {"pin", "slide", "weld", "revolute"}, {"arm"}),
        ("JOINT j2 0 arm pin cut=|", {"yes", "no"}, {"arm"}),
        ("Bx a 0 V={|}", {"gain", "limit", "angle", "max", "v"}, {"arm"}),
        ("Bx a 0 V={angle(|)}", {"hinge", "arm"}, {"drive", "m1"}),
        ("Bx a 0 V={torque(|)}", {"m1"}, {"hinge"}),
        ("Bx a 0 V={v(|)}", {"set", "out", "drive"}, {"hinge"}),
        (".print tran i(|)", {"vset", "m1"}, {"set"}),
        ("D2 set 0 |", {"dm"}, {"filter"}),
        ("D2 set 0 dm |", {"area"}, {"ic="}),
        ("X2 set out |", {"filter", "drive"}, {"dm"}),
        (".options |", {"reltol", "method"}, {"arm"}),
        (".options method=|", {"radau", "trap"}, {"reltol"}),
        (".model dd |", {"d", "sw", "dcmotor"}, {"arm"}),
        (".model dd D(|", {"is", "tt", "rs"}, {"kt"}),
        ("* a remark |", set(), {"MOTOR", "hinge"}),
        ("R9 a 0 1 ; here |", set(), {"MOTOR", "hinge"}),
    ],
)
def test_completion(editor, line, there, absent):
    text = DECK.replace(".tran 1m 1\n", f".tran 1m 1\n{line}\n")
    found = labels(editor, text, "|", editor.next())
    assert there <= set(found) and not absent & set(found), sorted(found)
    assert editor.replace(DECK, editor.next()) == []


def test_completion_says_what_it_offers(editor):
    found = labels(
        editor,
        DECK.replace(".tran", "MOTOR m2 set 0 hinge |\n.tran"),
        "|",
        editor.next(),
    )
    editor.replace(DECK, editor.next())
    assert found["kt"]["insertText"] == "kt=" and "N m/A" in found["kt"]["detail"]
    assert "torque per ampere" in found["kt"]["documentation"]["value"]


def test_outline(editor):
    found = editor.ask("textDocument/documentSymbol", {"textDocument": {"uri": editor.uri}})
    names = {entry["name"]: entry for entry in found}
    assert {"gain", "limit", "arm", "hinge", "m1", "vset", "bamp", "filter", "xf", "d1", "dm"} == set(names)
    assert [child["name"] for child in names["filter"]["children"]] == ["r1", "c1"]
    assert names["filter"]["range"]["end"]["line"] == DECK.split("\n").index("C1 out 0 1u")
    for entry in found:  # the protocol asks for it
        inner, outer = entry["selectionRange"], entry["range"]
        assert outer["start"]["line"] <= inner["start"]["line"] <= outer["end"]["line"]


def test_formatting(editor):
    options = {"tabSize": 2, "insertSpaces": True}
    (edit,) = editor.ask("textDocument/formatting", {"textDocument": {"uri": editor.uri}, "options": options})
    from emsim.editor.layout import formatted

    assert edit["newText"] == formatted(DECK) != DECK


def test_columns_are_the_clients_units(editor):
    """A character beyond the 16-bit plane counts as two."""
    text = "t\nR1 a 0 1 ; \U0001f600\nR2 a\U0001f600 0 {nix}\n"
    (found, *_) = [d for d in editor.replace(text, editor.next()) if "nix" in d["message"]]
    assert found["range"]["start"] == {"line": 2, "character": len("R2 axx 0 {")}
    assert "no parameter" in found["message"] or "nix" in found["message"]
    assert editor.replace(DECK, editor.next()) == []


def test_references_rename_and_signature_help(editor):
    editor.open(DECK)
    place = {"textDocument": {"uri": editor.uri}, "position": {"line": 1, "character": 8}}
    found = editor.ask("textDocument/references", {**place, "context": {"includeDeclaration": False}})
    assert [place["range"]["start"]["line"] for place in found] == [1, 7]
    assert editor.ask("textDocument/prepareRename", place)["end"] == {"line": 1, "character": 11}
    edits = editor.ask("textDocument/rename", {**place, "newName": "k"})["changes"][editor.uri]
    assert len(edits) == 3 and {edit["newText"] for edit in edits} == {"k"}
    row = next(k for k, line in enumerate(DECK.split("\n")) if line.startswith("MOTOR"))
    place["position"] = {"line": row, "character": len("MOTOR  m1     ")}
    said = editor.ask("textDocument/signatureHelp", place)
    assert said["activeParameter"] == 2 and said["signatures"][0]["label"].startswith("MOTOR name n+ n-")
    editor.number += 1
    where = {"textDocument": {"uri": editor.uri}, "position": {"line": 1, "character": 8}, "newName": "limit"}
    editor.send(id=editor.number, method="textDocument/rename", params=where)
    assert "there is a param limit already" in editor.answers.get(timeout=60)["error"]["message"]


def test_an_included_file(editor):
    folder = Path(editor.uri.removeprefix("file://")).parent
    (folder / "lib.inc").write_text(".param twice={2*gain}\nCl a 0\n.subckt inner a b\nR1 a b 1\n.ends\n")
    text = DECK.replace(".gravity 9.81", ".gravity 9.81\n.include lib.inc\nXi out 0 inner")
    found = [d for d in editor.replace(text, editor.next()) if d["severity"] == 1]
    assert found[0]["range"]["start"]["line"] == 3 and found[0]["message"].startswith("lib.inc:2: ")
    assert found[0]["relatedInformation"][0]["location"]["uri"] == (folder / "lib.inc").as_uri()
    place = editor.at("textDocument/definition", text, "out 0 inner", 6)
    assert place["uri"] == (folder / "lib.inc").as_uri() and place["range"]["start"]["line"] == 2
    assert editor.replace(DECK, editor.next()) == []


def test_values_stay_while_the_deck_is_wrong(editor):
    wrong = DECK.replace("R1 in out 1k", "R1 in out 1k)")
    assert editor.replace(wrong, editor.next())
    assert "v(drive) = 12 V" in editor.hover(wrong, "drive 0 hinge")
    assert editor.replace(DECK, editor.next()) == []


def test_without_pygls_it_says_what_to_install(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "pygls.lsp.server", None)
    for name in [n for n in sys.modules if n == "emsim.editor.server"]:
        monkeypatch.delitem(sys.modules, name)
    assert main(["lsp"]) == 5
    said = capsys.readouterr().err
    assert "pygls" in said and "emsim[lsp]" in said
    assert main(["lsp", "deck.cir"]) == 2


def test_the_quick_fix_mends_the_deck(editor):
    wrong = DECK.replace("R1 in out 1k", "R1 in out 1,5k")
    found = editor.replace(wrong, editor.next())
    where = found[0]["range"]
    asked = {"textDocument": {"uri": editor.uri}, "range": where, "context": {"diagnostics": found}}
    action = editor.ask("textDocument/codeAction", asked)[0]
    assert action["kind"] == "quickfix" and action["diagnostics"][0]["code"] == found[0]["code"]
    edits = (
        action["edit"]["documentChanges"][0]["edits"]
        if "documentChanges" in action["edit"]
        else action["edit"]["changes"][editor.uri]
    )
    lines = wrong.split("\n")
    for edit in edits:
        start, end = edit["range"]["start"], edit["range"]["end"]
        assert start["line"] == end["line"]
        line = lines[start["line"]]
        lines[start["line"]] = line[: start["character"]] + edit["newText"] + line[end["character"] :]
    assert "\n".join(lines) == DECK.replace("R1 in out 1k", "R1 in out 1.5k")
    assert editor.replace("\n".join(lines), editor.next()) == []
    # lines without a message offer nothing
    nowhere = {"start": {"line": 0, "character": 0}, "end": {"line": 0, "character": 1}}
    assert not editor.ask("textDocument/codeAction", {**asked, "range": nowhere})
    editor.replace(DECK, editor.next())
