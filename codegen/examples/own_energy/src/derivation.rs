//! User-defined energies, and the functions derived from them.

use bristle_codegen::ir::kernel::{Kernel, Output};
use bristle_codegen::ir::unit::Unit;
use bristle_codegen::model::chain::{Motion, RelaxedShape, VELOCITY};
use bristle_codegen::model::lagrange::{WholeEquations, whole_equations_with};
use bristle_codegen::model::whole::Purpose;
use bristle_codegen::passes::calculus::gradient;

/// A chain of three segments whose tip adheres to the plane `y = 0`, with Morse's potential
/// `W ((1 − exp(−y/λ))² − 1)` and a smoothed dry damper, `D = F v tanh(v/v_s)`, where `v = ẏ`.
fn equations() -> WholeEquations {
    whole_equations_with(3, Motion::Planar, RelaxedShape::default(), |chain| {
        let depth = chain.constant("adhesion_energy", "W", Unit::JOULE);
        let range = chain.constant("adhesion_range", "λ", Unit::METRE);
        let force = chain.constant("damper_force", "F", Unit::NEWTON);
        let speed = chain.constant("damper_speed", "v_s", VELOCITY);
        let ([_, y, _], [_, v, _]) = (chain.positions[3], chain.velocities[3]);
        let g = &mut chain.graph;

        let (one, ratio) = (g.integer(1), g.div(y, range));
        let exponent = g.neg(ratio);
        let decay = g.exp(exponent);
        let rise = g.sub(one, decay);
        let square = g.powi(rise, 2);
        let well = g.sub(square, one);
        chain.other.push(g.mul(depth, well));

        let (drag, ratio) = (g.mul(force, v), g.div(v, speed));
        let sign = g.tanh(ratio);
        chain.dissipation.push(g.mul(drag, sign));
    })
}

/// Returns mass matrix, force, energies, height of the tip, and dissipated power `q̇·∂D/∂q̇`.
pub fn kernels() -> Result<Vec<Kernel>, String> {
    let mut whole = equations();
    let [_, rates] = whole.variables();
    let torques = gradient(&mut whole.graph, whole.dissipation, &rates);
    let power = whole.graph.dot(&torques, &rates);
    let outputs = vec![
        Output::scalar("height", "`y` of the tip", Unit::METRE, whole.tip[1]),
        Output::scalar("power", "`q̇·∂D/∂q̇`", Unit::WATT, power),
    ];
    let mut kernels = whole.kernels(Purpose::Computing)?;
    kernels.push(whole.kernel("observed", "Tip and loss.", outputs, Purpose::Computing)?);
    Ok(kernels)
}

/// `−∂E_other/∂θ3` as text.
#[cfg(test)]
pub fn torque_of_adhesion() -> String {
    use bristle_codegen::ir::{notation::Text, writer::Writer};
    let mut whole = equations();
    let output = Output::vector("torques", "", Unit::JOULE, whole.parts().other);
    let kernel = whole.kernel("adhesion", "", vec![output], Purpose::Reading);
    let kernel = kernel.expect("a torque is an energy per angle");
    Writer::new(&kernel.graph, &Text)
        .expression(kernel.outputs[0].nodes[2])
        .text
}
