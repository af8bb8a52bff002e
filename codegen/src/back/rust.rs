//! Rust from expressions: one function per kernel, one named intermediate per shared operation.
//!
//! Each operation that is used more than once becomes a `let`; the others are built into syntax trees, to which
//! the printer adds the parentheses that precedence needs. The functions are generic over the scalar type, so
//! that one source serves single values and several at once.

use std::collections::BTreeMap;

use proc_macro2::{Literal, TokenStream};
use quote::{format_ident, quote};
use syn::Ident;

use crate::back::source::{EmitError, Language, Origin, count_operations, header, uses, write_body};
use crate::ir::constant::Constant;
use crate::ir::graph::{Node, NodeId};
use crate::ir::kernel::{Input, Kernel, Output, Shape};
use crate::ir::naming::camel_case;
use crate::ir::unit::Unit;

/// A function of more operations than this is not marked to be inlined.
const MAX_INLINED_OPERATIONS: usize = 1000;

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
    Ok(header(kernels, origin, "//")? + &functions)
}

/// `tokens` as formatted source.
fn format(tokens: TokenStream) -> Result<String, EmitError> {
    let file = syn::parse2(tokens).map_err(|error| EmitError::Syntax(error.to_string()))?;
    Ok(prettyplease::unparse(&file))
}

fn emit_kernel(kernel: &Kernel) -> Result<String, EmitError> {
    let function = format_ident!("{}", kernel.name);
    let result = format_ident!("{}", camel_case(&kernel.name));
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
    let head = format(quote! {
        #[doc = #result_doc]
        #[derive(Clone, Copy, Debug)]
        pub struct #result<T> {
            #(#fields,)*
        }

        #(#[doc = #docs])*
        #inline
        pub fn #function<T: Real>(#(#parameters),*) -> #result<T> {}
    })?;
    let head = head.trim_end().strip_suffix('}').expect("a function ends with its body");
    let [bindings, result] =
        [quote!(#(#bindings)*), quote!(#result { #(#values,)* })].map(|part| format_statements(&[part]));
    Ok([head, "\n", &bindings?, &body.statements, &result?, "}\n"].concat())
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

impl Body {
    fn new(kernel: &Kernel) -> Result<Self, EmitError> {
        let mut rust = Rust { statements: String::new(), pending: Vec::new() };
        let uses = uses(kernel);
        let expressions = write_body(kernel, &uses, &mut rust)?;
        rust.format_pending()?;
        Ok(Self { uses, statements: rust.statements, expressions })
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

/// Rust, with the statements written so far.
struct Rust {
    statements: String,
    /// Statements that are not formatted yet.
    pending: Vec<TokenStream>,
}

impl Rust {
    fn format_pending(&mut self) -> Result<(), EmitError> {
        self.statements.push_str(&format_statements(&std::mem::take(&mut self.pending))?);
        Ok(())
    }
}

impl Language for Rust {
    type Expression = syn::Expr;

    fn given(&self, name: &str) -> syn::Expr {
        let name = format_ident!("{name}");
        syn::parse_quote!(#name)
    }

    fn constant(&self, constant: Constant) -> syn::Expr {
        constant_expression(constant.value())
    }

    fn operation<'a>(&self, node: Node, of: &dyn Fn(NodeId) -> &'a syn::Expr) -> syn::Expr {
        match node {
            Node::Constant(_) | Node::Symbol(_) => unreachable!("constants and symbols are no operations"),
            Node::Add(a, b) => binary(of(a), syn::parse_quote!(+), of(b)),
            Node::Sub(a, b) => binary(of(a), syn::parse_quote!(-), of(b)),
            Node::Mul(a, b) => binary(of(a), syn::parse_quote!(*), of(b)),
            Node::Div(a, b) => binary(of(a), syn::parse_quote!(/), of(b)),
            Node::Neg(a) => negative(of(a)),
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
        }
    }

    fn intermediate(&mut self, number: usize, value: syn::Expr) -> Result<syn::Expr, EmitError> {
        let name = format_ident!("t{number}");
        self.pending.push(quote!(let #name = #value;));
        if self.pending.len() == STATEMENTS_AT_A_TIME {
            self.format_pending()?;
        }
        Ok(syn::parse_quote!(#name))
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
