//! LaTeX from the notation of the model: names, formulas and sentences, in ASCII.
//!
//! The input is Unicode, which may come from a file. The output is LaTeX that typesets the input
//! and does nothing else.

use bristle_codegen::ir::constant::Constant;
use bristle_codegen::ir::notation::{
    ATOM, Notation, POWER, PRODUCT, QUOTIENT, Written, applied, scientific,
};

use crate::print::printer::PageLayout;

/// Accents, as combining marks, each followed by its command.
const ACCENTS: &str = "\u{307}\\dot \u{308}\\ddot \u{20db}\\dddot \u{302}\\hat \u{303}\\tilde \u{304}\\bar \u{305}\\bar \u{20d7}\\vec";

/// Letters followed by their dotted form in Unicode.
const DOTTED: &str = "aȧbḃcċdḋeėfḟgġhḣmṁnṅoȯpṗrṙsṡtṫwẇxẋyẏzżAȦBḂCĊDḊEĖFḞGĠHḢMṀNṄOȮPṖRṘSṠTṪWẆXẊYẎZŻ";
const TWICE_DOTTED: &str = "aäeëhḧiïoötẗuüwẅxẍyÿAÄEËHḦIÏOÖUÜWẄXẌYŸ";
/// Letters followed by their form with a bar.
const BARRED: &str = "eē";

/// Letters, each followed by its command.
const GREEK: &str = r"
    α\alpha β\beta γ\gamma δ\delta ε\varepsilon ζ\zeta η\eta θ\theta ϑ\vartheta ι\iota κ\kappa λ\lambda μ\mu µ\mu
    ν\nu ξ\xi π\pi ρ\rho σ\sigma ς\varsigma τ\tau υ\upsilon φ\varphi ϕ\phi χ\chi ψ\psi ω\omega Γ\Gamma Δ\Delta
    Θ\Theta Λ\Lambda Ξ\Xi Π\Pi Σ\sum Φ\Phi Ψ\Psi Ω\Omega
";

/// Signs, each followed by its command. The dollar has none: Markdown ends a formula at any.
const SIGNS: &str = r"
    ∂\partial −- ·\cdot ×\times …\dots √\surd ∈\in ≤\leq ≥\geq ≠\neq →\to ∞\infty ½\tfrac{1}{2} ¼\tfrac{1}{4}
    ¾\tfrac{3}{4} ⅓\tfrac{1}{3} ⅔\tfrac{2}{3} ⅛\tfrac{1}{8} #\text{\#} $\text{U+0024} %\text{\%} &\text{\&} ~\sim
    ^\wedge \\backslash |\vert
";

/// Raised characters, and their forms on the line.
const RAISED: [&str; 2] = ["⁰¹²³⁴⁵⁶⁷⁸⁹⁻ᵀ", "0123456789-T"];

const FUNCTIONS: [&str; 9] = [
    "arccos", "arcsin", "cos", "exp", "ln", "max", "min", "sin", "tanh",
];

fn find(table: &'static str, character: char) -> Option<&'static str> {
    table
        .split_whitespace()
        .find_map(|entry| entry.strip_prefix(character))
}

/// The form on the line of a raised character.
fn lowered(character: char) -> Option<char> {
    let [raised, lowered] = RAISED.map(str::chars);
    raised
        .zip(lowered)
        .find(|(raised, _)| *raised == character)
        .map(|(_, lowered)| lowered)
}

/// Splits letters that carry dots or a bar into letter and combining mark.
fn decomposed(text: &str) -> Vec<char> {
    let tables = [
        (DOTTED, '\u{307}'),
        (TWICE_DOTTED, '\u{308}'),
        (BARRED, '\u{304}'),
    ];
    let split = |letter: char| {
        // Each follows its plain letter, which is ASCII.
        let mut tables = tables.iter().filter(|_| !letter.is_ascii());
        tables.find_map(|(table, mark)| {
            Some([table.split_once(letter)?.0.chars().next_back()?, *mark])
        })
    };
    let mut characters = Vec::new();
    for letter in text.chars() {
        match split(letter) {
            Some(pair) => characters.extend(pair),
            None => characters.push(letter),
        }
    }
    characters
}

fn accent(character: char) -> Option<&'static str> {
    find(ACCENTS, character)
}

/// `true` for a combining mark above its letter.
pub(super) fn is_accent(character: char) -> bool {
    accent(character).is_some()
}

fn primes(character: char) -> Option<usize> {
    match character {
        '\'' | '′' => Some(1),
        '″' => Some(2),
        '‴' => Some(3),
        _ => None,
    }
}

/// Writes one character of a formula.
fn character(character: char) -> String {
    if let Some(command) = find(GREEK, character).or_else(|| find(SIGNS, character)) {
        return command.into();
    }
    match character {
        '{' => "\\lbrace".into(),
        '}' => "\\rbrace".into(),
        '`' | '"' => format!("\\text{{{character}}}"),
        ' ' => "\\text{ }".into(),
        '_' => "\\text{\\_}".into(),
        _ if character.is_ascii() && !character.is_ascii_control() => character.into(),
        _ => format!("\\text{{U+{:04X}}}", u32::from(character)),
    }
}

/// Appends `token`, after a space where it would continue the name of a command.
fn push(text: &mut String, token: &str) {
    let command = text.rfind('\\').is_some_and(|start| {
        let name = &text[start + 1..];
        !name.is_empty() && name.chars().all(|letter| letter.is_ascii_alphabetic())
    });
    if command && token.starts_with(|first: char| first.is_ascii_alphabetic()) {
        text.push(' ');
    }
    text.push_str(token);
}

/// Writes a name of the model: a letter (or a word) with its accents, the rest as subscript. `φ̇1`
/// becomes `\dot\varphi_{1}`.
pub(super) fn symbol(notation: &str) -> String {
    let characters = decomposed(notation);
    let run = characters
        .iter()
        .take_while(|letter| letter.is_ascii_alphabetic())
        .count();
    // In `gx` the second letter is a component; longer runs are words.
    let component = run == 2 && matches!(characters[1], 'x' | 'y' | 'z');
    let marked = characters
        .get(1)
        .copied()
        .is_some_and(|second| accent(second).is_some());
    let length = if run < 2 || component || marked {
        characters.len().min(1)
    } else {
        run
    };
    let (base, mut rest) = characters.split_at(length);
    let mut head = match base {
        [] => return "\\text{?}".into(),
        [single] => character(*single),
        word => {
            let mut words: String = word.iter().collect();
            // `outer_force` is two words, not a word with a subscript.
            while let ['_', next @ ..] = rest
                && let length @ 2.. = next
                    .iter()
                    .take_while(|letter| letter.is_ascii_alphabetic())
                    .count()
            {
                words.push_str("\\ ");
                words.extend(&next[..length]);
                rest = &next[length..];
            }
            format!("\\mathrm{{{words}}}")
        }
    };
    while let Some(command) = rest.first().copied().and_then(accent) {
        let simple = head.len() == 1 || head.rfind('\\') == Some(0) && !head.contains('{');
        head = match simple {
            true if head.starts_with('\\') => format!("{command}{head}"),
            true => format!("{command} {head}"),
            false => format!("{command}{{{head}}}"),
        };
        rest = &rest[1..];
    }
    let mut prime_count = 0;
    let mut subscript = String::new();
    let mut index = 0;
    while index < rest.len() {
        let letters = rest[index..]
            .iter()
            .take_while(|letter| letter.is_ascii_alphabetic())
            .count();
        if let Some(count) = primes(rest[index]) {
            prime_count += count;
            index += 1;
        } else if letters > 1 {
            push(
                &mut subscript,
                &format!(
                    "\\mathrm{{{}}}",
                    rest[index..index + letters].iter().collect::<String>()
                ),
            );
            index += letters;
        } else {
            match rest[index] {
                '_' if subscript.is_empty() => {}
                '_' => subscript.push(','),
                mark if accent(mark).is_some() => {}
                other => push(&mut subscript, &character(other)),
            }
            index += 1;
        }
    }
    if !subscript.is_empty() {
        head.push_str(&format!("_{{{subscript}}}"));
    }
    head + &"'".repeat(prime_count)
}

/// Writes a formula in the notation of the model, such as `p = m ẍ + C q̈`.
pub(super) fn formula(text: &str) -> String {
    let characters = decomposed(text);
    let mut result = String::new();
    let (mut index, mut depth) = (0, 0_i64);
    while index < characters.len() {
        let first = characters[index];
        let greek = find(GREEK, first).is_some();
        if greek
            && matches!(first, 'δ' | 'Δ')
            && characters
                .get(index + 1)
                .is_some_and(char::is_ascii_alphabetic)
        {
            // δq is one quantity, not δ with a subscript.
            push(&mut result, &character(first));
            index += 1;
        } else if first.is_ascii_alphabetic() || greek {
            let part = |letter: &&char| {
                letter.is_ascii_alphanumeric()
                    || **letter == '_'
                    || accent(**letter).is_some()
                    || primes(**letter).is_some()
            };
            let length = 1 + characters[index + 1..].iter().take_while(part).count();
            let name: String = characters[index..index + length].iter().collect();
            match FUNCTIONS.contains(&name.as_str()) {
                true => push(&mut result, &format!("\\{name}")),
                false => push(&mut result, &symbol(&name)),
            }
            index += length;
        } else if lowered(first).is_some() {
            let raised: String = characters[index..]
                .iter()
                .map_while(|&letter| lowered(letter))
                .collect();
            index += raised.chars().count();
            let raised = if raised == "T" {
                "\\mathrm{T}".into()
            } else {
                raised
            };
            result.push_str(&format!("^{{{raised}}}"));
        } else {
            match first {
                ' ' if result.ends_with(',') && depth == 0 => result.push_str("\\quad "),
                ' ' => result.push(' '),
                mark if accent(mark).is_some() => {}
                mark if primes(mark).is_some() => result.push('\''),
                other => {
                    depth += i64::from(matches!(other, '(' | '['))
                        - i64::from(matches!(other, ')' | ']'));
                    push(&mut result, &character(other));
                }
            }
            index += 1;
        }
    }
    result.trim().into()
}

/// Writes words; what is not ASCII becomes a formula.
pub(super) fn words(text: &str) -> String {
    let characters = decomposed(text);
    let mut result = String::new();
    let mut index = 0;
    while index < characters.len() {
        let math = |at: usize| {
            let marked = characters
                .get(at + 1)
                .is_some_and(|&next| accent(next).is_some());
            characters
                .get(at)
                .is_some_and(|letter| !letter.is_ascii() || letter.is_ascii_alphabetic() && marked)
        };
        let length = (index..).take_while(|&at| math(at)).count();
        if length > 0 {
            let run: String = characters[index..index + length].iter().collect();
            match run.as_str() {
                "–" => result.push_str("--"),
                "—" => result.push_str("---"),
                run => result.push_str(&format!("${}$", formula(run))),
            }
            index += length;
            continue;
        }
        match characters[index] {
            '\\' => result.push_str("\\textbackslash{}"),
            '~' => result.push_str("\\textasciitilde{}"),
            '^' => result.push_str("\\textasciicircum{}"),
            '<' => result.push_str("\\textless{}"),
            '>' => result.push_str("\\textgreater{}"),
            '|' => result.push_str("\\textbar{}"),
            '`' => result.push_str("\\textasciigrave{}"),
            '-' => result.push_str("-{}"),
            special @ ('{' | '}' | '$' | '&' | '#' | '%' | '_') => result.extend(['\\', special]),
            control if control.is_ascii_control() && control != '\n' => result.push(' '),
            other => result.push(other),
        }
        index += 1;
    }
    // A hyphen between letters needs no protection from its neighbours.
    result
        .replace("-{}", "-\u{0}")
        .replace("-\u{0}-", "-{}-")
        .replace('\u{0}', "")
}

/// Estimates the width of a formula on a line in Computer Modern, in thousandths of an em. The
/// estimate is more often too large than too small.
pub(super) fn width(formula: &str) -> usize {
    /// Sizes of type of the line, of its scripts and of theirs, whose letters are wider for their
    /// height.
    const SIZES: [usize; 3] = [1000, 800, 680];
    let mut levels = vec![0];
    let mut total = 0;
    let mut characters = formula.chars().peekable();
    // Number of groups to follow in a smaller size.
    let mut smaller = 0;
    while let Some(letter) = characters.next() {
        let level: usize = levels.last().copied().unwrap_or(0);
        let size = match letter {
            '\\' => {
                let mut name = String::new();
                while let Some(next) = characters.next_if(char::is_ascii_alphabetic) {
                    name.push(next);
                }
                match name.as_str() {
                    "sin" | "cos" | "exp" | "ln" => 1650,
                    "tanh" => 2300,
                    "arcsin" | "arccos" => 2900,
                    "tfrac" => {
                        smaller += 2;
                        0
                    }
                    "dot" | "ddot" | "dddot" | "hat" | "tilde" | "bar" | "vec" | "mathrm"
                    | "text" | "frac" => 0,
                    "quad" | "sqrt" => 1000,
                    "cdot" => 750,
                    "cdots" | "ddots" => 1350,
                    "times" => 1250,
                    "theta" => 500,
                    _ => 670,
                }
            }
            '_' | '^' => {
                smaller += 1;
                0
            }
            '{' => {
                let is_smaller = smaller > 0;
                smaller -= usize::from(is_smaller);
                levels.push((level + usize::from(is_smaller)).min(SIZES.len() - 1));
                0
            }
            '}' => {
                levels.pop();
                0
            }
            ' ' => 0,
            '+' | '-' | '<' => 1250,
            '0'..='9' => 500,
            '(' | ')' | '[' | ']' | ',' | '\'' => 400,
            'M' => 1080,
            'm' => 880,
            'A'..='Z' => 760,
            _ => 560,
        };
        total += size * SIZES[level] / 1000;
    }
    total
}

/// Formulas of LaTeX, in ASCII.
pub(super) struct Latex;

/// Maximum width of a numerator, denominator or radicand, in thousandths of an em: LaTeX breaks no
/// line inside them.
const MAX_FRACTION: usize = 12_000;

impl Notation for Latex {
    fn minus(&self) -> char {
        '-'
    }

    fn number(&self, value: Constant) -> String {
        match value {
            Constant::Rational(ratio) if *ratio.denom() == 1 => ratio.numer().to_string(),
            Constant::Rational(ratio) => {
                format!("\\tfrac{{{}}}{{{}}}", ratio.numer(), ratio.denom())
            }
            Constant::Float(float) => match scientific(float) {
                Some((mantissa, exponent)) => format!("{mantissa} \\cdot 10^{{{exponent}}}"),
                None => float.to_string(),
            },
        }
    }

    fn symbol(&self, notation: &str) -> String {
        symbol(notation)
    }

    /// Writes a fraction where it is narrow enough.
    fn quotient(&self, above: Written, below: Written) -> Written {
        let is_narrow = |part: &Written| self.width(&part.text) <= MAX_FRACTION;
        if is_narrow(&above) && is_narrow(&below) {
            return Written::new(
                format!("\\frac{{{}}}{{{}}}", above.text, below.text),
                PRODUCT,
            );
        }
        let text = format!("{}/{}", above.within(PRODUCT), below.within(POWER));
        Written::new(text, QUOTIENT)
    }

    fn raised(&self, base: &str, exponent: i32) -> Written {
        Written::new(format!("{base}^{{{exponent}}}"), POWER)
    }

    fn real_power(&self, base: Written, exponent: Written) -> String {
        format!("{}^{{{}}}", base.within(ATOM), exponent.text)
    }

    fn magnitude(&self, argument: Written) -> String {
        format!("\\vert {}\\vert", argument.text)
    }

    fn root(&self, argument: &str) -> String {
        match self.width(argument) <= MAX_FRACTION {
            true => format!("\\sqrt{{{argument}}}"),
            false => format!("({argument})^{{1/2}}"),
        }
    }

    fn function(&self, name: &str, exponent: i32, argument: Written) -> String {
        let name = match name {
            "asin" => "\\arcsin".into(),
            "atan2" => "\\mathrm{atan2}".into(),
            _ => format!("\\{name}"),
        };
        match exponent {
            1 => applied(&name, &argument),
            _ => applied(&self.raised(&name, exponent).text, &argument),
        }
    }

    fn half_angle_squared(&self, order: u8, argument: &str) -> String {
        format!("S{}({argument})", "'".repeat(order.into()))
    }
}

impl PageLayout for Latex {
    fn element(&self, array: &str, indices: &[String]) -> String {
        let array = symbol(array);
        let indices: Vec<String> = indices.iter().map(|index| symbol(index)).collect();
        let indices = indices.join(",");
        match array.strip_suffix('}') {
            Some(subscribed) if array.contains("_{") => format!("{subscribed},{indices}}}"),
            _ => format!("{array}_{{{indices}}}"),
        }
    }

    fn width(&self, text: &str) -> usize {
        width(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares with boxes of pdfTeX, in thousandths of an em of 10 pt.
    #[test]
    fn widths_are_those_of_tex_or_somewhat_larger() {
        for (formula, set) in [
            (r"M_{\theta_{12},\theta_{12}}", 3481),
            (r"E_{\mathrm{spring}}", 2937),
            (r"\tfrac{11}{2}", 1037),
            (r"\cdots", 1333),
            (r"S'(u_{1})", 2750),
            (r"\ddot r_{0x}", 1353),
            (r"\cos(\theta_{1} - \theta_{2})", 5175),
            (r"\sin \varphi_{12} \cos \theta_{12}", 5885),
            (
                r"\tfrac{1}{2} h^{2} m_{12} \dot\theta_{11}^{2} \sin(\theta_{11} - \theta_{12})",
                10_733,
            ),
        ] {
            let estimate = width(formula);
            assert!(
                (set..set * 5 / 4).contains(&estimate),
                "{formula}: {estimate}"
            );
        }
    }

    #[test]
    fn names_become_letters_with_accents_and_subscripts() {
        for (notation, expected) in [
            ("φ1", "\\varphi_{1}"),
            ("φ̇12", "\\dot\\varphi_{12}"),
            ("θ̈", "\\ddot\\theta"),
            ("ṙ0x", "\\dot r_{0x}"),
            ("r\u{307}0x", "\\dot r_{0x}"),
            ("r̈0z", "\\ddot r_{0z}"),
            ("ẍy", "\\ddot x_{y}"),
            ("xx", "x_{x}"),
            ("gx", "g_{x}"),
            ("e'y", "e_{y}'"),
            ("φprevious", "\\varphi_{\\mathrm{previous}}"),
            ("θ̇next", "\\dot\\theta_{\\mathrm{next}}"),
            ("w_q", "w_{q}"),
            ("E_kin", "E_{\\mathrm{kin}}"),
            ("λ_a_1", "\\lambda_{a,1}"),
            ("stretch", "\\mathrm{stretch}"),
            ("outer_force_1", "\\mathrm{outer\\ force}_{1}"),
            ("t12", "t_{12}"),
            ("S″", "S''"),
            ("", "\\text{?}"),
            (
                "\\input{x}",
                "\\backslash_{\\mathrm{input}\\lbrace x\\rbrace}",
            ),
            (
                "a%$#&~^",
                "a_{\\text{\\%}\\text{U+0024}\\text{\\#}\\text{\\&}\\sim\\wedge}",
            ),
            ("漢", "\\text{U+6F22}"),
        ] {
            assert_eq!(symbol(notation), expected, "{notation}");
        }
    }

    #[test]
    fn formulas_and_words_are_typeset() {
        for (text, expected) in [
            ("p = m ẍ + C q̈ + p_0", "p = m \\ddot x + C \\ddot q + p_{0}"),
            (
                "M = ∂²E_kin/∂q̇²",
                "M = \\partial^{2}E_{\\mathrm{kin}}/\\partial\\dot q^{2}",
            ),
            ("δq = w_q δq̈", "\\delta q = w_{q} \\delta\\ddot q"),
            (
                "½ d |ω' − ω|²",
                "\\tfrac{1}{2} d \\vert\\omega' - \\omega\\vert^{2}",
            ),
            ("a, Gᵀ F", "a,\\quad G^{\\mathrm{T}} F"),
            ("1 − cos α", "1 - \\cos \\alpha"),
        ] {
            assert_eq!(formula(text), expected, "{text}");
        }
        assert_eq!(
            words("50 % of α_k \\ a--b q̈"),
            "50 \\% of $\\alpha$\\_k \\textbackslash{} a-{}-b $\\ddot q$"
        );
        assert!(words("\u{1f600}\u{202e}\r`").is_ascii());
    }
}
