//! Why a file of kernels cannot be read.

use crate::back::json::format::{FORMAT, MAX_BYTES, MAX_DEPTH, MAX_OPERATIONS, VERSION};
use crate::passes::dimension::DimensionError;

/// Why a file cannot be read.
#[derive(Debug, PartialEq, thiserror::Error)]
pub enum ExchangeError {
    /// The file is larger than [`MAX_BYTES`].
    #[error("the file has {bytes} bytes; at most {MAX_BYTES} are read")]
    TooLarge {
        /// Its size.
        bytes: usize,
    },
    /// The text is not JSON, or a field or operation is unknown, missing, or of a wrong type.
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
    /// The file states this format.
    #[error("the format is `{0}`, not `{FORMAT}`")]
    Format(String),
    /// The file states this version of the format.
    #[error("the version is {0}; this program reads version {VERSION}: derive the graph again")]
    Version(u64),
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
    /// A name is invalid or taken.
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
    #[error(
        "operation {operation} (`{operator}`) uses operation {operand}, which does not come before it"
    )]
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
    #[error(
        "operation {operation} (`{operator}`) has the parameter {parameter}; it must be {least} to {most}"
    )]
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
    #[error(
        "the powers up to operation {operation} take more than {MAX_OPERATIONS} multiplications"
    )]
    PowersTooLarge {
        /// Index of the power that goes beyond the limit.
        operation: usize,
    },
    /// A symbol is listed twice.
    #[error("operation {operation}: the symbol `{symbol}` is listed already")]
    DoubleSymbol {
        /// Index of the second operation.
        operation: usize,
        /// The symbol.
        symbol: String,
    },
    /// An input or output refers to an operation that does not exist.
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
    /// Two input elements give the same operation.
    #[error("input `{name}` gives operation {operation}, which another input gives")]
    GivenTwice {
        /// Name of the input.
        name: String,
        /// The operation.
        operation: usize,
    },
    /// An input would give a value to a constant.
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
    /// An output needs this symbol, which no input gives.
    #[error("an output needs the symbol `{0}`, which no input gives")]
    UnboundSymbol(String),
    /// A term makes no physical sense.
    #[error(transparent)]
    Dimension(#[from] DimensionError),
}
