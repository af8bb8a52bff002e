//! Rust from expressions: one function per kernel, one named intermediate per shared operation.
//!
//! Each operation that is used more than once becomes a `let`; the others are built into syntax trees, to which
//! the printer adds the parentheses that precedence needs. The functions are generic over the scalar type, so
//! that one source serves single values and several at once.

use std::collections::{BTreeMap, BTreeSet};

use proc_macro2::{Literal, TokenStream};
use quote::{format_ident, quote};
use syn::Ident;

use crate::back::json::fingerprint;
use crate::ir::graph::{Graph, Node, NodeId};
use crate::ir::kernel::{Input, Kernel, Output, Shape, computed_operands};
use crate::ir::naming::camel_case;
use crate::ir::unit::Unit;

/// Why a kernel cannot be emitted.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EmitError {
    /// An output needs a symbol that no input provides.
    #[error("kernel `{kernel}` uses `{symbol}`, which is not one of its inputs")]
    UnboundSymbol {
        /// Name of the kernel.
        kernel: String,
        /// Name of the symbol.
        symbol: String,
    },
    /// A constant is infinite or not a number.
    #[error("kernel `{kernel}` holds the constant {value}, which is not finite")]
    NonFiniteConstant {
        /// Name of the kernel.
        kernel: String,
        /// The constant.
        value: String,
    },
    /// The expressions cannot be written as JSON, on which their fingerprint is based.
    #[error("the expressions have no fingerprint: {0}")]
    Fingerprint(String),
    /// The tokens are not valid Rust: a defect of the emitter.
    #[error("the emitted code does not parse: {0}")]
    Syntax(String),
}

/// How many operations a kernel takes; a shared one counts once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OperationCount {
    /// Additions, subtractions and changes of sign.
    pub additions: usize,
    /// Multiplications, squares included.
    pub multiplications: usize,
    /// Divisions.
    pub divisions: usize,
    /// Square roots, sines, cosines, arc sines, comparisons, and evaluations of `S` and its derivatives.
    pub functions: usize,
}

impl OperationCount {
    /// All operations.
    pub fn total(&self) -> usize {
        self.additions + self.multiplications + self.divisions + self.functions
    }
}

impl std::fmt::Display for OperationCount {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { additions, multiplications, divisions, functions } = self;
        write!(
            formatter,
            "{additions} additions, {multiplications} multiplications, {divisions} divisions, {functions} functions"
        )
    }
}

/// A function of more operations than this is not marked to be inlined.
const MAX_INLINED_OPERATIONS: usize = 1000;

/// Counts the operations of a kernel.
pub fn count_operations(kernel: &Kernel) -> OperationCount {
    let mut count = OperationCount::default();
    for id in kernel.computed() {
        match kernel.graph.node(id) {
            Node::Constant(_) | Node::Symbol(_) => {}
            Node::Add(..) | Node::Sub(..) | Node::Neg(_) => count.additions += 1,
            Node::Mul(..) => count.multiplications += 1,
            Node::Div(..) => count.divisions += 1,
            Node::Powi(_, exponent) => {
                count.multiplications += exponent.unsigned_abs().saturating_sub(1) as usize;
                count.divisions += usize::from(exponent < 0);
            }
            Node::Sqrt(_)
            | Node::Sin(_)
            | Node::Cos(_)
            | Node::Asin(_)
            | Node::LessThan(..)
            | Node::HalfAngleSquared(..) => count.functions += 1,
        }
    }
    count
}

fn given(kernel: &Kernel) -> BTreeMap<NodeId, Ident> {
    let elements = kernel.inputs.iter().flat_map(|input| &input.elements);
    elements.map(|(name, node)| (*node, format_ident!("{name}"))).collect()
}

/// What the header of emitted source says about its origin.
#[derive(Clone, Copy, Debug)]
pub struct Origin<'a> {
    /// What the source computes, in one line.
    pub title: &'a str,
    /// What made the expressions: an engine with its version, and what it derived them from.
    pub maker: &'a str,
    /// The command that makes the source again.
    pub again: &'a str,
}

/// The header: origin, fingerprint of the expressions, and operations.
fn header(kernels: &[Kernel], origin: Origin<'_>) -> Result<String, EmitError> {
    let fingerprint = fingerprint(kernels).map_err(|error| EmitError::Fingerprint(error.to_string()))?;
    let operations: usize = kernels.iter().map(|kernel| count_operations(kernel).total()).sum();
    let Origin { title, maker, again } = origin;
    let lines = format!(
        "{title}\nMade by {maker}; do not edit.\nSHA-256 of the expressions: {fingerprint}\n\
         To make it again: {again}\nOperations: {operations}."
    );
    Ok(lines.lines().map(|line| format!("// {line}").trim_end().to_string() + "\n").collect())
}

/// The formatted Rust source of `kernels`, below a header that states its `origin`.
///
/// The same kernels give the same bytes. The source expects a trait `Real` in scope, as Bristle's runtime
/// defines it.
///
/// # Errors
/// The kernel that cannot be written, and why.
pub fn emit(kernels: &[Kernel], origin: Origin<'_>) -> Result<String, EmitError> {
    let mut functions = String::new();
    for kernel in kernels {
        functions.push('\n');
        functions.push_str(&emit_kernel(kernel)?);
    }
    Ok(header(kernels, origin)? + &functions)
}

/// `tokens` as formatted source.
fn format(tokens: TokenStream) -> Result<String, EmitError> {
    let file = syn::parse2(tokens).map_err(|error| EmitError::Syntax(error.to_string()))?;
    Ok(prettyplease::unparse(&file))
}

fn emit_kernel(kernel: &Kernel) -> Result<String, EmitError> {
    let function = format_ident!("{}", kernel.name);
    let result = format_ident!("{}", camel_case(&kernel.name));
    if let Some(symbol) = kernel.unbound_symbol() {
        return Err(EmitError::UnboundSymbol { kernel: kernel.name.clone(), symbol: symbol.into() });
    }
    let body = Body::new(kernel)?;

    let summary = kernel.summary.lines().map(|line| format!(" {line}"));
    let count = format!(" Operations: {}.", count_operations(kernel));
    let arguments = kernel.inputs.iter().map(|input| format!(" - `{}`: {}", input.name, input.doc));
    let docs: Vec<String> = summary.chain([String::new()]).chain(arguments).chain([String::new(), count]).collect();
    let parameters = kernel.inputs.iter().map(|input| parameter(input, &body.uses));
    let bindings = kernel.inputs.iter().filter_map(|input| binding(input, &body.uses));
    // Small functions go into the solver's loops; whole equations can be too large to copy.
    let inline = (count_operations(kernel).total() < MAX_INLINED_OPERATIONS).then(|| quote!(#[inline(always)]));
    let fields = kernel.outputs.iter().map(field);
    let values = kernel.outputs.iter().map(|output| body.value(output));
    let result_doc = format!(" Result of [`{}`].", kernel.name);
    let source = format(quote! {
        #[doc = #result_doc]
        #[derive(Clone, Copy, Debug)]
        pub struct #result<T> {
            #(#fields,)*
        }

        #(#[doc = #docs])*
        #inline
        pub fn #function<T: Real>(#(#parameters),*) -> #result<T> {
            #(#bindings)*
            statements!();
            #result { #(#values,)* }
        }
    })?;
    // The last one: the text above the function may contain the same line.
    let (head, tail) = source.rsplit_once("    statements!();\n").expect("the function has a place for its statements");
    Ok([head, &body.statements, tail].concat())
}

/// The local name of an element, with an underscore in front if nothing uses it.
fn local_name(element: &(String, NodeId), uses: &BTreeMap<NodeId, usize>) -> Ident {
    let (name, node) = element;
    if uses.contains_key(node) { format_ident!("{name}") } else { format_ident!("_{name}") }
}

fn parameter(input: &Input, uses: &BTreeMap<NodeId, usize>) -> TokenStream {
    if let [element] = &input.elements[..] {
        let element = local_name(element, uses);
        return quote!(#element: T);
    }
    let name = format_ident!("{}", input.name);
    let length = Literal::usize_unsuffixed(input.elements.len());
    quote!(#name: [T; #length])
}

fn binding(input: &Input, uses: &BTreeMap<NodeId, usize>) -> Option<TokenStream> {
    if input.elements.len() == 1 {
        return None;
    }
    let name = format_ident!("{}", input.name);
    let elements = input.elements.iter().map(|element| local_name(element, uses));
    Some(quote!(let [#(#elements),*] = #name;))
}

fn field(output: &Output) -> TokenStream {
    let name = format_ident!("{}", output.name);
    let unit = if output.unit == Unit::ONE { String::new() } else { format!(", in {}", output.unit) };
    let doc = format!(" {}{unit}", output.doc);
    let shape = match output.shape {
        Shape::Scalar => quote!(T),
        Shape::Vector(length) => {
            let length = Literal::usize_unsuffixed(length);
            quote!([T; #length])
        }
        Shape::Matrix(rows, columns) => {
            let (rows, columns) = (Literal::usize_unsuffixed(rows), Literal::usize_unsuffixed(columns));
            quote!([[T; #columns]; #rows])
        }
    };
    quote! {
        #[doc = #doc]
        pub #name: #shape
    }
}

/// How many statements are formatted at a time: their syntax trees are a hundred times larger than their text.
const STATEMENTS_AT_A_TIME: usize = 4096;

/// The statements of a function, and the expressions of the nodes that they make available to its result.
struct Body {
    /// How often each node is an operand or an output.
    uses: BTreeMap<NodeId, usize>,
    statements: String,
    expressions: BTreeMap<NodeId, syn::Expr>,
}

/// Expressions deeper than this are cut by a `let`, for the reader and for the parser's stack.
const MAX_DEPTH: usize = 6;

impl Body {
    fn new(kernel: &Kernel) -> Result<Self, EmitError> {
        let given = given(kernel);
        let order = kernel.computed();
        let mut uses: BTreeMap<NodeId, usize> = BTreeMap::new();
        for operand in
            order.iter().flat_map(|&id| computed_operands(kernel.graph.node(id))).chain(kernel.output_nodes())
        {
            *uses.entry(operand).or_default() += 1;
        }
        let mut body = Self { uses: uses.clone(), statements: String::new(), expressions: BTreeMap::new() };
        let mut statements = Vec::new();
        let mut depths: BTreeMap<NodeId, usize> = BTreeMap::new();
        for (id, name) in given {
            body.expressions.insert(id, syn::parse_quote!(#name));
        }
        let bases: BTreeSet<NodeId> = order.iter().filter_map(|&id| base_of_power(&kernel.graph, id)).collect();
        let mut names = 0;
        for id in order {
            let node = kernel.graph.node(id);
            let expression = body.operation(kernel, node)?;
            for operand in computed_operands(node) {
                // Expressions are dropped after their last use.
                let left = uses.get_mut(&operand).expect("every operand is counted");
                *left -= 1;
                if *left == 0 {
                    body.expressions.remove(&operand);
                }
            }
            let depth = 1 + computed_operands(node).filter_map(|operand| depths.get(&operand)).max().unwrap_or(&0);
            // A power repeats its base, and a constant is as short as a name.
            let shared = body.uses[&id] > 1 || depth > MAX_DEPTH || bases.contains(&id);
            if shared && !matches!(node, Node::Constant(_)) {
                let name = format_ident!("t{names}");
                names += 1;
                statements.push(quote!(let #name = #expression;));
                if statements.len() == STATEMENTS_AT_A_TIME {
                    body.statements.push_str(&format_statements(&std::mem::take(&mut statements))?);
                }
                body.expressions.insert(id, syn::parse_quote!(#name));
            } else {
                body.expressions.insert(id, expression);
                depths.insert(id, depth);
            }
        }
        body.statements.push_str(&format_statements(&statements)?);
        Ok(body)
    }

    fn operation(&self, kernel: &Kernel, node: Node) -> Result<syn::Expr, EmitError> {
        let of = |id: NodeId| &self.expressions[&id];
        Ok(match node {
            Node::Constant(constant) => {
                let value = constant.value();
                if !value.is_finite() {
                    return Err(EmitError::NonFiniteConstant { kernel: kernel.name.clone(), value: value.to_string() });
                }
                constant_expression(value)
            }
            Node::Symbol(_) => unreachable!("the symbols of a kernel are given"),
            Node::Add(a, b) => binary(of(a), syn::parse_quote!(+), of(b)),
            Node::Sub(a, b) => binary(of(a), syn::parse_quote!(-), of(b)),
            Node::Mul(a, b) => binary(of(a), syn::parse_quote!(*), of(b)),
            Node::Div(a, b) => binary(of(a), syn::parse_quote!(/), of(b)),
            Node::Neg(a) => negative(of(a)),
            Node::Powi(_, 0) => constant_expression(1.0),
            Node::Powi(a, exponent) => power(of(a), exponent),
            Node::Sqrt(a) => method(of(a), "sqrt", None),
            Node::Sin(a) => method(of(a), "sin", None),
            Node::Cos(a) => method(of(a), "cos", None),
            Node::Asin(a) => method(of(a), "asin", None),
            Node::LessThan(a, b) => method(of(a), "less_than", Some(of(b))),
            Node::HalfAngleSquared(order, a) => {
                let (order, argument) = (Literal::u8_unsuffixed(order), of(a));
                syn::parse_quote!(T::half_angle_squared::<#order>(#argument))
            }
        })
    }

    fn value(&self, output: &Output) -> TokenStream {
        let name = format_ident!("{}", output.name);
        let elements: Vec<&syn::Expr> = output.nodes.iter().map(|node| &self.expressions[node]).collect();
        match output.shape {
            Shape::Scalar => {
                let value = elements[0];
                quote!(#name: #value)
            }
            Shape::Vector(_) => quote!(#name: [#(#elements),*]),
            Shape::Matrix(_, columns) => {
                let rows = elements.chunks(columns).map(|row| quote!([#(#row),*]));
                quote!(#name: [#(#rows),*])
            }
        }
    }
}

/// Statements as the lines of a function's body.
fn format_statements(statements: &[TokenStream]) -> Result<String, EmitError> {
    let function = format(quote!(fn body() { #(#statements)* }))?;
    let mut lines: Vec<&str> = function.lines().collect();
    // Without the enclosing function; an empty one is a single line.
    lines.pop();
    Ok(lines.iter().skip(1).map(|line| format!("{line}\n")).collect())
}

fn base_of_power(graph: &Graph, id: NodeId) -> Option<NodeId> {
    match graph.node(id) {
        Node::Powi(base, exponent) => (exponent != 0).then_some(base),
        _ => None,
    }
}

fn binary(left: &syn::Expr, operator: syn::BinOp, right: &syn::Expr) -> syn::Expr {
    syn::Expr::Binary(syn::ExprBinary {
        attrs: Vec::new(),
        left: Box::new(left.clone()),
        op: operator,
        right: Box::new(right.clone()),
    })
}

fn negative(operand: &syn::Expr) -> syn::Expr {
    let expr = match operand {
        // Without parentheses the compiler warns about `--`, a decrement in other languages.
        syn::Expr::Unary(_) => Box::new(syn::Expr::Paren(syn::ExprParen {
            attrs: Vec::new(),
            paren_token: Default::default(),
            expr: Box::new(operand.clone()),
        })),
        _ => Box::new(operand.clone()),
    };
    syn::Expr::Unary(syn::ExprUnary { attrs: Vec::new(), op: syn::parse_quote!(-), expr })
}

fn method(receiver: &syn::Expr, name: &str, argument: Option<&syn::Expr>) -> syn::Expr {
    let name = format_ident!("{name}");
    syn::Expr::MethodCall(syn::ExprMethodCall {
        attrs: Vec::new(),
        receiver: Box::new(receiver.clone()),
        dot_token: Default::default(),
        method: name,
        turbofish: None,
        paren_token: Default::default(),
        args: argument.cloned().into_iter().collect(),
    })
}

fn constant_expression(value: f64) -> syn::Expr {
    let literal = Literal::f64_unsuffixed(value.abs());
    if value.is_sign_negative() {
        syn::parse_quote!(T::from_f64(-#literal))
    } else {
        syn::parse_quote!(T::from_f64(#literal))
    }
}

/// A nonzero integer power as multiplications: exact, and faster than `powi`.
fn power(base: &syn::Expr, exponent: i32) -> syn::Expr {
    let times = syn::parse_quote!(*);
    let product = (1..exponent.unsigned_abs()).fold(base.clone(), |product, _| binary(&product, times, base));
    if exponent < 0 { binary(&constant_expression(1.0), syn::parse_quote!(/), &product) } else { product }
}
