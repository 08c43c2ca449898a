//! Between which values an expression of time, sources and flags lies over a stretch of time, and its slope: interval arithmetic,
//! forward by the rules of differentiation. No value in the stretch is outside; the bounds are wider than the values are, and the less so the
//! shorter the stretch, for which slopes are the better of two: f <= f(a) + max f' (t - a).
//! (R. Moore, R. Kearfott, M. Cloud, Introduction to Interval Analysis, SIAM 2009, chapters 5 and 6.)
use crate::graph::{Fun, Graph, Id, Node};
use crate::waves::bounds::{hull, plus, sine_over, times, Bounds, Interval, ANYTHING};
use crate::waves::Wave;
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// Nodes, operands first and numbered by place; the last one is the result.
pub struct Program(Vec<Node>);

/// Does the deck alone say what this node is at any time, but for flags, if its operands are so?
pub fn is_known(node: Node, waves: &[Wave], flags: bool) -> bool {
    match node {
        Node::Const(_) | Node::Time => true,
        Node::Flag(_) => flags,
        Node::Wave(k) => waves.get(k as usize).is_some_and(Wave::is_known_ahead),
        Node::Unknown(_) | Node::Symbol(_) | Node::Join(..) | Node::Result(..) => false,
        _ => true,
    }
}

impl Program {
    pub fn new(g: &Graph, id: Id) -> Program {
        let order = g.reachable(&[id]);
        let place: BTreeMap<Id, Id> = order.iter().enumerate().map(|(k, &id)| (id, k as Id)).collect();
        let of = |o: Id| place[&o];
        let moved = |node: Node| match node {
            Node::Neg(a) => Node::Neg(of(a)),
            Node::Add(a, b) => Node::Add(of(a), of(b)),
            Node::Sub(a, b) => Node::Sub(of(a), of(b)),
            Node::Mul(a, b) => Node::Mul(of(a), of(b)),
            Node::Div(a, b) => Node::Div(of(a), of(b)),
            Node::Pow(a, b) => Node::Pow(of(a), of(b)),
            Node::Powi(a, n) => Node::Powi(of(a), n),
            Node::Atan2(a, b) => Node::Atan2(of(a), of(b)),
            Node::Call(f, a) => Node::Call(f, of(a)),
            Node::Select(c, a, b) => Node::Select(of(c), of(a), of(b)),
            Node::NotLess(a, b) => Node::NotLess(of(a), of(b)),
            leaf => leaf,
        };
        Program(order.iter().map(|&id| moved(g.node(id))).collect())
    }

    /// Flags that it reads.
    pub fn flags(&self) -> impl Iterator<Item = usize> + '_ {
        self.0.iter().filter_map(|node| if let Node::Flag(k) = node { Some(*k as usize) } else { None })
    }

    /// The value at t.
    pub fn at(&self, t: f64, waves: &[Wave], flags: &[f64], slots: &mut Vec<Bounds>) -> f64 {
        self.over(t, t, waves, flags, slots).value.0
    }

    /// From a, where jumps are over, to b, where none has come.
    pub fn over(&self, a: f64, b: f64, waves: &[Wave], flags: &[f64], slots: &mut Vec<Bounds>) -> Bounds {
        slots.clear();
        for &node in &self.0 {
            let of = |o: Id| slots[o as usize];
            let bounds = match node {
                Node::Const(bits) => Bounds::constant(f64::from_bits(bits)),
                Node::Time => Bounds { value: (a, b), slope: (1.0, 1.0) },
                Node::Wave(k) => waves[k as usize].over(a, b),
                Node::Flag(k) => flags.get(k as usize).map_or(Bounds::UNKNOWN, |&v| Bounds::constant(v)),
                Node::Neg(x) => Bounds { value: minus(of(x).value), slope: minus(of(x).slope) },
                Node::Add(x, y) => sum(of(x), of(y)),
                Node::Sub(x, y) => {
                    let y = of(y);
                    sum(of(x), Bounds { value: minus(y.value), slope: minus(y.slope) })
                }
                Node::Mul(x, y) if x == y => power(of(x), 2),
                Node::Mul(x, y) => product(of(x), of(y)),
                Node::Div(x, y) => product(of(x), power(of(y), -1)),
                Node::Powi(x, n) => power(of(x), n),
                Node::Pow(x, y) => raised(of(x), of(y)),
                Node::Atan2(y, x) => angle(of(y), of(x), a == b),
                Node::Call(f, x) => function(f, of(x)),
                Node::NotLess(x, y) => match (of(x).value, of(y).value) {
                    (x, y) if x.0 >= y.1 => Bounds::constant(1.0),
                    (x, y) if x.1 < y.0 => Bounds::constant(0.0),
                    _ => Bounds { value: (0.0, 1.0), slope: ANYTHING },
                },
                Node::Select(c, x, y) => match of(c).value {
                    (0.0, 0.0) => of(y),
                    (lo, hi) if lo > 0.0 || hi < 0.0 => of(x),
                    _ => Bounds { value: hull(of(x).value, of(y).value), slope: ANYTHING },
                },
                Node::Unknown(_) | Node::Symbol(_) | Node::Join(..) | Node::Result(..) => Bounds::UNKNOWN,
            };
            let known = |i: Interval| if i.0.is_nan() || i.1.is_nan() { ANYTHING } else { i };
            slots.push(Bounds { value: known(bounds.value), slope: known(bounds.slope) });
        }
        slots.last().copied().unwrap_or(Bounds::UNKNOWN)
    }
}

fn minus((lo, hi): Interval) -> Interval {
    (-hi, -lo)
}

fn sum(x: Bounds, y: Bounds) -> Bounds {
    Bounds { value: plus(x.value, y.value), slope: plus(x.slope, y.slope) }
}

fn product(x: Bounds, y: Bounds) -> Bounds {
    Bounds { value: times(x.value, y.value), slope: plus(times(x.slope, y.value), times(x.value, y.slope)) }
}

/// x^n of what lies between two numbers.
fn powers((lo, hi): Interval, n: i32) -> Interval {
    match n {
        0 => (1.0, 1.0),
        _ if n < 0 && lo <= 0.0 && hi >= 0.0 => ANYTHING,
        _ if n % 2 == 0 && n > 0 && lo <= 0.0 && hi >= 0.0 => (0.0, lo.powi(n).max(hi.powi(n))),
        _ => hull((lo.powi(n), lo.powi(n)), (hi.powi(n), hi.powi(n))),
    }
}

fn power(x: Bounds, n: i32) -> Bounds {
    let factor = times((f64::from(n), f64::from(n)), powers(x.value, n - 1));
    Bounds { value: powers(x.value, n), slope: if n == 0 { (0.0, 0.0) } else { times(factor, x.slope) } }
}

fn raised(x: Bounds, y: Bounds) -> Bounds {
    if x.value.0 == x.value.1 && y.value.0 == y.value.1 {
        return Bounds { slope: ANYTHING, ..Bounds::constant(x.value.0.powf(y.value.0)) };
    }
    if x.value.0 <= 0.0 {
        return Bounds::UNKNOWN;
    }
    function(Fun::Exp, product(y, function(Fun::Log, x)))
}

fn angle(y: Bounds, x: Bounds, at_once: bool) -> Bounds {
    if at_once {
        return Bounds { slope: ANYTHING, ..Bounds::constant(y.value.0.atan2(x.value.0)) };
    }
    if x.value.0 > 0.0 {
        return function(Fun::Atan, product(y, power(x, -1)));
    }
    // above and below the line on which the angle jumps: a quarter of a turn less the angle to the other axis
    if y.value.0 > 0.0 || y.value.1 < 0.0 {
        let other = function(Fun::Atan, product(x, power(y, -1)));
        let quarter = Bounds::constant((0.5 * PI).copysign(y.value.0));
        return sum(quarter, Bounds { value: minus(other.value), slope: minus(other.slope) });
    }
    Bounds { value: (-PI, PI), slope: ANYTHING }
}

/// A function of one argument: what its values and its derivative's are over the argument's.
fn function(f: Fun, x: Bounds) -> Bounds {
    let (lo, hi) = x.value;
    let rising = (f.apply(lo), f.apply(hi));
    // of a derivative that has its largest value where the argument is nearest to 0, and one that rises towards both sides
    let peak = |d: &dyn Fn(f64) -> f64| {
        let ends = hull((d(lo), d(lo)), (d(hi), d(hi)));
        if lo <= 0.0 && hi >= 0.0 {
            hull(ends, (d(0.0), d(0.0)))
        } else {
            ends
        }
    };
    let (value, derivative) = match f {
        Fun::Sin => (sine_over(x.value), sine_over((lo + 0.5 * PI, hi + 0.5 * PI))),
        Fun::Cos => (sine_over((lo + 0.5 * PI, hi + 0.5 * PI)), minus(sine_over(x.value))),
        Fun::Exp => (rising, rising),
        Fun::Sinh => (rising, peak(&f64::cosh)),
        Fun::Cosh => (peak(&f64::cosh), (lo.sinh(), hi.sinh())),
        Fun::Tanh => (rising, peak(&|v| 1.0 / v.cosh().powi(2))),
        Fun::Atan => (rising, peak(&|v| 1.0 / (1.0 + v * v))),
        Fun::Asinh => (rising, peak(&|v| 1.0 / (1.0 + v * v).sqrt())),
        Fun::Asin => (rising, peak(&|v| 1.0 / (1.0 - v * v).sqrt())),
        Fun::Acos => ((hi.acos(), lo.acos()), peak(&|v| -1.0 / (1.0 - v * v).sqrt())),
        Fun::Atanh => (rising, peak(&|v| 1.0 / (1.0 - v * v))),
        Fun::Acosh => (rising, (1.0 / (hi * hi - 1.0).sqrt(), 1.0 / (lo * lo - 1.0).sqrt())),
        Fun::Sqrt if lo >= 0.0 => (rising, (0.5 / hi.sqrt(), 0.5 / lo.sqrt())),
        Fun::Log if lo > 0.0 => (rising, (1.0 / hi, 1.0 / lo)),
        Fun::Tan if (lo / PI - 0.5).floor() == (hi / PI - 0.5).floor() => (rising, plus((1.0, 1.0), powers(rising, 2))),
        Fun::Abs if lo >= 0.0 => (x.value, (1.0, 1.0)),
        Fun::Abs if hi <= 0.0 => (minus(x.value), (-1.0, -1.0)),
        Fun::Abs => ((0.0, hi.max(-lo)), (-1.0, 1.0)),
        Fun::Floor | Fun::Ceil | Fun::Round | Fun::Sign if rising.0 == rising.1 => (rising, (0.0, 0.0)),
        Fun::Floor | Fun::Ceil | Fun::Round | Fun::Sign => return Bounds { value: rising, slope: ANYTHING },
        Fun::Sqrt | Fun::Log | Fun::Tan if lo == hi => (rising, ANYTHING),
        Fun::Sqrt | Fun::Log | Fun::Tan => (ANYTHING, ANYTHING),
    };
    Bounds { value, slope: times(derivative, x.slope) }
}
