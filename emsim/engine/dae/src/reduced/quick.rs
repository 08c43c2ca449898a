//! Multipliers and accelerations of closed loops far from their singular positions, as straight-line code: the masses by
//! Cholesky's factors, S = Z^T Z as it stands and by its own. That loses the square of how near S is to a loss of rank, which is
//! nothing where it is far from one. Near one, and where a loop is to be closed, the columns of Z are looked at (saddle.rs).
use super::saddle::{Saddle, NEAR};
use super::{Held, Point, Reduced};
use crate::rounding::ROUNDED;
use crate::tape::{Inputs, Leaf, Tape, Value, Written};

pub struct Quick {
    tape: Tape,
    masses: usize, // unless they are constant
}

/// A program's values, of which zeros are left out.
struct Sums {
    p: Written,
    zero: Value,
    one: Value,
}

type Entry = Option<Value>;

impl Sums {
    fn product(&mut self, a: Entry, b: Entry) -> Entry {
        Some(self.p.mul(a?, b?))
    }

    /// a <- a - b
    fn take(&mut self, a: &mut Entry, b: Entry) {
        if let Some(b) = b {
            *a = Some(self.p.sub(a.unwrap_or(self.zero), b));
        }
    }

    fn sum(&mut self, a: Entry, b: Entry) -> Entry {
        match (a, b) {
            (Some(a), Some(b)) => Some(self.p.add(a, b)),
            (a, b) => a.or(b),
        }
    }

    /// Symmetric A, upper triangle by rows, to U and the inverses of its diagonal (dense.rs).
    fn factor(&mut self, a: &mut [Entry], n: usize) -> Vec<Entry> {
        let mut inverse = Vec::with_capacity(n);
        for k in 0..n {
            let pivot = a[k * n + k].unwrap_or(self.zero);
            let r = Some(self.p.div(self.one, pivot));
            inverse.push(r);
            for i in k + 1..n {
                let f = self.product(a[k * n + i], r);
                for j in i..n {
                    let less = self.product(f, a[k * n + j]);
                    self.take(&mut a[i * n + j], less);
                }
            }
        }
        inverse
    }

    fn forward(&mut self, u: &[Entry], inverse: &[Entry], b: &mut [Entry]) {
        let n = b.len();
        for k in 0..n {
            let f = self.product(b[k], inverse[k]);
            for i in k + 1..n {
                let less = self.product(f, u[k * n + i]);
                self.take(&mut b[i], less);
            }
        }
    }

    fn backward(&mut self, u: &[Entry], inverse: &[Entry], b: &mut [Entry]) {
        let n = b.len();
        for k in (0..n).rev() {
            for i in k + 1..n {
                let less = self.product(u[k * n + i], b[i]);
                self.take(&mut b[k], less);
            }
            b[k] = self.product(b[k], inverse[k]);
        }
    }

    /// Sum of a_k b_k.
    fn dot(&mut self, a: &[Entry], b: &[Entry]) -> Entry {
        let mut sum = None;
        for (&a, &b) in a.iter().zip(b) {
            let product = self.product(a, b);
            sum = self.sum(sum, product);
        }
        sum
    }
    /// A l - b, A by columns as long as b.
    fn excess(&mut self, a: &[Entry], l: &[Entry], b: &[Entry]) -> Vec<Entry> {
        let k = b.len();
        let row = |i: usize| -> Vec<Entry> { (0..l.len()).map(|j| a[j * k + i]).collect() };
        (0..k)
            .map(|i| {
                let mut sum = self.dot(&row(i), l);
                self.take(&mut sum, b[i]);
                sum
            })
            .collect()
    }
}

impl Saddle {
    /// The program, reading the slots of `tape`. Results: multipliers, accelerations where they are read, S_ii, its pivots; the
    /// masses' pivots and what they began with.
    pub fn quick(&self, tape: &Tape) -> Option<Quick> {
        let (k, m) = (self.mass.unknowns.len(), self.rows.len());
        // operations of a longer program would not stay in the processor's cache
        if k * k * k / 6 + k * k * (m + 2) + k * m * m + m * m * m / 6 > 1500 {
            return None;
        }
        let known = self.mass.constant.as_ref().map(|c| &c.0);
        if known.is_some_and(Vec::is_empty) {
            return None; // masses that could not be factored
        }
        let base = known.unwrap_or(&self.mass.base);
        let inverses = (0..k).map(|i| 1.0 / base[i * k + i]); // where the masses are constant
        let (p, values) =
            Written::new(&[0.0, 1.0].into_iter().chain(inverses).chain(base.iter().copied()).collect::<Vec<_>>());
        let mut s = Sums { p, zero: values[0], one: values[1] };
        let (ready, values) = values[2..].split_at(k);
        let slots = tape.part_places(self.mass.part);
        let read = |s: &mut Sums, i: usize| -> Entry {
            (tape.constant(slots[i]) != Some(0.0)).then(|| s.p.leaf(Leaf::X(slots[i] as usize)))
        };

        let mut u: Vec<Entry> = base.iter().zip(values).map(|(&v, &value)| (v != 0.0).then_some(value)).collect();
        for (i, &(place, _)) in self.mass.varying.iter().enumerate() {
            u[place] = read(&mut s, k + m + i);
        }
        let diagonal = |a: &[Entry], n: usize| -> Vec<Entry> { (0..n).map(|i| a[i * n + i]).collect() };
        let began = diagonal(&u, k);
        let inverse = match known {
            Some(_) => ready.iter().copied().map(Some).collect(),
            None => s.factor(&mut u, k),
        };

        let first = k + m + self.mass.varying.len();
        let pull: Vec<Entry> = (0..k * m).map(|i| read(&mut s, first + i)).collect();
        let mut z = pull.clone();
        for column in z.chunks_exact_mut(k) {
            s.forward(&u, &inverse, column);
        }
        let force: Vec<Entry> = (0..k).map(|i| read(&mut s, i)).collect();
        let mut c = force.clone();
        s.forward(&u, &inverse, &mut c);
        let mut weighed: Vec<Entry> = Vec::with_capacity(k * m);
        for column in z.chunks_exact(k) {
            weighed.extend(column.iter().zip(&inverse).map(|(&z, &r)| s.product(z, r)).collect::<Vec<_>>());
        }
        let mut square = vec![None; m * m];
        let mut lambda = Vec::with_capacity(m);
        for (j, column) in weighed.chunks_exact(k).enumerate() {
            for i in 0..=j {
                square[i * m + j] = s.dot(column, &z[i * k..(i + 1) * k]);
            }
            let mut l = s.dot(column, &c);
            let given = read(&mut s, k + j);
            s.take(&mut l, given);
            lambda.push(l);
        }
        let sizes = diagonal(&square, m);
        let inverses = s.factor(&mut square, m);
        s.forward(&square, &inverses, &mut lambda);
        s.backward(&square, &inverses, &mut lambda);

        let mut results = lambda.clone();
        if self.rates {
            let mut rates = s.excess(&pull, &lambda, &force);
            s.forward(&u, &inverse, &mut rates);
            s.backward(&u, &inverse, &mut rates);
            results.extend(rates);
        }
        results.extend(sizes.into_iter().chain(diagonal(&square, m)));
        let masses = if known.is_some() { 0 } else { k };
        if masses > 0 {
            results.extend(diagonal(&u, k).into_iter().chain(began));
        }
        let results: Vec<Value> = results.into_iter().map(|r| r.unwrap_or(s.zero)).collect();
        Some(Quick { tape: s.p.native(&results)?, masses })
    }
}

impl Quick {
    /// Scratch: slots, then results.
    pub fn scratch(&self) -> (Vec<f64>, Vec<f64>) {
        (self.tape.workspace(), vec![0.0; self.tape.part_places(0).len()])
    }
}

impl Reduced {
    /// Multipliers and accelerations into their leaves, where the masses are sound and S is far from a loss of rank; false
    /// where it is not known to be.
    pub(super) fn quickly(&self, s: &Saddle, step: usize, p: &mut Point) -> bool {
        let Some(quick) = &s.quick else { return false };
        let Held { quick: (slots, results), columns: Some(columns), stale, .. } = &mut p.held[step] else {
            return false;
        };
        quick.tape.run_into(0, &Inputs { x: &p.slots, t: 0.0, waves: &[], flags: &[] }, slots, results);
        let (m, k) = (s.rows.len(), if s.rates { s.mass.unknowns.len() } else { 0 });
        let (lambda, rest) = results.split_at(m);
        let (rates, rest) = rest.split_at(k);
        let (sizes, rest) = rest.split_at(m);
        let (pivots, masses) = rest.split_at(m);
        let nearness = columns.nearness(sizes, pivots);
        let (ends, begins) = masses.split_at(quick.masses);
        let sound = ends.iter().zip(begins).all(|(end, begin)| *end > ROUNDED * begin);
        if !(nearness > NEAR && sound) {
            return false;
        }
        columns.weakest = nearness;
        *stale = true;
        for (&u, &v) in s.mass.unknowns.iter().zip(rates) {
            p.v[u] = v;
        }
        for (&row, &v) in s.rows.iter().zip(lambda) {
            p.v[row] = v;
        }
        true
    }
}
