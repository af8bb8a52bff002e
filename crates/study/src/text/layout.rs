//! Lines and columns in a terminal.

/// Width of the terminal, in columns, for which tables and advice are made.
pub const WIDTH: usize = 100;

/// Rows with equal numbers of cells as lines, with each column right-aligned.
pub fn aligned(rows: &[Vec<String>]) -> Vec<String> {
    let columns = rows.first().map_or(0, Vec::len);
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let line = |row: &Vec<String>| row.iter().zip(&widths).map(|(cell, width)| format!("  {cell:>width$}")).collect();
    rows.iter().map(line).collect()
}

/// Appends `beginning` and, indented to its right, `words`, in lines no longer than [`WIDTH`] if the words allow it.
pub fn wrap(text: &mut String, beginning: &str, words: &str) {
    wrap_at(WIDTH, text, beginning, words);
}

/// Like [`wrap`], in lines of `width` columns.
pub(crate) fn wrap_at(width: usize, text: &mut String, beginning: &str, words: &str) {
    let indent = beginning.chars().count();
    text.push_str(beginning);
    let mut column = indent;
    for word in words.split(' ') {
        let letters = word.chars().count();
        if column > indent && column + 1 + letters > width {
            text.push_str(&format!("\n{:indent$}", ""));
            column = indent;
        } else if column > indent {
            text.push(' ');
            column += 1;
        }
        text.push_str(word);
        column += letters;
    }
    text.push('\n');
}

/// Width of the terminal, in columns, for which warnings are made.
pub(crate) const WARNING_WIDTH: usize = 80;

/// A warning for a terminal 80 columns wide, without a line end.
pub fn warning(statement: &str) -> String {
    of_warning("warning: ", statement)
}

/// What to do about a warning, on the lines below it: a statement, and a line to add to the input file.
pub fn help(statement: &str, line: &str) -> String {
    const HELP: &str = "   = help: ";
    format!("{}\n{:indent$}{line}", of_warning(HELP, statement), "", indent = HELP.len())
}

fn of_warning(beginning: &str, statement: &str) -> String {
    let mut text = String::new();
    wrap_at(WARNING_WIDTH, &mut text, beginning, statement);
    text.truncate(text.trim_end().len());
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_wrapped_between_words() {
        let mut text = String::new();
        wrap(&mut text, "ε_tc  ", &"word ".repeat(40).trim_end().replace("word word", "word µ"));
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines.iter().all(|line| line.chars().count() <= WIDTH && line.trim_end() == *line), "{text}");
        assert!(lines[0].starts_with("ε_tc  word") && lines[1].starts_with("      "), "{text}");
        assert_eq!(text.split_whitespace().count(), 41);
    }
}
