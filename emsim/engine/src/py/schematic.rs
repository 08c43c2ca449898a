use super::guarded;
use crate::schematic::{arrange, Diagram, Pin, Point, Variant, Wish};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use std::panic::{catch_unwind, AssertUnwindSafe};

type VariantOf = (i32, Vec<[i32; 4]>, Vec<[i32; 4]>);

/// Places the parts of a diagram and wires them, see schematic.rs. Variants are (cost, rectangles, pins as [x, y, dx, dy]), nets
/// lists of (part, pin), wishes ("right" | "after" | "row" | "below" | "column", a, b, weight). Returns (places as (x, y, variant), the wires of
/// each net as lists of corners, nets that are not wired whole, cost).
#[pyfunction]
#[pyo3(signature = (parts, nets, wishes, seed, rounds, moves, polish))]
pub fn arrange_diagram(
    py: Python<'_>,
    parts: Vec<Vec<VariantOf>>,
    nets: Vec<Vec<(usize, usize)>>,
    wishes: Vec<(String, usize, usize, i32)>,
    seed: u64,
    rounds: usize,
    moves: usize,
    polish: usize,
) -> PyResult<(Vec<(i32, i32, usize)>, Vec<Vec<Vec<Point>>>, Vec<usize>, i64)> {
    let wrong = |said: &str| Err(PyValueError::new_err(said.to_string()));
    let parts: Vec<Vec<Variant>> = parts
        .into_iter()
        .map(|variants| {
            let pin = |p: [i32; 4]| Pin { at: (p[0], p[1]), out: (p[2], p[3]) };
            variants
                .into_iter()
                .map(|(cost, rects, pins)| Variant { cost, rects, pins: pins.into_iter().map(pin).collect() })
                .collect()
        })
        .collect();
    if parts.is_empty() || parts.iter().any(|p: &Vec<Variant>| p.is_empty() || p.iter().any(|v| v.rects.is_empty())) {
        return wrong("a part needs a variant with a rectangle");
    }
    if nets.iter().flatten().any(|&(p, k)| p >= parts.len() || parts[p].iter().any(|v| k >= v.pins.len())) {
        return wrong("a net names a pin that is not there");
    }
    let mut asked = Vec::new();
    for (wish, a, b, weight) in wishes {
        let wish = match wish.as_str() {
            "right" => Wish::Right,
            "after" => Wish::After,
            "row" => Wish::Row,
            "below" => Wish::Below,
            "column" => Wish::Column,
            _ => return wrong("no such wish"),
        };
        if a.max(b) >= parts.len() {
            return wrong("a wish names a part that is not there");
        }
        asked.push((wish, a, b, weight));
    }
    let diagram = Diagram { parts, nets, wishes: asked };
    // a drawing never takes the run with it that it is a picture of
    let arranged = || guarded(|| arrange(&diagram, seed, rounds, moves, polish));
    let drawing = py.detach(|| catch_unwind(AssertUnwindSafe(arranged)));
    let drawing = drawing.map_err(|_| PyRuntimeError::new_err("the search for a layout failed"))??;
    Ok((drawing.places, drawing.wires, drawing.failed, drawing.cost))
}
