//! $table_model: what lies between points, by straight lines ("1"), natural splines ("3") or the nearest of them ("D").
//!
//! Points lie on lines, whose first input is the same on each of them (LRM 9.21): what the lines come to at the inner inputs is
//! interpolated along the outer one. Beyond its ends a curve goes on as a straight line (L), stays (C), or is an error (E).
use super::ast::E;
use super::elaborate::{Answer, Elaborator, Num, Val};
use super::source::{self, Place};
use emsim_expr::graph::Id;
use std::path::Path;

#[derive(Clone, Copy, PartialEq)]
enum Between {
    Ignored,
    Nearest,
    Lines,
    Spline,
}

/// How one input is gone along.
#[derive(Clone, Copy)]
struct Along {
    between: Between,
    /// below and above: does it stay?
    stays: [bool; 2],
}

impl Elaborator<'_> {
    pub fn table_model(&mut self, arguments: &[E], at: Place) -> Answer<Num> {
        let (mut inputs, mut rows, mut texts) = (Vec::new(), Vec::new(), Vec::new());
        for &e in arguments {
            match self.eval(e)? {
                Val::Num(n) if rows.is_empty() && texts.is_empty() => inputs.push(self.plain(&n).id),
                Val::Row(..) if texts.is_empty() => rows.push(self.row_of_numbers(e)?),
                Val::Text(text) => texts.push((text, e)),
                _ => {
                    return self.stop(self.place(e), "not expected here", "$table_model(x, y, file or rows, \"1L,3C\")")
                }
            }
        }
        if inputs.is_empty() || texts.len() > if rows.is_empty() { 2 } else { 1 } {
            return self.stop(
                at,
                "$table_model takes inputs, a file or rows, and how it goes on",
                "$table_model(V(a), x, y, \"3L\")",
            );
        }
        let (points, control) = if rows.is_empty() {
            let Some((file, e)) = texts.first().cloned() else {
                return self.stop(
                    at,
                    "$table_model without points",
                    "name a file, or a row for each input and one of values",
                );
            };
            (self.points_of_file(&file, e)?, texts.get(1).cloned())
        } else {
            if rows.iter().any(|row| row.len() != rows[0].len()) {
                return self.stop(
                    at,
                    "rows of $table_model have different numbers of values",
                    "one value for each point",
                );
            }
            let points = (0..rows[0].len()).map(|k| rows.iter().map(|row| row[k]).collect()).collect();
            (points, texts.first().cloned())
        };
        let (along, dependent) = match &control {
            Some((text, e)) => self.controls(text, *e)?,
            None => (Vec::new(), 1),
        };
        let mut along = along;
        if along.is_empty() {
            along = vec![Along { between: Between::Lines, stays: [false; 2] }; inputs.len()];
        }
        let used: Vec<usize> = (0..along.len()).filter(|&k| along[k].between != Between::Ignored).collect();
        let value = along.len() + dependent - 1;
        let columns = points.iter().map(Vec::len).min().unwrap_or(0);
        if used.len() != inputs.len() || columns <= value || points.iter().any(|p: &Vec<f64>| p.len() != columns) {
            let what =
                format!("{} inputs, and {} columns of which {} are gone along", inputs.len(), columns, used.len());
            return self.stop(
                at,
                what,
                "each point has a number for each input and a value, as the control string says",
            );
        }
        if points.iter().flatten().any(|v| !v.is_finite()) {
            return self.stop(at, "a number of this table is infinite", "");
        }
        let points: Vec<Vec<f64>> =
            points.iter().map(|p| used.iter().map(|&k| p[k]).chain([p[value]]).collect()).collect();
        let along: Vec<Along> = used.iter().map(|&k| along[k]).collect();
        let id = self.table(&inputs, &along, &points.iter().map(Vec::as_slice).collect::<Vec<_>>(), at)?;
        Ok(self.real(id))
    }

    /// Numbers of a file beside the module's text: a point a line, # before remarks.
    pub fn points_of_file(&mut self, name: &str, e: E) -> Answer<Vec<Vec<f64>>> {
        let own = self.library.sources.message(self.place(e), "", "").file;
        let path = Path::new(&own).parent().unwrap_or(Path::new("")).join(name);
        let text = match source::read(&path) {
            Ok(text) => text,
            Err(text) => return self.stop(self.place(e), text, "a table stands beside the module's file"),
        };
        let mut points = Vec::new();
        for (line, text) in text.lines().enumerate() {
            let text = text.split('#').next().unwrap_or("");
            let words = text.split(|c: char| c.is_whitespace() || c == ',').filter(|w| !w.is_empty());
            let mut point = Vec::new();
            for word in words {
                let Some(v) = super::body::scaled(word) else {
                    let what = format!("{name}, line {}: {word} is no number", line + 1);
                    return self.stop(self.place(e), what, "numbers of a point stand in a line");
                };
                point.push(v);
            }
            if !point.is_empty() {
                points.push(point);
            }
        }
        Ok(points)
    }

    /// "1LL,3C;2": of each input how it is gone along, and which value is taken.
    fn controls(&mut self, text: &str, e: E) -> Answer<(Vec<Along>, usize)> {
        let at = self.place(e);
        let mut parts = text.splitn(2, ';');
        let (inputs, value) = (parts.next().unwrap_or("").trim(), parts.next().map(str::trim));
        let Some(value) = value.map_or(Some(1), |v| v.parse().ok().filter(|&v: &usize| v > 0)) else {
            return self.stop(at, "behind the ; a number says which value is taken", "\"1L,1L;2\"");
        };
        let mut along = Vec::new();
        for word in inputs.split(',').filter(|_| !inputs.is_empty()) {
            let mut one = Along { between: Between::Lines, stays: [false; 2] };
            let mut ends = Vec::new();
            for c in word.trim().chars() {
                match c.to_ascii_uppercase() {
                    'I' => one.between = Between::Ignored,
                    'D' => one.between = Between::Nearest,
                    '1' => one.between = Between::Lines,
                    '3' => one.between = Between::Spline,
                    'C' => ends.push(true),
                    'L' => ends.push(false),
                    'E' => {
                        ends.push(false);
                        self.leave_out("$table_model with E", "beyond its ends it goes on as straight lines");
                    }
                    '2' => {
                        return self.stop(at, "splines of second order are not supported", "\"3\" is a cubic spline")
                    }
                    _ => return self.stop(at, format!("{c} means nothing here"), "1, 3, D or I, then L, C or E"),
                }
            }
            if ends.len() > 2 {
                return self.stop(at, format!("{word}: an input has two ends"), "\"1CL\": below and above");
            }
            if let (Some(&below), Some(&above)) = (ends.first(), ends.last()) {
                one.stays = [below, above];
            }
            along.push(one);
        }
        Ok((along, value))
    }

    fn table(&mut self, inputs: &[Id], along: &[Along], points: &[&[f64]], at: Place) -> Answer<Id> {
        let mut sorted = points.to_vec();
        sorted.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let (mut places, mut values) = (Vec::new(), Vec::new());
        for line in sorted.chunk_by(|a, b| a[0] == b[0]) {
            places.push(line[0][0]);
            values.push(if inputs.len() > 1 {
                let inner: Vec<&[f64]> = line.iter().map(|p| &p[1..]).collect();
                self.table(&inputs[1..], &along[1..], &inner, at)?
            } else if line.iter().any(|p| p[1] != line[0][1]) {
                return self.stop(at, format!("two values at {}", line[0][0]), "a point of a table is there once");
            } else {
                self.g.constant(line[0][1])
            });
        }
        self.is_small(at)?;
        Ok(self.curve(inputs[0], along[0], &places, &values))
    }

    fn curve(&mut self, x: Id, along: Along, places: &[f64], values: &[Id]) -> Id {
        let last = places.len() - 1;
        if last == 0 {
            return values[0];
        }
        if along.between == Between::Nearest {
            return self.nearest_point(x, places, values);
        }
        let bends = match along.between {
            Between::Spline => self.bends(along, places, values),
            _ => vec![self.g.constant(0.0); places.len()],
        };
        let mut pieces: Vec<(f64, Id)> = Vec::new();
        for k in 0..last {
            let piece = self.piece(x, &places[k..], &values[k..], &bends[k..]);
            pieces.push((places[k], piece));
        }
        // beyond the ends
        let first = if along.stays[0] { values[0] } else { self.line(x, 0, places, values, &bends) };
        let beyond = if along.stays[1] { values[last] } else { self.line(x, last, places, values, &bends) };
        let mut y = first;
        pieces.push((places[last], beyond));
        if along.between == Between::Lines {
            // a straight line goes on as it is
            pieces[0].0 = if along.stays[0] { places[0] } else { f64::NEG_INFINITY };
            if !along.stays[1] {
                pieces.pop();
            }
        }
        for (from, piece) in pieces {
            if from == f64::NEG_INFINITY {
                y = piece;
                continue;
            }
            let from = self.g.constant(from);
            let behind = self.g.not_less(x, from);
            y = self.g.select(behind, piece, y);
        }
        y
    }

    fn nearest_point(&mut self, x: Id, places: &[f64], values: &[Id]) -> Id {
        let mut y = values[0];
        for k in 1..places.len() {
            // half of the way, where the one that is further from 0 is taken
            let middle = 0.5 * (places[k - 1] + places[k]);
            let edge = self.g.constant(middle);
            y = if middle >= 0.0 {
                let behind = self.g.not_less(x, edge);
                self.g.select(behind, values[k], y)
            } else {
                let before = self.g.not_less(edge, x);
                self.g.select(before, y, values[k])
            };
        }
        y
    }

    /// Second derivatives of the spline at its points: the slope is continuous, and at an end the bend is 0, or the slope where it stays.
    fn bends(&mut self, along: Along, places: &[f64], values: &[Id]) -> Vec<Id> {
        let (n, zero) = (places.len(), self.g.constant(0.0));
        let chords: Vec<Id> = (0..n - 1)
            .map(|k| {
                let rise = self.g.sub(values[k + 1], values[k]);
                let width = self.g.constant(places[k + 1] - places[k]);
                self.g.div(rise, width)
            })
            .collect();
        // rows below, on and above the diagonal, and their right sides
        let mut rows: Vec<(f64, f64, f64, Id)> = Vec::new();
        for k in 0..n {
            let left = if k > 0 { places[k] - places[k - 1] } else { 0.0 };
            let right = if k + 1 < n { places[k + 1] - places[k] } else { 0.0 };
            let is_end = k == 0 || k + 1 == n;
            if is_end && !along.stays[usize::from(k > 0)] {
                rows.push((0.0, 1.0, 0.0, zero));
                continue;
            }
            let before = if k > 0 { chords[k - 1] } else { zero };
            let behind = if k + 1 < n { chords[k] } else { zero };
            let turn = self.g.sub(behind, before);
            rows.push((left / 6.0, (left + right) / 3.0, right / 6.0, turn));
        }
        for k in 1..n {
            let (_, on, above, right) = rows[k - 1];
            let factor = rows[k].0 / on;
            let less = self.g.constant(factor);
            let less = self.g.mul(less, right);
            rows[k].1 -= factor * above;
            rows[k].3 = self.g.sub(rows[k].3, less);
        }
        let mut bends = vec![zero; n];
        for k in (0..n).rev() {
            let (_, on, above, mut right) = rows[k];
            if k + 1 < n {
                let above = self.g.constant(above);
                let less = self.g.mul(above, bends[k + 1]);
                right = self.g.sub(right, less);
            }
            let on = self.g.constant(on);
            bends[k] = self.g.div(right, on);
        }
        bends
    }

    /// y0 + t (slope + t (b0/2 + t (b1 - b0)/(6 h))), t from the first of two points on.
    fn piece(&mut self, x: Id, places: &[f64], values: &[Id], bends: &[Id]) -> Id {
        let h = places[1] - places[0];
        let [from, half, sixth] = [places[0], 0.5, 1.0 / (6.0 * h)].map(|v| self.g.constant(v));
        let t = self.g.sub(x, from);
        let slope = self.slope_at(0, places, values, bends);
        let third = self.g.sub(bends[1], bends[0]);
        let third = self.g.mul(third, sixth);
        let second = self.g.mul(half, bends[0]);
        let mut y = self.g.mul(third, t);
        for c in [second, slope] {
            y = self.g.add(c, y);
            y = self.g.mul(y, t);
        }
        self.g.add(values[0], y)
    }

    /// The slope at point k, of the piece behind it, of the last point of that before it.
    fn slope_at(&mut self, k: usize, places: &[f64], values: &[Id], bends: &[Id]) -> Id {
        let last = k + 1 == places.len();
        let (a, b) = if last { (k - 1, k) } else { (k, k + 1) };
        let h = places[b] - places[a];
        let width = self.g.constant(h);
        let rise = self.g.sub(values[b], values[a]);
        let chord = self.g.div(rise, width);
        let (near, far) = if last { (b, a) } else { (a, b) };
        let [third, sixth] = [h / 3.0, h / 6.0].map(|v| self.g.constant(if last { v } else { -v }));
        let (one, two) = (self.g.mul(third, bends[near]), self.g.mul(sixth, bends[far]));
        let turn = self.g.add(one, two);
        self.g.add(chord, turn)
    }

    fn line(&mut self, x: Id, k: usize, places: &[f64], values: &[Id], bends: &[Id]) -> Id {
        let slope = self.slope_at(k, places, values, bends);
        let from = self.g.constant(places[k]);
        let way = self.g.sub(x, from);
        let way = self.g.mul(slope, way);
        self.g.add(values[k], way)
    }
}
