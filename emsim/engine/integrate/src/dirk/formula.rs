//! The coefficients of a method, and what follows from them.
use crate::rounding::SAME;

/// Coefficients; stage 0 is the step's start.
pub struct Tableau {
    pub c: Vec<f64>,
    pub a: Vec<Vec<f64>>, // rows of stages 1.., up to the diagonal
    pub d: Vec<f64>,      // b - b^
    /// of each stage's value: coefficients of 1, theta, theta^2, ... in dense output
    pub dense: Vec<Vec<f64>>,
    /// the error falls as h to this power
    pub falls: usize,
    /// local tolerance against the asked one: keeps the global error of ordinary problems near what was asked
    pub local: f64,
}

pub struct Formula {
    pub k: Tableau,
    /// of each stage: those that its first guess is made of, and their weights
    pub ahead: Vec<Vec<(usize, f64)>>,
    /// of each stage but the first and the last: weights of all in dense output there
    pub through: Vec<Vec<f64>>,
    /// of the stages in sums over a step
    pub weights: Vec<Vec<f64>>,
    /// A^-1 1, where the start stands in no stage: a charge that moves at once is spread over the stages as currents of so much of it
    /// over the step
    pub spread: Vec<f64>,
    /// what d leaves of it
    pub at_once: f64,
}

impl Formula {
    pub fn new(k: Tableau) -> Formula {
        let s = k.c.len();
        let spread = spread(&k);
        Formula {
            ahead: (0..s).map(|i| points_behind(&k, i)).collect(),
            through: k.c[1..s - 1].iter().map(|&theta| k.weights_at(theta).collect()).collect(),
            weights: k.a[s - 2..].to_vec(),
            at_once: k.d.iter().zip(&spread).map(|(d, m)| d * m).sum(),
            spread,
            k,
        }
    }
}

impl Tableau {
    /// Does the start stand in no stage?
    pub fn starts_anew(&self) -> bool {
        self.a.iter().all(|row| row[0] == 0.0)
    }

    /// Weights of the stages in dense output at theta.
    pub fn weights_at(&self, theta: f64) -> impl Iterator<Item = f64> + '_ {
        self.dense.iter().map(move |d| d.iter().rev().fold(0.0, |sum, d| sum * theta + d))
    }
}

/// The polynomial through the last three stages before stage i that lie apart, at its node: those stages and their weights. Not
/// through the start where that stands in no stage.
fn points_behind(k: &Tableau, i: usize) -> Vec<(usize, f64)> {
    let c = &k.c;
    let mut nodes: Vec<usize> = Vec::new();
    for j in (usize::from(k.starts_anew())..i).rev() {
        if nodes.len() < 3 && nodes.iter().all(|&n| (c[n] - c[j]).abs() > SAME) {
            nodes.push(j);
        }
    }
    let weight = |j: usize| nodes.iter().filter(|&&n| n != j).map(|&n| (c[i] - c[n]) / (c[j] - c[n])).product();
    nodes.iter().map(|&j| (j, weight(j))).collect()
}

fn spread(k: &Tableau) -> Vec<f64> {
    let mut moved = vec![0.0];
    for (i, row) in (1..).zip(&k.a) {
        let before: f64 = row.iter().zip(&moved).map(|(a, m)| a * m).sum();
        moved.push((1.0 - before) / row[i]);
    }
    moved
}
