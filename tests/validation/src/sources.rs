//! The sources of the references.

/// A source.
#[derive(Debug)]
pub struct ReferenceSource {
    /// Its name in the record.
    pub name: &'static str,
    /// The citation.
    pub citation: &'static str,
}

/// Declares the sources.
macro_rules! sources {
    ($($constant:ident = $citation:literal;)*) => {
        $(
            #[doc = $citation]
            pub const $constant: &ReferenceSource = &ReferenceSource {
                name: stringify!($constant),
                citation: $citation,
            };
        )*
    };
}

sources! {
    EXACT = "An exact property of the model, stated with the case";
    SYMMETRY = "The model has no preferred direction: the same motion in other coordinates";
    CHAIN = "The chain's error falls as n⁻² (docs/MODEL.md, \"Energies\")";
    MODEL = "The definition in docs/MODEL.md";
    BISSHOPP = "K. E. Bisshopp and D. C. Drucker, Large deflection of cantilever beams, \
        Quarterly of Applied Mathematics 3 (1945) 272–275";
    HEAVY_ELASTICA = "F. V. Rohde, Large deflections of a cantilever beam with uniformly \
        distributed load, Quarterly of Applied Mathematics 11 (1953) 337–338, for the equation; \
        the series is our own";
    TIMOSHENKO = "S. P. Timoshenko and J. M. Gere, Theory of elastic stability, 2nd edition, \
        McGraw-Hill 1961, section 2.7";
    EDGE_ELASTICA = "The elastica with a force at one point, by elliptic integrals, as stated \
        with the case (tests/validation/src/exact/held.rs)";
    PRESSED = "The force per length between filaments in docs/MODEL.md, integrated along \
        straight filaments (tests/validation/src/exact/pressed.rs)";
    HERTZ_CROSSED = "Hertz's law for crossed cylinders, as docs/MODEL.md states it for \
        filaments; K. L. Johnson, Contact mechanics, Cambridge University Press 1985, section 4.2";
    CANTILEVERS = "Bending of both beams, a³/(3 E I), and the contact in series, as stated with \
        the case";
    HEINRICH = "S. M. Heinrich, R. J. Stango and C. Y. Shia, Effect of workpart curvature on the \
        stiffness properties of circular filamentary brushes, Journal of Engineering for Industry \
        113 (1991) 276–282, for the problem; the solution is our own";
    BEAM = "The beam of Euler and Bernoulli, as in S. Timoshenko, Vibration problems in \
        engineering, 2nd edition, Van Nostrand 1937";
    NAGULESWARAN = "S. Naguleswaran, A direct solution for the transverse vibration of \
        Euler-Bernoulli wedge and cone beams, Journal of Sound and Vibration 172 (1994) 289–304";
    CURVED_BEAM = "Kirchhoff's law of bending: the moment over E I adds to the relaxed curvature";
    BERNOULLI = "D. Bernoulli, Theoremata de oscillationibus corporum filo flexili connexorum et \
        catenae verticaliter suspensae, Commentarii Academiae Scientiarum Imperialis \
        Petropolitanae 6 (1738) 108–122";
    WRIGHT = "A. D. Wright, C. E. Smith, R. W. Thresher and J. L. C. Wang, Vibration modes of \
        centrifugally stiffened beams, Journal of Applied Mechanics 49 (1982) 197–202";
    SOUTHWELL = "R. V. Southwell and B. S. Gough, On the free transverse vibrations of airscrew \
        blades, Aeronautical Research Committee, Reports and Memoranda 766 (1921)";
    WHITTAKER = "E. T. Whittaker, Analytical dynamics of particles and rigid bodies, 4th \
        edition, Cambridge 1937, article 55";
    HUNT_CROSSLEY = "K. H. Hunt and F. R. E. Crossley, Coefficient of restitution interpreted as \
        damping in vibroimpact, Journal of Applied Mechanics 42 (1975) 440–445, for the law; its \
        integral in docs/MODEL.md";
    JOHNSON = "K. L. Johnson, Contact mechanics, Cambridge University Press 1985, section 11.4";
    COULOMB = "Coulomb's law of friction";
    CVODES = "tests/data/reference_contacts_cvodes.csv, by derivations/passes.py \
        contacts_cvodes: CasADi and SUNDIALS' CVODES at 1e-11";
    CONTROL = "Errors proportional to the tolerance, the aim of a step control";
    PENALTY = "The depth F_n/k_c of a steady tip in a linear contact of stiffness k_c";
    CVODES_PASS = "derivations/trajectories/pass_casadi_cvodes.csv, by derivations/passes.py \
        trajectory";
    SCIPY_POSES = "tests/data/reference_poses.json, by derivations/passes.py poses: SciPy's \
        minima of energies that CasADi differentiates";
    MUJOCO_ROW = "tests/data/reference_row_mujoco.json, by benches/peers/trajectories.py: MuJoCo \
        4.0";
    KNOWN_ROW = "Forces of a converged planar row in docs/MODEL.md, \"Filaments that touch\"";
    CONVERGENCE = "The same row with another setting: a converged result does not depend on it";
    EXUDYN = "benches/peers/trajectories/pass_exudyn_ancf.csv, by Exudyn 1.13 as \
        benches/peers/README.md says";
    DAMPED_BEAM = "The end of a beam with damping proportional to its stiffness, as stated with \
        the case";
    PAPER = "E. Uhlmann and A. Hoyer, Modeling of contact forces for brushing tools, Ceramics \
        2021 (docs/MODEL.md)";
}
