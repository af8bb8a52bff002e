//! Numbers for people, with few digits.

/// Swept values with equal numbers of decimals.
pub fn labels(values: impl Iterator<Item = f64>) -> Vec<String> {
    let labels: Vec<String> = values.map(short).collect();
    let decimals = |label: &String| match label.split_once('.') {
        Some((_, decimals)) if !label.contains('e') => decimals.len(),
        _ => 0,
    };
    let most = labels.iter().map(decimals).max().unwrap_or(0);
    let with_decimals = |label: String| match label.parse::<f64>() {
        Ok(value) if !label.contains('e') => format!("{value:.most$}"),
        _ => label,
    };
    labels.into_iter().map(with_decimals).collect()
}

/// A swept value with at most four significant digits.
pub fn short(value: f64) -> String {
    let scientific = format!("{value:.3e}");
    match scientific.parse::<f64>() {
        Ok(rounded) if (1e-3..1e5).contains(&rounded.abs()) || rounded == 0.0 => rounded.to_string(),
        Ok(rounded) => format!("{rounded:e}"),
        Err(_) => scientific,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_have_equally_many_decimals() {
        let values = [2.5, 5.0, 0.5e-3 * 1e3, 1.0 / 3.0];
        assert_eq!(labels(values.into_iter()), ["2.5000", "5.0000", "0.5000", "0.3333"]);
        assert_eq!(labels([10.0, 1e300].into_iter()), ["10", "1e300"]);
    }
}
