//! Newton's method ends where its update is small, and that may be no solution: 10/v at v = 1e-31 takes 1e31 amperes, and its own slope
//! says that 1e-31 V away all is well. What such a circuit is without its expressions is a better start than nothing at all.
use super::Dc;
use crate::model::Kind;
use crate::system::Work;

/// Conductance to ground of a node that expressions alone hold.
pub(super) const LEAK: f64 = 1e-9;

impl Dc<'_> {
    /// What the terms of each row come to before they cancel; F and its derivatives at x are left in w.
    fn terms(&self, w: &mut Work, x: &[f64]) -> Vec<f64> {
        let sys = self.sys;
        sys.eval_jacobian(w, x, 0.0, true);
        let mut terms = vec![0.0; sys.n];
        for (c, x) in x.iter().enumerate() {
            for k in sys.pattern.colptr[c]..sys.pattern.colptr[c + 1] {
                terms[sys.pattern.rowidx[k]] += (w.gv[k] * x).abs();
            }
        }
        terms
    }

    /// Is the residual of every row what rounding leaves of its terms?
    pub(super) fn is_rounding(&self, w: &mut Work, x: &[f64]) -> bool {
        let terms = self.terms(w, x);
        self.forced.is_empty()
            && (0..self.sys.n).all(|i| self.held[i].is_some() || w.f[i].abs() <= 4.0 * f64::EPSILON * terms[i])
    }

    /// Do the currents into every node that an expression stands at, and the voltages of every such source, come to nothing, roughly?
    pub(super) fn balances(&self, w: &mut Work, x: &[f64], shunt: f64) -> bool {
        let sys = self.sys;
        if sys.expression_rows().is_empty() {
            return true;
        }
        let terms = self.terms(w, x);
        let open = |&row: &usize| {
            let others = sys.sums.iter().filter(|s| s.root == row).map(|s| x[s.node]);
            let shunt = if sys.unknowns[row].kind == Kind::Node { shunt } else { 0.0 };
            let missing = (w.f[row] + shunt * (x[row] + others.sum::<f64>())).abs();
            let electrical = matches!(sys.unknowns[row].kind, Kind::Node | Kind::Branch);
            // of what the terms of a balance come to, and of what may be missing anywhere [A, V]
            // of what the terms of a balance come to, and of what may be missing anywhere [A, V]
            electrical && self.held[row].is_none() && missing > 1e-9 + 0.1 * (terms[row] + shunt * x[row].abs())
        };
        let forced = |row: usize| self.forced.iter().any(|f| f.0 == row);
        !sys.expression_rows().iter().any(|row| open(row) && !forced(*row))
    }

    /// x of the circuit without its expressions and diodes. False where it has none.
    pub(super) fn without_expressions(&mut self, w: &mut Work, x: &mut [f64]) -> bool {
        let sys = self.sys;
        x.iter_mut().zip(&self.held).filter(|(_, held)| held.is_none()).for_each(|(x, _)| *x = 0.0);
        self.matrix.fill(0.0);
        for (&at, g) in self.place.iter().zip(sys.linear_part(w, x, 0.0)) {
            self.matrix[at] += g;
        }
        for i in 0..sys.n {
            self.residual[i] = -w.f[i];
        }
        (0..sys.n).filter(|&i| sys.unknowns[i].kind == Kind::Node).for_each(|i| self.lead(i, LEAK, 0.0));
        for &(row, value) in &self.forced {
            self.matrix[self.diagonal[row]] += super::FORCE;
            self.residual[row] += super::FORCE * value;
        }
        self.hold(x);
        if self.lu.factor_or_refactor(&self.matrix).is_err() {
            return false;
        }
        self.lu.solve(&mut self.residual);
        x.iter_mut().zip(&self.residual).for_each(|(x, d)| *x += d);
        x.iter().all(|x| x.is_finite())
    }
}
