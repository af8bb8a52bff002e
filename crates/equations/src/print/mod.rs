//! Expressions as readable mathematics, in the notation of the model: as text, as LaTeX, and as
//! Markdown.
//!
//! A page has a legend of the symbols and a definition of each output. The whole equations for
//! reading are sums of products in closed form. Other expressions can be deep and share much. Nodes
//! that are used more than once, or nested too deeply, get a name, so that the printer never
//! recurses far.

use std::io::{self, Write};

use crate::print::page::PrintedPage;
use crate::print::printer::Printer;
use crate::print::wording::{CYLINDER, PLANE};
use bristle_codegen::back::source::Origin;
use bristle_codegen::ir::kernel::{Kernel, Output};
use bristle_codegen::model::chain::{Motion, RelaxedShape};

mod breaks;
mod latex;
mod legend;
mod page;
mod printer;
mod walkthrough;
mod wording;

pub use crate::print::page::PageForm;
pub use crate::print::walkthrough::Walkthrough;
pub use crate::print::wording::title;

/// Writes the equations of `motion` of a chain of `segments` segments.
///
/// `kernels` are those of [`whole_kernels`](bristle_codegen::model::whole::whole_kernels) for
/// reading, of `shape`.
///
/// # Errors
/// If `out` cannot be written to.
pub fn equations(
    out: &mut dyn Write,
    form: PageForm,
    segments: usize,
    motion: Motion,
    shape: RelaxedShape,
    kernels: &[Kernel],
    origin: Origin<'_>,
) -> io::Result<()> {
    let mut page = PrintedPage::new(out, form, origin);
    let coordinates = match motion {
        Motion::Spatial => "φ1, θ1, …, φn, θn",
        Motion::Planar => "θ1, …, θn",
    };
    page.prose(&format!(
        "`M(q) q̈ = f(q, q̇, t) + Q`,   `q = ({coordinates})`,   `n = {segments}`\n\
         from `d/dt(∂L/∂q̇) − ∂L/∂q + ∂D/∂q̇ = Q`,   `L = E_kin − E_spring − E_grav`"
    ));
    if motion == Motion::Planar {
        page.prose(PLANE);
    }
    if shape.is_cylinder {
        page.prose(CYLINDER);
    }
    page.legend(&legend::rows(
        kernels
            .iter()
            .map(|kernel| (&kernel.graph, kernel.output_nodes())),
    ));
    for kernel in kernels {
        let printer = Printer::closed(
            &kernel.graph,
            &kernel.output_nodes(),
            motion,
            page.notation(),
        );
        page.begin(&kernel.name, printer.head_width(&kernel.outputs));
        page.prose(&kernel.summary);
        for output in &kernel.outputs {
            write_whole(&mut page, &printer, output);
        }
        let outputs = kernel
            .outputs
            .iter()
            .flat_map(|output| printer.output(output));
        page.definitions(printer.named_definitions().chain(outputs));
    }
    page.finish()
}

/// Writes any kernels, with a name for each intermediate that is shared or deep.
///
/// # Errors
/// If `out` cannot be written to.
pub fn kernels(
    out: &mut dyn Write,
    form: PageForm,
    kernels: &[Kernel],
    origin: Origin<'_>,
) -> io::Result<()> {
    let mut page = PrintedPage::new(out, form, origin);
    page.prose(
        "Each kernel is a list of definitions: `t1`, `t2`, … are its intermediates, the others its results.\n\
         Results that are zero, and those that symmetry repeats, are left out.",
    );
    page.legend(&legend::rows(
        kernels
            .iter()
            .map(|kernel| (&kernel.graph, kernel.output_nodes())),
    ));
    for kernel in kernels {
        let printer = Printer::shared(kernel, page.notation());
        page.begin(&kernel.name, printer.head_width(&kernel.outputs));
        page.heading(&kernel.name);
        page.prose(&kernel.summary);
        for input in &kernel.inputs {
            let given = input
                .elements
                .iter()
                .filter(|(_, node)| printer.is_given(*node));
            for (name, _) in given {
                page.item(&format!(
                    "`{name}` is given as part of `{}`: {}",
                    input.name, input.doc
                ));
            }
        }
        page.definitions(printer.named_definitions());
        for output in &kernel.outputs {
            page.item(&format!(
                "`{}`: {}{}",
                output.name,
                output.doc,
                output.in_unit()
            ));
            write_whole(&mut page, &printer, output);
            page.definitions(printer.output(output));
        }
    }
    page.finish()
}

/// Writes a vector or a matrix as a whole, if the page shows them.
fn write_whole(page: &mut PrintedPage<'_>, printer: &Printer<'_>, output: &Output) {
    let whole = page
        .matrix_width()
        .and_then(|width| printer.whole(output, width));
    if let Some(whole) = whole {
        page.whole(whole);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::print::latex::Latex;
    use bristle_codegen::back::json::{from_json, to_json};
    use bristle_codegen::ir::constant::Constant;
    use bristle_codegen::ir::graph::{Graph, Node, NodeId};
    use bristle_codegen::ir::kernel::KernelInput;
    use bristle_codegen::ir::notation::{Notation, Text};
    use bristle_codegen::ir::unit::Unit;
    use bristle_codegen::ir::writer::Writer;

    fn kernel(graph: Graph, node: NodeId) -> Kernel {
        let symbols: Vec<String> = graph
            .symbols()
            .iter()
            .map(|symbol| symbol.name.clone())
            .collect();
        let inputs = symbols
            .iter()
            .map(|name| KernelInput::symbols(&graph, name, "", &[name]))
            .collect();
        let outputs = vec![Output::scalar("value", "the value", Unit::ONE, node)];
        Kernel {
            name: "example".into(),
            summary: "An example.".into(),
            graph,
            inputs,
            outputs,
        }
    }

    fn written(build: impl FnOnce(&mut Graph, [NodeId; 2]) -> NodeId) -> [String; 2] {
        let mut graph = Graph::raw();
        let symbols = ["a", "b"].map(|name| graph.symbol(name, name, Unit::ONE));
        let node = build(&mut graph, symbols);
        let notations: [&dyn Notation; 2] = [&Text, &Latex];
        notations.map(|notation| Writer::new(&graph, notation).expression(node).text)
    }

    #[test]
    fn operators_keep_their_meaning_in_both_notations() {
        let quotients = written(|g, [a, b]| {
            let (first, second) = (g.div(a, b), g.div(b, a));
            let product = g.mul(first, second);
            g.sub(product, first)
        });
        assert_eq!(
            quotients,
            [
                "(a/b) (b/a) − a/b",
                "\\frac{a}{b} \\frac{b}{a} - \\frac{a}{b}"
            ]
        );
        let functions = written(|g, [a, b]| {
            let (less, angle, root) = (g.less_than(a, b), g.asin(a), g.sqrt(b));
            let product = g.mul(less, angle);
            g.div(product, root)
        });
        assert_eq!(
            functions,
            [
                "[a < b] asin a/√(b)",
                "\\frac{[a < b] \\arcsin a}{\\sqrt{b}}"
            ]
        );
        let more = written(|g, [a, b]| {
            let (exponent, product) = (g.ratio(5, 2), g.mul(a, b));
            let power = g.pow(a, exponent);
            let (power, decay) = (g.pow(power, b), g.neg(product));
            let (exp, ln, tanh) = (g.exp(decay), g.ln(product), g.tanh(a));
            let (tanh, abs, angle) = (g.powi(tanh, 2), g.abs(decay), g.atan2(a, b));
            g.sum([power, exp, ln, tanh, abs, angle])
        });
        assert_eq!(
            more,
            [
                "(a^(5/2))^b + exp(−a b) + ln(a b) + tanh² a + |−a b| + atan2(a, b)",
                "(a^{\\tfrac{5}{2}})^{b} + \\exp(-a b) + \\ln(a b) + \\tanh^{2} a + \\vert -a b\\vert \
                 + \\mathrm{atan2}(a, b)"
            ]
        );
        let powers = written(|g, [a, b]| {
            let (sin, root, sum) = (g.sin(a), g.sqrt(b), g.add(a, b));
            let powers = [
                g.powi(sin, 2),
                g.powi(sin, -1),
                g.powi(root, 2),
                g.powi(sum, 3),
            ];
            let constant = g.constant(Constant::Float(-2.5e-9));
            let sum = g.sum(powers);
            g.add(constant, sum)
        });
        let latex =
            "-2.5 \\cdot 10^{-9} + \\sin^{2} a + (\\sin a)^{-1} + (\\sqrt{b})^{2} + (a + b)^{3}";
        assert_eq!(
            powers,
            ["−2.5e-9 + sin² a + (sin a)⁻¹ + (√(b))² + (a + b)³", latex]
        );
        let derivative = written(|g, [a, _]| g.intern(Node::HalfAngleSquared(2, a)));
        assert_eq!(derivative, ["S″(a)", "S''(a)"]);
    }

    #[test]
    fn long_chains_of_operations_are_printed() {
        // A recursion this deep does not fit on the stack of a thread.
        const LENGTH: usize = 100_000;
        let mut graph = Graph::raw();
        let (a, b) = (
            graph.symbol("a", "a", Unit::ONE),
            graph.symbol("b", "b", Unit::ONE),
        );
        let mut node = a;
        for i in 0..LENGTH {
            node = match i % 6 {
                0 => graph.intern(Node::Sin(node)),
                1 => graph.intern(Node::Neg(node)),
                2 => graph.intern(Node::Add(b, node)),
                3 => graph.intern(Node::Div(b, node)),
                4 => graph.intern(Node::Mul(node, b)),
                _ => graph.intern(Node::Sub(b, node)),
            };
        }
        // The printer must handle whatever the reader accepts.
        let file = to_json(&[kernel(graph, node)], "a test").expect("the chain can be written");
        let kernels = from_json(&file).expect("the chain can be read").kernels;
        for form in [
            PageForm::Text,
            PageForm::Latex,
            PageForm::Fragment { width: 34_000 },
            PageForm::Markdown,
        ] {
            let page = kernels_page(form, &kernels);
            assert!(page.contains("value = ") || page.contains("\\mathrm{value} &= "));
            let longest = page.lines().map(str::len).max();
            assert!(longest < Some(400), "{longest:?}");
        }
    }

    fn kernels_page(form: PageForm, kernels: &[Kernel]) -> String {
        let mut page = Vec::new();
        let origin = Origin {
            title: "A graph",
            maker: "a test",
            again: "bristle",
        };
        super::kernels(&mut page, form, kernels, origin).expect("memory can be written to");
        String::from_utf8(page).expect("a page is text")
    }

    #[test]
    fn sums_of_one_kind_are_cut_too() {
        let mut graph = Graph::raw();
        let a = graph.symbol("a", "a", Unit::ONE);
        let sum = (0..100_000).fold(a, |sum, _| graph.intern(Node::Add(a, sum)));
        let page = kernels_page(PageForm::Text, &[kernel(graph, sum)]);
        assert!(
            page.contains("t2 = a + a") && page.lines().all(|line| line.chars().count() <= 110)
        );
    }

    #[test]
    fn intermediates_are_not_called_like_symbols() {
        let mut graph = Graph::raw();
        let [a, b] = ["t1", "t3"].map(|name| graph.symbol(name, name, Unit::ONE));
        let (sum, product) = (graph.add(a, b), graph.mul(a, b));
        let (left, right) = (graph.div(sum, product), graph.div(product, sum));
        let node = graph.add(left, right);
        for (form, lines) in [
            (PageForm::Text, ["t2 = t1 + t3", "t4 = t1 t3"]),
            (
                PageForm::Latex,
                ["t_{2} &= t_{1} + t_{3}", "t_{4} &= t_{1} t_{3}"],
            ),
        ] {
            let page = kernels_page(form, &[kernel(graph.clone(), node)]);
            assert!(lines.iter().all(|line| page.contains(line)), "{page}");
        }
    }

    #[test]
    fn what_comes_from_a_file_is_escaped() {
        let mut graph = Graph::raw();
        let hostile = graph.symbol(
            "hostile",
            "}\\input{/etc/passwd}$_^#&%~<b>|漢\u{202e}",
            Unit::ONE,
        );
        let mut kernel = kernel(graph, hostile);
        kernel.summary =
            "\\end{document} $ % & # _ ^ ~ <script> `\\def\\x{` [`a`] 漢 --> *b* |".into();
        let latex = kernels_page(PageForm::Latex, std::slice::from_ref(&kernel));
        assert!(latex.is_ascii());
        for command in ["\\input{", "\\def", "\\end{document} "] {
            assert!(!latex.contains(command), "{command}");
        }
        let markdown = kernels_page(PageForm::Markdown, &[kernel]);
        assert!(
            !markdown.contains("<script>") && !markdown.contains("<b>"),
            "{markdown}"
        );
    }
}
