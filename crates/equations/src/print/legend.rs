//! Meanings of the symbols: one table for all pages.

use std::collections::BTreeMap;

use bristle_codegen::ir::graph::{Graph, Node, NodeId};
use bristle_codegen::ir::unit::Unit;

/// A line of a legend.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Row {
    /// The symbols, in the notation of the model.
    pub symbols: Vec<String>,
    /// A sentence, with formulas between backticks.
    pub meaning: String,
    /// The unit; `None` where the row explains a function.
    pub unit: Option<String>,
}

/// The families of symbols: the name without segment and axis, and the meaning. The unit is that of
/// the symbol.
const FAMILIES: [(&str, &str); 36] = [
    ("phi", "polar angle of a segment from `+z`"),
    ("theta", "azimuth of a segment about `z`"),
    (
        "phi_x",
        "polar angle of a segment in the second chart, from `+x`",
    ),
    (
        "theta_x",
        "azimuth of a segment in the second chart, about `x`",
    ),
    ("phi_rate", "rate of the polar angle"),
    ("theta_rate", "rate of the azimuth"),
    ("phi_acceleration", "second derivative of the polar angle"),
    ("theta_acceleration", "second derivative of the azimuth"),
    (
        "phi_variation",
        "lateral variation, `∂φ/∂τ` with the tilt `τ` of the clamp out of the plane of rotation",
    ),
    ("phi_variation_rate", "its rate"),
    (
        "root_position",
        "root of the filament, which the tool moves",
    ),
    ("root_velocity", "velocity of the root"),
    ("root_acceleration", "acceleration of the root"),
    (
        "clamp_direction",
        "unit vector along which the filament is clamped",
    ),
    ("clamp_direction_rate", "rate of the clamp direction"),
    ("angular_velocity", "angular velocity of the brush body"),
    (
        "relaxed_direction",
        "clamp direction turned about `z` by the relaxed angle of the clamp joint",
    ),
    ("relaxed_direction_rate", "rate of that vector"),
    ("base_position", "inner end of a segment"),
    ("base_velocity", "velocity of the inner end"),
    ("base_acceleration", "acceleration of the inner end"),
    (
        "direction",
        "unit vector along a segment; at a joint, along its inner side",
    ),
    ("direction_rate", "rate of that vector"),
    (
        "outer_direction",
        "unit vector along the outer side of a joint",
    ),
    (
        "unbent_direction",
        "that vector turned back about `z` by the relaxed angle of the joint",
    ),
    ("outer_direction_rate", "rate of that vector"),
    (
        "outer_force",
        "force that the outer part of the chain needs at the outer end of the segment",
    ),
    ("segment_length", "length of a segment"),
    ("segment_mass", "mass of a segment"),
    (
        "segment_inertia",
        "transverse moment of inertia of a segment about its centre",
    ),
    (
        "joint_stiffness",
        "stiffness of the joint at the inner end of a segment",
    ),
    (
        "joint_damping",
        "damping of the joint at the inner end of a segment",
    ),
    (
        "relaxed_angle",
        "angle about `z` at which the joint at the inner end of a segment is relaxed",
    ),
    ("gravity", "gravitational acceleration"),
    ("coordinate_weight", "weight of a time step: `δq = w_q δq̈`"),
    ("rate_weight", "weight of a time step: `δq̇ = w_v δq̈`"),
];

/// Endings of names that state the segment or axis of a symbol.
const LABELS: [&str; 6] = ["x", "y", "z", "k", "previous", "next"];

/// Maximum symbols of a family that are all shown; of more, the first two and the last.
const MAX_SHOWN: usize = 6;

/// The entry of a symbol in [`FAMILIES`].
fn family(name: &str) -> Option<usize> {
    let exact = |name: &str| FAMILIES.iter().position(|&(family, _)| family == name);
    exact(name).or_else(|| {
        let (rest, label) = name.rsplit_once('_')?;
        let numbered = !label.is_empty() && label.bytes().all(|digit| digit.is_ascii_digit());
        if numbered || LABELS.contains(&label) {
            exact(rest)
        } else {
            None
        }
    })
}

/// The rows for all nodes that `graphs` need, in the order of the table. Symbols without an entry
/// follow, under their own names, then functions.
pub(super) fn rows<'a>(graphs: impl IntoIterator<Item = (&'a Graph, Vec<NodeId>)>) -> Vec<Row> {
    let mut known: BTreeMap<usize, (Vec<String>, Unit)> = BTreeMap::new();
    let mut others: Vec<Row> = Vec::new();
    let (mut half_angle, mut comparison) = (0, false);
    for (graph, outputs) in graphs {
        let mut occurring = Vec::new();
        for id in graph.reachable(&outputs) {
            match graph.node(id) {
                Node::Symbol(symbol) => occurring.push(symbol),
                Node::HalfAngleSquared(order, _) => half_angle = half_angle.max(order + 1),
                Node::LessThan(..) => comparison = true,
                _ => {}
            }
        }
        occurring.sort_unstable();
        for symbol in occurring
            .into_iter()
            .map(|symbol| &graph.symbols()[symbol.index()])
        {
            // A known name with another unit is another quantity.
            let entry = family(&symbol.name)
                .map(|family| {
                    known
                        .entry(family)
                        .or_insert_with(|| (Vec::new(), symbol.unit))
                })
                .filter(|entry| entry.1 == symbol.unit);
            match entry {
                Some((symbols, _)) if !symbols.contains(&symbol.notation) => {
                    symbols.push(symbol.notation.clone())
                }
                Some(_) => {}
                None => {
                    let unit = Some(symbol.unit.to_string());
                    let row = Row {
                        symbols: vec![symbol.notation.clone()],
                        meaning: symbol.name.clone(),
                        unit,
                    };
                    if !others.contains(&row) {
                        others.push(row);
                    }
                }
            }
        }
    }
    let mut rows: Vec<Row> = known
        .into_iter()
        .map(|(family, (symbols, unit))| Row {
            symbols: shown(symbols),
            meaning: FAMILIES[family].1.into(),
            unit: Some(unit.to_string()),
        })
        .collect();
    rows.extend(others);
    let mut function = |symbol: &str, meaning: &str| {
        rows.push(Row {
            symbols: vec![symbol.into()],
            meaning: meaning.into(),
            unit: None,
        });
    };
    if half_angle > 0 {
        function(
            "S",
            "`S(u) = ½ arccos²(1 − u) = ½ α²` for `u = 1 − cos α`, `α` the angle of a joint",
        );
    }
    if half_angle > 1 {
        function("S′", "its derivative; `S″` and `S‴` are the next");
    }
    if comparison {
        function("[ ]", "`[a < b]` is 1 where `a < b`, else 0");
    }
    rows
}

fn shown(symbols: Vec<String>) -> Vec<String> {
    match &symbols[..] {
        [first, second, .., last] if symbols.len() > MAX_SHOWN => {
            vec![first.clone(), second.clone(), "…".into(), last.clone()]
        }
        _ => symbols,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bristle_codegen::model::chain::Motion;
    use bristle_codegen::model::kernels::kernels;
    use bristle_codegen::model::whole::{Purpose, whole_kernels};

    #[test]
    fn every_symbol_of_the_model_has_an_entry() {
        let whole =
            whole_kernels(3, Motion::Spatial, Purpose::Computing).expect("the derivation is sound");
        for kernel in whole
            .into_iter()
            .chain(kernels().expect("the derivation is sound"))
        {
            for symbol in kernel.graph.symbols() {
                let entry = family(&symbol.name);
                assert!(entry.is_some(), "{}", symbol.name);
            }
        }
        assert_eq!(family("phi_rate_12"), family("phi_rate_next"));
        assert_eq!(family("phi_fast"), None);
    }

    #[test]
    fn other_symbols_are_listed_by_their_own_names() {
        let mut graph = Graph::raw();
        let stretch = graph.symbol("stretch", "λ", Unit::ONE);
        // A known name with another unit is a quantity outside the table.
        let gravity = graph.symbol("gravity_x", "gx", Unit::METRE.per(Unit::SECOND.powi(2)));
        let other = graph.symbol("gravity_y", "gy", Unit::ONE);
        let less = graph.less_than(stretch, other);
        let rows = rows([(&graph, vec![less, gravity])]);
        let text: Vec<(&str, &str)> = rows
            .iter()
            .map(|row| (row.symbols[0].as_str(), row.meaning.as_str()))
            .collect();
        assert_eq!(
            text[..3],
            [
                ("gx", "gravitational acceleration"),
                ("λ", "stretch"),
                ("gy", "gravity_y")
            ]
        );
        assert_eq!(text.len(), 4);
    }
}
