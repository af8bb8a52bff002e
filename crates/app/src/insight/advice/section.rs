//! Advice as data: the cases that it cites, sentences about them, and the sections that these form.

use std::collections::BTreeMap;

use bristle_study::text::number::spanning;
use serde::Serialize;
use serde_json::Value;

use super::cited::Cited;
use super::outcome::Outcome;
use super::suggestion::Suggestion;
use crate::insight::slices::Slice;

/// Advice from cases that differ only in velocity and depth.
#[derive(Clone, Debug, Serialize)]
pub struct Section {
    /// Path and value of each further swept setting, and the name of the tool under `tool`.
    pub settings: BTreeMap<&'static str, Value>,
    /// The advice, topic by topic.
    pub advice: Vec<Sentence>,
    /// Settings between simulated cases, if a force is asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub interpolated: Vec<Suggestion>,
    /// Omissions of the advice, with reasons.
    pub notes: Vec<String>,
    #[serde(skip)]
    pub(super) slice: Slice,
    /// The cases, by depth and then by velocity.
    #[serde(skip)]
    pub(super) cells: Vec<Vec<Option<Cited>>>,
}

/// One piece of advice.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sentence {
    /// Its topic.
    pub topic: Topic,
    /// The case that it describes.
    #[serde(flatten)]
    pub cell: Cited,
    /// The sentence itself.
    pub sentence: String,
    /// Rows of the other cases that it mentions.
    pub other_rows: Vec<usize>,
}

/// The topic of a piece of advice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Topic {
    /// The highest force of all.
    Highest,
    /// The best cases within [`Limits`](super::Limits), ranked. Cases whose whole uncertainty is
    /// within the limit of the force come first. Among them stable ones precede, then sweeping
    /// ones, then the highest force.
    WithinLimits,
    /// The cases within the limits whose force is the target or nearest to it, ranked.
    NearTarget,
    /// The highest force of a laterally stable case. Only where the highest of all is unstable.
    Stable,
    /// The highest force at each brushing velocity.
    AtVelocity,
    /// The highest force at each penetration depth.
    AtDepth,
    /// The most force per brushing velocity.
    PerVelocity,
    /// The most force per penetration depth.
    PerDepth,
    /// A local maximum over the velocity along the tier.
    Tier,
    /// The least power for each force that is given in place of a depth.
    LeastPower,
    /// The most removal per time, in a study with `[removal]`.
    MostRemoval,
    /// The most removal from edges per time.
    MostOfEdge,
    /// The most removal per power of the drive.
    RemovalPerPower,
    /// The best case of a named tool.
    OfTool,
    /// The case of a named tool at the speed of the best tool, nearest to its force.
    ToolAlongside,
}

impl Topic {
    /// Returns `true` if the cases are the best of all, or within the limits.
    pub(super) fn is_ranking(self) -> bool {
        matches!(
            self,
            Self::Highest | Self::WithinLimits | Self::NearTarget | Self::Stable
        )
    }

    pub(super) fn heading(self) -> &'static str {
        match self {
            Self::Highest => "Highest force F_n,w of the tool",
            Self::WithinLimits => "Best within the limits",
            Self::NearTarget => "Nearest to the target force",
            Self::Stable => "Highest force of a laterally stable case",
            Self::AtVelocity => "Highest force at each brushing velocity",
            Self::AtDepth => "Highest force at each penetration depth",
            Self::PerVelocity => {
                "Most force per brushing velocity, and so the highest impulse p_n of a filament"
            }
            Self::PerDepth => "Most force per penetration depth",
            Self::OfTool => "Best case of each tool",
            Self::ToolAlongside => "Other tools at this speed, nearest to this force",
            Self::Tier => {
                "Local maxima over the velocity along the line ε_tc = ½ between sweeping and striking"
            }
            Self::LeastPower => "Least power for each force",
            Self::MostRemoval => "Most removal",
            Self::MostOfEdge => "Most removal from the edge",
            Self::RemovalPerPower => "Most removal per power of the drive",
        }
    }
}

/// A sentence about a case. It ends with a warning if the case is laterally unstable.
pub(super) fn about(
    topic: Topic,
    cell: &Cited,
    mut sentence: String,
    others: &[&Cited],
) -> Sentence {
    warn_of_instability(&mut sentence, &cell.outcome);
    Sentence {
        topic,
        cell: cell.clone(),
        sentence,
        other_rows: others.iter().map(|cell| cell.row).collect(),
    }
}

/// Adds a warning to a sentence about a laterally unstable case.
pub(super) fn warn_of_instability(sentence: &mut String, outcome: &Outcome) {
    if outcome.laterally_unstable {
        sentence.push_str(&format!(
            " Laterally unstable: {}-fold.",
            spanning(outcome.lateral_amplification)
        ));
    }
}
