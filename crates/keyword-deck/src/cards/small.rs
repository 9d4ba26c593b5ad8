//! *TITLE, *PARAMETER, *DEFINE_TRANSFORMATION.

use super::Block;
use crate::deck::Deck;
use crate::error::Error;
use crate::parameter::{Duplication, Parameters, Value};
use crate::row::{At, Format, TENS, decode};
use crate::transform::Step;
use crate::warning::Warning;

pub(crate) fn title(block: &Block<'_>, deck: &mut Deck) {
    if let Some(card) = block.cards.first()
        && deck.title.is_empty()
    {
        deck.title = card.title();
    }
}

/// Reads definitions into `parameters`; a value may name one defined before it.
///
/// # Errors
/// What is wrong with a card.
pub(crate) fn parameter(
    block: &Block<'_>,
    parameters: &mut Parameters,
    warnings: &mut Vec<Warning>,
) -> Result<(), Error> {
    if block.has("DUPLICATION") {
        parameters.duplication = Duplication::of(block.row(0, TENS, "DFLAG")?.integer(0, "DFLAG")?);
        return Ok(());
    }
    if block.has("EXPRESSION") {
        return expressions(block, parameters, warnings);
    }
    // TYPE has one definition a card, the others four.
    let definitions: &[usize] = if block.has("TYPE") { &[0] } else { &[0, 2, 4, 6] };
    for card in block.cards.iter().filter(|card| !card.is_blank()) {
        for &at in definitions {
            let seen = At { parameters, ..*block.at };
            let row = card.row(TENS, &seen);
            let field = row.text(at);
            let value = match field.bytes().next().map(|first| first.to_ascii_uppercase()) {
                None => continue,
                Some(b'I') => Value::Integer(row.integer(at + 1, "VAL")?),
                Some(b'R') => Value::Real(row.real(at + 1, "VAL")?),
                Some(b'C') => Value::Text(row.text(at + 1)),
                Some(_) => return Err(row.wrong(at, "PRMR", "a type (R, I or C) and a name")),
            };
            define(block, card.line, &field, value, parameters, warnings);
        }
    }
    Ok(())
}

/// `field`: the type's letter and the name.
fn define(
    block: &Block<'_>,
    line: u64,
    field: &str,
    value: Value,
    parameters: &mut Parameters,
    warnings: &mut Vec<Warning>,
) {
    let name = field.chars().skip(1).collect::<String>().trim().to_owned();
    if let Some(replaced) = parameters.set(&name, value, block.has("LOCAL"), block.has("MUTABLE")) {
        warnings.push(Warning::ParameterTwice { place: block.at.place(line), name, replaced });
    }
}

/// A name in the first ten columns (twenty in long format), an expression behind it, which goes on where the next
/// card's first columns are blank.
fn expressions(block: &Block<'_>, parameters: &mut Parameters, warnings: &mut Vec<Warning>) -> Result<(), Error> {
    let width = if block.at.format == Format::Long { 20 } else { 10 };
    let mut whole: Vec<(u64, String, String)> = Vec::new();
    for card in block.cards.iter().filter(|card| !card.is_blank()) {
        let comma = memchr::memchr(b',', card.text).filter(|&at| at < width);
        let (name, rest) = match comma {
            Some(at) => (&card.text[..at], &card.text[at + 1..]),
            None => card.text.split_at(width.min(card.text.len())),
        };
        let (name, rest) = (decode(name.trim_ascii()), decode(rest.trim_ascii()));
        match whole.last_mut() {
            Some((_, _, expression)) if name.is_empty() => expression.push_str(&rest),
            _ => whole.push((card.line, name, rest)),
        }
    }
    for (line, field, expression) in whole {
        let wrong = |what: String| Error::Expression {
            place: block.at.place(line),
            keyword: block.keyword.to_owned(),
            text: crate::row::short(expression.as_bytes()),
            what,
        };
        let value = parameters.evaluate(&expression).map_err(wrong)?;
        let kind = field.chars().next().unwrap_or(' ').to_ascii_uppercase();
        let value = match (kind, value) {
            ('I', Value::Real(value)) if value.abs() < 9e15 => Value::Integer(value as i64),
            ('I', Value::Integer(value)) => Value::Integer(value),
            ('R', Value::Integer(value)) => Value::Real(value as f64),
            ('R', value) => value,
            _ => return Err(wrong("a type (R or I) and a name were expected in front of it".into())),
        };
        define(block, line, &field, value, parameters, warnings);
    }
    Ok(())
}

/// The id of a transformation, offset applied, and its steps.
///
/// # Errors
/// What is wrong with a card.
pub(crate) fn transformation(block: &Block<'_>) -> Result<(u64, Vec<Step>), Error> {
    let first = usize::from(block.has("TITLE"));
    let id = block.row(first, TENS, "TRANID")?.moved(0, "TRANID", block.frame.define)?;
    let mut steps = Vec::new();
    for card in block.cards.iter().skip(first + 1).filter(|card| !card.is_blank()) {
        let row = card.row(TENS, block.at);
        let mut a = [0.0; 7];
        for (at, value) in a.iter_mut().enumerate() {
            *value = row.real(at + 1, "A")?;
        }
        steps.push(Step { option: row.text(0).to_ascii_uppercase(), a });
    }
    Ok((id, steps))
}
