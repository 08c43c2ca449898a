//! Matching, strong components and floating groups: the graph theory that `plan` needs.
use std::collections::{HashMap, VecDeque};

/// A path of exchanges that gives equation `start` an unknown. `by`: equation of an unknown, `of`: unknown of an equation.
pub fn augment(
    start: usize,
    reads: &dyn Fn(usize) -> Vec<usize>,
    by: &mut [Option<usize>],
    of: &mut [Option<usize>],
) -> bool {
    let mut from: HashMap<usize, usize> = HashMap::new(); // unknown -> equation that looked at it
    let mut queue = VecDeque::from([start]);
    while let Some(e) = queue.pop_front() {
        for unknown in reads(e) {
            if from.contains_key(&unknown) {
                continue;
            }
            from.insert(unknown, e);
            let Some(taken) = by[unknown] else {
                let mut free = unknown;
                loop {
                    let e = from[&free];
                    let before = of[e];
                    (by[free], of[e]) = (Some(e), Some(free));
                    match before {
                        Some(b) if e != start => free = b,
                        _ => return true,
                    }
                }
            };
            queue.push_back(taken);
        }
    }
    false
}

/// Tarjan's algorithm without recursion; components come after those they lead to.
pub fn strong_components(next: &[Vec<usize>], roots: &[usize]) -> Vec<Vec<usize>> {
    let n = next.len();
    let (mut index, mut low, mut on) = (vec![usize::MAX; n], vec![0; n], vec![false; n]);
    let (mut stack, mut out, mut count) = (Vec::new(), Vec::new(), 0);
    for &root in roots {
        if index[root] != usize::MAX {
            continue;
        }
        let mut calls = vec![(root, 0)];
        while let Some(&mut (v, ref mut k)) = calls.last_mut() {
            if *k == 0 {
                (index[v], low[v], on[v]) = (count, count, true);
                count += 1;
                stack.push(v);
            }
            if let Some(&to) = next[v].get(*k) {
                *k += 1;
                if index[to] == usize::MAX {
                    calls.push((to, 0));
                } else if on[to] {
                    low[v] = low[v].min(index[to]);
                }
                continue;
            }
            calls.pop();
            if let Some(&(parent, _)) = calls.last() {
                low[parent] = low[parent].min(low[v]);
            }
            if low[v] == index[v] {
                let mut component = Vec::new();
                while let Some(w) = stack.pop() {
                    on[w] = false;
                    component.push(w);
                    if w == v {
                        break;
                    }
                }
                out.push(component);
            }
        }
    }
    out
}
