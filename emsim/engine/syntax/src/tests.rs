//! The driver by itself; that its trees are Lark's is proven in tests/unit/frontend/test_driver.py.
use super::lines::cut;
use super::number::plain;
use super::parse::{Node, Parser};
use super::pattern::{Class, Found, Others, Pattern, Stack};
use super::table::table;

fn shown(text: &str, start: &str) -> Option<String> {
    let mut parser = Parser::default();
    let ok = parser.parse(table(), table().start(start).unwrap(), text);
    ok.then(|| node(&parser, parser.tree.root, text))
}

fn node(p: &Parser, k: u32, text: &str) -> String {
    match p.tree.nodes[k as usize] {
        Node::Leaf { terminal, start, end } => {
            format!("{}:{}", table().terminal(terminal as usize).unwrap().name, &text[start as usize..end as usize])
        }
        Node::Rule { name, first, count } => {
            let children: Vec<String> = p.tree.of(first, count).iter().map(|&c| node(p, c, text)).collect();
            format!("{}({})", table().names[name as usize], children.join(" "))
        }
    }
}

#[test]
fn the_tables_are_sound() {
    assert!(table().is_sound());
}

#[test]
fn a_line_becomes_a_tree() {
    assert_eq!(shown("R1 a 0 1k ; c", "element").unwrap(), "resistor(R_NAME:R1 WORD:a WORD:0 WORD:1k)");
    assert_eq!(shown("V1 a 0\n* between\n+ dc 5", "element").unwrap(), "source(V_NAME:V1 WORD:a WORD:0 DC:dc WORD:5)");
    assert_eq!(
        shown("-2^2<x", "expression").unwrap(),
        "binary(unary(MINUS:- binary(NUMBER:2 POWER:^ NUMBER:2)) LESS:< NAME:x)"
    );
    assert_eq!(
        shown("SPRING s a b k=1", "machine_card").unwrap(),
        "machine_card(WORD:SPRING WORD:s WORD:a WORD:b setting(WORD:k WORD:1))"
    );
}

#[test]
fn what_is_wrong_or_uncertain_is_handed_back() {
    for (text, start) in [("R1 a", "element"), ("R1 a 0 {1", "element"), ("", "dot"), ("1+\u{661}", "expression")] {
        assert_eq!(shown(text, start), None, "{text}");
    }
}

#[test]
fn patterns_mean_what_python_means() {
    let letters = |s: &str| Class { ascii: s.bytes().fold(0, |m, b| m | 1 << b), others: Others::Out, ranges: vec![] };
    let classes = [letters("a"), letters("b"), letters("ab")];
    let at = |notation: &str, text: &str| {
        Pattern::read(notation, &classes).unwrap().at(&classes, text, 0, &mut Stack::default())
    };
    assert_eq!(at("* 1 - g 2 1", "abab"), Found::To(4)); // [ab]+b gives back
    assert_eq!(at("* 0 - g 2 1", "abaa"), Found::To(2));
    assert_eq!(at("* 0 - l ( 2 ) 1", "aabb"), Found::To(3)); // lazy
    assert_eq!(at("( 0 | 0 1 )", "ab"), Found::To(1)); // the first alternative, not the longest
    assert_eq!(at("* 2 3 g ( 0 1 )", "abababab"), Found::To(6));
    assert_eq!(at("* 2 3 g ( 0 1 )", "ab"), Found::Nothing);
    assert_eq!(at("0 = 1", "ab"), Found::To(1));
    assert_eq!(at("0 ! 1", "ab"), Found::Nothing);
    assert_eq!(at("0 $", "a\n"), Found::To(1));
    // (a*)*-like patterns end by the budget
    assert_eq!(at("* 0 - g ( * 1 - g ( * 1 - g ( 0 ) ) ) 1", &"a".repeat(60)), Found::Unknown);
}

#[test]
fn numbers_are_spices() {
    let known: [(&str, f64); 11] = [
        ("1k", 1e3),
        ("1.1n", 1.1e-9),
        ("2MEG", 2e6),
        ("5", 5.0),
        ("-3mV", -3e-3),
        ("1e3k", 1e6),
        (".5u", 0.5e-6),
        ("10mil", 254e-6),
        ("1d3", 1e3),
        ("5D-1", 0.5),
        ("1megohm", 1e6),
    ];
    for (word, value) in known {
        assert_eq!(plain(word), Some(value), "{word}");
    }
    for word in ["", "k", "1e999", "1k5", "--1", ".", "+", "1*2", "1µ", "1e", "1x", "1Farad"] {
        assert_eq!(plain(word), None, "{word}");
    }
}

#[test]
fn lines_are_joined_and_comments_left_out() {
    let text = "t\n\n* c\nR1 a 0 1\n+ tc=1\n  C1 a 0 1\n.control\nrun\n.endc\n+ x\n.end\nno\n.control\nop\n.endc\nR2";
    let lines = cut(text, true, false);
    let cards: Vec<_> = lines.cards.iter().map(|l| (l.number, l.indent, &text[l.start..l.end])).collect();
    assert_eq!(cards, [(4, 0, "R1 a 0 1\n+ tc=1"), (6, 2, "C1 a 0 1")]);
    assert_eq!(lines.commands.iter().map(|l| l.number).collect::<Vec<_>>(), [8, 14]);
    assert_eq!(lines.stray.len(), 1);
    assert_eq!(lines.behind.map(|p| p.number), Some(12));
}

/// Whatever the bytes, the driver ends and does not panic.
#[test]
fn junk_is_survived() {
    let mut seed = 1u64;
    let mut random = |n: usize| {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 33) as usize % n
    };
    let pieces = [
        "R1 a 0 1k",
        " ",
        "\n",
        "+",
        "(",
        ")",
        "{",
        "}",
        "'",
        "\"",
        "=",
        ",",
        "v(",
        "1e3",
        ".param",
        "µ",
        "\u{130}",
        "JOINT j a b pin",
        "BODY b m=1",
        "\u{a0}",
        ";",
        "*",
        "$",
        "//",
        "*",
        "pulse",
        "tc=",
        "x",
        "\t",
        "\r",
        "\0",
        "@d[",
        "?",
        ":",
        "<=",
        "\u{2028}",
        "\u{10000}",
        "spring s j k",
        "\n*\n",
        "\n+",
    ];
    let mut parser = Parser::default();
    for _ in 0..20_000 {
        let text: String = (0..random(14)).map(|_| pieces[random(pieces.len())]).collect();
        for &(_, first, last) in &table().starts {
            parser.parse(table(), (first, last), &text);
        }
        cut(&text, random(2) == 0, random(2) == 0);
        plain(&text);
    }
}
