//! Bristle's symbolic engine: from the energies of a filament to Rust that computes its motion.
//!
//! Data flows through four layers, each of which uses only those before it:
//!
//! 1. [`ir`]: expressions in a [`ir::graph::Graph`], whose constructors apply the rules of
//!    [`ir::simplify`], and a function over them, [`ir::kernel::Kernel`];
//! 2. [`passes`]: [`passes::specialise`] substitutes known values, [`passes::calculus`]
//!    differentiates, [`passes::normal_form`] reduces expressions, and [`passes::dimension`] checks
//!    their SI dimensions;
//! 3. [`model`]: [`model::chain`] states the energies of a segment and of a joint.
//!    [`model::lagrange`] derives the dense equations `M q̈ = f` of any number of segments from
//!    them, which people read, snapshot and compare ([`model::whole`] names the results).
//!    [`model::kernels`] derives the functions of one segment and one joint, from which the solver
//!    computes accelerations and implicit steps in O(n). [`model::lateral`] derives those of the
//!    lateral variation of a planar motion;
//! 4. [`back`]: [`back::languages`] emits either form as Rust, [`back::json`] writes and reads
//!    JSON. `bristle-equations` has other languages, text, LaTeX and Markdown.
//!
//! User-defined energies enter before Lagrange's equations. This chain of two segments also adheres
//! to the plane `y = 0`, with an energy that decays over a length `λ`:
//!
//! ```
//! use bristle_codegen::back::languages::rust::emit;
//! use bristle_codegen::back::source::Origin;
//! use bristle_codegen::ir::unit::Unit;
//! use bristle_codegen::model::chain::{Motion, RelaxedShape};
//! use bristle_codegen::model::lagrange::whole_equations_with;
//! use bristle_codegen::model::whole::Purpose;
//!
//! let whole = whole_equations_with(2, Motion::Planar, RelaxedShape::default(), |chain| {
//!     let depth = chain.constant("adhesion_energy", "E_a", Unit::JOULE);
//!     let length = chain.constant("adhesion_length", "λ", Unit::METRE);
//!     let [_, height, _] = chain.positions[2];
//!     let g = &mut chain.graph;
//!     let ratio = g.div(height, length);
//!     let exponent = g.neg(ratio);
//!     let decay = g.exp(exponent);
//!     let energy = g.mul(depth, decay);
//!     let energy = g.neg(energy);
//!     chain.other.push(energy);
//! });
//! let kernels = whole.kernels(Purpose::Computing)?;
//! let source = emit(
//!     &kernels,
//!     Origin { title: "A chain that adheres.", maker: "an example", again: "cargo test" },
//! )?;
//! assert!(source.contains("pub fn planar_force<T: Real>("));
//! assert!(source.contains("T::exp("));
//! # Ok::<(), String>(())
//! ```
//!
//! The dimensions are checked: without the division, the error says that `exp` is defined for
//! numbers only. `codegen/examples/own_energy/` is a program that integrates such a chain.
//!
//! Three tools complete them: [`fingerprint`] hashes texts and sources, [`text`] makes text of
//! files fit for a message, and [`mod@compare`] evaluates two derivations of the same kernels.

/// Name of this engine as the maker of a derivation.
pub const MAKER: &str = concat!(
    "bristle-codegen ",
    env!("CARGO_PKG_VERSION"),
    " from the energies in codegen/src/model/chain.rs"
);

pub mod back;
pub mod compare;
pub mod fingerprint;
pub mod ir;
pub mod model;
pub mod passes;
pub mod text;
