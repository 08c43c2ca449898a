//! Of the tables and the tokens; what the language means is tested in tests/veriloga.
use super::{nearest, source, unquote, Given, Library};

fn words(text: &str) -> Vec<String> {
    let (sources, tokens) = source::tokens(text, "t.va", &[], &[]).unwrap_or_else(|m| panic!("{}", m.text));
    tokens.iter().map(|t| sources.word(t.word).to_string()).collect()
}

#[test]
fn tokens_are_the_longest() {
    assert_eq!(words("a<+b<=c<<d"), ["a", "<+", "b", "<=", "c", "<<", "d"]);
    assert_eq!(words("1.5e-3*2u+3.*x"), ["1.5e-3", "*", "2u", "+", "3.", "*", "x"]);
    assert_eq!(words("(* desc=\"a b\" *) // end\n/* no */ $limit"), ["(*", "desc", "=", "\"a b\"", "*)", "$limit"]);
}

#[test]
fn macros_expand_inside_out() {
    let text = "`define A(x, y) x-y\n`define B 2 \\\n +3\n`A(`A(1, `B), (4, 5))";
    assert_eq!(words(text).concat(), "1-2+3-(4,5)");
}

#[test]
fn a_place_is_that_in_the_text() {
    let Err(message) = source::tokens("a\n  é `nothing", "t.va", &[], &[]) else { panic!("no message") };
    assert_eq!((message.line, message.column), (2, 3));
}

#[test]
fn near_words() {
    assert_eq!(nearest("curent", ["voltage", "current"].into_iter()).as_deref(), Some("current"));
    assert_eq!(nearest("x", ["y"].into_iter()), None);
    assert_eq!(unquote("\"a\\\"b\\n\""), "a\"b\n");
}

/// A fold is the same whenever it is made: classes of devices compare them.
#[test]
fn folding_is_repeatable() {
    let text = "`include \"disciplines.vams\"\nmodule d(a, c); inout a, c; electrical a, c, i; parameter real is = 1f; parameter real r = 1;
        analog begin if (V(i, c) > 0) I(i, c) <+ is * (limexp(V(i, c) / $vt) - 1); else I(i, c) <+ is * V(i, c) / $vt;
        I(a, i) <+ V(a, i) / r; I(i, c) <+ ddt(1p * V(i, c)); end endmodule";
    let library = Library::parse(text, "d.va", &[], &[]).unwrap_or_default();
    let module = library.module("d").unwrap_or_else(|| panic!("no module"));
    let fold = || module.fold(&Given::default()).unwrap_or_else(|m| panic!("{}", m[0].text));
    let (one, two) = (fold(), fold());
    assert_eq!(one.flows, two.flows);
    assert_eq!(one.ports, two.ports);
    assert_eq!(one.graph.len(), two.graph.len());
}
