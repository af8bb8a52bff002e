//! Shards: parts of a study that separate calls simulate, on different machines if need be.

use std::fmt::{self, Display, Formatter};
use std::str::FromStr;

/// One of several shards. Case `c`, counted from 0, belongs to shard `c mod N + 1` of `N`, so that
/// shards of a grid take about as long.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Number of the shard, from 1.
    number: usize,
    /// Number of shards.
    count: usize,
}

impl Shard {
    /// Returns `true` if the shard has a case, counted from 0.
    #[must_use]
    pub fn has(self, case: usize) -> bool {
        case % self.count == self.number - 1
    }
}

impl FromStr for Shard {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let numbers = text
            .split_once('/')
            .and_then(|(number, count)| Some((number.parse().ok()?, count.parse().ok()?)));
        match numbers {
            Some((number, count)) if (1..=count).contains(&number) => Ok(Self { number, count }),
            _ => Err("must be I/N, shard I of N, as in 2/3"),
        }
    }
}

impl Display for Shard {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}/{}", self.number, self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_case_is_in_one_shard() {
        let shards: Vec<Shard> = ["1/3", "2/3", "3/3"]
            .iter()
            .map(|text| text.parse().expect("a shard"))
            .collect();
        assert!((0..20).all(|case| shards.iter().filter(|shard| shard.has(case)).count() == 1));
        assert_eq!(shards[1].to_string(), "2/3");
        for text in ["", "1", "0/3", "4/3", "1/0", "-1/3", "1/3/3", "a/b"] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }
}
