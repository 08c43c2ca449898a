//! What the deck's side says of an FMU: assemble/foreign.py makes these dictionaries.
use crate::foreign::{Kind, Spec, Start, Variable};
use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;

type Word = (u32, String);

fn variable((reference, kind): Word) -> PyResult<Variable> {
    let kind = Kind::named(&kind).ok_or_else(|| PyValueError::new_err(format!("no type `{kind}`")))?;
    Ok(Variable { reference, kind })
}

pub fn spec(d: &Bound<'_, PyDict>) -> PyResult<Arc<Spec>> {
    let get = |key: &str| d.get_item(key)?.ok_or_else(|| PyKeyError::new_err(key.to_string()));
    let all = |key: &str| get(key)?.extract::<Vec<Word>>()?.into_iter().map(variable).collect::<PyResult<Vec<_>>>();
    let mut starts = Vec::new();
    for (word, value) in get("starts")?.extract::<Vec<(Word, f64)>>()? {
        starts.push(Start::Number(variable(word)?, value));
    }
    for (reference, text) in get("texts")?.extract::<Vec<(u32, String)>>()? {
        starts.push(Start::Text(reference, text));
    }
    Ok(Arc::new(Spec {
        card: get("card")?.extract()?,
        version: get("version")?.extract()?,
        exchange: get("exchange")?.extract()?,
        library: get("library")?.extract()?,
        resources: get("resources")?.extract()?,
        token: get("token")?.extract()?,
        starts,
        inputs: all("inputs")?,
        discrete: get("discrete")?.extract()?,
        outputs: all("outputs")?,
        rough: get("rough")?.extract()?,
        states: get("states")?.extract()?,
        derivatives: get("derivatives")?.extract()?,
        indicators: get("indicators")?.extract()?,
        returns: get("returns")?.extract()?,
        differentiates: get("differentiates")?.extract()?,
        hears_steps: get("hears_steps")?.extract()?,
        logs: get("logs")?.extract()?,
        tolerance: get("tolerance")?.extract()?,
        stop: get("stop")?.extract()?,
        step: get("step")?.extract()?,
        last_words: get("last_words")?.extract()?,
        files: get("files")?.extract()?,
        folders: get("folders")?.extract()?,
        told: Default::default(),
    }))
}
