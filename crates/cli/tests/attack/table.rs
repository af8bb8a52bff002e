//! Tables as text, damaged by cells, rows and columns.

use fastrand::Rng;

use crate::odd::{EXTREMES, odd_text};

/// A table of cells without quotes.
#[derive(Clone, Debug)]
pub struct Table(Vec<Vec<String>>);

/// A change of a table with at least one row.
type Change = fn(&mut Vec<Vec<String>>, &mut Rng);

/// The changes, by name.
pub const CHANGES: [(&str, Change); 13] = [
    ("drop row", |rows, random| {
        drop(rows.remove(random.usize(..rows.len())))
    }),
    ("duplicate row", |rows, random| {
        let copy = rows[random.usize(..rows.len())].clone();
        rows.insert(random.usize(..=rows.len()), copy);
    }),
    ("reorder rows", |rows, random| {
        random.shuffle(&mut rows[1..])
    }),
    ("drop column", |rows, random| {
        let column = random.usize(..=rows[0].len());
        rows.iter_mut()
            .for_each(|row| drop((column < row.len()).then(|| row.remove(column))));
    }),
    ("duplicate column", |rows, random| {
        let (from, to) = (
            random.usize(..=rows[0].len()),
            random.usize(..=rows[0].len()),
        );
        for row in rows.iter_mut() {
            let copy = row.get(from).cloned().unwrap_or_default();
            row.insert(to.min(row.len()), copy);
        }
    }),
    ("exchange columns", |rows, random| {
        let columns = [
            random.usize(..=rows[0].len()),
            random.usize(..=rows[0].len()),
        ];
        rows.iter_mut()
            .filter(|row| columns.iter().all(|&column| column < row.len()))
            .for_each(|row| {
                row.swap(columns[0], columns[1]);
            });
    }),
    ("heading", |rows, random| {
        if let Some(cell) = any_cell(&mut rows[0], random) {
            match random.u8(..4) {
                0 => cell.push('s'),
                1 => *cell = cell.to_uppercase(),
                2 => *cell = format!(" {cell} "),
                _ => *cell = odd_text(random),
            }
        }
    }),
    ("number", |rows, random| {
        if let Some(cell) = any_below(rows, random) {
            let number: f64 = cell.parse().unwrap_or(1.0);
            *cell = format!("{:?}", number * (0.5 + random.f64()));
        }
    }),
    ("extreme", |rows, random| {
        if let Some(cell) = any_below(rows, random) {
            *cell = EXTREMES[random.usize(..EXTREMES.len())].to_owned();
        }
    }),
    ("odd text", |rows, random| {
        if let Some(cell) = any_below(rows, random) {
            *cell = odd_text(random);
        }
    }),
    ("quote", |rows, random| {
        if let Some(cell) = any_below(rows, random) {
            *cell = ["\"", "\"\"", "\"\n\"", "\"1.0\"", "\"1,5\""][random.usize(..5)].to_owned();
        }
    }),
    ("cells", |rows, random| {
        let row = random.usize(..rows.len());
        if random.bool() {
            rows[row].push("1.0".to_owned())
        } else {
            drop(rows[row].pop())
        }
    }),
    ("long", |rows, random| {
        let last = rows[rows.len() - 1].clone();
        let many = [100, 2_000][random.usize(..2)];
        rows.extend((1..=many).map(|index| {
            let mut row = last.clone();
            if let Some(first) = row.first_mut() {
                *first = format!(
                    "{:?}",
                    first.parse().unwrap_or(1.0) + f64::from(index) * 1e-3
                );
            }
            row
        }));
    }),
];

impl Table {
    /// The table of a text without quotes.
    pub fn of(text: &str) -> Self {
        Self(
            text.lines()
                .map(|line| line.split(',').map(str::to_owned).collect())
                .collect(),
        )
    }

    /// As text; one time in ten with another separator, or with decimal commas.
    pub fn text(&self, random: &mut Rng) -> String {
        let separator = if random.u8(..10) == 0 {
            [";", "\t", ", ", " "][random.usize(..4)]
        } else {
            ","
        };
        self.0
            .iter()
            .map(|row| row.join(separator) + "\n")
            .collect()
    }

    /// Changes the table in one way, chosen at random. Returns its name.
    pub fn change(&mut self, random: &mut Rng) -> &'static str {
        let (name, change) = CHANGES[random.usize(..CHANGES.len())];
        if !self.0.is_empty() {
            change(&mut self.0, random);
        }
        name
    }
}

fn any_cell<'r>(row: &'r mut [String], random: &mut Rng) -> Option<&'r mut String> {
    if row.is_empty() {
        None
    } else {
        Some(&mut row[random.usize(..row.len())])
    }
}

/// A cell below the heading.
fn any_below<'r>(rows: &'r mut [Vec<String>], random: &mut Rng) -> Option<&'r mut String> {
    if rows.len() < 2 {
        return None;
    }
    any_cell(&mut rows[random.usize(1..rows.len())], random)
}
