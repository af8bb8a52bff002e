//! Kernels as JSON, written and read: how derivations of different engines meet.
//!
//! A file holds one or more kernels. A kernel is a list of operations in single assignment, operands before users;
//! a number in an operand's place is the index of an earlier operation. `docs/graph-format.md` has every field.
//!
//! A file that is read may be broken or hostile: everything is checked before it is used, and what cannot be is an
//! error that names the kernel and the operation. Nothing recurses over the expressions.

use std::collections::HashSet;
use std::fmt::{self, Formatter};
use std::marker::PhantomData;

use num_rational::Ratio;
use serde::de::value::MapAccessDeserializer;
use serde::de::{self, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde::ser::Error as _;
use serde::{Deserialize, Deserializer, Serialize};
use sha2::{Digest, Sha256};

use crate::constant::Constant;
use crate::dimension::{self, DimensionError};
use crate::emit::camel_case;
use crate::graph::{Graph, Node, NodeId};
use crate::kernels::{Input, Kernel, Output, Shape};
use crate::special;
use crate::unit::Unit;

/// What a file calls its format.
pub const FORMAT: &str = "bristle-graph";
/// The version of the format that is written and read.
pub const VERSION: u32 = 2;

/// Largest file that is read, in bytes.
pub const MAX_BYTES: usize = 256 << 20;
/// Most kernels of a file.
pub const MAX_KERNELS: usize = 1000;
/// Most operations of a kernel, and most multiplications that its powers stand for.
pub const MAX_OPERATIONS: usize = 8_000_000;
/// Most inputs, and most outputs, of a kernel.
pub const MAX_FIELDS: usize = 1000;
/// Most elements of an input or output.
pub const MAX_ELEMENTS: usize = 1_000_000;
/// Longest chain of operations that use each other.
pub const MAX_DEPTH: u32 = 1_000_000;
/// Largest size of an integer exponent: a power is emitted as so many multiplications.
pub const MAX_EXPONENT: i32 = 64;
/// Longest name, in characters.
pub const MAX_NAME: usize = 64;
/// Longest text of any other kind, in characters.
pub const MAX_TEXT: usize = 4000;

/// A file, read and checked.
#[derive(Clone, Debug)]
pub struct GraphFile {
    /// What made it: a command, and the versions of its engine.
    pub generator: String,
    /// Its kernels.
    pub kernels: Vec<Kernel>,
}

/// Why a file cannot be read.
#[derive(Debug, PartialEq, thiserror::Error)]
pub enum ExchangeError {
    /// The file is larger than [`MAX_BYTES`].
    #[error("the file has {bytes} bytes; at most {MAX_BYTES} are read")]
    TooLarge {
        /// Its size.
        bytes: usize,
    },
    /// The text is no JSON, or a field or operation is unknown, missing, or of a wrong type.
    #[error("line {line}, column {column}, at `{path}`: {message}")]
    Syntax {
        /// Path of the value: `kernels[0].operations[17]`.
        path: String,
        /// Line, counted from 1.
        line: usize,
        /// Column, counted from 1.
        column: usize,
        /// What is wrong.
        message: String,
    },
    /// It is another kind of file.
    #[error("the format is `{found}`, not `{FORMAT}`")]
    Format {
        /// What the file says.
        found: String,
    },
    /// It has another version.
    #[error("the version is {found}; this program reads version {VERSION}: derive the graph again")]
    Version {
        /// What the file says.
        found: u64,
    },
    /// The file has no kernel.
    #[error("the file holds no kernel")]
    Empty,
    /// A text of the file cannot be shown.
    #[error("`{field}` {problem}")]
    Text {
        /// The field.
        field: &'static str,
        /// What is wrong.
        problem: String,
    },
    /// A kernel is wrong.
    #[error("kernel `{kernel}`: {error}")]
    Kernel {
        /// Its name.
        kernel: String,
        /// What is wrong.
        error: KernelError,
    },
}

/// What is wrong with a kernel.
#[derive(Debug, PartialEq, thiserror::Error)]
pub enum KernelError {
    /// A name is none, or taken.
    #[error("{what} `{name}` {problem}")]
    Name {
        /// What is named.
        what: String,
        /// The name.
        name: String,
        /// What is wrong.
        problem: &'static str,
    },
    /// A text cannot be shown.
    #[error("the {field} of {what} {problem}")]
    Text {
        /// The field.
        field: &'static str,
        /// What it belongs to.
        what: String,
        /// What is wrong.
        problem: String,
    },
    /// An operand does not come before its user.
    #[error("operation {operation} (`{operator}`) uses operation {operand}, which does not come before it")]
    OperandAfterUser {
        /// Index of the user.
        operation: usize,
        /// Its operator.
        operator: &'static str,
        /// Index of the operand.
        operand: usize,
    },
    /// Operations are nested too deeply.
    #[error("operation {operation} is nested deeper than {MAX_DEPTH} operations")]
    TooDeep {
        /// Index of the operation.
        operation: usize,
    },
    /// A parameter is out of range.
    #[error("operation {operation} (`{operator}`) has the parameter {parameter}; it must be {least} to {most}")]
    Parameter {
        /// Index of the operation.
        operation: usize,
        /// Its operator.
        operator: &'static str,
        /// The parameter.
        parameter: i32,
        /// The least allowed.
        least: i32,
        /// The largest allowed.
        most: i32,
    },
    /// The powers take too many multiplications.
    #[error("the powers up to operation {operation} take more than {MAX_OPERATIONS} multiplications")]
    PowersTooLarge {
        /// Index of the power that goes beyond the limit.
        operation: usize,
    },
    /// A symbol is listed twice.
    #[error("operation {operation}: the symbol `{symbol}` is listed before")]
    DoubleSymbol {
        /// Index of the second operation.
        operation: usize,
        /// The symbol.
        symbol: String,
    },
    /// An input or output names no operation.
    #[error("{what} `{name}` refers to operation {operation}, but there are {operations}")]
    NoSuchOperation {
        /// Input or output.
        what: &'static str,
        /// Its name.
        name: String,
        /// The index.
        operation: usize,
        /// How many there are.
        operations: usize,
    },
    /// Two input elements give one operation.
    #[error("input `{name}` gives operation {operation}, which another input gives")]
    GivenTwice {
        /// Name of the input.
        name: String,
        /// The operation.
        operation: usize,
    },
    /// An input would give what has its value already.
    #[error("input `{name}` gives operation {operation}, which is a constant")]
    GivenConstant {
        /// Name of the input.
        name: String,
        /// The operation.
        operation: usize,
    },
    /// A list is empty.
    #[error("{0} has no element")]
    Nothing(String),
    /// A shape does not fit the number of elements.
    #[error("output `{name}` has the shape {shape:?} but {elements} elements")]
    BadShape {
        /// Name of the output.
        name: String,
        /// Its shape.
        shape: Vec<usize>,
        /// Number of its elements.
        elements: usize,
    },
    /// An output needs a symbol that no input gives.
    #[error("an output needs the symbol `{symbol}`, which no input gives")]
    UnboundSymbol {
        /// The symbol.
        symbol: String,
    },
    /// A term makes no physical sense.
    #[error(transparent)]
    Dimension(#[from] DimensionError),
}

/// A named operation of the format.
struct Operator {
    name: &'static str,
    operands: usize,
    /// Range of the integer after the operands, if there is one.
    parameter: Option<(i32, i32)>,
    node: fn([NodeId; 2], i32) -> Node,
}

const fn operator(name: &'static str, operands: usize, node: fn([NodeId; 2], i32) -> Node) -> Operator {
    Operator { name, operands, parameter: None, node }
}

const OPERATORS: [Operator; 12] = [
    operator("add", 2, |[a, b], _| Node::Add(a, b)),
    operator("sub", 2, |[a, b], _| Node::Sub(a, b)),
    operator("mul", 2, |[a, b], _| Node::Mul(a, b)),
    operator("div", 2, |[a, b], _| Node::Div(a, b)),
    operator("neg", 1, |[a, _], _| Node::Neg(a)),
    operator("sqrt", 1, |[a, _], _| Node::Sqrt(a)),
    operator("sin", 1, |[a, _], _| Node::Sin(a)),
    operator("cos", 1, |[a, _], _| Node::Cos(a)),
    operator("asin", 1, |[a, _], _| Node::Asin(a)),
    operator("less_than", 2, |[a, b], _| Node::LessThan(a, b)),
    Operator {
        name: "powi",
        operands: 1,
        parameter: Some((-MAX_EXPONENT, MAX_EXPONENT)),
        node: |[a, _], exponent| Node::Powi(a, exponent),
    },
    Operator {
        name: "half_angle_squared",
        operands: 1,
        parameter: Some((0, special::MAX_ORDER as i32)),
        node: |[a, _], order| Node::HalfAngleSquared(order as u8, a),
    },
];

/// The operators of the format: name, number of operands, and range of the integer after them.
pub fn operators() -> impl Iterator<Item = (&'static str, usize, Option<(i32, i32)>)> {
    OPERATORS.iter().map(|operator| (operator.name, operator.operands, operator.parameter))
}

/// The name of an operation in the format, and the integer after its operands.
fn name_and_parameter(node: Node) -> (&'static str, Option<i64>) {
    match node {
        Node::Constant(Constant::Rational(_)) => ("rational", None),
        Node::Constant(Constant::Float(_)) => ("float", None),
        Node::Symbol(_) => ("symbol", None),
        Node::Add(..) => ("add", None),
        Node::Sub(..) => ("sub", None),
        Node::Mul(..) => ("mul", None),
        Node::Div(..) => ("div", None),
        Node::Neg(_) => ("neg", None),
        Node::Powi(_, exponent) => ("powi", Some(exponent.into())),
        Node::Sqrt(_) => ("sqrt", None),
        Node::Sin(_) => ("sin", None),
        Node::Cos(_) => ("cos", None),
        Node::Asin(_) => ("asin", None),
        Node::LessThan(..) => ("less_than", None),
        Node::HalfAngleSquared(order, _) => ("half_angle_squared", Some(order.into())),
    }
}

#[derive(Deserialize)]
struct Head {
    format: String,
    version: u64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileEntry {
    #[serde(rename = "format")]
    _format: IgnoredAny,
    #[serde(rename = "version")]
    _version: IgnoredAny,
    generator: String,
    #[serde(deserialize_with = "limited::<MAX_KERNELS, _, _>")]
    kernels: Vec<Object<KernelEntry>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct KernelEntry {
    name: String,
    summary: String,
    #[serde(deserialize_with = "limited::<MAX_FIELDS, _, _>")]
    inputs: Vec<Object<InputEntry>>,
    #[serde(deserialize_with = "limited::<MAX_OPERATIONS, _, _>")]
    operations: Vec<Operation>,
    #[serde(deserialize_with = "limited::<MAX_FIELDS, _, _>")]
    outputs: Vec<Object<OutputEntry>>,
}

/// An object of JSON; serde alone would take a list of the fields' values too.
struct Object<T>(T);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Object<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Fields<T>(PhantomData<T>);

        impl<'de, T: Deserialize<'de>> Visitor<'de> for Fields<T> {
            type Value = Object<T>;

            fn expecting(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
                formatter.write_str("an object, {…}")
            }

            fn visit_map<A: MapAccess<'de>>(self, fields: A) -> Result<Object<T>, A::Error> {
                T::deserialize(MapAccessDeserializer::new(fields)).map(Object)
            }
        }

        deserializer.deserialize_map(Fields(PhantomData))
    }
}

/// A list that is given up as soon as it is too long to be kept.
fn limited<'de, const MOST: usize, D: Deserializer<'de>, T: Deserialize<'de>>(
    deserializer: D,
) -> Result<Vec<T>, D::Error> {
    struct List<const MOST: usize, T>(PhantomData<T>);

    impl<'de, const MOST: usize, T: Deserialize<'de>> Visitor<'de> for List<MOST, T> {
        type Value = Vec<T>;

        fn expecting(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
            formatter.write_str("a list")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Vec<T>, A::Error> {
            let mut list = Vec::new();
            while let Some(item) = items.next_element()? {
                if list.len() == MOST {
                    return Err(de::Error::custom(format!("this list has at most {MOST} entries")));
                }
                list.push(item);
            }
            Ok(list)
        }
    }

    deserializer.deserialize_seq(List::<MOST, T>(PhantomData))
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct InputEntry {
    name: String,
    doc: String,
    #[serde(deserialize_with = "limited::<MAX_ELEMENTS, _, _>")]
    elements: Vec<(String, usize)>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct OutputEntry {
    name: String,
    doc: String,
    unit: UnitCode,
    #[serde(deserialize_with = "limited::<2, _, _>")]
    shape: Vec<usize>,
    #[serde(deserialize_with = "limited::<MAX_ELEMENTS, _, _>")]
    operations: Vec<usize>,
}

struct UnitCode(Unit);

impl Serialize for UnitCode {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.0.code())
    }
}

impl<'de> Deserialize<'de> for UnitCode {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        Unit::parse(&text).map(UnitCode).ok_or_else(|| {
            let shown = shortened(&text);
            de::Error::custom(format!("`{shown}` is no unit; units are products like `kg m^2` or `rad s^-1`, or `1`"))
        })
    }
}

/// One entry of `operations`, as it is read.
enum Operation {
    Symbol { name: String, notation: String, unit: Unit },
    Constant(Constant),
    Operator { operator: &'static Operator, operands: [usize; 2], parameter: i32 },
}

impl<'de> Deserialize<'de> for Operation {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(OperationVisitor)
    }
}

struct OperationVisitor;

impl<'de> Visitor<'de> for OperationVisitor {
    type Value = Operation;

    fn expecting(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        formatter.write_str("an operation, a list like [\"add\", 3, 4]")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Operation, A::Error> {
        let tag: String = next(&mut items, "an operation has a name")?;
        let operation = match tag.as_str() {
            "symbol" => {
                const WANTED: &str = "`symbol` takes a name, a notation and a unit";
                let (name, notation) = (next(&mut items, WANTED)?, next(&mut items, WANTED)?);
                let UnitCode(unit) = next(&mut items, WANTED)?;
                Operation::Symbol { name, notation, unit }
            }
            "rational" => {
                const WANTED: &str = "`rational` takes a numerator and a positive denominator";
                let (numerator, denominator): (i64, i64) = (next(&mut items, WANTED)?, next(&mut items, WANTED)?);
                // The least integer has no opposite.
                if denominator <= 0 || numerator == i64::MIN {
                    return Err(de::Error::custom(WANTED));
                }
                Operation::Constant(Constant::Rational(Ratio::new(numerator, denominator)))
            }
            "float" => {
                let value: f64 = next(&mut items, "`float` takes a number")?;
                if !value.is_finite() {
                    return Err(de::Error::custom("the constant is not finite"));
                }
                Operation::Constant(Constant::Float(value))
            }
            name => {
                let operator = OPERATORS.iter().find(|operator| operator.name == name).ok_or_else(|| {
                    let known = OPERATORS.map(|operator| operator.name).join(", ");
                    let shown = shortened(name);
                    de::Error::custom(format!("unknown operator `{shown}`; known are symbol, rational, float, {known}"))
                })?;
                let plural = if operator.operands == 1 { "" } else { "s" };
                let and = if operator.parameter.is_some() { " and an integer" } else { "" };
                let wanted = format!("`{name}` takes {} operand{plural}{and}", operator.operands);
                let mut operands = [0; 2];
                for operand in &mut operands[..operator.operands] {
                    *operand = next(&mut items, &wanted)?;
                }
                let parameter = match operator.parameter {
                    Some(_) => next(&mut items, &wanted)?,
                    None => 0,
                };
                Operation::Operator { operator, operands, parameter }
            }
        };
        match items.next_element::<IgnoredAny>()? {
            None => Ok(operation),
            Some(_) => Err(de::Error::custom(format!("`{tag}` has more entries than it takes"))),
        }
    }
}

fn next<'de, A: SeqAccess<'de>, T: Deserialize<'de>>(items: &mut A, wanted: &str) -> Result<T, A::Error> {
    items.next_element()?.ok_or_else(|| de::Error::custom(wanted))
}

/// A name or text of the file for a message: one short line that shows every character.
fn shortened(text: &str) -> String {
    shown(text, 40)
}

pub(crate) fn shown(text: &str, most: usize) -> String {
    let mut shown = String::new();
    for letter in text.chars().take(most) {
        if is_invisible(letter) {
            shown.extend(letter.escape_unicode());
        } else {
            shown.push(letter);
        }
    }
    if text.chars().nth(most).is_some() {
        shown.push('…');
    }
    shown
}

/// Controls, and characters that change how others are shown: a reader of emitted code must see what is there,
/// and the compiler refuses some of them in comments.
fn is_invisible(letter: char) -> bool {
    letter.is_control()
        || matches!(letter,
            '\u{ad}' | '\u{61c}' | '\u{180e}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}'
            | '\u{2060}'..='\u{206f}' | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}')
}

/// Reads a file and checks all that it says.
///
/// # Errors
/// The first thing that is wrong, with its place.
pub fn from_json(text: &str) -> Result<GraphFile, ExchangeError> {
    if text.len() > MAX_BYTES {
        return Err(ExchangeError::TooLarge { bytes: text.len() });
    }
    let Object(head): Object<Head> = parse(text)?;
    if head.format != FORMAT {
        return Err(ExchangeError::Format { found: shortened(&head.format) });
    }
    if head.version != u64::from(VERSION) {
        return Err(ExchangeError::Version { found: head.version });
    }
    let Object(file): Object<FileEntry> = parse(text)?;
    check_text(&file.generator, false).map_err(|problem| ExchangeError::Text { field: "generator", problem })?;
    if file.kernels.is_empty() {
        return Err(ExchangeError::Empty);
    }
    let mut types = HashSet::new();
    let mut kernels = Vec::with_capacity(file.kernels.len());
    for Object(entry) in file.kernels {
        let kernel = shortened(&entry.name);
        let within = |error| ExchangeError::Kernel { kernel, error };
        let result = check_kernel_name(&entry.name, &mut types).and_then(|()| entry.kernel());
        kernels.push(result.map_err(within)?);
    }
    Ok(GraphFile { generator: file.generator, kernels })
}

fn parse<'a, T: Deserialize<'a>>(text: &'a str) -> Result<T, ExchangeError> {
    let mut deserializer = serde_json::Deserializer::from_str(text);
    let syntax = |path: String, error: &serde_json::Error| {
        // The message may quote the file.
        const SHOWN: usize = 400;
        let message = error.to_string();
        let place = format!(" at line {} column {}", error.line(), error.column());
        ExchangeError::Syntax {
            // Outside of any key the path is a mark only.
            path: if matches!(path.as_str(), "." | "?") { "file".into() } else { shortened(&path) },
            line: error.line(),
            column: error.column(),
            message: shown(message.strip_suffix(&place).unwrap_or(&message), SHOWN),
        }
    };
    let value = serde_path_to_error::deserialize(&mut deserializer)
        .map_err(|error| syntax(error.path().to_string(), error.inner()))?;
    deserializer.end().map_err(|error| syntax(".".into(), &error))?;
    Ok(value)
}

/// Names that the emitted source needs for itself.
const RESERVED: [&str; 3] = ["gen", "real", "t"];

fn check_name(what: &str, name: &str) -> Result<(), KernelError> {
    let words = name.split('_');
    let snake_case = name.starts_with(|first: char| first.is_ascii_lowercase())
        && words.clone().all(|word| !word.is_empty())
        && name.chars().all(|letter| letter.is_ascii_lowercase() || letter.is_ascii_digit() || letter == '_');
    let intermediate = name.strip_prefix('t').is_some_and(|rest| rest.chars().all(|digit| digit.is_ascii_digit()));
    let problem = if !snake_case || name.len() > MAX_NAME {
        "is no name: a name is lower-case words of letters and digits, joined by `_`, of at most 64 characters"
    } else if intermediate || RESERVED.contains(&name) || syn::parse_str::<syn::Ident>(name).is_err() {
        "is reserved"
    } else {
        return Ok(());
    };
    Err(name_error(what, name, problem))
}

fn name_error(what: &str, name: &str, problem: &'static str) -> KernelError {
    KernelError::Name { what: what.into(), name: shortened(name), problem }
}

fn check_kernel_name(name: &str, types: &mut HashSet<String>) -> Result<(), KernelError> {
    check_name("the name", name)?;
    if types.insert(camel_case(name)) {
        return Ok(());
    }
    Err(name_error("the name", name, "is taken by another kernel, or gives its result the same type"))
}

/// What would be a block of code, which documentation tests run, or markup, in the documentation of emitted code.
const MARKUP: [&str; 3] = ["```", "~~~", "    "];

fn check_text(text: &str, lines: bool) -> Result<(), String> {
    if text.chars().nth(MAX_TEXT).is_some() {
        return Err(format!("is longer than {MAX_TEXT} characters"));
    }
    let forbidden = |letter: &char| is_invisible(*letter) && !(lines && *letter == '\n');
    if let Some(letter) = text.chars().find(forbidden) {
        return Err(format!("holds the control character {}", letter.escape_unicode()));
    }
    let opens_tag = |next: char| next.is_ascii_alphabetic() || matches!(next, '/' | '!' | '?');
    if text.split('<').skip(1).any(|rest| rest.starts_with(opens_tag)) {
        return Err("holds markup: put a space after `<`".into());
    }
    match MARKUP.into_iter().find(|markup| text.contains(markup)) {
        Some(markup) => Err(format!("holds \"{markup}\", which can start a block of code")),
        None => Ok(()),
    }
}

/// The names of a kernel's arguments and of their elements, which become variables side by side.
#[derive(Default)]
struct Variables(HashSet<String>);

impl Variables {
    fn add(&mut self, what: &'static str, name: &str) -> Result<(), KernelError> {
        check_name(what, name)?;
        if self.0.insert(name.to_owned()) {
            return Ok(());
        }
        Err(name_error(what, name, "is taken by another input or element"))
    }
}

impl KernelEntry {
    fn kernel(self) -> Result<Kernel, KernelError> {
        let Self { name, summary, inputs, operations, outputs } = self;
        let text = |field, what: &str, text: &str, lines| {
            check_text(text, lines).map_err(|problem| KernelError::Text { field, what: what.to_owned(), problem })
        };
        text("summary", "the kernel", &summary, true)?;
        let (graph, nodes) = build(operations)?;
        let find = |what, name: &str, operation: usize| {
            nodes.get(operation).copied().ok_or_else(|| KernelError::NoSuchOperation {
                what,
                name: name.to_owned(),
                operation,
                operations: nodes.len(),
            })
        };

        let mut variables = Variables::default();
        let mut input_names = HashSet::new();
        let mut given = HashSet::new();
        let mut checked_inputs = Vec::with_capacity(inputs.len());
        for Object(InputEntry { name, doc, elements }) in inputs {
            check_name("input", &name)?;
            if !input_names.insert(name.clone()) {
                return Err(name_error("input", &name, "is taken by another input"));
            }
            text("text", &format!("input `{name}`"), &doc, false)?;
            match elements.len() {
                0 => return Err(KernelError::Nothing(format!("input `{name}`"))),
                1 => {}
                _ => variables.add("input", &name)?,
            }
            let mut checked = Vec::with_capacity(elements.len());
            for (element, operation) in elements {
                variables.add("element", &element)?;
                let node = find("input", &name, operation)?;
                if !given.insert(node) {
                    return Err(KernelError::GivenTwice { name, operation });
                }
                if graph.as_constant(node).is_some() {
                    return Err(KernelError::GivenConstant { name, operation });
                }
                checked.push((element, node));
            }
            checked_inputs.push(Input { name, doc, elements: checked });
        }

        if outputs.is_empty() {
            return Err(KernelError::Nothing("the list of outputs".into()));
        }
        let mut fields = HashSet::new();
        let mut checked_outputs = Vec::with_capacity(outputs.len());
        for Object(OutputEntry { name, doc, unit: UnitCode(unit), shape, operations }) in outputs {
            check_name("output", &name)?;
            if !fields.insert(name.clone()) {
                return Err(name_error("output", &name, "is taken by another output"));
            }
            text("text", &format!("output `{name}`"), &doc, false)?;
            let elements = operations.len();
            let shape = match shape[..] {
                [] if elements == 1 => Shape::Scalar,
                [length] if length == elements && length > 0 => Shape::Vector(length),
                [rows, columns] if rows > 0 && columns > 0 && rows.checked_mul(columns) == Some(elements) => {
                    Shape::Matrix(rows, columns)
                }
                _ => return Err(KernelError::BadShape { name, shape, elements }),
            };
            let nodes: Result<Vec<NodeId>, _> =
                operations.into_iter().map(|operation| find("output", &name, operation)).collect();
            checked_outputs.push(Output { nodes: nodes?, name, doc, unit, shape });
        }
        dimension::check(&graph, &checked_outputs)?;
        let kernel = Kernel { name, summary, graph, inputs: checked_inputs, outputs: checked_outputs };
        match kernel.unbound_symbol() {
            Some(symbol) => Err(KernelError::UnboundSymbol { symbol: symbol.to_owned() }),
            None => Ok(kernel),
        }
    }
}

/// The graph of a list of operations, and the node of each.
fn build(operations: Vec<Operation>) -> Result<(Graph, Vec<NodeId>), KernelError> {
    let mut graph = Graph::raw();
    let mut nodes: Vec<NodeId> = Vec::with_capacity(operations.len());
    let mut depths: Vec<u32> = Vec::with_capacity(operations.len());
    let mut factors = 0;
    for (index, operation) in operations.into_iter().enumerate() {
        let mut depth = 0;
        let node = match operation {
            Operation::Constant(value) => graph.constant(value),
            Operation::Symbol { name, notation, unit } => {
                check_name(&format!("operation {index}: symbol"), &name)?;
                check_text(&notation, false).map_err(|problem| KernelError::Text {
                    field: "notation",
                    what: format!("symbol `{name}`"),
                    problem,
                })?;
                if graph.find_symbol(&name).is_some() {
                    return Err(KernelError::DoubleSymbol { operation: index, symbol: name });
                }
                graph.symbol(&name, &notation, unit)
            }
            Operation::Operator { operator, operands, parameter } => {
                let mut found = [NodeId::default(); 2];
                for (found, operand) in found.iter_mut().zip(operands).take(operator.operands) {
                    *found = *nodes.get(operand).ok_or(KernelError::OperandAfterUser {
                        operation: index,
                        operator: operator.name,
                        operand,
                    })?;
                    depth = depth.max(depths[operand] + 1);
                }
                if depth > MAX_DEPTH {
                    return Err(KernelError::TooDeep { operation: index });
                }
                if let Some((least, most)) = operator.parameter
                    && !(least..=most).contains(&parameter)
                {
                    let operator = operator.name;
                    return Err(KernelError::Parameter { operation: index, operator, parameter, least, most });
                }
                let node = (operator.node)(found, parameter);
                if let Node::Powi(_, exponent) = node {
                    factors += exponent.unsigned_abs() as usize;
                    if factors > MAX_OPERATIONS {
                        return Err(KernelError::PowersTooLarge { operation: index });
                    }
                }
                graph.intern(node)
            }
        };
        nodes.push(node);
        depths.push(depth);
    }
    Ok((graph, nodes))
}

/// The kernels as a file, an operation a line. The same kernels give the same bytes.
///
/// `generator` says what made them, in one line.
///
/// # Errors
/// If a constant is not finite.
pub fn to_json(kernels: &[Kernel], generator: &str) -> serde_json::Result<String> {
    let generator = serde_json::to_string(generator)?;
    let mut text =
        format!("{{\"format\":\"{FORMAT}\",\"version\":{VERSION},\n\"generator\":{generator},\n\"kernels\":[");
    for (i, kernel) in kernels.iter().enumerate() {
        text.push_str(if i == 0 { "\n" } else { ",\n" });
        write_kernel(&mut text, kernel)?;
    }
    text.push_str("\n]}\n");
    Ok(text)
}

fn write_kernel(text: &mut String, kernel: &Kernel) -> serde_json::Result<()> {
    let roots = kernel.outputs.iter().flat_map(|output| output.nodes.iter().copied());
    let arguments = kernel.inputs.iter().flat_map(|input| input.elements.iter().map(|(_, node)| *node));
    let live = kernel.graph.reachable(&roots.chain(arguments).collect::<Vec<_>>());
    let mut positions = vec![0; live.last().map_or(0, |id| id.index() + 1)];
    for (position, id) in live.iter().enumerate() {
        positions[id.index()] = position;
    }
    let position = |id: NodeId| positions[id.index()];
    let inputs: Vec<InputEntry> = kernel
        .inputs
        .iter()
        .map(|input| InputEntry {
            name: input.name.clone(),
            doc: input.doc.clone(),
            elements: input.elements.iter().map(|(name, node)| (name.clone(), position(*node))).collect(),
        })
        .collect();
    let outputs: Vec<OutputEntry> = kernel
        .outputs
        .iter()
        .map(|output| OutputEntry {
            name: output.name.clone(),
            doc: output.doc.clone(),
            unit: UnitCode(output.unit),
            shape: match output.shape {
                Shape::Scalar => vec![],
                Shape::Vector(length) => vec![length],
                Shape::Matrix(rows, columns) => vec![rows, columns],
            },
            operations: output.nodes.iter().copied().map(position).collect(),
        })
        .collect();
    let (name, summary) = (serde_json::to_string(&kernel.name)?, serde_json::to_string(&kernel.summary)?);
    let inputs = serde_json::to_string(&inputs)?;
    text.push_str(&format!("{{\"name\":{name},\"summary\":{summary},\n\"inputs\":{inputs},\n\"operations\":[\n"));
    for (i, &id) in live.iter().enumerate() {
        text.push_str(if i == 0 { "" } else { ",\n" });
        text.push_str(&operation(&kernel.graph, id, position)?);
    }
    let outputs = serde_json::to_string(&outputs)?;
    text.push_str(&format!("\n],\n\"outputs\":{outputs}}}"));
    Ok(())
}

fn operation(graph: &Graph, id: NodeId, position: impl Fn(NodeId) -> usize) -> serde_json::Result<String> {
    let node = graph.node(id);
    let (name, parameter) = name_and_parameter(node);
    match node {
        Node::Constant(Constant::Rational(value)) => serde_json::to_string(&(name, value.numer(), value.denom())),
        Node::Constant(Constant::Float(value)) => {
            if !value.is_finite() {
                return Err(serde_json::Error::custom(format!("the constant {value} is not finite")));
            }
            serde_json::to_string(&(name, value))
        }
        Node::Symbol(symbol) => {
            let symbol = &graph.symbols()[symbol.index()];
            serde_json::to_string(&(name, &symbol.name, &symbol.notation, symbol.unit.code()))
        }
        _ => {
            let mut text = format!("[\"{name}\"");
            for integer in node.operands().map(|operand| position(operand) as i64).chain(parameter) {
                text.push_str(&format!(",{integer}"));
            }
            text.push(']');
            Ok(text)
        }
    }
}

/// SHA-256 of the kernels as they are exchanged, in hexadecimal digits: it names the expressions, whatever made them.
///
/// # Errors
/// If a constant is not finite.
pub fn fingerprint(kernels: &[Kernel]) -> serde_json::Result<String> {
    Ok(digest(to_json(kernels, "")?.as_bytes()))
}

/// SHA-256 in hexadecimal digits.
pub fn digest(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_operator_is_read_as_it_is_written() {
        let mut graph = Graph::raw();
        let (a, b) = (graph.symbol("a", "a", Unit::ONE), graph.symbol("b", "b", Unit::ONE));
        for operator in &OPERATORS {
            let parameter = operator.parameter.map_or(0, |(least, _)| least);
            let node = (operator.node)([a, b], parameter);
            let written = operator.parameter.map(|_| i64::from(parameter));
            assert_eq!(name_and_parameter(node), (operator.name, written));
            assert_eq!(node.operands().count(), operator.operands);
        }
    }
}
