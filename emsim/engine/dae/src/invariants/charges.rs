//! Charge that nothing carries away: of nodes that currents flow only between, and that hang on all else by capacitors, charges of devices
//! and shunts of picosiemens alone, the sum of all Q stays what it was, but for what the shunts let through:
//!
//!   sum_i Q_i(t) + integral of sum_i F_i = const,   F_i linear there
//!
//! whatever the waveforms are. Floating gates, capacitive dividers, pumps between two strokes. The integral is one of straight lines
//! between the recorded rows, and what these may miss is allowed besides.
use super::{Broken, MOST};
use crate::floating_groups::Groups;
use crate::rounding::ROUNDED;
use crate::system::{Kind, System, Work};
use crate::tolerances::Tolerances;
use std::collections::BTreeMap;

/// A conductance that is no more than a shunt [S].
const SHUNT: f64 = 1e-9;

struct Group {
    rows: Vec<usize>,
    places: Vec<(usize, usize)>, // column and place in the pattern of every entry of these rows, by columns
    leaks: Vec<(usize, f64)>,
    first: Option<f64>,
    leaked: f64,
    missed: f64,              // what straight lines may miss of that
    last: Option<(f64, f64)>, // time and current of the last row
}

pub struct Charges {
    groups: Vec<Group>,
    rows: u32,
}

impl Charges {
    pub fn new(sys: &System) -> Charges {
        let node = |i: usize| sys.unknowns[i].kind == Kind::Node;
        let mut open = vec![false; sys.n];
        let waves = sys.source_rows().iter().map(|&(row, ..)| row);
        let expressions = sys.expression_ids(0).iter().map(|&(row, _)| row);
        let summed = sys.sums.iter().flat_map(|s| [s.node, s.root]);
        waves.chain(expressions).chain(summed).for_each(|row| open[row] = true);
        // nodes that a current may flow between belong together
        let (mut groups, mut carried_by) = (Groups::new(sys.n), BTreeMap::new());
        let terms: Vec<(usize, usize, f64)> = sys.constant_terms().filter(|&(row, ..)| node(row)).collect();
        for &(row, col, v) in &terms {
            match node(col) {
                true if v.abs() > SHUNT => groups.join(row, col),
                true => {}
                false => groups.join(row, *carried_by.entry(col).or_insert(row)),
            }
        }
        for rows in sys.carrying_branches() {
            let mut ends = rows.into_iter().filter_map(|row| usize::try_from(row).ok());
            match (ends.next(), ends.next()) {
                (Some(a), Some(b)) => groups.join(a, b),
                (Some(a), None) => open[a] = true, // to ground
                _ => {}
            }
        }
        let mut members: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        (0..sys.n).filter(|&i| node(i)).for_each(|i| members.entry(groups.of(i)).or_default().push(i));
        members.retain(|_, rows| rows.iter().all(|&i| !open[i]) && rows.iter().any(|&i| sys.has_q[i]));
        let mut sums: BTreeMap<(usize, usize), (f64, f64)> = BTreeMap::new(); // of each column: sum, and of sizes
        for (row, col, v) in terms {
            let sum = sums.entry((groups.of(row), col)).or_default();
            *sum = (sum.0 + v, sum.1 + v.abs());
        }
        let found = members.into_iter().filter_map(|(of, rows)| {
            let own = sums.range((of, 0)..=(of, usize::MAX)).map(|(&(_, col), &sum)| (col, sum));
            let leaks: Vec<_> =
                own.filter(|(_, sum)| sum.0.abs() > ROUNDED * sum.1).map(|(c, sum)| (c, sum.0)).collect();
            let shunts = leaks.iter().all(|&(col, v)| node(col) && v.abs() <= SHUNT);
            let places = Vec::new();
            shunts.then_some(Group { rows, places, leaks, first: None, leaked: 0.0, missed: 0.0, last: None })
        });
        let mut groups: Vec<Group> = found.collect();
        let mut group_of = vec![None; sys.n];
        groups.iter().enumerate().for_each(|(g, group)| group.rows.iter().for_each(|&row| group_of[row] = Some(g)));
        for j in 0..sys.n {
            for k in sys.pattern.colptr[j]..sys.pattern.colptr[j + 1] {
                if let Some(g) = group_of[sys.pattern.rowidx[k]] {
                    groups[g].places.push((j, k));
                }
            }
        }
        Charges { groups, rows: 0 }
    }

    pub fn is_empty(&self) -> bool {
        self.groups.is_empty()
    }

    /// The row (t, x) is recorded. Is it to be looked at?
    #[inline]
    pub fn row(&mut self, t: f64, x: &[f64]) -> bool {
        for group in &mut self.groups {
            let current: f64 = group.leaks.iter().map(|&(k, v)| v * x[k]).sum();
            if let Some((before, last)) = group.last {
                group.leaked += 0.5 * (t - before) * (last + current);
                group.missed += 0.5 * (t - before) * (last - current).abs();
            }
            group.last = Some((t, current));
        }
        self.rows = self.rows.wrapping_add(1);
        // rows from one look to the next
        self.rows % 32 == 0
    }

    /// Groups whose charge at (t, x) is not what it was at the first look; `w` has charges and capacitances there.
    pub fn look(&mut self, w: &Work, tol: &Tolerances, t: f64, x: &[f64]) -> Vec<Broken> {
        let mut broken = Vec::new();
        for group in &mut self.groups {
            let charge = group.leaked + group.rows.iter().map(|&row| w.q[row]).sum::<f64>();
            let first = *group.first.get_or_insert(charge);
            let (mut bound, mut size) = (group.missed, 0.0);
            for column in group.places.chunk_by(|a, b| a.0 == b.0) {
                let (j, of) = (column[0].0, column.iter().map(|&(_, k)| w.cv[k]).sum::<f64>().abs());
                bound += MOST * of * tol.error_weight(j, x[j], x[j]);
                size += of * x[j].abs();
            }
            let left = charge - first;
            if left.abs() > bound + ROUNDED * (size + first.abs()) && left.is_finite() {
                broken.push(Broken { row: group.rows[0], first: t, t, left, bound, charge: true });
            }
        }
        broken
    }
}
