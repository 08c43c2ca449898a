//! Circuit diagrams: where parts stand and how wires run between them, on a grid.
//!
//! A part offers variants (turned, mirrored, its label elsewhere), each with a cost, the rectangles that it covers and its pins.
//! Placement (`place`) is a search by threshold accepting (Dueck and Scheuer, J. Comput. Phys. 90, 1990): a change is kept if the
//! cost grows by less than a threshold that falls to nothing. All costs are whole numbers and the generator is our own, so that a
//! deck gives the same drawing everywhere. Wires (`route`) are found by Dijkstra's algorithm over grid points and directions; the
//! last part of the search judges drawings by their real wires.
//!
//! All coordinates are grid points, y downwards. A rectangle [x0, y0, x1, y1] covers its border.
mod place;
mod route;

pub use place::arrange;

pub type Point = (i32, i32);

/// One way to draw a part, about its own origin.
#[derive(Clone)]
pub struct Variant {
    pub cost: i32,
    pub rects: Vec<[i32; 4]>,
    pub pins: Vec<Pin>,
}

/// Where a wire ends, and the direction in which it leaves the part.
#[derive(Clone, Copy)]
pub struct Pin {
    pub at: Point,
    pub out: Point,
}

/// What is wished of two parts: `b` right of `a`, no further left, in a row with it, below it, in a column with it.
#[derive(Clone, Copy, PartialEq)]
pub enum Wish {
    Right,
    After,
    Row,
    Below,
    Column,
}

/// A diagram to be drawn. `nets` name (part, pin); `wishes` weigh (what, a, b, weight by grid unit).
pub struct Diagram {
    pub parts: Vec<Vec<Variant>>,
    pub nets: Vec<Vec<(usize, usize)>>,
    pub wishes: Vec<(Wish, usize, usize, i32)>,
}

/// Of each part its place and variant, of each net its wires; `failed` nets have pins that no wire reaches.
pub struct Drawing {
    pub places: Vec<(i32, i32, usize)>,
    pub wires: Vec<Vec<Vec<Point>>>,
    pub failed: Vec<usize>,
    pub cost: i64,
}

/// xorshift64*, Vigna, ACM Trans. Math. Softw. 42, 2016.
pub(crate) struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Random {
        Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    /// A whole number from 0 to n - 1.
    pub fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        ((self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 33) % n.max(1) as u64) as usize
    }

    pub fn between(&mut self, low: i32, high: i32) -> i32 {
        low + self.below((high - low + 1) as usize) as i32
    }
}
