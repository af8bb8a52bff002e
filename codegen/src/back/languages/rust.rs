//! Rust, generic over the scalar type, so that one source serves single values and several at once.
//!
//! Kernels whose results have the same fields share one type, whatever the sizes of these are: what
//! uses the functions can be generic in the sizes. Inputs that belong together are one argument.

use std::collections::BTreeMap;
use std::fmt::Display;

use proc_macro2::{Ident, Literal, TokenStream};
use quote::{ToTokens, format_ident, quote};

use crate::back::languages::{Dialect, FunctionBody, SUM, Strength};
use crate::back::source::{Origin, count_operations, header};
use crate::ir::constant::Constant;
use crate::ir::kernel::{Input, Kernel, Output, Shape};
use crate::ir::naming::camel_case;

/// A function of more operations than this is not marked to be inlined.
const MAX_INLINED_OPERATIONS: usize = 1000;

/// Inputs that are one argument, of a structure, wherever a kernel has all of them.
struct Group {
    /// The name of the structure.
    name: &'static str,
    doc: &'static str,
    /// Its fields, with their descriptions.
    fields: &'static [(&'static str, &'static str)],
    /// Whether they are arrays.
    arrays: bool,
    /// The arguments, each with the inputs that are its fields.
    arguments: &'static [(&'static str, &'static [&'static str])],
}

const GROUPS: [Group; 6] = [
    Group {
        name: "SegmentConstants",
        doc: "The constants of a segment.",
        fields: &[
            ("length", "Its length, `h` in m."),
            ("mass", "Its mass, `m` in kg."),
            (
                "inertia",
                "Its transverse moment of inertia about its centre, `J` in kg m².",
            ),
        ],
        arrays: false,
        arguments: &[(
            "segment",
            &["segment_length", "segment_mass", "segment_inertia"],
        )],
    },
    Group {
        name: "JointConstants",
        doc: "The constants of a joint.",
        fields: &[
            ("stiffness", "Its stiffness, `c` in N m."),
            ("damping", "Its damping, `d` in N m s."),
        ],
        arrays: false,
        arguments: &[("joint", &["joint_stiffness", "joint_damping"])],
    },
    Group {
        name: "StepWeights",
        doc: "How an implicit step moves coordinates and rates with the accelerations: `δq = w_q δq̈`, `δq̇ = w_v δq̈`.",
        fields: &[("coordinates", "`w_q` in s²."), ("rates", "`w_v` in s.")],
        arrays: false,
        arguments: &[("weights", &["coordinate_weight", "rate_weight"])],
    },
    Group {
        name: "Side",
        doc: "One side of a joint.",
        fields: &[
            (
                "angles",
                "`sin φ, cos φ`, and where the function takes four, `sin θ, cos θ`.",
            ),
            (
                "rates",
                "`φ̇, θ̇` in rad/s, less those of a segment that turns rigidly with the body.",
            ),
        ],
        arrays: true,
        arguments: &[
            ("previous", &["previous", "previous_rates"]),
            ("next", &["next", "next_rates"]),
            ("z", &["z_angles", "z_rates"]),
            ("x", &["x_angles", "x_rates"]),
        ],
    },
    Group {
        name: "AzimuthSteps",
        doc: "How the azimuth changes at a joint, `θ` of the previous segment less `θ'` of the next.",
        fields: &[
            ("plain", "`sin(θ − θ'), cos(θ − θ')`"),
            (
                "unbent",
                "`sin(θ − θ' + κ), cos(θ − θ' + κ)`, with the relaxed angle `κ`.",
            ),
        ],
        arrays: true,
        arguments: &[("steps", &["azimuth_step", "unbent_step"])],
    },
    Group {
        name: "Coordinate",
        doc: "An azimuth or the variation of a polar angle, with its rate.",
        fields: &[
            ("value", "`θ` in rad, or `η`."),
            ("rate", "`θ̇` in rad/s, or `η̇` in 1/s."),
        ],
        arrays: false,
        arguments: &[
            ("previous", &["theta_previous", "theta_rate_previous"]),
            ("next", &["theta_next", "theta_rate_next"]),
            ("variation", &["phi_variation", "phi_variation_rate"]),
            (
                "previous_variation",
                &["phi_variation_previous", "phi_variation_rate_previous"],
            ),
            (
                "next_variation",
                &["phi_variation_next", "phi_variation_rate_next"],
            ),
        ],
    },
];

impl Group {
    /// The inputs of `kernel` with these names, if it has them all. A scalar of another name is one
    /// of several: `segment_mass_1`.
    fn find<'a>(&self, kernel: &'a Kernel, names: &[&str]) -> Option<Vec<&'a Input>> {
        let is_alike = |Input { name, elements, .. }: &Input| match &elements[..] {
            [(element, _)] => !self.arrays && element == name,
            _ => self.arrays,
        };
        let find = |name: &&str| {
            kernel
                .inputs
                .iter()
                .find(|input| input.name == **name && is_alike(input))
        };
        names.iter().map(find).collect()
    }
}

/// The formatted Rust source of `kernels`, below a header that states its `origin`.
///
/// The same kernels give the same bytes. The source expects a trait `Real` in scope, as Bristle's
/// runtime defines it.
///
/// # Errors
/// The kernel that cannot be written, and why.
pub fn emit(kernels: &[Kernel], origin: Origin<'_>) -> Result<String, String> {
    emit_with("", kernels, origin)
}

/// The same as a file for users of the solver, which imports that trait.
///
/// # Errors
/// The kernel that cannot be written, and why.
pub fn emit_file(kernels: &[Kernel], origin: Origin<'_>) -> Result<String, String> {
    emit_with("\nuse bristle::equations::Real;\n", kernels, origin)
}

fn emit_with(imports: &str, kernels: &[Kernel], origin: Origin<'_>) -> Result<String, String> {
    // First, because an error here names the kernel.
    let items = items(kernels)?;
    Ok(header(kernels, origin, "//")? + imports + &items)
}

/// Structures and functions, each after an empty line.
fn items(kernels: &[Kernel]) -> Result<String, String> {
    let mut text = String::new();
    // A file may give a kernel's result the name of a structure.
    let is_free = |group: &&Group| {
        kernels
            .iter()
            .all(|kernel| camel_case(&kernel.name) != group.name)
    };
    let groups: Vec<&Group> = GROUPS.iter().filter(is_free).collect();
    let arguments: Vec<Vec<Argument>> = kernels
        .iter()
        .map(|kernel| arguments(kernel, &groups))
        .collect();
    let mut structures = BTreeMap::new();
    for Group {
        name,
        doc,
        fields,
        arrays,
        ..
    } in groups
    {
        let uses = arguments
            .iter()
            .flatten()
            .filter(|argument| argument.structure == Some(*name));
        let sizes: Vec<Vec<usize>> = uses.map(Argument::sizes).collect();
        if !sizes.is_empty() {
            let structure = Structure::new((*name).into(), &sizes);
            let fields = fields
                .iter()
                .map(|&(name, doc)| (name, doc.into(), usize::from(*arrays)));
            text += &format!(
                "\n{}",
                structure.declaration(doc, quote!(Clone, Copy, Debug, PartialEq), fields)?
            );
            structures.insert(*name, structure);
        }
    }
    let mut alike: BTreeMap<Vec<(&str, usize)>, Vec<&Kernel>> = BTreeMap::new();
    for kernel in kernels {
        alike.entry(fields(kernel)).or_default().push(kernel);
    }
    let result_of = |(fields, alike): (_, &Vec<&Kernel>)| {
        let sizes: Vec<Vec<usize>> = alike.iter().map(|kernel| result_sizes(kernel)).collect();
        (fields, Structure::new(camel_case(&alike[0].name), &sizes))
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
        text += &function(kernel, arguments, &structures, result)?;
    }
    Ok(text)
}

/// The error of tokens that are not valid Rust: a defect of the emitter.
fn unparsable(error: impl Display) -> String {
    format!("the emitted code does not parse: {error}")
}

/// `tokens` as formatted source.
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
    /// The name of its type, if it is a structure.
    structure: Option<&'static str>,
    /// The inputs in it, each with the expression that stands for it.
    inputs: Vec<(&'a Input, String)>,
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

    fn declaration(&self, structures: &BTreeMap<&str, Structure>) -> TokenStream {
        let (name, sizes) = (format_ident!("{}", self.name), self.sizes());
        let kind = match self.structure {
            Some(name) => structures[name].with(&sizes),
            None => array(
                &sizes
                    .into_iter()
                    .map(Literal::usize_unsuffixed)
                    .collect::<Vec<_>>(),
            ),
        };
        quote!(#name: #kind)
    }
}

/// The arguments of the function of `kernel`: its inputs, of which those of `groups` are put
/// together.
fn arguments<'a>(kernel: &'a Kernel, groups: &[&Group]) -> Vec<Argument<'a>> {
    let single = |input: &'a Input| {
        let name = parameter_name(input);
        Argument {
            name,
            structure: None,
            inputs: vec![(input, name.into())],
        }
    };
    let mut arguments: Vec<Argument> = kernel.inputs.iter().map(single).collect();
    for group in groups {
        for (name, members) in group.arguments {
            let Some(inputs) = group.find(kernel, members) else {
                continue;
            };
            // A file may use the name for something else.
            let is_taken = |input: &Input| {
                (input.name == *name && !members.contains(name))
                    || input.elements.iter().any(|(element, _)| element == name)
            };
            if !kernel.inputs.iter().any(is_taken) {
                let fields = inputs.into_iter().zip(group.fields);
                let inputs = fields
                    .map(|(input, (field, _))| (input, format!("{name}.{field}")))
                    .collect();
                arguments.retain(|argument| !members[1..].contains(&argument.name));
                let first = arguments
                    .iter_mut()
                    .find(|argument| argument.name == members[0]);
                *first.expect("it is an input") = Argument {
                    name,
                    structure: Some(group.name),
                    inputs,
                };
            }
        }
    }
    arguments
}

/// A scalar is named as the element that it is, because the names of elements differ from each
/// other and from those of arrays.
fn parameter_name(input: &Input) -> &str {
    match &input.elements[..] {
        [(element, _)] => element,
        _ => &input.name,
    }
}

/// The type of an array of these sizes, from the outermost inwards.
fn array(sizes: &[impl ToTokens]) -> TokenStream {
    sizes
        .iter()
        .rev()
        .fold(quote!(T), |of, size| quote!([#of; #size]))
}

/// A structure for several sizes of its fields.
struct Structure {
    name: String,
    /// The sizes of all fields as they are declared: a number where all uses agree, else a
    /// parameter.
    sizes: Vec<TokenStream>,
    /// Where each parameter stands first among them.
    parameters: Vec<usize>,
}

impl Structure {
    /// For these `uses`, each with the sizes of all fields.
    fn new(name: String, uses: &[Vec<usize>]) -> Self {
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
            .map(|&place| Literal::usize_unsuffixed(sizes[place]));
        quote!(#name<T #(, #parameters)*>)
    }

    /// Its definition, with the names, descriptions and dimensions of its fields.
    fn declaration<'a>(
        &self,
        doc: &str,
        traits: TokenStream,
        fields: impl Iterator<Item = (&'a str, String, usize)>,
    ) -> Result<String, String> {
        let (name, docs) = (format_ident!("{}", self.name), lines(doc));
        let parameters = (0..self.parameters.len()).map(size_name);
        let mut rest = &self.sizes[..];
        let fields = fields.map(|(name, doc, dimensions)| {
            let (sizes, others) = rest.split_at(dimensions);
            rest = others;
            let (name, docs, kind) = (format_ident!("{name}"), lines(&doc), array(sizes));
            quote!(#(#[doc = #docs])* pub #name: #kind)
        });
        format(quote! {
            #(#[doc = #docs])*
            #[derive(#traits)]
            pub struct #name<T #(, const #parameters: usize)*> {
                #(#fields,)*
            }
        })
    }
}

/// `D` for coordinates and `S` for dimensions of space, as the recursions name them; others follow.
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

/// What the output of this number is in each of the `kernels`.
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

/// Rust, with the expressions that stand for inputs.
struct Rust<'a>(BTreeMap<&'a str, &'a str>);

impl Dialect for Rust<'_> {
    const LIBRARY: &'static str = "T::";

    fn name(function: &'static str) -> &'static str {
        if function == "pow" { "powf" } else { function }
    }

    // They are arguments.
    const COMPARED: Strength = SUM;

    fn number(&self, value: Constant) -> String {
        format!("T::from_f64({:?})", value.value())
    }

    fn less_than(&self, a: &str, b: &str) -> String {
        format!("T::less_than({a}, {b})")
    }

    fn half_angle_squared(&self, order: u8, u: &str) -> String {
        format!("T::half_angle_squared::<{order}>({u})")
    }

    fn assignment(&self, name: &str, value: &str) -> String {
        format!("let {name} = {value};\n")
    }

    fn argument(&self, input: &Input) -> String {
        self.0[input.name.as_str()].into()
    }
}

fn function(
    kernel: &Kernel,
    arguments: &[Argument],
    structures: &BTreeMap<&str, Structure>,
    result: &Structure,
) -> Result<String, String> {
    let inputs = || arguments.iter().flat_map(|argument| &argument.inputs);
    let places = inputs()
        .map(|(input, place)| (input.name.as_str(), place.as_str()))
        .collect();
    let body = FunctionBody::new(kernel, &Rust(places))?;
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
        .map(|argument| argument.declaration(structures));
    let head = format(quote! {
        #(#[doc = #docs])*
        #inline
        pub fn #name<T: Real>(#(#parameters),*) -> #kind {}
    })?;
    let head = head
        .trim_end()
        .strip_suffix('}')
        .expect("a function ends with its body");

    let is_unused = |(input, _): &(&Input, String)| body.unused.contains(&input.name);
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
        Shape::Scalar => values.concat(),
        Shape::Vector(_) => format!("[{}]", values.join(", ")),
        Shape::Matrix(_, columns) => {
            let rows: Vec<String> = values
                .chunks(columns)
                .map(|row| format!("[{}]", row.join(", ")))
                .collect();
            format!("[{}]", rows.join(", "))
        }
    };
    format!("{}: {value}, ", output.name)
}

/// How many statements are formatted at a time: their syntax trees are a hundred times larger than
/// their text.
const STATEMENTS_AT_A_TIME: usize = 4096;

/// Statements, one a line, as the lines of a function's body.
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
