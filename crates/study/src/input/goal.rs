//! Section `[goal]`: the question that a study answers.

use serde_json::{Value, json};

pub(crate) const GOAL: &str = "goal";
/// Key of the quantity to maximise, and the words for such quantities.
pub(crate) const MOST: &str = "most";
pub(crate) const MOST_OF: [&str; 3] = ["force", "edge", "removal"];
/// Other keys, which are numbers, with their meanings.
pub(crate) const NUMBERS: [(&str, &str); 8] = [
    (
        "target_force_n",
        "The force F_n,w of the tool that is wanted, in N.",
    ),
    ("max_force_n", "Highest force F_n,w of the tool in N."),
    ("max_power_w", "Highest power P_w in W."),
    ("max_velocity_m_s", "Highest brushing velocity v_b in m/s."),
    (
        "max_rotational_speed_rpm",
        "Highest rotational speed n_w in rpm.",
    ),
    ("max_depth_m", "Largest penetration depth a_e in m."),
    (
        "min_ratio",
        "Lowest contact time ratio ε_tc, for filaments that sweep.",
    ),
    (
        "max_ratio",
        "Highest contact time ratio ε_tc, for filaments that strike.",
    ),
];

/// Returns the largest value of a number.
pub(crate) fn largest(key: &str) -> f64 {
    if key.ends_with("ratio") {
        1.0
    } else {
        f64::INFINITY
    }
}

/// Describes the allowed values of a number.
pub(crate) fn allowed(key: &str) -> &'static str {
    if largest(key) == 1.0 {
        "a number greater than 0 and at most 1"
    } else {
        "a finite number greater than 0"
    }
}

pub(crate) fn goal_schema() -> Value {
    let number = |(key, meaning): (&str, &str)| {
        let mut schema =
            json!({ "type": "number", "exclusiveMinimum": 0.0, "description": meaning });
        if largest(key).is_finite() {
            schema["maximum"] = json!(largest(key));
        }
        (key.to_owned(), schema)
    };
    let mut properties: serde_json::Map<String, Value> = NUMBERS.into_iter().map(number).collect();
    let most = "Quantity to maximise within the limits: the force, or what is removed from edges or in all, which needs [removal].";
    properties.insert(
        MOST.to_owned(),
        json!({ "enum": MOST_OF, "default": MOST_OF[0], "description": most }),
    );
    json!({
        "description": "What `bristle study` is asked for: its report begins with the speed and depth that answer it.",
        "type": "object",
        "properties": properties,
        "additionalProperties": false,
    })
}
