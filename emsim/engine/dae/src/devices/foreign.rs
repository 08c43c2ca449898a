//! An FMU for model exchange in the equations: for its states d/dt x - derivative = 0, for its outputs and event indicators y - value = 0. What
//! is linear of these the deck's side has placed; here are the values. Their arguments, the ports, are states, inputs and the time.
use super::class::{across, add, Asked, Class, Facts, Layout, Line, Link, Met, Number, Seat, Shape};
use super::Noise;
use crate::foreign::exchange::Exchange;
use crate::graph::{Graph, Id};
use std::sync::Arc;

pub struct Exchanged {
    of: Arc<Exchange>,
    seats: Vec<Seat>,
    shape: Shape,
    layout: Layout,
}

impl Exchanged {
    /// Unknowns: those of the ports, and those whose rows the values enter.
    pub fn new(of: Arc<Exchange>, ports: &[usize], rows: &[usize]) -> Exchanged {
        let nodes: Vec<i32> = ports.iter().map(|&k| k as i32).chain([-1]).collect();
        let (reference, layout) = (ports.len(), Layout { ports: ports.len(), branches: rows.len() });
        let link = Link { current: true, charge: false };
        let shape = Shape {
            ports: (0..ports.len()).map(|k| (k, reference)).collect(),
            // (no voltage lies along them: what they bring is no power)
            branches: vec![(reference, reference); rows.len()],
            links: vec![link; rows.len() * ports.len()],
        };
        let rows = rows.iter().map(|&row| [row as i32, -1, -1, -1]).collect();
        let seat = Seat { name: of.spec.card.clone(), nodes, rows, series: Vec::new() };
        Exchanged { of, seats: vec![seat], shape, layout }
    }

    fn asked(&self, x: &[f64]) -> Vec<f64> {
        let nodes = &self.seats[0].nodes;
        nodes[..self.layout.ports].iter().map(|&k| across(x, k, -1)).collect()
    }
}

impl Class for Exchanged {
    fn kind(&self) -> &str {
        "FMU"
    }

    fn terminals(&self) -> usize {
        self.layout.ports
    }

    fn ports(&self) -> usize {
        self.layout.ports
    }

    fn room(&self, count: usize) -> usize {
        self.layout.room(count)
    }

    fn place(&self, instance: usize, number: Number) -> usize {
        self.layout.place(instance, number)
    }

    fn is_formula(&self) -> bool {
        false
    }

    fn seats(&self) -> &[Seat] {
        &self.seats
    }

    fn seats_mut(&mut self) -> &mut [Seat] {
        &mut self.seats
    }

    fn settle(&mut self) {}

    fn moved(&self, place: &dyn Fn(i32) -> i32) -> Box<dyn Class> {
        let mut seats = self.seats.clone();
        for seat in &mut seats {
            seat.nodes.iter_mut().chain(seat.rows.as_flattened_mut()).for_each(|k| *k = place(*k));
        }
        Box::new(Exchanged { of: self.of.clone(), seats, shape: self.shape.clone(), layout: self.layout })
    }

    fn shape(&self, _: usize) -> &Shape {
        &self.shape
    }

    fn facts(&self, _: usize) -> Facts {
        Facts { exponential: false, passive: false }
    }

    fn bend(&self, _: usize, _: usize) -> f64 {
        f64::INFINITY
    }

    fn values(&self, x: &[f64], _: f64, f: &mut [f64], _: &mut [f64]) {
        let mut out = vec![0.0; self.layout.branches];
        self.of.evaluate(&self.asked(x), &mut out, None);
        self.seats[0].rows.iter().zip(out).for_each(|(rows, value)| add(f, rows, -value));
    }

    fn linearise(&self, asked: &Asked, held: &mut [f64], lines: &mut [f64]) -> Met {
        let Layout { ports, branches } = self.layout;
        let v = self.asked(asked.x);
        let (mut out, mut slopes) = (vec![0.0; branches], vec![0.0; branches * ports]);
        self.of.evaluate(&v, &mut out, Some(&mut slopes));
        let at = |number| self.layout.place(0, number);
        let mut apart = false;
        for j in 0..branches {
            let (current, mut line, mut worth) = (-out[j], lines[at(Number::StageCurrent(j))], 0.0);
            for k in 0..ports {
                let slope = -slopes[j * ports + k];
                line += lines[at(Number::StageConductance(j, k))] * (v[k] - lines[at(Number::Voltage(k))]);
                if let Some(near) = asked.near {
                    worth += slope.abs() * (near.reltol * v[k].abs() + near.vntol);
                }
                lines[at(Number::Conductance(j, k))] = slope;
                lines[at(Number::StageConductance(j, k))] = slope;
                lines[at(Number::Capacitance(j, k))] = 0.0;
            }
            if let Some(near) = asked.near {
                let worth = worth + near.share * current.abs().max(near.least) + f64::MIN_POSITIVE;
                // (a number that is none is not near anything)
                apart |= !((current - line).abs() < worth);
            }
            lines[at(Number::Current(j))] = current;
            lines[at(Number::StageCurrent(j))] = current;
            lines[at(Number::Charge(j))] = 0.0;
        }
        for k in 0..ports {
            lines[at(Number::Voltage(k))] = v[k];
            lines[at(Number::At(k))] = v[k];
            held[k * super::class::LANES] = v[k];
        }
        Met { moved: false, apart }
    }

    fn start(&self, held: &mut [f64]) {
        held.fill(0.0);
    }

    fn at(&self, _: usize, v: &[f64], _: f64, line: &mut Line) {
        let Layout { ports, branches } = self.layout;
        let (mut out, mut slopes) = (vec![0.0; branches], vec![0.0; branches * ports]);
        self.of.evaluate(v, &mut out, Some(&mut slopes));
        line.i = out.iter().map(|value| -value).collect();
        line.g = slopes.iter().map(|slope| -slope).collect();
        (line.q, line.c) = (vec![0.0; branches], vec![0.0; branches * ports]);
    }

    fn limit(&self, _: usize, _: &mut [f64], _: &[f64]) -> bool {
        false
    }

    fn energy(&self, _: usize, _: &[f64], _: f64) -> f64 {
        0.0
    }

    fn output(&self, _: usize, _: &str, _: &[f64], _: &Line) -> Option<f64> {
        None
    }

    fn noise(&self, _: usize, _: &[f64], _: &Line, _: &mut dyn FnMut(Noise)) {}

    /// There is none (`is_formula`).
    fn symbols(&self, _: usize, g: &mut Graph, _: &[Id], _: Id) -> Vec<(Id, Id)> {
        let none = g.constant(f64::NAN);
        vec![(none, none); self.layout.branches]
    }
}
