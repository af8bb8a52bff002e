//! Names and texts: what a name becomes in Rust, and how text from a file is shown.

/// `segment_tangent` as `SegmentTangent`.
pub(crate) fn camel_case(name: &str) -> String {
    let capitalise = |word: &str| {
        let mut letters = word.chars();
        letters.next().map(|first| first.to_uppercase().chain(letters).collect::<String>()).unwrap_or_default()
    };
    name.split('_').map(capitalise).collect()
}

/// [`shown`], for a name or a short text.
pub(crate) fn shortened(text: &str) -> String {
    shown(text, 40)
}

/// At most `most` characters of a text from a file, for a message: on one line, with every character visible.
pub(crate) fn shown(text: &str, most: usize) -> String {
    let mut shown = String::new();
    for letter in text.chars().take(most) {
        if is_invisible(letter) {
            shown.extend(letter.escape_unicode());
        } else {
            shown.push(letter);
        }
    }
    if text.chars().nth(most).is_some() {
        shown.push('…');
    }
    shown
}

/// True for control characters and those that change how others are shown. A reader of emitted code must see what is
/// there, and the compiler refuses some of them in comments.
pub(crate) fn is_invisible(letter: char) -> bool {
    letter.is_control()
        || matches!(letter,
            '\u{ad}' | '\u{61c}' | '\u{180e}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}'
            | '\u{2060}'..='\u{206f}' | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}')
}
