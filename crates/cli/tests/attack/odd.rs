//! Values and texts that programs stumble over.

use fastrand::Rng;

/// Numbers at the limits of their types, and what looks like a number.
pub const EXTREMES: [&str; 34] = [
    "0",
    "-0.0",
    "-1",
    "1",
    "2.5",
    "1e3",
    "1e-3",
    "1e16",
    "1e308",
    "-1e308",
    "1.7976931348623157e308",
    "1e-308",
    "2.2250738585072014e-308",
    "5e-324",
    "1e999",
    "-1e999",
    "nan",
    "inf",
    "-inf",
    "NaN",
    "Infinity",
    "4294967295",
    "4294967296",
    "9007199254740993",
    "9223372036854775807",
    "9223372036854775808",
    "-9223372036854775808",
    "18446744073709551616",
    "0x7fffffff",
    "1_000",
    "1.",
    ".5",
    "+1",
    "000000000000000000000000000000000000000001",
];

/// Values of all types that files know.
pub const OTHER_TYPES: [&str; 12] = [
    "true",
    "false",
    "null",
    "\"text\"",
    "\"\"",
    "[]",
    "{}",
    "[1.0, 2.0, 3.0]",
    "[[1.0]]",
    "1979-05-27",
    "1979-05-27T07:32:00Z",
    "\"25\"",
];

/// A text that a terminal, a file name or a format can misread.
pub fn odd_text(random: &mut Rng) -> String {
    const TEXTS: [&str; 23] = [
        "",
        " ",
        "\t",
        "\n\n",
        "\r",
        "\0",
        "\u{7}",
        "\u{1b}[31mred\u{1b}[0m",
        "\u{1b}]0;title\u{7}",
        "\u{9b}2J",
        "\u{7f}",
        "\u{202e}desrever",
        "\u{feff}",
        "\u{2028}",
        "é\u{301}",
        "🦀",
        "\"quoted\"",
        "back\\slash",
        "%s%n",
        "</script><b>",
        "`backquoted`",
        "a.b.c",
        "no/such/directory",
    ];
    match random.usize(..TEXTS.len() + 2) {
        index if index < TEXTS.len() => TEXTS[index].to_owned(),
        index if index == TEXTS.len() => "long ".repeat(2_000),
        _ => (0..random.usize(1..40)).map(|_| random.char(..)).collect(),
    }
}
