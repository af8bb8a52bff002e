//! Rust: generic over the scalar type, so that one source serves single values and several at once,
//! or on `f64`.
//!
//! Kernels whose results have the same fields share one type, whatever the sizes of the fields, so
//! that callers can be generic in the sizes. Inputs of an [`InputGroup`] are one argument.

use std::collections::BTreeMap;
use std::fmt::Display;

use proc_macro2::{Ident, Literal, TokenStream};
use quote::{ToTokens, format_ident, quote};

use crate::back::languages::{Dialect, FunctionBody, check_names};
use crate::back::source::{Origin, count_operations, header};
use crate::ir::constant::Constant;
use crate::ir::kernel::{InputGroup, Kernel, KernelInput, Output, OutputShape};
use crate::ir::naming::camel_case;
use crate::ir::notation::SUM;

/// Number of operations from which a function is not marked to be inlined.
const MAX_INLINED_OPERATIONS: usize = 1000;

/// The scalar type of emitted Rust.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RustScalar {
    /// Any type with the trait `Real`, as Bristle's runtime defines it, which must be in scope.
    Generic,
    /// `f64`. Derivatives of `S` need a function `half_angle_squared(order: u8, u: f64) -> f64` in
    /// scope.
    Double,
}

impl RustScalar {
    fn kind(self) -> TokenStream {
        match self {
            Self::Generic => quote!(T),
            Self::Double => quote!(f64),
        }
    }

    /// The parameters or arguments of a type: the scalar, if it is one of them, and `sizes`.
    fn with(self, sizes: impl Iterator<Item = TokenStream>) -> TokenStream {
        let scalar = (self == Self::Generic).then(|| quote!(T));
        let all: Vec<TokenStream> = scalar.into_iter().chain(sizes).collect();
        match &all[..] {
            [] => TokenStream::new(),
            _ => quote!(<#(#all),*>),
        }
    }

    /// The attribute of an item. A program may call only a part of a file on `f64`.
    fn attribute(self) -> Option<TokenStream> {
        (self == Self::Double).then(|| quote!(#[allow(dead_code)]))
    }
}

/// Emits `kernels` as formatted Rust, generic over the scalar type, below a header that states the
/// `origin`.
///
/// Equal kernels give equal bytes. The source expects a trait `Real` in scope, as Bristle's runtime
/// defines it.
///
/// # Errors
/// The kernel that cannot be written, and why.
pub fn emit(kernels: &[Kernel], origin: Origin<'_>) -> Result<String, String> {
    // Items come first, because their errors name the kernel.
    let items = items(kernels, RustScalar::Generic)?;
    Ok(header(kernels, origin, "//")? + &items)
}

/// Writes structures and functions of `kernels`, each after an empty line.
///
/// # Errors
/// The kernel that cannot be written, and why.
pub fn items(kernels: &[Kernel], scalar: RustScalar) -> Result<String, String> {
    check_names(kernels, RESERVED)?;
    let mut text = String::new();
    let arguments: Vec<Vec<Argument>> = kernels.iter().map(arguments).collect::<Result<_, _>>()?;
    let mut structures = BTreeMap::new();
    let mut groups: Vec<&InputGroup> = Vec::new();
    for argument in arguments.iter().flatten() {
        groups.extend(argument.group.filter(|group| !groups.contains(group)));
    }
    for group in groups {
        let uses: Vec<&Argument> = arguments
            .iter()
            .flatten()
            .filter(|argument| argument.group == Some(group))
            .collect();
        let sizes: Vec<Vec<usize>> = uses.iter().map(|argument| argument.sizes()).collect();
        let structure = Structure::new(group.name.into(), scalar, &sizes);
        let fields = group.fields.iter().zip(&uses[0].inputs);
        let fields = fields.map(|(&(name, doc), (input, _))| {
            (name, doc.into(), usize::from(input.elements.len() > 1))
        });
        text += &format!(
            "\n{}",
            structure.declaration(group.doc, quote!(Clone, Copy, Debug, PartialEq), fields)?
        );
        structures.insert(group.name, structure);
    }
    let mut alike: BTreeMap<Vec<(&str, usize)>, Vec<&Kernel>> = BTreeMap::new();
    for kernel in kernels {
        alike.entry(fields(kernel)).or_default().push(kernel);
    }
    let result_of = |(fields, alike): (_, &Vec<&Kernel>)| {
        let sizes: Vec<Vec<usize>> = alike.iter().map(|kernel| result_sizes(kernel)).collect();
        let name = camel_case(&alike[0].name);
        (fields, Structure::new(name, scalar, &sizes))
    };
    let results: BTreeMap<_, Structure> = alike.iter().map(result_of).collect();
    for (kernel, arguments) in kernels.iter().zip(&arguments) {
        let fields = fields(kernel);
        let (alike, result) = (&alike[&fields], &results[&fields]);
        text.push('\n');
        if std::ptr::eq(alike[0], kernel) {
            let functions: Vec<String> = alike
                .iter()
                .map(|kernel| format!("[`{}`]", kernel.name))
                .collect();
            let doc = format!("Result of {}.", functions.join(", "));
            let fields = fields
                .iter()
                .enumerate()
                .map(|(k, &(name, size))| (name, description(alike, k), size));
            text += &result.declaration(&doc, quote!(Clone, Copy, Debug), fields)?;
        }
        text += &function(kernel, scalar, arguments, &structures, result)?;
    }
    Ok(text)
}

/// The error of tokens that are not valid Rust: a defect of the emitter.
fn unparsable(error: impl Display) -> String {
    format!("the emitted code does not parse: {error}")
}

/// Formats `tokens` as source.
fn format(tokens: TokenStream) -> Result<String, String> {
    let file = syn::parse2(tokens).map_err(unparsable)?;
    Ok(prettyplease::unparse(&file))
}

/// The lines of a documentation.
fn lines(doc: &str) -> impl Iterator<Item = String> {
    doc.lines().map(|line| format!(" {line}"))
}

/// An argument of a function.
struct Argument<'a> {
    name: &'a str,
    /// Its type, if it is a structure.
    group: Option<&'static InputGroup>,
    /// The inputs in it, in the order of the fields, each with the expression that stands for it.
    inputs: Vec<(&'a KernelInput, String)>,
}

impl Argument<'_> {
    /// The sizes of its arrays.
    fn sizes(&self) -> Vec<usize> {
        self.inputs
            .iter()
            .map(|(input, _)| input.elements.len())
            .filter(|&size| size > 1)
            .collect()
    }

    fn declaration(
        &self,
        scalar: RustScalar,
        structures: &BTreeMap<&str, Structure>,
    ) -> TokenStream {
        let (name, sizes) = (format_ident!("{}", self.name), self.sizes());
        let kind = match self.group {
            Some(group) => structures[group.name].with(&sizes),
            None => {
                let sizes = sizes.into_iter().map(Literal::usize_unsuffixed);
                array(scalar, &sizes.collect::<Vec<_>>())
            }
        };
        quote!(#name: #kind)
    }
}

/// The arguments of the function of `kernel`: its inputs, of which those of a group are one.
fn arguments(kernel: &Kernel) -> Result<Vec<Argument<'_>>, String> {
    let mut arguments: Vec<Argument> = Vec::new();
    for input in &kernel.inputs {
        let Some(place) = &input.place else {
            let name = parameter_name(input);
            arguments.push(Argument {
                name,
                group: None,
                inputs: vec![(input, name.into())],
            });
            continue;
        };
        let text = format!("{}.{}", place.argument, place.field);
        let is_it = |argument: &&mut Argument| {
            argument.name == place.argument && argument.group == Some(place.group)
        };
        match arguments.iter_mut().find(is_it) {
            Some(argument) => argument.inputs.push((input, text)),
            None => arguments.push(Argument {
                name: &place.argument,
                group: Some(place.group),
                inputs: vec![(input, text)],
            }),
        }
    }
    for Argument {
        name,
        group,
        inputs,
    } in &mut arguments
    {
        let Some(group) = group else { continue };
        let field = |input: &KernelInput| input.place.as_ref().map(|place| place.field);
        let order = |input| {
            group
                .fields
                .iter()
                .position(|(name, _)| field(input) == Some(name))
        };
        inputs.sort_by_key(|(input, _)| order(input));
        let found = inputs.iter().map(|(input, _)| field(input));
        if !found.eq(group.fields.iter().map(|(name, _)| Some(*name))) {
            return Err(format!(
                "argument `{name}` of kernel `{}` does not have each field of `{}` once",
                kernel.name, group.name
            ));
        }
    }
    Ok(arguments)
}

/// The name of a parameter. A scalar is named like its element, because names of elements differ
/// from each other and from those of arrays.
fn parameter_name(input: &KernelInput) -> &str {
    match &input.elements[..] {
        [(element, _)] => element,
        _ => &input.name,
    }
}

/// The type of an array of these sizes, from the outermost inwards.
fn array(scalar: RustScalar, sizes: &[impl ToTokens]) -> TokenStream {
    sizes
        .iter()
        .rev()
        .fold(scalar.kind(), |of, size| quote!([#of; #size]))
}

/// A structure for several sizes of its fields.
struct Structure {
    name: String,
    scalar: RustScalar,
    /// The sizes of all fields as they are declared: a number where all uses agree, else a
    /// parameter.
    sizes: Vec<TokenStream>,
    /// First place of each parameter among the sizes.
    parameters: Vec<usize>,
}

impl Structure {
    /// The structure of these `uses`, each with the sizes of all fields.
    fn new(name: String, scalar: RustScalar, uses: &[Vec<usize>]) -> Self {
        let (mut sizes, mut parameters) = (Vec::new(), Vec::new());
        for (place, &size) in uses[0].iter().enumerate() {
            if uses.iter().all(|sizes| sizes[place] == size) {
                sizes.push(Literal::usize_unsuffixed(size).into_token_stream());
                continue;
            }
            let is_alike = |&other: &usize| uses.iter().all(|sizes| sizes[other] == sizes[place]);
            let parameter = parameters.iter().position(is_alike).unwrap_or_else(|| {
                parameters.push(place);
                parameters.len() - 1
            });
            sizes.push(size_name(parameter).into_token_stream());
        }
        Self {
            name,
            scalar,
            sizes,
            parameters,
        }
    }

    /// The type where its fields have these sizes.
    fn with(&self, sizes: &[usize]) -> TokenStream {
        let name = format_ident!("{}", self.name);
        let parameters = self
            .parameters
            .iter()
            .map(|&place| Literal::usize_unsuffixed(sizes[place]).into_token_stream());
        let parameters = self.scalar.with(parameters);
        quote!(#name #parameters)
    }

    /// Its definition, with the names, descriptions and dimensions of its fields.
    fn declaration<'a>(
        &self,
        doc: &str,
        traits: TokenStream,
        fields: impl Iterator<Item = (&'a str, String, usize)>,
    ) -> Result<String, String> {
        let (name, docs) = (format_ident!("{}", self.name), lines(doc));
        let parameters = (0..self.parameters.len()).map(|number| {
            let name = size_name(number);
            quote!(const #name: usize)
        });
        let (parameters, attribute) = (self.scalar.with(parameters), self.scalar.attribute());
        let mut rest = &self.sizes[..];
        let fields = fields.map(|(name, doc, dimensions)| {
            let (sizes, others) = rest.split_at(dimensions);
            rest = others;
            let (name, docs, kind) = (
                format_ident!("{name}"),
                lines(&doc),
                array(self.scalar, sizes),
            );
            quote!(#(#[doc = #docs])* pub #name: #kind)
        });
        format(quote! {
            #(#[doc = #docs])*
            #[derive(#traits)]
            #attribute
            pub struct #name #parameters {
                #(#fields,)*
            }
        })
    }
}

/// Names a size: `D` for coordinates, `S` for dimensions of space, as in the recursions; others
/// follow.
fn size_name(number: usize) -> Ident {
    ["D", "S"].get(number).map_or_else(
        || format_ident!("S{number}"),
        |name| format_ident!("{name}"),
    )
}

/// Names and dimensions of the outputs. Kernels in which they agree have results of one type.
fn fields(kernel: &Kernel) -> Vec<(&str, usize)> {
    kernel
        .outputs
        .iter()
        .map(|output| (output.name.as_str(), output.shape.sizes().len()))
        .collect()
}

/// The sizes of all outputs.
fn result_sizes(kernel: &Kernel) -> Vec<usize> {
    kernel
        .outputs
        .iter()
        .flat_map(|output| output.shape.sizes())
        .collect()
}

/// Describes the output of this number in each of the `kernels`.
fn description(kernels: &[&Kernel], number: usize) -> String {
    let mut texts: Vec<String> = Vec::new();
    for kernel in kernels {
        let output = &kernel.outputs[number];
        let text = format!("{}{}", output.doc, output.in_unit());
        if !texts.contains(&text) {
            texts.push(text);
        }
    }
    texts.join("; ")
}

/// Words that cannot be names: keywords, identifiers of the source, and those that no variable may
/// shadow.
const RESERVED: &str = "\
    as break const continue crate else enum extern false fn for if impl in let loop match mod \
    move mut pub ref return self Self static struct super trait true type unsafe use where while \
    async await dyn abstract become box do final gen macro override priv try typeof unsized \
    virtual yield Real T f64 half_angle_squared None Some Ok Err";

/// Rust, with the expressions that stand for inputs.
struct Rust<'a> {
    scalar: RustScalar,
    places: BTreeMap<&'a str, &'a str>,
}

impl Dialect for Rust<'_> {
    fn name(function: &str) -> &str {
        if function == "pow" { "powf" } else { function }
    }

    // The operands are arguments.
    const COMPARED: u8 = SUM;
    const RESERVED: &'static str = RESERVED;

    fn library(&self) -> &'static str {
        match self.scalar {
            RustScalar::Generic => "T::",
            RustScalar::Double => "f64::",
        }
    }

    fn number(&self, value: Constant) -> String {
        match self.scalar {
            RustScalar::Generic => format!("T::from_f64({:?})", value.value()),
            RustScalar::Double => format!("{:?}", value.value()),
        }
    }

    fn less_than(&self, a: &str, b: &str) -> String {
        match self.scalar {
            RustScalar::Generic => format!("T::less_than({a}, {b})"),
            RustScalar::Double => format!("f64::from({a} < {b})"),
        }
    }

    fn half_angle_squared(&self, order: u8, u: &str) -> String {
        match self.scalar {
            RustScalar::Generic => format!("T::half_angle_squared::<{order}>({u})"),
            RustScalar::Double => format!("half_angle_squared({order}, {u})"),
        }
    }

    fn assignment(&self, name: &str, value: &str) -> String {
        format!("let {name} = {value};\n")
    }

    fn argument(&self, input: &KernelInput) -> String {
        self.places[input.name.as_str()].into()
    }
}

fn function(
    kernel: &Kernel,
    scalar: RustScalar,
    arguments: &[Argument],
    structures: &BTreeMap<&str, Structure>,
    result: &Structure,
) -> Result<String, String> {
    let inputs = || arguments.iter().flat_map(|argument| &argument.inputs);
    let places = inputs()
        .map(|(input, place)| (input.name.as_str(), place.as_str()))
        .collect();
    let body = FunctionBody::new(kernel, &Rust { scalar, places })?;
    let operations = count_operations(kernel);
    let given: String = inputs()
        .map(|(input, place)| format!("- `{place}`: {}\n", input.doc))
        .collect();
    let doc = format!("{}\n\n{given}\nOperations: {operations}.", kernel.summary);
    // Small functions go into the solver's loops; whole equations can be too large to copy.
    let inline = (operations.total() < MAX_INLINED_OPERATIONS).then(|| quote!(#[inline(always)]));
    let (name, docs, kind) = (
        format_ident!("{}", kernel.name),
        lines(&doc),
        result.with(&result_sizes(kernel)),
    );
    let parameters = arguments
        .iter()
        .map(|argument| argument.declaration(scalar, structures));
    let generic = (scalar == RustScalar::Generic).then(|| quote!(<T: Real>));
    let attribute = scalar.attribute();
    let head = format(quote! {
        #(#[doc = #docs])*
        #attribute
        #inline
        pub fn #name #generic(#(#parameters),*) -> #kind {}
    })?;
    let head = head
        .trim_end()
        .strip_suffix('}')
        .expect("a function ends with its body");

    let is_unused = |(input, _): &(&KernelInput, String)| body.unused.contains(&input.name);
    let unused = arguments
        .iter()
        .filter(|argument| argument.inputs.iter().all(is_unused));
    let mut statements: String = unused
        .map(|argument| format!("let _ = {};\n", argument.name))
        .collect();
    statements += &body.statements;
    let values: String = kernel
        .outputs
        .iter()
        .map(|output| value(output, &body))
        .collect();
    statements += &format!("{} {{ {values} }}", result.name);
    Ok([head, "\n", &format_statements(&statements)?, "}\n"].concat())
}

/// The field of the result for an output.
fn value(output: &Output, body: &FunctionBody) -> String {
    let values = body.values(output);
    let value = match output.shape {
        OutputShape::Scalar => values.concat(),
        OutputShape::Vector(_) => format!("[{}]", values.join(", ")),
        OutputShape::Matrix(_, columns) => {
            let rows: Vec<String> = values
                .chunks(columns)
                .map(|row| format!("[{}]", row.join(", ")))
                .collect();
            format!("[{}]", rows.join(", "))
        }
    };
    format!("{}: {value}, ", output.name)
}

/// Number of statements formatted at a time: their syntax trees are a hundred times larger than
/// their text.
const STATEMENTS_AT_A_TIME: usize = 4096;

/// Formats statements, one a line, as the lines of a function's body.
fn format_statements(statements: &str) -> Result<String, String> {
    let lines: Vec<&str> = statements.lines().collect();
    let mut text = String::new();
    for lines in lines.chunks(STATEMENTS_AT_A_TIME) {
        let body: TokenStream = lines.join("\n").parse().map_err(unparsable)?;
        let function = format(quote!(fn body() { #body }))?;
        let inner = function
            .trim_end()
            .strip_suffix('}')
            .and_then(|function| function.split_once('\n'));
        text += inner.expect("the body has a line").1;
    }
    Ok(text)
}
