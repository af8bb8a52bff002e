//! Helpers shared by the unit tests of several modules.

/// Brush and filament of an input file with a number of segments, as a literal. Tests append to it
/// with `concat!`.
macro_rules! brush {
    ($segments:literal) => {
        concat!(
            "[tool]\nbody_radius_m = 0.140\nwidth_m = 0.020\nfilament_count = 10500\nfilament_count_uncertainty = 600\n[filament]\nsegments = ",
            $segments,
            "\nlength_m = 0.040\ndiameter_m = 1.18e-3\n"
        )
    };
}

pub(crate) use brush;
