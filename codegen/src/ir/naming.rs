//! Names: what a name becomes in Rust.

/// `segment_tangent` as `SegmentTangent`.
pub fn camel_case(name: &str) -> String {
    let capitalise = |word: &str| {
        let mut letters = word.chars();
        letters
            .next()
            .map(|first| first.to_uppercase().chain(letters).collect::<String>())
            .unwrap_or_default()
    };
    name.split('_').map(capitalise).collect()
}
