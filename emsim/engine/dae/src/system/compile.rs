//! A model whose rows are final becomes a `System`: derivatives of its expressions, one pattern for C and G, constants to the
//! linear part and the rest to tapes, what is a state, what bends.
use super::devices::places;
use super::follow::Follow;
use super::lowered::Prepared;
use super::time_only::TimeOnly;
use super::{phases, Conditions, Constant, Expressions, Made, Start, Summed, System};
use super::{Delays, Devices, Kind, Laws, Model};
use crate::conditions::size;
use crate::derive::gradient;
use crate::edges::{affine, Edges};
use crate::floating_groups::{sum_pairs, Roots};
use crate::graph::{Graph, Id, Node};
use crate::passive::is_passive;
use crate::sparse::{reciprocal, Pairs, Pattern, Rows, Stamp};
use crate::tape::Tape;
use std::collections::{BTreeMap, HashSet};
use std::sync::atomic::AtomicU32;

/// Constant entries, those of one place added up, by row and column.
type Sums = BTreeMap<(usize, usize), f64>;
/// Derivatives of rows that are expressions: row, column, d.
type Derivatives = Vec<(usize, usize, Id)>;

impl System {
    /// A system of its own, with what lowers its index laid by (lowered.rs).
    pub fn compile(mut model: Model, g: &mut Graph) -> Result<System, String> {
        model.fold_linear(g);
        let [g_sum, c_sum] = [&model.g, &model.c].map(|entries| summed(entries));
        let passive = model.f.is_empty()
            && model.q.is_empty()
            && model.flags.is_empty()
            && is_passive(&model.unknowns, &g_sum, &c_sum);
        let mut pairs = reciprocal(|i| model.unknowns[i].kind == Kind::Node, [&g_sum, &c_sum]);
        let (groups, floating) = model.sum_floating_groups(g);
        groups.iter().for_each(|layer| sum_pairs(&mut pairs, &g_sum, layer));
        let prepared = Prepared { model, groups, floating, pairs, passive, twice_bent: None };
        let lowered = prepared.lowered(g);
        let mut system = System::finish(prepared, g)?;
        system.made.lowered = lowered;
        Ok(system)
    }

    /// The model's rows are final.
    pub(super) fn finish(prepared: Prepared, g: &mut Graph) -> Result<System, String> {
        let Prepared { model, groups, floating, pairs, passive, twice_bent } = prepared;
        let n = model.unknowns.len();
        let [mut g_sum, c_sum] = [&model.g, &model.c].map(|entries| summed(entries));
        let derivatives = [&model.f, &model.q].map(|rows| derived(g, rows, n));
        let loose = loose_branches(&model, &derivatives);
        let pattern = pattern(&model, &derivatives, &loose, &groups);

        let follow = Follow::new(&model, g, &g_sum, &c_sum);
        let wanted = Edges::reads(&model, g).into_iter().chain(follow.fixed(&model));
        let follows = follow.expressions(&model, g, wanted);
        let (edges, [moved, hung]) = Edges::find(&model, g, [&g_sum, &c_sum], &follows, follow.fixed(&model));
        let time_only = TimeOnly::find(g, &moved, &model.waves, |e| affine(g, e, &model.waves));
        let swing = follow.swing(&model, g, &hung);

        let mut linear = [&g_sum, &c_sum].map(|sums| spread(sums, &pattern));
        let expressions = Expressions::compile(&model, g, &pattern, &derivatives, &mut linear);
        let conditions = Conditions::compile(&model, g);
        let tapes = [&expressions.values, &expressions.jacobian, &conditions.roots];
        if tapes.into_iter().any(Tape::has_free_symbols) {
            return Err("an expression holds a symbol that was never substituted".into());
        }
        let (has_q, differential) = stored(&model, &c_sum, &derivatives[1], &expressions.q_rows, &pattern);
        let laws = Laws::new(g, model.laws);
        let devices = Devices::new(model.classes, &model.off, &pattern);
        for i in without_number(&devices, &loose, n) {
            linear[0][at(&pattern, i, i)] = 1.0;
            g_sum.insert((i, i), 1.0);
        }
        let sums = sums(&groups, &pattern);
        let floating: HashSet<usize> = floating.into_iter().chain(sums.iter().flat_map(|s| [s.node, s.root])).collect();
        let constant_slopes = expressions.g_slots.is_empty() && expressions.c_slots.is_empty();
        let is_linear = devices.is_empty() && constant_slopes && model.flags.is_empty();
        let (mut logic, mut clocked) = (model.logic, model.clocked);
        logic.compile(g);
        clocked.compile(g);
        let mut system = System {
            n,
            stamps: stamps(&devices, &expressions),
            constant: Constant::new(n, [&model.g, &model.c], [&g_sum, &c_sum], &pairs, linear, model.f_wave),
            delays: Delays::new(g, model.delays, model.still),
            responses: model.responses,
            logic,
            clocked,
            waves: model.waves,
            flags: model.flags,
            laws,
            forces: model.forces,
            start: Start {
                currents: model.starting_currents,
                states: model.states,
                charges: model.ic_charge,
                given: model.given,
            },
            phases: phases::phases(g, &model.f.values().chain(model.q.values()).copied().collect::<Vec<_>>()),
            twice_bent,
            made: Made::default(),
            analysis: AtomicU32::new(crate::veriloga::folded::symbol_of("tran").unwrap_or(0)),
            whole: None,
            slopes: model.slopes,
            passive: passive && devices.passive,
            floating: (0..n).map(|i| floating.contains(&i)).collect(),
            sums,
            pure_linear: is_linear && expressions.values.is_empty(),
            linear: is_linear,
            expressions,
            conditions,
            edges,
            time_only,
            swing,
            nonlinear: Default::default(),
            devices,
            has_q,
            differential,
            pattern,
            unknowns: model.unknowns,
        };
        system.find_bends();
        Ok(system)
    }
}

/// Entries, those of one place added up.
pub fn summed(entries: &[(usize, usize, f64)]) -> Sums {
    let mut sums = BTreeMap::new();
    for &(r, c, v) in entries {
        *sums.entry((r, c)).or_default() += v;
    }
    sums
}

/// Derivatives of every row that is an expression, by reverse mode, only for unknowns that the row reads.
fn derived(g: &mut Graph, rows: &BTreeMap<usize, Id>, n: usize) -> Derivatives {
    let leaves: Vec<Id> = (0..n).map(|i| g.unknown(i as u32)).collect();
    let mut found = Vec::new();
    for (&row, &expr) in rows {
        let read = g.unknowns(&[expr]);
        let xs: Vec<Id> = read.iter().map(|&i| leaves[i]).collect();
        for (&col, d) in read.iter().zip(gradient(g, expr, &xs)) {
            if g.value(d) != Some(0.0) {
                found.push((row, col, d));
            }
        }
    }
    found
}

/// Branches whose two ends are one node: they stand in no row, and their own has nothing but a number.
fn loose_branches(model: &Model, derivatives: &[Derivatives; 2]) -> Vec<usize> {
    let mut bound: HashSet<usize> = model.f.keys().chain(model.q.keys()).copied().collect();
    bound.extend(model.f_wave.iter().map(|&(r, _, _)| r));
    bound.extend(model.g.iter().chain(&model.c).flat_map(|&(r, c, _)| [r, c]));
    bound.extend(derivatives.iter().flatten().flat_map(|&(r, c, _)| [r, c]));
    bound.extend(model.classes.iter().flat_map(|c| places(&**c, false)).flat_map(|(r, c)| [r, c]));
    let branch = |i: &usize| model.unknowns[*i].kind == Kind::Branch;
    (0..model.unknowns.len()).filter(branch).filter(|i| !bound.contains(i)).collect()
}

/// One pattern for C and G.
fn pattern(model: &Model, derivatives: &[Derivatives; 2], loose: &[usize], groups: &[Roots; 2]) -> Pattern {
    let constant = model.g.iter().chain(&model.c).map(|&(r, c, _)| (r, c));
    let mut entries: Vec<(usize, usize)> = constant.collect();
    entries.extend(derivatives.iter().flatten().map(|&(r, c, _)| (r, c)));
    entries.extend(model.classes.iter().flat_map(|class| places(&**class, true)));
    entries.extend(loose.iter().map(|&i| (i, i)));
    entries.extend(groups.iter().flatten().map(|(&node, &root)| (root, node)));
    Pattern::from_entries(model.unknowns.len(), &entries)
}

/// Where an entry stands that the pattern has.
fn at(pattern: &Pattern, r: usize, c: usize) -> usize {
    pattern.position(r, c).expect("every place was collected")
}

/// Sums on the pattern.
fn spread(sums: &Sums, pattern: &Pattern) -> Vec<f64> {
    let mut values = vec![0.0; pattern.rowidx.len()];
    for (&(r, c), &v) in sums {
        values[at(pattern, r, c)] = v;
    }
    values
}

impl Expressions {
    /// Constant derivatives are added to `linear`, those of G and of C; the others are on the tape.
    fn compile(
        model: &Model,
        g: &Graph,
        pattern: &Pattern,
        derivatives: &[Derivatives; 2],
        linear: &mut [Vec<f64>; 2],
    ) -> Expressions {
        let mut outs: Vec<Id> = model.f.values().chain(model.q.values()).copied().collect();
        let exponential = g.has_exponentials(&outs);
        let values = Tape::new(g, &outs).native();
        let mut slots = [Vec::new(), Vec::new()];
        let (mut constant_c, mut c_places) = (Vec::new(), Vec::new());
        for (stored, entries) in derivatives.iter().enumerate() {
            for &(r, c, d) in entries {
                let place = at(pattern, r, c);
                match g.value(d) {
                    Some(v) => linear[stored][place] += v,
                    None => {
                        slots[stored].push(place);
                        outs.push(d);
                    }
                }
                match g.value(d) {
                    _ if stored == 0 => {}
                    Some(v) => constant_c.push((r, c, v)),
                    None => c_places.push((r, c)),
                }
            }
        }
        let [g_slots, c_slots] = slots;
        let moving: HashSet<usize> = g_slots.iter().chain(&c_slots).copied().collect();
        let conducting: HashSet<usize> = g_slots.iter().copied().collect();
        let own = |i: usize| {
            let of = if exponential { &moving } else { &conducting };
            let yields = exponential || model.unknowns[i].kind == Kind::Node;
            pattern.position(i, i).filter(|k| yields && of.contains(k))
        };
        Expressions {
            rows: [&model.f, &model.q].map(|rows| rows.iter().map(|(&row, &id)| (row, id)).collect()),
            f_rows: model.f.keys().copied().collect(),
            q_rows: model.q.keys().copied().collect(),
            values,
            jacobian: Tape::new(g, &outs).native(),
            yielding: (0..pattern.n).filter_map(own).collect(),
            g_slots,
            c_slots,
            constant_c,
            c_places,
            exponential,
        }
    }
}

impl Conditions {
    fn compile(model: &Model, g: &mut Graph) -> Conditions {
        let operands: Vec<Id> = model.flags.iter().flat_map(|f| [f.up, f.down]).collect();
        let roots = Tape::new(g, &operands).native();
        let size_ids: Vec<Id> = model.flags.iter().map(|f| size(g, f.up)).collect();
        let sizes = Tape::new(g, &size_ids);
        let asks = model.flags.iter().filter(|f| !f.law.remembers() && !f.law.of_modes());
        let asked: Vec<Id> = asks.flat_map(|f| [f.up, f.down]).collect();
        let leaves = g.reachable(&asked).into_iter().filter_map(|id| match g.node(id) {
            Node::Unknown(i) => Some(i as usize),
            _ => None,
        });
        let read = leaves.collect();
        Conditions { roots, sizes, read, turning: phases::phases(g, &operands) }
    }
}

/// Which rows have a d/dt term, which unknowns stand under one.
fn stored(
    model: &Model,
    c_sum: &Sums,
    derivatives: &Derivatives,
    q_rows: &[usize],
    pattern: &Pattern,
) -> (Vec<bool>, Vec<bool>) {
    let (mut has_q, mut differential) = (vec![false; pattern.n], vec![false; pattern.n]);
    // a derivative that nobody else's equation reads is only shown; one that is read makes a state of its argument
    let read = |k: usize| pattern.column(k).iter().any(|&r| r != k);
    let state = |r: usize| model.unknowns[r].kind != Kind::Derivative || read(r);
    for &(r, c) in c_sum.keys() {
        has_q[r] = true;
        differential[c] |= state(r);
    }
    for &r in q_rows {
        has_q[r] = true;
    }
    for &(r, c, _) in derivatives {
        differential[c] |= state(r);
    }
    for (class, k) in model.classes.iter().flat_map(|c| (0..c.seats().len()).map(move |k| (c, k))) {
        let (seat, shape) = (&class.seats()[k], class.shape(k));
        for (j, rows) in seat.rows.iter().enumerate().filter(|&(j, _)| shape.stores(j)) {
            rows.iter().filter(|&&k| k >= 0).for_each(|&k| has_q[k as usize] = true);
            for (_, port) in shape.ports.iter().enumerate().filter(|&(p, _)| shape.link(j, p).charge) {
                let ends = [seat.nodes[port.0], seat.nodes[port.1]];
                ends.iter().filter(|&&k| k >= 0).for_each(|&k| differential[k as usize] = true);
            }
        }
    }
    (has_q, differential)
}

/// Loose branches whose own row is 0 = 0: the least current is as good as any. Where its number is not 0, nothing solves it.
fn without_number(devices: &Devices, loose: &[usize], n: usize) -> Vec<usize> {
    if loose.is_empty() {
        return Vec::new();
    }
    let (mut f, mut q) = (vec![0.0; n], vec![0.0; n]);
    devices.add_values(&vec![0.0; n], 0.0, &mut f, &mut q);
    loose.iter().copied().filter(|&i| f[i] == 0.0).collect()
}

fn sums(groups: &[Roots; 2], pattern: &Pattern) -> Vec<Summed> {
    let mut sums = Vec::new();
    for (layer, tied) in groups.iter().zip([true, false]) {
        let others = layer.iter().filter(|(node, root)| node != root);
        sums.extend(others.map(|(&node, &root)| Summed { node, root, place: at(pattern, root, node), tied }));
    }
    sums
}

/// Slopes of devices, then entries of G, then of C, that are not constant.
fn stamps(devices: &Devices, expressions: &Expressions) -> Vec<Stamp> {
    let mut stamps = Vec::new();
    for (k, slope) in devices.slopes.iter().enumerate() {
        stamps.extend(slope.stamps().map(|(slot, sign)| Stamp { slot: slot as u32, source: k as u32, sign }));
    }
    for (k, &slot) in expressions.g_slots.iter().chain(&expressions.c_slots).enumerate() {
        stamps.push(Stamp { slot: slot as u32, source: (devices.slopes.len() + k) as u32, sign: 1.0 });
    }
    stamps
}

impl Constant {
    /// `entries` of G and C one by one, `sums` of them by place, `linear` those on the pattern with the constant derivatives of
    /// expressions.
    fn new(
        n: usize,
        entries: [&[(usize, usize, f64)]; 2],
        sums: [&Sums; 2],
        pairs: &Pairs,
        linear: [Vec<f64>; 2],
        f_wave: Vec<(usize, usize, f64)>,
    ) -> Constant {
        let rows = |k: usize, sums: &Sums| Rows::new(n, sums, entries[k], pairs);
        // on the union of both
        let widened = |k: usize| {
            let mut wide = sums[k].clone();
            sums[1 - k].keys().for_each(|&place| {
                wide.entry(place).or_default();
            });
            rows(k, &wide)
        };
        let [g, c] = linear;
        Constant {
            g_rows: rows(0, sums[0]),
            c_rows: rows(1, sums[1]),
            stage_g: widened(0),
            stage_c: widened(1),
            g,
            c,
            f_wave,
        }
    }
}
