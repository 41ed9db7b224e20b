//! The small sections: isovalues, events, collapses.

use super::column::{Column, Columns, Content, collected, unzigzag, write_column, zigzag};
use crate::error::{Error, Result};
use crate::spectrum::{Collapse, Event, EventKind, FINEST_QUANTUM};

/// Appends the table of isovalues of a tree to the content of section `ISOV`.
pub(super) fn write_isovalues(bytes: &mut Vec<u8>, isovalues: &[f64]) {
    bytes.extend((isovalues.len() as u64).to_le_bytes());
    let mut previous = 0;
    let steps: Vec<u64> = isovalues
        .iter()
        .map(|&c| {
            let key = ordered_bits(c);
            key.wrapping_sub(std::mem::replace(&mut previous, key))
        })
        .collect();
    write_column(bytes, &steps);
}

/// Reads section `ISOV`: a table for each tree.
pub(super) fn read_isovalues(content: &Content) -> Result<Vec<Vec<f64>>> {
    let mut columns = content.columns();
    let mut tables = vec![read_table(&mut columns)?];
    while !columns.is_empty() {
        tables.push(read_table(&mut columns)?);
    }
    Ok(tables)
}

fn read_table(columns: &mut Columns) -> Result<Vec<f64>> {
    let n = columns.count()?;
    let steps = columns.column(n, 64)?;
    let mut key = 0u64;
    let mut previous = f64::NEG_INFINITY;
    collected(n, |i| {
        key = key.wrapping_add(steps.get(i)?);
        let c = from_ordered_bits(key);
        // Predictions divide by differences of isovalues, so this cannot wait for the check.
        if !(c.is_finite() && previous < c) {
            return Err(Error::input(format!(
                "isovalue {i} is {c}, expected finite numbers that increase"
            )));
        }
        previous = c;
        Ok(c)
    })
}

/// Bits that sort as the numbers do.
fn ordered_bits(x: f64) -> u64 {
    let bits = x.to_bits();
    if bits >> 63 == 1 { !bits } else { bits | 1 << 63 }
}

fn from_ordered_bits(key: u64) -> f64 {
    f64::from_bits(if key >> 63 == 1 { key & !(1 << 63) } else { !key })
}

/// Section `EVNT`. Positions are multiples of [`FINEST_QUANTUM`].
pub(super) fn write_events(events: &[Event]) -> Vec<u8> {
    let mut bytes = (events.len() as u64).to_le_bytes().to_vec();
    let mut column = |of: &dyn Fn(&Event) -> u64| {
        write_column(&mut bytes, &events.iter().map(of).collect::<Vec<u64>>());
    };
    column(&|e| e.isovalue.to_bits());
    for axis in 0..3 {
        column(&|e| zigzag((e.position[axis] / FINEST_QUANTUM).round() as i64));
    }
    column(&|e| e.kind.code().into());
    column(&|e| e.persistence.unwrap_or(0.0).to_bits());
    bytes
}

/// Reads section `EVNT`.
pub(super) fn read_events(content: &Content) -> Result<Vec<Event>> {
    let mut columns = content.columns();
    let n = columns.count()?;
    let isovalues = columns.column(n, 64)?;
    let positions = [columns.column(n, 40)?, columns.column(n, 40)?, columns.column(n, 40)?];
    let kinds = columns.column(n, 8)?;
    let persistence = columns.column(n, 64)?;
    columns.end()?;
    collected(n, |i| {
        let coordinate =
            |column: &Column| column.get_signed(i).map(|quanta| quanta as f64 * FINEST_QUANTUM);
        let [x, y, z] = &positions;
        let lasts = f64::from_bits(persistence.get(i)?);
        let code = kinds.get(i)? as usize;
        Ok(Event {
            isovalue: f64::from_bits(isovalues.get(i)?),
            position: [coordinate(x)?, coordinate(y)?, coordinate(z)?],
            kind: *EventKind::ALL.get(code).ok_or_else(|| {
                Error::input(format!("event {i} is of kind {code}, expected 0 to 5"))
            })?,
            persistence: (lasts != 0.0).then_some(lasts),
        })
    })
}

/// Section `COLL`.
pub(super) fn write_collapses(collapses: &[Collapse]) -> Vec<u8> {
    let mut bytes = (collapses.len() as u64).to_le_bytes().to_vec();
    let step = |of: &dyn Fn(&Collapse) -> u32| {
        let mut previous = 0i64;
        let mut steps = Vec::with_capacity(collapses.len());
        for collapse in collapses {
            let value = i64::from(of(collapse));
            steps.push(zigzag(value - previous));
            previous = value;
        }
        steps
    };
    write_column(&mut bytes, &step(&|c| c.vertex));
    let offset = |c: &Collapse| zigzag(i64::from(c.target) - i64::from(c.vertex));
    write_column(&mut bytes, &collapses.iter().map(offset).collect::<Vec<_>>());
    write_column(&mut bytes, &step(&|c| c.rank));
    write_column(&mut bytes, &collapses.iter().map(|c| u64::from(c.upward)).collect::<Vec<_>>());
    bytes
}

/// Reads section `COLL`.
pub(super) fn read_collapses(content: &Content) -> Result<Vec<Collapse>> {
    let mut columns = content.columns();
    let n = columns.count()?;
    let vertices = columns.column(n, 33)?;
    let targets = columns.column(n, 33)?;
    let ranks = columns.column(n, 33)?;
    let upward = columns.column(n, 1)?;
    columns.end()?;
    let add = |base: u32, step: u64| {
        u32::try_from(i64::from(base) + unzigzag(step))
            .map_err(|_| Error::input("a collapse refers to something beyond 32 bits"))
    };
    let (mut vertex, mut rank) = (0, 0);
    collected(n, |i| {
        vertex = add(vertex, vertices.get(i)?)?;
        rank = add(rank, ranks.get(i)?)?;
        let target = add(vertex, targets.get(i)?)?;
        Ok(Collapse { vertex, target, rank, upward: upward.get(i)? == 1 })
    })
}
