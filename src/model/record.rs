//! Structures of numbers that describe their own columns.
//!
//! `record!` defines a record once: its fields, and for each field a [`Column`] with symbol, unit,
//! meaning and display. Everything that lists the numbers of a record (files, tables, figures,
//! pages, documents) reads [`Record::COLUMNS`].

/// Structure of numbers, each a column.
pub trait Record: Default + 'static {
    /// Entry per number, in the order of the columns in files.
    const COLUMNS: &'static [Column<Self>];

    /// Returns `true` if every number is finite.
    fn is_finite(&self) -> bool {
        Self::COLUMNS
            .iter()
            .all(|column| column.get(self).is_finite())
    }
}

/// One number of a record.
#[derive(Debug)]
pub struct Column<R> {
    /// Name of the field and key in files, with the unit.
    pub key: &'static str,
    /// MODEL's symbol, with an underscore before a subscript; empty if there is none.
    pub symbol: &'static str,
    /// SI unit; empty for a dimensionless number.
    pub unit: &'static str,
    /// Name in words.
    pub name: &'static str,
    /// Meaning; empty if the name says it all.
    pub meaning: &'static str,
    /// `true` for a count, which is a whole number.
    pub whole: bool,
    /// Presentation to people.
    pub display: Display,
    get: fn(&R) -> f64,
    set: fn(&mut R, f64),
}

impl<R> Column<R> {
    /// Reads the number. Counts are exact up to 2⁵³.
    pub fn get(&self, record: &R) -> f64 {
        (self.get)(record)
    }

    /// Changes the number. A count takes the integer part.
    pub fn set(&self, record: &mut R, value: f64) {
        (self.set)(record, value);
    }

    /// Creates a column, only for `record!` and for structures whose numbers are not all fields.
    #[doc(hidden)]
    pub const fn new(
        [key, symbol, unit, name, meaning]: [&'static str; 5],
        whole: bool,
        display: Display,
        get: fn(&R) -> f64,
        set: fn(&mut R, f64),
    ) -> Self {
        Self {
            key,
            symbol,
            unit,
            name,
            meaning,
            whole,
            display,
            get,
            set,
        }
    }
}

/// Presentation of a number to people.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Display {
    /// Places where the number is shown.
    pub prominence: Prominence,
    /// Start of the file names of its figures.
    pub file_name: &'static str,
    /// Readable unit for figures.
    pub unit: &'static str,
    /// Conversion factor from SI to that unit.
    pub factor: f64,
    /// Scale of axes and colours.
    pub scale: Scale,
    /// Object that the number describes.
    pub scope: Scope,
    /// Combination of the values of several filaments, or of several passes of one.
    pub combine: Combine,
    /// `true` if tables and figures leave the number out where it is zero in all cases, because
    /// nothing there can change it.
    pub optional: bool,
    /// Requirement on results that have the number.
    pub needs: Needs,
    /// Range of the colours of maps, in the unit for figures; by default the range of the values.
    pub range: Option<[f64; 2]>,
    /// Line that maps show.
    pub level: Option<Level>,
    /// Curves that go with a map.
    pub curves: Curves,
}

impl Display {
    /// Display in files and on pages, with the mean of several filaments.
    pub const DETAIL: Self = Self {
        prominence: Prominence::Detail,
        file_name: "",
        unit: "",
        factor: 1.0,
        scale: Scale::Linear,
        scope: Scope::Filament,
        combine: Combine::Mean,
        optional: false,
        needs: Needs::Nothing,
        range: None,
        level: None,
        curves: Curves::OverVelocity,
    };
}

/// Places where a number is shown. Each variant includes the places of later variants.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Prominence {
    /// Tables of a terminal, and first on a page.
    Headline,
    /// Figures.
    Figure,
    /// Files and pages.
    Detail,
}

/// Scale on which axes and colours show a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences are at equal distances.
    Linear,
    /// Equal ratios are at equal distances. The values of a study span decades; they are not
    /// negative.
    Logarithmic,
    /// Logarithmic where the values of a study span decades.
    Fitting,
}

/// Requirement on results that have a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Needs {
    /// None: every result has the number.
    Nothing,
    /// A filament that is simulated alone.
    OneFilament,
    /// A tool that is pressed on with a given force, for which the depth is found.
    GivenForce,
    /// A workpiece with edges.
    Edge,
    /// A Preston coefficient.
    Removal,
    /// A Preston coefficient, and a plane over which the tool is fed.
    RemovalFromPlane,
    /// A Preston coefficient, and one of wear.
    RemovalAndWear,
}

/// Level of a number, which maps show as a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Level {
    /// Key of the number: that of the map, or another metric.
    pub of: &'static str,
    /// Level, in the unit for figures.
    pub value: f64,
    /// Meaning of the line.
    pub meaning: &'static str,
    /// Name of the line among curves; empty if they do not show it.
    pub in_curves: &'static str,
}

/// Curves that go with a map over velocity and depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Curves {
    /// None: the map suffices.
    None,
    /// Curves over the velocity, one for each depth.
    OverVelocity,
    /// Curves over the depth too, one for each velocity.
    OverBoth,
}

/// Object that a number describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scope {
    /// One filament.
    Filament,
    /// The tool: the number is proportional to the number of filaments.
    Tool,
}

/// Combination of the values of several filaments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Combine {
    /// Their mean.
    Mean,
    /// Largest value.
    Max,
}

/// Type of a number in records and settings.
pub trait Scalar {
    /// `true` if the type has only whole numbers.
    const WHOLE: bool;

    /// Returns the number as `f64`, exact up to 2⁵³.
    fn into_f64(self) -> f64;

    /// Rounds the number towards zero to a value of the type.
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

/// `true` is one, `false` zero.
impl Scalar for bool {
    const WHOLE: bool = true;

    fn into_f64(self) -> f64 {
        f64::from(u8::from(self))
    }

    fn from_f64(value: f64) -> Self {
        value != 0.0
    }
}

/// Defines a structure of numbers and implements [`Record`] for it. A field and its column are one
/// entry.
///
/// ```
/// bristle::record! {
///     /// A measurement with a ruler. Each entry has a symbol, unit, name and meaning.
///     #[derive(Default)]
///     pub struct Measured {
///         length_m: f64 = ["l", "m", "length", "from one end to the other"],
///         marks: usize = ["", "", "number of marks", "marks between the ends"],
///     }
/// }
/// use bristle::model::record::Record;
/// let keys: Vec<&str> = Measured::COLUMNS.iter().map(|column| column.key).collect();
/// assert_eq!(keys, ["length_m", "marks"]);
/// ```
///
/// An optional [`Display`] follows after `=>`; the default is [`Display::DETAIL`]. Fields after
/// `with` are not columns.
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
