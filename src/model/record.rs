//! Structures of numbers that state their own columns.
//!
//! A record is defined once, by `record!`: its fields, and for each of them a [`Column`] with symbol, unit, meaning and how to
//! show it. Whatever lists the numbers of a record (files, tables, figures, pages, documents) reads [`Record::COLUMNS`].

/// A structure of numbers, each of them a column.
pub trait Record: Default + 'static {
    /// One entry for each number, in the order of files.
    const COLUMNS: &'static [Column<Self>];

    /// True if every number is finite.
    fn is_finite(&self) -> bool {
        Self::COLUMNS.iter().all(|column| column.get(self).is_finite())
    }
}

/// One number of a record.
#[derive(Debug)]
pub struct Column<R> {
    /// Its field, which is its key in files; the unit is part of it.
    pub key: &'static str,
    /// MODEL's symbol, with an underscore before a subscript; empty where MODEL has none.
    pub symbol: &'static str,
    /// SI unit; empty for a pure number.
    pub unit: &'static str,
    /// In words.
    pub name: &'static str,
    /// What it means; empty where its name says all.
    pub meaning: &'static str,
    /// True for a count, which is a whole number.
    pub whole: bool,
    /// How people see it.
    pub display: Display,
    get: fn(&R) -> f64,
    set: fn(&mut R, f64),
}

impl<R> Column<R> {
    /// Reads the number. Counts are exact up to 2⁵³.
    pub fn get(&self, record: &R) -> f64 {
        (self.get)(record)
    }

    /// Changes the number; a count takes the whole part.
    pub fn set(&self, record: &mut R, value: f64) {
        (self.set)(record, value);
    }

    /// Used by `record!` alone.
    #[doc(hidden)]
    pub const fn new(
        [key, symbol, unit, name, meaning]: [&'static str; 5],
        whole: bool,
        display: Display,
        get: fn(&R) -> f64,
        set: fn(&mut R, f64),
    ) -> Self {
        Self { key, symbol, unit, name, meaning, whole, display, get, set }
    }
}

/// How people see a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Display {
    /// Where it is shown.
    pub prominence: Prominence,
    /// Unit of diagrams, of a readable size.
    pub unit: &'static str,
    /// From SI to that unit.
    pub factor: f64,
    /// How the values of several filaments, or of several passes of one, become one.
    pub combine: Combine,
}

impl Display {
    /// In files and on pages, with its mean over several filaments.
    pub const DETAIL: Self = Self { prominence: Prominence::Detail, unit: "", factor: 1.0, combine: Combine::Mean };
}

/// Where a number is shown. Each place includes those after it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Prominence {
    /// In the tables of a terminal, and first on a page.
    Headline,
    /// In figures.
    Figure,
    /// In files and on pages.
    Detail,
}

/// How the values of several filaments become one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Combine {
    /// Their mean.
    Mean,
    /// The largest.
    Max,
}

/// The types of numbers in records and settings.
pub trait Scalar {
    /// True if only whole numbers belong to the type.
    const WHOLE: bool;

    /// The number; exact up to 2⁵³.
    fn into_f64(self) -> f64;

    /// The type's nearest number towards zero.
    fn from_f64(value: f64) -> Self;
}

impl Scalar for f64 {
    const WHOLE: bool = false;

    fn into_f64(self) -> f64 {
        self
    }

    fn from_f64(value: f64) -> Self {
        value
    }
}

impl Scalar for usize {
    const WHOLE: bool = true;

    fn into_f64(self) -> f64 {
        self as f64
    }

    fn from_f64(value: f64) -> Self {
        value as Self
    }
}

impl Scalar for u32 {
    const WHOLE: bool = true;

    fn into_f64(self) -> f64 {
        f64::from(self)
    }

    fn from_f64(value: f64) -> Self {
        value as Self
    }
}

/// Defines a structure of numbers and its [`Record`], so that a field and its column are one entry.
///
/// ```
/// bristle::record! {
///     /// What a ruler has measured: for each number its symbol, unit, name and meaning.
///     pub struct Measured {
///         length_m: f64 = ["l", "m", "length", "from one end to the other"],
///         marks: usize = ["", "", "number of marks", "those that were read"],
///     }
/// }
/// use bristle::model::record::Record;
/// let keys: Vec<&str> = Measured::COLUMNS.iter().map(|column| column.key).collect();
/// assert_eq!(keys, ["length_m", "marks"]);
/// ```
///
/// A [`Display`] may follow after `=>`; without one it is [`Display::DETAIL`]. Fields after `with` are no columns.
#[macro_export]
macro_rules! record {
    (
        $(#[$attribute:meta])*
        $visibility:vis struct $record:ident {
            $(
                $field:ident: $type:ty = [$symbol:literal, $unit:literal, $name:literal, $meaning:literal]
                    $(=> $display:expr)?
            ),* $(,)?
        }
        $(with {
            $($(#[$of_other:meta])* pub $other:ident: $other_type:ty,)*
        })?
    ) => {
        $(#[$attribute])*
        $visibility struct $record {
            $(
                #[doc = concat!(
                    "The ", $name, ".\n\n| symbol | SI unit | meaning |\n|---|---|---|\n| ",
                    $symbol, " | ", $unit, " | ", $meaning, " |",
                )]
                pub $field: $type,
            )*
            $($($(#[$of_other])* pub $other: $other_type,)*)?
        }

        impl $crate::model::record::Record for $record {
            const COLUMNS: &'static [$crate::model::record::Column<Self>] = &[$(
                $crate::model::record::Column::new(
                    [stringify!($field), $symbol, $unit, $name, $meaning],
                    <$type as $crate::model::record::Scalar>::WHOLE,
                    {
                        let display = $crate::model::record::Display::DETAIL;
                        $(
                            let _ = display;
                            let display = $display;
                        )?
                        display
                    },
                    |record| $crate::model::record::Scalar::into_f64(record.$field),
                    |record, value| record.$field = $crate::model::record::Scalar::from_f64(value),
                ),
            )*];
        }
    };
}
