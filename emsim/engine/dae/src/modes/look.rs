//! A step of implicit Euler in which the efforts of laws are parameters: what their flows are for any of them.
use super::{Event, Modes, Point};

/// A step of implicit Euler with efforts as parameters.
pub(super) struct Look {
    pub y: Vec<f64>,            // without them
    pub columns: Vec<Vec<f64>>, // dy/df of the laws in question
    pub a: Vec<f64>,            // their flows: w = b + A f
    pub b: Vec<f64>,
}

impl Look {
    pub fn at(&self, f: &[f64]) -> Vec<f64> {
        let mut x = self.y.clone();
        for (column, f) in self.columns.iter().zip(f) {
            x.iter_mut().zip(column).for_each(|(x, c)| *x += f * c);
        }
        x
    }
}

impl Modes {
    /// From p, with the efforts of `which`, whose modes are free.
    pub(super) fn look(&mut self, e: &Event, p: &mut Point, h: f64, which: &[usize]) -> Option<Look> {
        self.look_from(e, p, h, which, None)
    }

    /// The same with slopes at efforts that a look before has found, from there: friction by a load that the impact makes goes with its
    /// size, which bends.
    pub(super) fn look_from(
        &mut self,
        e: &Event,
        p: &mut Point,
        h: f64,
        which: &[usize],
        from: Option<(&Look, &[f64])>,
    ) -> Option<Look> {
        let (sys, end) = (e.sys, p.t + h);
        let w = &mut *p.w;
        let ports = w.ports.clone();
        sys.eval(w, p.x, p.t);
        let mut r: Vec<f64> = w.q.iter().map(|q| -q / h).collect();
        let f0 = from.map_or(vec![0.0; which.len()], |(_, f)| f.to_vec());
        which.iter().zip(&f0).for_each(|(&k, f)| r[sys.laws.list[k].row] -= f);
        let mut y = from.map_or(p.x.to_vec(), |(look, f)| look.at(f));
        self.newton.forget();
        // rounding of charges over a short step keeps an iteration from more, and another one, linear, follows
        let (tol, a) = (&e.tol.at_least(1e-9), 1.0 / h);
        let solved = self.newton.solve(sys, w, a, &r, &mut y, end, tol, 100).is_ok()
            && self.newton.again(sys, w, (a, &r), &mut y, end, tol).is_ok();
        w.ports = ports;
        if !solved {
            return None;
        }
        sys.stage_expand(w, &y, end, 1.0 / h);
        if !self.newton.hold(sys, w, 1.0 / h) {
            return None;
        }
        let columns: Vec<Vec<f64>> = which
            .iter()
            .map(|&k| {
                let mut column = vec![0.0; sys.n];
                column[sys.laws.list[k].row] = 1.0;
                self.newton.solve_held(w, &mut column);
                column
            })
            .collect();
        let (readings, slopes) = sys.read_laws(w, &y, end);
        let m = which.len();
        let mut a = vec![0.0; m * m];
        for (i, k) in which.iter().enumerate() {
            for &(_, unknown, slope) in slopes.iter().filter(|s| s.0 == *k) {
                (0..m).for_each(|j| a[i * m + j] += slope * columns[j][unknown]);
            }
        }
        let bent = |i: usize| (0..m).map(|j| a[i * m + j] * f0[j]).sum::<f64>();
        let b = which.iter().enumerate().map(|(i, &k)| readings[k].flow - bent(i)).collect();
        let back: Vec<f64> = f0.iter().map(|f| -f).collect();
        let look = Look { y, columns, a, b };
        Some(Look { y: look.at(&back), ..look })
    }
}
