//! Summary of a simulated case, and the settings that it begins with.

use bristle::model::metrics::Metrics;
use bristle::model::settings::Settings;
use bristle::simulation::{DepthSearch, Statistics};
use serde::{Deserialize, Serialize};

use crate::grid::interaction::Interaction;
use crate::grid::uncertainty::ForceScatter;

/// The part of a simulated case that is kept.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CaseSummary {
    /// Contact metrics, those of the last turn.
    pub metrics: Metrics,
    /// Contact normal impulse of each turn in N s.
    pub turn_contact_normal_impulses_n_s: Vec<f64>,
    /// Work of the solver.
    pub statistics: Statistics,
    /// Distribution of the tool force where filaments scatter. `None` if most of the sampled tools
    /// failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scatter: Option<ForceScatter>,
    /// Interaction in a brush. `None` if the case is one filament alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub brush: Option<Interaction>,
    /// Largest relative change of the headline metrics when the case was repeated more precisely.
    /// `None` if it was not repeated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub change_when_checked: Option<f64>,
}

/// A case's summary, or the text of the error that ended it.
pub type CaseResult = Result<CaseSummary, String>;

/// Returns settings with a depth: the first one of a search, where they state a force.
#[must_use]
pub fn tentative(settings: Settings) -> Settings {
    let first =
        DepthSearch::<()>::of(&settings, None).map(|search| settings.at_depth(search.depth()));
    first.unwrap_or(settings)
}
