//! Words common to several pages.

use bristle_codegen::model::chain::Motion;

/// The title of the equations of `motion` of a filament of `segments` segments, at the start of a
/// sentence.
pub fn title(segments: usize, motion: Motion) -> String {
    let plural = if segments == 1 { "" } else { "s" };
    let place = match motion {
        Motion::Spatial => "",
        Motion::Planar => " in the plane of rotation",
    };
    format!("Equations of motion of a filament of {segments} rigid segment{plural}{place}")
}

/// Effect of the plane on the energies.
pub(super) const PLANE: &str = "In the plane of rotation every `φ = π/2`, and nothing has a component along `z`.\n\
                                The angle of a joint between two segments is `α = θ' − θ`, where `|α| < π`; its spring \
                                has the energy `½ c α²`.";

/// Effect of a cylinder on the joints.
pub(super) const CYLINDER: &str = "All segments and joints are alike, but the joint at the clamp bends half the length of the others: \
                                   it has `2 c` and `2 d`.";
