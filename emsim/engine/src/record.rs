//! Recorded waveforms: time and the asked outputs at every kept point, row by row.
use crate::graph::{Graph, Id, Node};
use crate::system::{System, Work};
use crate::tape::{Inputs, Tape};
use std::io::{self, BufWriter, Write};

enum Source {
    Unknown(usize),
    Probe(usize),
}

pub struct Record {
    sources: Vec<Source>,
    tape: Tape,
    scratch: Vec<f64>,
    pub columns: usize,
    pub data: Vec<f64>,
}

impl Record {
    pub fn new(g: &Graph, outputs: &[Id]) -> Record {
        let mut probes = Vec::new();
        let sources = outputs
            .iter()
            .map(|&id| match g.node(id) {
                Node::Unknown(i) => Source::Unknown(i as usize),
                _ => {
                    probes.push(id);
                    Source::Probe(probes.len() - 1)
                }
            })
            .collect();
        let tape = Tape::new(g, &probes);
        let scratch = tape.workspace();
        Record { sources, tape, scratch, columns: outputs.len() + 1, data: Vec::new() }
    }

    pub fn rows(&self) -> usize {
        self.data.len() / self.columns
    }

    pub fn push(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]) {
        if !self.tape.is_empty() {
            sys.set_time(w, t);
            self.tape.run(&Inputs { x, t, waves: &w.waves, flags: &w.flags }, &mut self.scratch);
        }
        self.data.push(t);
        for s in &self.sources {
            self.data.push(match *s {
                Source::Unknown(i) => x[i],
                Source::Probe(k) => self.tape.output(&self.scratch, k),
            });
        }
    }
}

/// ngspice's raw file: a text header, then little-endian float64 records or one value a line.
pub struct RawHeader<'a> {
    pub title: &'a str,
    pub date: &'a str,
    pub plotname: &'a str,
    pub command: &'a str,
    pub variables: &'a [(String, String)],
}

pub fn write_raw(
    path: &str,
    append: bool,
    head: &RawHeader,
    data: &[f64],
    skip_first: bool,
    ascii: bool,
) -> io::Result<()> {
    let file = std::fs::OpenOptions::new().create(true).write(true).append(append).truncate(!append).open(path)?;
    let mut out = BufWriter::with_capacity(1 << 20, file);
    let width = head.variables.len() + usize::from(skip_first);
    let rows = if width == 0 { 0 } else { data.len() / width };
    writeln!(out, "Title: {}", head.title)?;
    writeln!(out, "Date: {}", head.date)?;
    writeln!(out, "Plotname: {}", head.plotname)?;
    writeln!(out, "Flags: real")?;
    writeln!(out, "No. Variables: {}", head.variables.len())?;
    writeln!(out, "No. Points: {rows}")?;
    writeln!(out, "Command: {}", head.command)?;
    writeln!(out, "Variables:")?;
    for (k, (name, kind)) in head.variables.iter().enumerate() {
        writeln!(out, "\t{k}\t{name}\t{kind}")?;
    }
    writeln!(out, "{}", if ascii { "Values:" } else { "Binary:" })?;
    for (k, row) in data.chunks_exact(width.max(1)).enumerate() {
        let row = if skip_first { &row[1..] } else { row };
        if ascii {
            write!(out, "{k}")?;
            for v in row {
                writeln!(out, "\t{v:.16e}")?;
            }
            writeln!(out)?;
        } else {
            for v in row {
                out.write_all(&v.to_le_bytes())?;
            }
        }
    }
    out.flush()
}
