//! What a text says: modules with their declarations, expressions and statements with names resolved. Expressions and statements lie
//! in arrays of their library and are numbered.
use super::source::{Place, Word};
use std::sync::Arc;

pub type E = u32;
pub type S = u32;

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Type {
    Real,
    Integer,
    Text,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Operator {
    Or,
    And,
    BitOr,
    BitXor,
    BitXnor,
    BitAnd,
    BitNot,
    Equals,
    Differs,
    Less,
    More,
    AtMost,
    AtLeast,
    Left,
    Right,
    Plus,
    Minus,
    Times,
    Over,
    Percent,
    Power,
    Not,
}

#[derive(Clone, Debug)]
pub enum Expression {
    Number(f64, bool), // whole: written without point and exponent
    Text(Arc<str>),
    /// of the frame: a module's variables, or a function's
    Variable(u32),
    Parameter(u32),
    Element(u32, E),          // of an array variable
    ParameterElement(u32, E), // of an array parameter
    Name(Word, Option<E>),    // a node or branch, where those may stand; with the index of one in a row of nodes
    Part(Word, E, E),         // of a row of nodes: name[first:last]
    Port(Word),               // <name>
    System(Word),
    Call(Word, Vec<E>),    // a function, or an access to a branch
    Function(u32, Vec<E>), // an analogue function of the module
    Unary(Operator, E),
    Binary(Operator, E, E),
    Conditional(E, E, E),
    List(Vec<E>),
    Repeated(E, Vec<E>), // in a list: count{items}
    Empty,
}

#[derive(Clone, Debug)]
pub enum Statement {
    Nothing,
    Block(Vec<S>),
    /// variables begin anew where they are declared in a block
    Begin(u32, Option<E>),
    If(E, S, Option<S>),
    Case(E, Vec<(Vec<E>, S)>, Option<S>),
    For(S, E, S, S),
    /// how often it may be repeated where the end hangs on voltages: (* unroll = n *)
    While(E, S, Option<u32>),
    Repeat(E, S),
    Event(Vec<E>, S),
    Assign(u32, Option<E>, E),
    Contribute(E, E),
    Indirect(E, E),
    Call(E),
}

#[derive(Clone, Debug)]
pub struct Variable {
    pub name: Word,
    pub kind: Type,
    pub at: Place,
    pub size: Option<(E, E)>,
    pub initial: Option<E>,
    pub meaning: String,
    pub unit: String,
    /// the power of $mfactor that its value is told with
    pub multiplicity: i32,
    pub described: bool,
}

#[derive(Clone, Debug)]
pub enum Allowed {
    /// low, high, and whether they belong to it
    Interval(E, E, bool, bool),
    Values(Vec<E>),
}

#[derive(Clone, Debug)]
pub struct Parameter {
    pub name: Word,
    pub aliases: Vec<Word>,
    pub kind: Option<Type>,
    pub at: Place,
    pub local: bool,
    pub size: Option<(E, E)>,
    pub default: E,
    /// `true`: excluded
    pub limits: Vec<(bool, Allowed)>,
    pub meaning: String,
    pub unit: String,
    pub instance: bool,
}

#[derive(Clone, Debug)]
pub struct Node {
    pub name: Word,
    pub at: Place,
    pub discipline: Option<Word>,
    pub range: Option<(E, E)>,
    pub ground: bool,
}

#[derive(Clone, Debug)]
pub struct Branch {
    pub name: Word,
    /// a name or a port; the second may be missing: ground
    pub ends: (E, Option<E>),
}

#[derive(Clone, Debug)]
pub struct Function {
    pub name: Word,
    pub kind: Type,
    pub variables: Vec<Variable>,
    /// variable, does it come in, does it go out
    pub arguments: Vec<(u32, bool, bool)>,
    /// the variable that is the result
    pub result: u32,
    pub body: Vec<S>,
}

#[derive(Clone, Debug)]
pub struct Instance {
    pub module: Word,
    pub name: Word,
    pub at: Place,
    /// of a row of instances
    pub range: Option<(E, E)>,
    pub parameters: Vec<(Option<Word>, E)>,
    pub nodes: Vec<(Option<Word>, E)>,
}

/// What a generate block holds.
#[derive(Clone, Debug)]
pub enum Generated {
    Instance(Instance),
    Analog(S),
    Block(Option<Word>, Vec<Generated>),
    If(E, Vec<Generated>, Vec<Generated>),
    For(S, E, S, Vec<Generated>),
}

#[derive(Clone, Debug, Default)]
pub struct Module {
    pub name: Word,
    pub at: Place,
    pub meaning: String,
    pub nodes: Vec<Node>, // the ports first
    pub ports: usize,
    pub branches: Vec<Branch>,
    pub parameters: Vec<Parameter>,
    pub variables: Vec<Variable>,
    pub functions: Vec<Function>,
    pub initial: Vec<S>,
    pub analog: Vec<S>,
    pub instances: Vec<Instance>,
    pub generated: Vec<Generated>,
    /// the analogue blocks among what is generated
    pub generated_analog: Vec<S>,
    /// of a paramset: the module that it is a set of parameters for, and what it chooses
    pub base: Option<Word>,
    pub choices: Vec<(Word, E, Place)>,
}

#[derive(Clone, Debug, Default)]
pub struct Discipline {
    pub name: Word,
    /// natures
    pub potential: Option<Word>,
    pub flow: Option<Word>,
}

#[derive(Clone, Debug, Default)]
pub struct Nature {
    pub name: Word,
    pub access: Option<Word>,
    pub unit: String,
}
