//! Reads and checks a file of kernels.

use std::collections::HashSet;
use std::fmt::{self, Formatter};
use std::marker::PhantomData;

use crate::text::{is_invisible, shortened, shown};
use num_rational::Ratio;
use serde::de::value::MapAccessDeserializer;
use serde::de::{self, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use crate::back::json::format::{
    FORMAT, InputEntry, MAX_BYTES, MAX_DEPTH, MAX_FIELDS, MAX_KERNELS, MAX_NAME, MAX_OPERATIONS,
    MAX_TEXT, OPERATORS, Operator, OutputEntry, UnitCode, VERSION, limited,
};
use crate::ir::constant::Constant;
use crate::ir::graph::{Graph, Node, NodeId};
use crate::ir::kernel::{Kernel, KernelInput, Output, OutputShape};
use crate::ir::naming::camel_case;
use crate::ir::unit::Unit;
use crate::passes::dimension;

/// A file, read and checked.
#[derive(Clone, Debug)]
pub struct GraphFile {
    /// The command that made it, and the versions of its engine.
    pub generator: String,
    /// Its kernels.
    pub kernels: Vec<Kernel>,
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

/// A JSON object; serde alone would also accept a list of the fields' values.
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

/// One entry of `operations`, as it is read.
enum Operation {
    Symbol {
        name: String,
        notation: String,
        unit: Unit,
    },
    Constant(Constant),
    Operator {
        operator: &'static Operator,
        operands: [usize; 2],
        parameter: i32,
    },
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
                Operation::Symbol {
                    name,
                    notation,
                    unit,
                }
            }
            "rational" => {
                const WANTED: &str = "`rational` takes a numerator and a positive denominator";
                let (numerator, denominator): (i64, i64) =
                    (next(&mut items, WANTED)?, next(&mut items, WANTED)?);
                // The least integer has no negative.
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
                let operator = OPERATORS
                    .iter()
                    .find(|operator| operator.name == name)
                    .ok_or_else(|| {
                        let known = OPERATORS.map(|operator| operator.name).join(", ");
                        let shown = shortened(name);
                        de::Error::custom(format!(
                            "unknown operator `{shown}`; known are symbol, rational, float, {known}"
                        ))
                    })?;
                let plural = if operator.operands == 1 { "" } else { "s" };
                let and = if operator.parameter.is_some() {
                    " and an integer"
                } else {
                    ""
                };
                let wanted = format!("`{name}` takes {} operand{plural}{and}", operator.operands);
                let mut operands = [0; 2];
                for operand in &mut operands[..operator.operands] {
                    *operand = next(&mut items, &wanted)?;
                }
                let parameter = match operator.parameter {
                    Some(_) => next(&mut items, &wanted)?,
                    None => 0,
                };
                Operation::Operator {
                    operator,
                    operands,
                    parameter,
                }
            }
        };
        match items.next_element::<IgnoredAny>()? {
            None => Ok(operation),
            Some(_) => Err(de::Error::custom(format!(
                "`{tag}` has more entries than it takes"
            ))),
        }
    }
}

fn next<'de, A: SeqAccess<'de>, T: Deserialize<'de>>(
    items: &mut A,
    wanted: &str,
) -> Result<T, A::Error> {
    items
        .next_element()?
        .ok_or_else(|| de::Error::custom(wanted))
}

/// Reads a file and checks everything in it.
///
/// # Errors
/// The first fault, with its place.
pub fn from_json(text: &str) -> Result<GraphFile, String> {
    if text.len() > MAX_BYTES {
        return Err(format!(
            "the file has {} bytes; at most {MAX_BYTES} are read",
            text.len()
        ));
    }
    let Object(head): Object<Head> = parse(text)?;
    if head.format != FORMAT {
        return Err(format!(
            "the format is `{}`, not `{FORMAT}`",
            shortened(&head.format)
        ));
    }
    if head.version != u64::from(VERSION) {
        return Err(format!(
            "the version is {}; this program reads version {VERSION}: derive the graph again",
            head.version
        ));
    }
    let Object(file): Object<FileEntry> = parse(text)?;
    check_text(&file.generator, false).map_err(|problem| format!("`generator` {problem}"))?;
    if file.kernels.is_empty() {
        return Err("the file holds no kernel".to_owned());
    }
    let mut types = HashSet::new();
    let mut kernels = Vec::with_capacity(file.kernels.len());
    for Object(entry) in file.kernels {
        let kernel = shortened(&entry.name);
        let within = |error| format!("kernel `{kernel}`: {error}");
        let result = check_kernel_name(&entry.name, &mut types).and_then(|()| entry.kernel());
        kernels.push(result.map_err(within)?);
    }
    Ok(GraphFile {
        generator: file.generator,
        kernels,
    })
}

fn parse<'a, T: Deserialize<'a>>(text: &'a str) -> Result<T, String> {
    let mut deserializer = serde_json::Deserializer::from_str(text);
    let syntax = |path: String, error: &serde_json::Error| {
        // The message may quote the file.
        const MAX_CHARS: usize = 400;
        let message = error.to_string();
        let place = format!(" at line {} column {}", error.line(), error.column());
        // Outside any key the path is only a placeholder.
        let path = if matches!(path.as_str(), "." | "?") {
            "file".into()
        } else {
            shortened(&path)
        };
        format!(
            "line {}, column {}, at `{path}`: {}",
            error.line(),
            error.column(),
            shown(message.strip_suffix(&place).unwrap_or(&message), MAX_CHARS)
        )
    };
    let value = serde_path_to_error::deserialize(&mut deserializer)
        .map_err(|error| syntax(error.path().to_string(), error.inner()))?;
    deserializer
        .end()
        .map_err(|error| syntax(".".into(), &error))?;
    Ok(value)
}

/// Names that the emitted source needs for itself.
const RESERVED: [&str; 3] = ["gen", "real", "t"];

fn check_name(what: &str, name: &str) -> Result<(), String> {
    let words = name.split('_');
    let snake_case = name.starts_with(|first: char| first.is_ascii_lowercase())
        && words.clone().all(|word| !word.is_empty())
        && name
            .chars()
            .all(|letter| letter.is_ascii_lowercase() || letter.is_ascii_digit() || letter == '_');
    let intermediate = name
        .strip_prefix('t')
        .is_some_and(|rest| rest.chars().all(|digit| digit.is_ascii_digit()));
    let problem = if !snake_case || name.len() > MAX_NAME {
        "is not a valid name: use lower-case words of letters and digits, joined by `_`, at most 64 characters"
    } else if intermediate
        || RESERVED.contains(&name)
        || syn::parse_str::<syn::Ident>(name).is_err()
    {
        "is reserved"
    } else {
        return Ok(());
    };
    Err(name_error(what, name, problem))
}

fn name_error(what: &str, name: &str, problem: &str) -> String {
    format!("{what} `{}` {problem}", shortened(name))
}

fn check_kernel_name(name: &str, types: &mut HashSet<String>) -> Result<(), String> {
    check_name("the name", name)?;
    if types.insert(camel_case(name)) {
        return Ok(());
    }
    Err(name_error(
        "the name",
        name,
        "is taken by another kernel, or gives its result the same type",
    ))
}

/// Starts of code blocks in the documentation of emitted code, which documentation tests would run.
const MARKUP: [&str; 3] = ["```", "~~~", "    "];

fn check_text(text: &str, lines: bool) -> Result<(), String> {
    if text.chars().nth(MAX_TEXT).is_some() {
        return Err(format!("is longer than {MAX_TEXT} characters"));
    }
    let forbidden = |letter: &char| is_invisible(*letter) && !(lines && *letter == '\n');
    if let Some(letter) = text.chars().find(forbidden) {
        return Err(format!(
            "holds the control character {}",
            letter.escape_unicode()
        ));
    }
    let opens_tag = |next: char| next.is_ascii_alphabetic() || matches!(next, '/' | '!' | '?');
    if text
        .split('<')
        .skip(1)
        .any(|rest| rest.starts_with(opens_tag))
    {
        return Err("holds markup: put a space after `<`".into());
    }
    match MARKUP.into_iter().find(|markup| text.contains(markup)) {
        Some(markup) => Err(format!(
            "holds \"{markup}\", which can start a block of code"
        )),
        None => Ok(()),
    }
}

/// The names of a kernel's arguments and of their elements, which become variables in one scope.
#[derive(Default)]
struct Variables(HashSet<String>);

impl Variables {
    fn add(&mut self, what: &'static str, name: &str) -> Result<(), String> {
        check_name(what, name)?;
        if self.0.insert(name.to_owned()) {
            return Ok(());
        }
        Err(name_error(
            what,
            name,
            "is taken by another input or element",
        ))
    }
}

impl KernelEntry {
    fn kernel(self) -> Result<Kernel, String> {
        let Self {
            name,
            summary,
            inputs,
            operations,
            outputs,
        } = self;
        let text = |field: &str, what: &str, text: &str, lines| {
            check_text(text, lines).map_err(|problem| format!("the {field} of {what} {problem}"))
        };
        text("summary", "the kernel", &summary, true)?;
        let (graph, nodes) = build(operations)?;
        let find = |what: &str, name: &str, operation: usize| {
            nodes.get(operation).copied().ok_or_else(|| {
                let operations = nodes.len();
                format!(
                    "{what} `{name}` refers to operation {operation}, but there are {operations}"
                )
            })
        };

        let mut variables = Variables::default();
        let mut given = HashSet::new();
        let mut checked_inputs = Vec::with_capacity(inputs.len());
        for Object(InputEntry {
            name,
            doc,
            elements,
        }) in inputs
        {
            check_name("input", &name)?;
            text("text", &format!("input `{name}`"), &doc, false)?;
            match elements.len() {
                0 => return Err(format!("input `{name}` has no element")),
                // A single element is the argument itself, and may be named like it.
                1 if elements[0].0 == name => {}
                _ => variables.add("input", &name)?,
            }
            let mut checked = Vec::with_capacity(elements.len());
            for (element, operation) in elements {
                variables.add("element", &element)?;
                let node = find("input", &name, operation)?;
                if !given.insert(node) {
                    return Err(format!(
                        "input `{name}` gives operation {operation}, which another input gives"
                    ));
                }
                if graph.as_constant(node).is_some() {
                    return Err(format!(
                        "input `{name}` gives operation {operation}, which is a constant"
                    ));
                }
                checked.push((element, node));
            }
            checked_inputs.push(KernelInput::new(&name, &doc, checked));
        }

        if outputs.is_empty() {
            return Err("the list of outputs has no element".to_owned());
        }
        let mut fields = HashSet::new();
        let mut checked_outputs = Vec::with_capacity(outputs.len());
        for Object(OutputEntry {
            name,
            doc,
            unit: UnitCode(unit),
            shape,
            operations,
        }) in outputs
        {
            check_name("output", &name)?;
            if !fields.insert(name.clone()) {
                return Err(name_error("output", &name, "is taken by another output"));
            }
            text("text", &format!("output `{name}`"), &doc, false)?;
            let elements = operations.len();
            let shape = match shape[..] {
                [] if elements == 1 => OutputShape::Scalar,
                [length] if length == elements && length > 0 => OutputShape::Vector(length),
                [rows, columns]
                    if rows > 0 && columns > 0 && rows.checked_mul(columns) == Some(elements) =>
                {
                    OutputShape::Matrix(rows, columns)
                }
                _ => {
                    return Err(format!(
                        "output `{name}` has the shape {shape:?} but {elements} elements"
                    ));
                }
            };
            let nodes: Result<Vec<NodeId>, _> = operations
                .into_iter()
                .map(|operation| find("output", &name, operation))
                .collect();
            checked_outputs.push(Output {
                nodes: nodes?,
                name,
                doc,
                unit,
                shape,
            });
        }
        dimension::check(&graph, &checked_outputs)?;
        let kernel = Kernel {
            name,
            summary,
            graph,
            inputs: checked_inputs,
            outputs: checked_outputs,
        };
        match kernel.unbound_symbol() {
            Some(symbol) => Err(format!(
                "an output needs the symbol `{symbol}`, which no input gives"
            )),
            None => Ok(kernel),
        }
    }
}

/// Builds the graph of a list of operations, with the node of each.
fn build(operations: Vec<Operation>) -> Result<(Graph, Vec<NodeId>), String> {
    let mut graph = Graph::raw();
    let mut nodes: Vec<NodeId> = Vec::with_capacity(operations.len());
    let mut depths: Vec<u32> = Vec::with_capacity(operations.len());
    let mut factors = 0;
    for (index, operation) in operations.into_iter().enumerate() {
        let mut depth = 0;
        let node = match operation {
            Operation::Constant(value) => graph.constant(value),
            Operation::Symbol {
                name,
                notation,
                unit,
            } => {
                check_name(&format!("operation {index}: symbol"), &name)?;
                check_text(&notation, false)
                    .map_err(|problem| format!("the notation of symbol `{name}` {problem}"))?;
                if graph.find_symbol(&name).is_some() {
                    return Err(format!(
                        "operation {index}: the symbol `{name}` is listed already"
                    ));
                }
                graph.symbol(&name, &notation, unit)
            }
            Operation::Operator {
                operator,
                operands,
                parameter,
            } => {
                let name = operator.name;
                let mut found = [NodeId::default(); 2];
                for (found, operand) in found.iter_mut().zip(operands).take(operator.operands) {
                    *found = *nodes.get(operand).ok_or_else(|| {
                        format!(
                            "operation {index} (`{name}`) uses operation {operand}, which does not \
                             come before it"
                        )
                    })?;
                    depth = depth.max(depths[operand] + 1);
                }
                if depth > MAX_DEPTH {
                    return Err(format!(
                        "operation {index} is nested deeper than {MAX_DEPTH} operations"
                    ));
                }
                if let Some((least, most)) = operator.parameter
                    && !(least..=most).contains(&parameter)
                {
                    return Err(format!(
                        "operation {index} (`{name}`) has the parameter {parameter}; it must be \
                         {least} to {most}"
                    ));
                }
                let node = (operator.node)(found, parameter);
                if let Node::Powi(_, exponent) = node {
                    factors += exponent.unsigned_abs() as usize;
                    if factors > MAX_OPERATIONS {
                        return Err(format!(
                            "the powers up to operation {index} take more than {MAX_OPERATIONS} \
                             multiplications"
                        ));
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
