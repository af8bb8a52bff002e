//! The origin of the tool force's scatter, as text for a terminal.

use bristle_study::grid::uncertainty::{ForceScatter, SHARES, scatters};
use bristle_study::grid::{CaseResult, Study};
use bristle_study::text::layout::wrap;

/// Returns the origin of the tool force's scatter, and the number of tools left out.
pub(super) fn origin_of_scatter(study: &Study, results: &[CaseResult], width: usize) -> String {
    let mut text = String::new();
    let known: Vec<&ForceScatter> = results
        .iter()
        .flatten()
        .filter_map(|summary| summary.scatter.as_ref())
        .collect();
    let varying: Vec<[f64; SHARES.len()]> = known
        .iter()
        .filter(|scatter| scatter.tool_force_std_n > 0.0)
        .map(|scatter| scatter.sobol_indices())
        .collect();
    if !varying.is_empty() {
        let mean = |index: usize| {
            varying.iter().map(|indices| indices[index]).sum::<f64>() / varying.len() as f64
        };
        let shares = SHARES
            .iter()
            .enumerate()
            .map(|(index, [_, name])| (*name, mean(index)));
        let mut shares: Vec<(&str, f64)> = shares.filter(|(_, mean)| *mean > 0.0).collect();
        shares.sort_by(|(_, a), (_, b)| b.total_cmp(a));
        let rest = 1.0 - shares.iter().map(|(_, share)| share).sum::<f64>();
        let rest = (rest >= 0.005).then_some(("not attributed to one input", rest));
        let shares: Vec<String> = shares
            .into_iter()
            .chain(rest)
            .map(|(name, share)| format!("{name} {:.0} %", 100.0 * share))
            .collect();
        let mean = if varying.len() > 1 {
            " (mean over the cases)"
        } else {
            ""
        };
        wrap(
            width,
            &mut text,
            "",
            &format!(
                "The scatter of F_n,w comes from: {}{mean}",
                shares.join(", ")
            ),
        );
    }
    let failed: usize = known.iter().map(|scatter| scatter.failed_samples).sum();
    if failed > 0 {
        text.push_str(&format!(
            "{failed} sampled tools are left out because their simulations failed\n"
        ));
    }
    let without = |(case, result): &(usize, &CaseResult)| {
        result
            .as_ref()
            .is_ok_and(|summary| summary.scatter.is_none())
            && scatters(&study.settings(*case))
    };
    let without = results.iter().enumerate().filter(without).count();
    if without > 0 {
        let cases = if without == 1 {
            "case has"
        } else {
            "cases have"
        };
        let statement =
            format!("{without} {cases} no band because simulations of sampled tools failed");
        wrap(width, &mut text, "", &statement);
    }
    text
}
