//! Files with structure, as trees that can be damaged in ways that their formats forbid.

use fastrand::Rng;
use serde_json::Value;

use crate::odd::{EXTREMES, OTHER_TYPES, odd_text};

/// A value of a file. Unlike in JSON or TOML, keys may repeat, and any text may stand for a number.
#[derive(Clone, Debug)]
pub enum Tree {
    Object(Vec<(String, Tree)>),
    Array(Vec<Tree>),
    Text(String),
    /// Anything else, written as it is.
    Token(String),
}

/// A format of files.
pub struct Format {
    /// The tree of a valid text.
    pub read: fn(&str) -> Tree,
    /// The text of a tree.
    pub write: fn(&Tree) -> String,
}

pub const JSON: Format = Format {
    read: Tree::of_json,
    write: Tree::json,
};
pub const TOML: Format = Format {
    read: Tree::of_toml,
    write: Tree::toml,
};

/// A change of a tree. False if the tree has no place for it.
type Change = fn(&mut Tree, &mut Rng) -> bool;

/// The changes, by name.
pub const CHANGES: [(&str, Change); 15] = [
    ("scale", scale),
    ("drop", drop_entry),
    ("duplicate", duplicate),
    ("rename", rename),
    ("reorder", reorder),
    ("nest", nest),
    ("exchange", exchange),
    ("move", move_entry),
    ("other type", other_type),
    ("extreme", extreme),
    ("unit", unit),
    ("odd text", odd_value),
    ("empty", empty),
    ("long array", long_array),
    ("deep", deep),
];

/// Numbers of elements that are far beyond what a person writes.
const MANY: [usize; 3] = [130, 1_000, 5_000];

/// Longest array in bytes.
const LONGEST: usize = 1 << 20;

impl Tree {
    fn of_json(text: &str) -> Self {
        Self::of(&serde_json::from_str(text).expect("a seed is JSON"))
    }

    /// The tree of a TOML text.
    pub fn of_toml(text: &str) -> Self {
        Self::of(&toml::from_str(text).expect("a seed is TOML"))
    }

    /// The tree of a value.
    pub fn of(value: &Value) -> Self {
        match value {
            Value::Object(fields) => Self::Object(
                fields
                    .iter()
                    .map(|(key, value)| (key.clone(), Self::of(value)))
                    .collect(),
            ),
            Value::Array(items) => Self::Array(items.iter().map(Self::of).collect()),
            Value::String(text) => Self::Text(text.clone()),
            other => Self::Token(other.to_string()),
        }
    }

    /// As JSON.
    pub fn json(&self) -> String {
        self.text(":", quoted)
    }

    /// As TOML, with objects at the top as sections.
    pub fn toml(&self) -> String {
        let Self::Object(entries) = self else {
            return self.text(" = ", bare);
        };
        let line = |(key, value): &(String, Self)| {
            format!("{} = {}\n", bare(key), value.text(" = ", bare))
        };
        let section = |(key, value): &(String, Self)| match value {
            Self::Object(lines) => format!(
                "[{}]\n{}\n",
                bare(key),
                lines.iter().map(line).collect::<String>()
            ),
            _ => line(&(key.clone(), value.clone())),
        };
        entries.iter().map(section).collect()
    }

    fn text(&self, colon: &str, key: fn(&str) -> String) -> String {
        let list = |items: Vec<String>| items.join(", ");
        match self {
            Self::Object(entries) => {
                let entry = |(name, value): &(String, Self)| {
                    format!("{}{colon}{}", key(name), value.text(colon, key))
                };
                format!("{{{}}}", list(entries.iter().map(entry).collect()))
            }
            Self::Array(items) => format!(
                "[{}]",
                list(items.iter().map(|item| item.text(colon, key)).collect())
            ),
            Self::Text(text) => quoted(text),
            Self::Token(token) => token.clone(),
        }
    }

    /// Changes the tree in one way, chosen at random. Returns its name.
    pub fn change(&mut self, random: &mut Rng) -> &'static str {
        loop {
            let (name, change) = CHANGES[random.usize(..CHANGES.len())];
            if change(self, random) {
                return name;
            }
        }
    }

    fn children(&mut self) -> Vec<&mut Self> {
        match self {
            Self::Object(entries) => entries.iter_mut().map(|(_, value)| value).collect(),
            Self::Array(items) => items.iter_mut().collect(),
            Self::Text(_) | Self::Token(_) => Vec::new(),
        }
    }

    fn count(&mut self, wanted: fn(&Self) -> bool) -> usize {
        usize::from(wanted(self))
            + self
                .children()
                .into_iter()
                .map(|child| child.count(wanted))
                .sum::<usize>()
    }

    fn find(&mut self, left: &mut usize, wanted: fn(&Self) -> bool) -> Option<&mut Self> {
        if wanted(self) {
            if *left == 0 {
                return Some(self);
            }
            *left -= 1;
        }
        self.children()
            .into_iter()
            .find_map(|child| child.find(left, wanted))
    }

    /// One of the wanted nodes.
    fn any(&mut self, random: &mut Rng, wanted: fn(&Self) -> bool) -> Option<&mut Self> {
        let count = self.count(wanted);
        if count == 0 {
            return None;
        }
        self.find(&mut random.usize(..count), wanted)
    }

    /// The entries of an object.
    fn any_object(&mut self, random: &mut Rng) -> Option<&mut Vec<(String, Self)>> {
        match self.any(
            random,
            |node| matches!(node, Self::Object(entries) if !entries.is_empty()),
        )? {
            Self::Object(entries) => Some(entries),
            _ => None,
        }
    }

    fn any_leaf(&mut self, random: &mut Rng) -> Option<&mut Self> {
        self.any(random, |node| {
            matches!(node, Self::Text(_) | Self::Token(_))
        })
    }

    fn any_number(&mut self, random: &mut Rng) -> Option<(&mut Self, f64)> {
        let node = self.any(random, |node| node.number().is_some())?;
        let number = node.number()?;
        Some((node, number))
    }

    fn number(&self) -> Option<f64> {
        match self {
            Self::Token(token) => token.parse().ok(),
            _ => None,
        }
    }
}

fn quoted(text: &str) -> String {
    Value::from(text).to_string()
}

/// A key of TOML.
fn bare(key: &str) -> String {
    let is_bare = !key.is_empty()
        && key
            .bytes()
            .all(|byte| byte.is_ascii_alphanumeric() || b"_-".contains(&byte));
    if is_bare { key.to_owned() } else { quoted(key) }
}

fn drop_entry(tree: &mut Tree, random: &mut Rng) -> bool {
    let node = tree.any(random, |node| match node {
        Tree::Object(entries) => !entries.is_empty(),
        Tree::Array(items) => !items.is_empty(),
        _ => false,
    });
    match node {
        Some(Tree::Object(entries)) => drop(entries.remove(random.usize(..entries.len()))),
        Some(Tree::Array(items)) => drop(items.remove(random.usize(..items.len()))),
        _ => return false,
    }
    true
}

fn duplicate(tree: &mut Tree, random: &mut Rng) -> bool {
    let Some(entries) = tree.any_object(random) else {
        return false;
    };
    let copy = entries[random.usize(..entries.len())].clone();
    entries.insert(random.usize(..=entries.len()), copy);
    true
}

fn rename(tree: &mut Tree, random: &mut Rng) -> bool {
    let Some(entries) = tree.any_object(random) else {
        return false;
    };
    let another = entries[random.usize(..entries.len())].0.clone();
    let at = random.usize(..entries.len());
    let key = &mut entries[at].0;
    match random.u8(..5) {
        0 => key.push('s'),
        1 => drop(key.pop()),
        2 => *key = key.to_uppercase(),
        3 => *key = another,
        _ => *key = odd_text(random),
    }
    true
}

fn reorder(tree: &mut Tree, random: &mut Rng) -> bool {
    match tree.any(random, |node| {
        matches!(node, Tree::Object(_) | Tree::Array(_))
    }) {
        Some(Tree::Object(entries)) => random.shuffle(entries),
        Some(Tree::Array(items)) => random.shuffle(items),
        _ => return false,
    }
    true
}

fn nest(tree: &mut Tree, random: &mut Rng) -> bool {
    let Some(node) = tree.any(random, |_| true) else {
        return false;
    };
    let inner = node.clone();
    *node = if random.bool() {
        Tree::Array(vec![inner])
    } else {
        Tree::Object(vec![("value".to_owned(), inner)])
    };
    true
}

/// Exchanges two values of an object.
fn exchange(tree: &mut Tree, random: &mut Rng) -> bool {
    let Some(entries) = tree.any_object(random) else {
        return false;
    };
    let (one, two) = (random.usize(..entries.len()), random.usize(..entries.len()));
    let value = entries[one].1.clone();
    entries[one].1 = std::mem::replace(&mut entries[two].1, value);
    true
}

/// Moves an entry to another object.
fn move_entry(tree: &mut Tree, random: &mut Rng) -> bool {
    let Some(entries) = tree.any_object(random) else {
        return false;
    };
    let entry = entries.remove(random.usize(..entries.len()));
    let Some(entries) = tree.any_object(random) else {
        return false;
    };
    entries.push(entry);
    true
}

fn other_type(tree: &mut Tree, random: &mut Rng) -> bool {
    let Some(node) = tree.any(random, |_| true) else {
        return false;
    };
    *node = Tree::Token(OTHER_TYPES[random.usize(..OTHER_TYPES.len())].to_owned());
    true
}

fn extreme(tree: &mut Tree, random: &mut Rng) -> bool {
    let Some(node) = tree.any_leaf(random) else {
        return false;
    };
    *node = Tree::Token(EXTREMES[random.usize(..EXTREMES.len())].to_owned());
    true
}

/// Another value of the same size, as a user tries it.
fn scale(tree: &mut Tree, random: &mut Rng) -> bool {
    let Some((node, number)) = tree.any_number(random) else {
        return false;
    };
    let factor = 0.5 + 1.5 * random.f64();
    *node = Tree::Token(if number.fract() == 0.0 && random.bool() {
        format!("{}", (number * factor).round())
    } else {
        format!("{:?}", number * factor)
    });
    true
}

/// A number in mm instead of m, in GPa instead of Pa, or in degrees.
fn unit(tree: &mut Tree, random: &mut Rng) -> bool {
    let Some((node, number)) = tree.any_number(random) else {
        return false;
    };
    let factor = [
        1e3,
        1e-3,
        1e6,
        1e9,
        1e-9,
        180.0 / std::f64::consts::PI,
        -1.0,
    ][random.usize(..7)];
    *node = match random.u8(..4) {
        0 => Tree::Text(format!("{number} mm")),
        1 => Tree::Token(format!("{number} mm")),
        _ => Tree::Token(format!("{:?}", number * factor)),
    };
    true
}

fn odd_value(tree: &mut Tree, random: &mut Rng) -> bool {
    let Some(node) = tree.any_leaf(random) else {
        return false;
    };
    *node = Tree::Text(odd_text(random));
    true
}

fn empty(tree: &mut Tree, random: &mut Rng) -> bool {
    let Some(node) = tree.any(random, |_| true) else {
        return false;
    };
    *node = match node {
        Tree::Object(_) => Tree::Object(Vec::new()),
        Tree::Array(_) => Tree::Array(Vec::new()),
        Tree::Text(_) | Tree::Token(_) => Tree::Text(String::new()),
    };
    true
}

fn long_array(tree: &mut Tree, random: &mut Rng) -> bool {
    let Some(node) = tree.any_leaf(random) else {
        return false;
    };
    let item = node.clone();
    // What is deep already does not become a file of many megabytes.
    let many = MANY[random.usize(..MANY.len())].min(LONGEST / item.json().len().max(1));
    *node = match (random.bool(), node.number()) {
        (true, Some(number)) => Tree::Array(
            (0..many)
                .map(|index| Tree::Token(format!("{:?}", number + index as f64 * 1e-6)))
                .collect(),
        ),
        _ => Tree::Array(vec![item; many]),
    };
    true
}

fn deep(tree: &mut Tree, random: &mut Rng) -> bool {
    let Some(node) = tree.any(random, |_| true) else {
        return false;
    };
    let levels = [130, 5_000, 100_000][random.usize(..3)];
    let (open, close) =
        [("[", "]"), ("{ a = ", "}"), ("{\"a\":", "}"), ("[", "")][random.usize(..4)];
    // As a token: a tree this deep could not be walked.
    *node = Tree::Token(format!("{}1{}", open.repeat(levels), close.repeat(levels)));
    true
}
