//! Pages of definitions: text, a LaTeX document, or Markdown with formulas as GitHub shows them.
//!
//! Sentences hold formulas between backticks, as doc comments do. The rest of a sentence is literal
//! text.

use std::io::{self, Write};

use crate::print::breaks::{ANYWHERE, BETWEEN_TERMS, lines};
use crate::print::latex::{self, Latex};
use crate::print::legend::Row;
use crate::print::printer::PageLayout;
use bristle_codegen::back::source::{Origin, comment};
use bristle_codegen::ir::notation::Text;

/// Language of a page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PageForm {
    /// Plain text.
    Text,
    /// A LaTeX document, in ASCII; it needs amsmath, longtable and geometry.
    Latex,
    /// Equations with labels for the LaTeX of a paper, without a preamble or sentences, in ASCII;
    /// they need amsmath and `\\allowdisplaybreaks`.
    Fragment {
        /// Width of the text in thousandths of an em.
        width: usize,
    },
    /// Markdown with formulas between dollar signs.
    Markdown,
}

/// `head = body`, in the page's notation.
#[derive(Clone, Debug)]
pub(super) struct Definition {
    pub head: String,
    pub body: String,
}

/// Maximum width of a line, where a sum can be broken: in characters, including the start of the
/// line before the sum, and in thousandths of an em, without it.
const TEXT_WIDTH: usize = 110;
const FORMULA_WIDTH: usize = 38_000;
/// Width of an equality sign with its spaces, in thousandths of an em.
const EQUALITY_WIDTH: usize = 1_400;
/// Width of the number of an equation with the space before it, in thousandths of an em: `(1234)`.
const NUMBER_WIDTH: usize = 3_300;
/// Maximum number of lines in a display of formulas: TeX keeps a whole display in memory.
const LATEX_LINES: usize = 30;
const MARKDOWN_LINES: usize = 10;

/// Columns between symbol and meaning of a legend in text.
const LEGEND_INDENT: usize = 20;

/// A page that goes to `out` while it is written, so that it never is in memory as a whole.
pub(super) struct PrintedPage<'w> {
    form: PageForm,
    out: &'w mut dyn Write,
    /// Prefix of labels.
    subject: String,
    /// Width of the names before equality signs, in thousandths of an em.
    head_width: usize,
    /// The first error of `out`; nothing is written after it.
    result: io::Result<()>,
}

impl<'w> PrintedPage<'w> {
    /// Begins a page, with a comment that states its `origin` unless it is text.
    pub fn new(out: &'w mut dyn Write, form: PageForm, origin: Origin<'_>) -> Self {
        let Origin {
            title,
            maker,
            again,
        } = origin;
        let source = format!("Made by {maker}.\nTo make it again: {again}\n");
        let ascii = source.replace(|letter: char| !letter.is_ascii(), "?");
        let text = match form {
            PageForm::Text => format!("{title}\n"),
            PageForm::Latex => format!(
                "{}\
                 \\documentclass[fleqn,a4paper]{{article}}\n\
                 \\usepackage{{amsmath}}\n\
                 \\usepackage{{longtable}}\n\
                 \\usepackage[margin=20mm]{{geometry}}\n\
                 \\setlength{{\\parindent}}{{0pt}}\n\
                 \\setlength{{\\parskip}}{{1ex}}\n\
                 \\setlength{{\\mathindent}}{{0pt}}\n\
                 \\setlength{{\\LTleft}}{{0pt}}\n\
                 \\allowdisplaybreaks\n\
                 \\raggedright\n\
                 \\begin{{document}}\n\n\
                 \\section*{{{}}}\n",
                comment(&ascii, "%"),
                latex::words(title)
            ),
            PageForm::Fragment { .. } => format!(
                "% {}\n{}\
                 % It needs \\usepackage{{amsmath}} and \\allowdisplaybreaks in the preamble.\n",
                latex::words(title),
                comment(&ascii, "%")
            ),
            PageForm::Markdown => format!(
                "<!--\n{}-->\n\n# {}\n",
                source.replace("-->", "--&gt;"),
                markdown_words(title)
            ),
        };
        let mut page = Self {
            form,
            out,
            subject: String::new(),
            head_width: 0,
            result: Ok(()),
        };
        page.write(&text);
        page
    }

    fn write(&mut self, text: &str) {
        if self.result.is_ok() {
            self.result = self.out.write_all(text.as_bytes());
        }
    }

    pub fn notation(&self) -> &'static dyn PageLayout {
        match self.form {
            PageForm::Text => &Text,
            PageForm::Latex | PageForm::Fragment { .. } | PageForm::Markdown => &Latex,
        }
    }

    /// Begins the definitions of a kernel, whose name is in their labels. The defined names are at
    /// most `head_width` wide.
    pub fn begin(&mut self, kernel: &str, head_width: usize) {
        self.subject = label(kernel);
        self.head_width = head_width;
        if self.is_fragment() {
            self.write(&format!("\n% {}\n", self.subject));
        }
    }

    fn is_fragment(&self) -> bool {
        matches!(self.form, PageForm::Fragment { .. })
    }

    /// Maximum width of the definition of a vector or a matrix as a whole, without the equality
    /// sign; `None` where the page shows elements only.
    pub fn matrix_width(&self) -> Option<usize> {
        match self.form {
            PageForm::Fragment { width } => Some(width.saturating_sub(EQUALITY_WIDTH)),
            _ => None,
        }
    }

    pub fn heading(&mut self, title: &str) {
        let text = match self.form {
            // The first paragraph follows without an empty line.
            PageForm::Text => format!("\n{title}"),
            PageForm::Latex => format!("\n\\subsection*{{{}}}\n", latex::words(title)),
            PageForm::Fragment { .. } => return,
            PageForm::Markdown => format!("\n## {}\n", markdown_words(title)),
        };
        self.write(&text);
    }

    /// Writes a paragraph.
    pub fn prose(&mut self, sentences: &str) {
        if self.is_fragment() {
            return;
        }
        let text = format!("\n{}\n", self.sentences(sentences));
        self.write(&text);
    }

    /// Writes a line above the definitions that it introduces.
    pub fn item(&mut self, sentence: &str) {
        let sentence = self.sentences(sentence);
        let text = match self.form {
            PageForm::Text => format!("  {}\n", sentence.replace('\n', "\n  ")),
            PageForm::Fragment { .. } => return,
            PageForm::Latex | PageForm::Markdown => format!("\n{sentence}\n"),
        };
        self.write(&text);
    }

    fn sentences(&self, text: &str) -> String {
        let parts: Vec<&str> = text.split('`').collect();
        if parts.len().is_multiple_of(2) {
            // The backticks are not paired, unlike those of a doc comment.
            return self.words(text);
        }
        let mut result = String::new();
        for (i, part) in parts.iter().enumerate() {
            let links = |at: Option<usize>, bracket: char, start: bool| {
                let part = at.and_then(|at| parts.get(at)).copied().unwrap_or("");
                if start {
                    part.starts_with(bracket)
                } else {
                    part.ends_with(bracket)
                }
            };
            if i % 2 == 0 {
                let after_link =
                    i > 0 && links(Some(i), ']', true) && links(i.checked_sub(2), '[', false);
                let before_link = links(Some(i), '[', false) && links(Some(i + 2), ']', true);
                let part = if after_link { &part[1..] } else { part };
                let part = if before_link {
                    part.strip_suffix('[').unwrap_or(part)
                } else {
                    part
                };
                result.push_str(&self.words(part));
            } else if links(i.checked_sub(1), '[', false) && links(Some(i + 1), ']', true) {
                result.push_str(&match self.form {
                    PageForm::Text => (*part).to_owned(),
                    PageForm::Latex | PageForm::Fragment { .. } => {
                        format!("\\texttt{{{}}}", latex::words(part))
                    }
                    PageForm::Markdown => format!("`{part}`"),
                });
            } else {
                result.push_str(&match self.form {
                    PageForm::Text => (*part).to_owned(),
                    PageForm::Latex | PageForm::Fragment { .. } => {
                        format!("${}$", latex::formula(part))
                    }
                    PageForm::Markdown => format!("${}$", in_markdown(&latex::formula(part))),
                });
            }
        }
        result
    }

    fn words(&self, text: &str) -> String {
        match self.form {
            PageForm::Text => text.into(),
            PageForm::Latex | PageForm::Fragment { .. } => latex::words(text),
            PageForm::Markdown => markdown_words(text),
        }
    }

    /// Writes formulas one below the other, aligned at their equality signs. Each is taken after
    /// those before it are written.
    pub fn definitions(&mut self, definitions: impl IntoIterator<Item = Definition>) {
        if self.form == PageForm::Text {
            for Definition { head, body } in definitions {
                let head = format!("  {head} = ");
                let indent = head.chars().count();
                let width = TEXT_WIDTH.saturating_sub(indent).max(TEXT_WIDTH / 4);
                let lines = lines(&Text, &body, width, ANYWHERE);
                self.write(&format!(
                    "{head}{}\n",
                    lines.join(&format!("\n{}", " ".repeat(indent)))
                ));
            }
            return;
        }
        let (width, breaks) = match self.form {
            PageForm::Fragment { width } => (
                width.saturating_sub(self.head_width + EQUALITY_WIDTH),
                BETWEEN_TERMS,
            ),
            _ => (FORMULA_WIDTH, ANYWHERE),
        };
        let mut display: Vec<String> = Vec::new();
        for Definition { head, body } in definitions {
            let lines_within = |width| lines(&Latex, &body, width, breaks);
            let mut lines = lines_within(width);
            let last = lines.last().map_or(0, |line| latex::width(line));
            if self.is_fragment() && last + NUMBER_WIDTH > width {
                lines = lines_within(width.saturating_sub(NUMBER_WIDTH));
            }
            let continued = lines.iter().skip(1).map(|line| {
                let is_term = !self.is_fragment() || line.starts_with(['+', '-']);
                let times = if is_term { "" } else { "\\cdot " };
                format!("&\\quad {times}{line}")
            });
            let first = display.len();
            display.push(format!("{head} &= {}", lines[0]));
            display.extend(continued);
            if self.is_fragment() {
                let last = display.len() - 1;
                display[first..last]
                    .iter_mut()
                    .for_each(|line| line.push_str(" \\notag"));
                display[last].push_str(&self.label(&head));
            }
            if display.len() >= self.display_lines() {
                self.display(&std::mem::take(&mut display));
            }
        }
        if !display.is_empty() {
            self.display(&display);
        }
    }

    /// Writes a vector or a matrix by its elements, which LaTeX does not break.
    pub fn whole(&mut self, Definition { head, body }: Definition) {
        let line = format!("{head} &= {body}{}", self.label(&head));
        self.display(&[line]);
    }

    /// The label of the equation that begins with `head`.
    fn label(&self, head: &str) -> String {
        format!(" \\label{{eq:{}:{}}}", self.subject, label(head))
    }

    fn display_lines(&self) -> usize {
        if self.form == PageForm::Markdown {
            MARKDOWN_LINES
        } else {
            LATEX_LINES
        }
    }

    fn display(&mut self, lines: &[String]) {
        let text = match self.form {
            PageForm::Text => unreachable!("text has no displays"),
            PageForm::Fragment { .. } => format!(
                "\\begin{{align}}\n{}\n\\end{{align}}\n",
                lines.join(" \\\\{}\n")
            ),
            // An empty group keeps a bracket at the start of a line from being an option of the
            // line break.
            PageForm::Latex => format!(
                "\\begin{{align*}}\n{}\n\\end{{align*}}\n",
                lines.join(" \\\\{}\n")
            ),
            // Markdown may take `\\` for an escaped backslash.
            PageForm::Markdown => {
                format!(
                    "\n$$\n\\begin{{aligned}}\n{}\n\\end{{aligned}}\n$$\n",
                    in_markdown(&lines.join(" \\cr\n"))
                )
            }
        };
        self.write(&text);
    }

    /// Writes the symbols with their meanings and units.
    pub fn legend(&mut self, rows: &[Row]) {
        let symbols = |row: &Row| {
            let written: Vec<String> = row
                .symbols
                .iter()
                .map(|symbol| self.notation().symbol(symbol))
                .collect();
            written.join(", ")
        };
        let mut text = String::new();
        match self.form {
            PageForm::Fragment { .. } => return,
            PageForm::Text => {
                text.push_str("\nSymbols, with SI units; a dot is a time derivative\n");
                for row in rows {
                    let symbols = symbols(row);
                    let width = symbols
                        .chars()
                        .filter(|&letter| !latex::is_accent(letter))
                        .count();
                    let pad = " ".repeat(LEGEND_INDENT.saturating_sub(width).max(2));
                    let unit = row.unit.as_ref().filter(|unit| *unit != "1");
                    let unit = unit.map(|unit| format!(", {unit}")).unwrap_or_default();
                    text.push_str(&format!(
                        "  {symbols}{pad}{}{unit}\n",
                        self.sentences(&row.meaning)
                    ));
                }
            }
            PageForm::Latex => {
                text.push_str(
                    "\nA dot is a time derivative.\n\n\
                     \\begin{longtable}{@{}p{0.28\\textwidth}p{0.52\\textwidth}p{0.12\\textwidth}@{}}\n\
                     symbol & meaning & unit \\\\\n\\hline\\noalign{\\vskip 2pt}\n\\endhead\n",
                );
                for row in rows {
                    let unit = row.unit.as_deref().map(latex::words).unwrap_or_default();
                    // Many symbols need breaks between them.
                    let symbols = symbols(row).replace(", ", "$, $");
                    text.push_str(&format!(
                        "${symbols}$ & {} & {unit} \\\\\n",
                        self.sentences(&row.meaning)
                    ));
                }
                text.push_str("\\end{longtable}\n");
            }
            PageForm::Markdown => {
                text.push_str(
                    "\nA dot is a time derivative.\n\n| symbol | meaning | unit |\n|---|---|---|\n",
                );
                for row in rows {
                    let unit = row.unit.as_deref().map(markdown_words).unwrap_or_default();
                    let symbols = in_markdown(&symbols(row));
                    let meaning = self.sentences(&row.meaning);
                    text.push_str(&format!("| ${symbols}$ | {meaning} | {unit} |\n"));
                }
            }
        }
        self.write(&text);
    }

    /// Ends the page.
    ///
    /// # Errors
    /// The first error of writing it.
    pub fn finish(mut self) -> io::Result<()> {
        if self.form == PageForm::Latex {
            self.write("\n\\end{document}\n");
        }
        self.result
    }
}

/// Makes a label of a name: its letters and digits, with a hyphen for all between them.
fn label(name: &str) -> String {
    let letters: String = name
        .chars()
        .map(|letter| {
            if letter.is_ascii_alphanumeric() {
                letter
            } else {
                ' '
            }
        })
        .collect();
    letters
        .split_whitespace()
        .filter(|word| *word != "mathrm")
        .collect::<Vec<_>>()
        .join("-")
}

/// Replaces signs of a formula that Markdown would take for HTML.
fn in_markdown(formula: &str) -> String {
    formula.replace('<', "\\lt ").replace('>', "\\gt ")
}

/// Escapes the signs of Markdown in words.
fn markdown_words(text: &str) -> String {
    let mut result = String::new();
    for letter in text.chars() {
        match letter {
            '<' => result.push_str("&lt;"),
            '>' => result.push_str("&gt;"),
            '&' => result.push_str("&amp;"),
            '\\' | '`' | '*' | '_' | '$' | '|' | '[' | ']' | '#' | '~' | '!' => {
                result.extend(['\\', letter])
            }
            _ => result.push(letter),
        }
    }
    result
}
