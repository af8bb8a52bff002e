//! The brushes that the page compares, and their simulation.

use std::collections::BTreeMap;
use std::error::Error;
use std::f64::consts::TAU;
use std::sync::Mutex;

use bristle::brush::{BrushError, BrushResult, BrushRun, RunOptions};
use bristle::model::settings::{BrushSettings, Hold, Settings, Turns, UncertaintySettings};

/// Brushing velocities of the table of forces in m/s.
pub const VELOCITIES: [u32; 4] = [2, 10, 20, 30];
/// Penetration depths of the table of forces in µm.
pub const DEPTHS: [u32; 4] = [500, 1000, 2000, 3000];
/// Number of segments of a filament, and that with which it is checked how much it matters.
const SEGMENTS: [usize; 2] = [12, 25];
/// Filaments of the brush, its rows, and the filaments around in each.
const FILAMENTS: f64 = 10_500.0;
const ROWS: usize = 15;
const AROUND: f64 = FILAMENTS / ROWS as f64;
/// Rows of a brush in space, which repeat along the axis.
const SPATIAL_ROWS: usize = 4;
/// Tilt of a filament alone in rad.
pub const TILT: f64 = 1e-3;
/// Standard deviations of the tilts of brushes in space, in mrad: that of most of them, and those
/// that are compared.
pub const USUAL_TILT: u32 = 1;
pub const TILTS: [u32; 4] = [USUAL_TILT, 5, 10, 20];
/// Filaments around in rows of whole brushes with fewer filaments, whose pitch is as equal both
/// ways as it can be.
pub const SPARSE: [u32; 5] = [639, 479, 383, 319, 240];
/// Coefficient of friction, where there is friction.
const FRICTION: f64 = 0.3;
/// Number of turns, where there are several.
const TURNS: usize = 3;
/// Columns of a brush that takes several turns, and of filaments that differ.
const MANY_COLUMNS: usize = 160;
/// Filaments around that are too far apart to touch each other, and how many of them are simulated.
const APART: (f64, usize) = (70.0, 60);
/// Frames of a brush whose filaments are followed on their way.
const FRAMES: usize = 400;

/// Brushing velocity in m/s, and penetration depth in µm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct OperatingPoint {
    pub velocity: u32,
    pub depth: u32,
}

/// The places at these depths in µm, velocity by velocity.
pub fn places<const N: usize>(depths: [u32; N]) -> impl Iterator<Item = OperatingPoint> {
    VELOCITIES
        .into_iter()
        .flat_map(move |velocity| depths.map(|depth| at(velocity, depth)))
}

/// A place, in m/s and µm.
pub const fn at(velocity: u32, depth: u32) -> OperatingPoint {
    OperatingPoint { velocity, depth }
}

impl OperatingPoint {
    /// Velocity in m/s.
    pub fn velocity(self) -> f64 {
        f64::from(self.velocity)
    }

    /// Depth in mm.
    pub fn depth_mm(self) -> f64 {
        1e-3 * f64::from(self.depth)
    }

    /// The paper's brush as a planar row.
    pub fn settings(self) -> Settings {
        let mut settings = Settings::paper(self.velocity(), 1e-6 * f64::from(self.depth));
        settings.filament.segments = SEGMENTS[0];
        settings.tool.filament_count = AROUND;
        settings
    }

    /// Force of the whole tool in N whose filaments have a mean impulse (N s).
    pub fn tool_force(self, impulse: f64) -> f64 {
        impulse * FILAMENTS * self.settings().angular_velocity_rad_s() / TAU
    }
}

/// What differs from filament to filament.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Scatter {
    Nothing,
    Length,
    Diameter,
    Waviness,
}

impl Scatter {
    /// All kinds.
    pub const ALL: [Self; 4] = [Self::Nothing, Self::Length, Self::Diameter, Self::Waviness];

    /// As an entry of a table.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nothing => "nothing",
            Self::Length => "length, by 0.2 mm",
            Self::Diameter => "diameter, by 0.02 mm",
            Self::Waviness => "waves, by 0.02 mm, of any phase",
        }
    }

    fn uncertainty(self) -> UncertaintySettings {
        let none = UncertaintySettings {
            hold: Hold::Machine,
            ..UncertaintySettings::default()
        };
        match self {
            Self::Nothing => none,
            Self::Length => UncertaintySettings {
                length_std_m: 2e-4,
                ..none
            },
            Self::Diameter => UncertaintySettings {
                diameter_std_m: 2e-5,
                ..none
            },
            Self::Waviness => UncertaintySettings {
                waviness_amplitude_std_m: 2e-5,
                waviness_phase_std_rad: 1.8,
                ..none
            },
        }
    }
}

/// A brush to simulate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Case {
    /// A planar row.
    Row(OperatingPoint),
    /// A planar row of filaments with 25 segments.
    Finer(OperatingPoint),
    /// Staggered rows in space, of filaments whose clamps are tilted, with a standard deviation in
    /// mrad.
    Space { place: OperatingPoint, tilt: u32 },
    /// A planar row of so many filaments around.
    Sparse { place: OperatingPoint, around: u32 },
    /// A row with friction on the workpiece, or between filaments, or both.
    Rough {
        place: OperatingPoint,
        workpiece: bool,
        filaments: bool,
    },
    /// A row of filaments that differ, near each other or too far apart to touch.
    Differing {
        place: OperatingPoint,
        scatter: Scatter,
        apart: bool,
    },
    /// A row that takes several turns.
    Turning(OperatingPoint),
}

/// The places at which brushes in space are simulated.
pub const SPATIAL: [OperatingPoint; 4] = [at(2, 1000), at(10, 1000), at(10, 3000), at(30, 1000)];
/// The places at which tilts are compared.
pub const TILTED: [OperatingPoint; 2] = [at(10, 1000), at(30, 1000)];
/// The depths in µm at which brushes with fewer filaments are simulated.
pub const SPARSE_DEPTHS: [u32; 2] = [1000, 3000];
/// The places with friction.
pub const ROUGH: [OperatingPoint; 3] = [at(10, 1000), at(10, 3000), at(30, 1000)];
/// Where filaments differ.
pub const DIFFERING: OperatingPoint = at(10, 1000);
/// Where brushes take several turns.
pub const TURNING: [OperatingPoint; 2] = [at(20, 1000), at(30, 1000)];
/// Where filaments are followed on their way.
pub const FOLLOWED: [OperatingPoint; 3] = [at(10, 500), at(10, 3000), at(30, 1000)];
/// Where the number of segments is checked.
pub const FINER: [OperatingPoint; 2] = [at(10, 1000), at(30, 3000)];

impl Case {
    /// All cases, roughly from the longest to the shortest.
    fn all() -> Vec<Self> {
        let rough = |place| {
            [[true, false], [false, true], [true, true]].map(|[workpiece, filaments]| Self::Rough {
                place,
                workpiece,
                filaments,
            })
        };
        let differing = |scatter| {
            [false, true].map(|apart| Self::Differing {
                place: DIFFERING,
                scatter,
                apart,
            })
        };
        let mut cases: Vec<Self> = TURNING.map(Self::Turning).into();
        let tilts = SPATIAL.into_iter().flat_map(|place| {
            let tilts = if TILTED.contains(&place) {
                &TILTS[..]
            } else {
                &[USUAL_TILT]
            };
            tilts.iter().map(move |&tilt| Self::Space { place, tilt })
        });
        cases.extend(tilts);
        let sparse =
            |around| places(SPARSE_DEPTHS).map(move |place| Self::Sparse { place, around });
        cases.extend(SPARSE.into_iter().flat_map(sparse));
        cases.extend(Scatter::ALL.into_iter().flat_map(differing));
        cases.extend(ROUGH.into_iter().flat_map(rough));
        cases.extend(FINER.map(Self::Finer));
        cases.extend(places(DEPTHS).map(Self::Row));
        cases
    }

    /// Its settings.
    pub fn settings(self) -> Settings {
        let place = match self {
            Self::Row(place) | Self::Finer(place) | Self::Turning(place) => place,
            Self::Rough { place, .. } | Self::Differing { place, .. } => place,
            Self::Space { place, .. } | Self::Sparse { place, .. } => place,
        };
        let mut settings = place.settings();
        let mut brush = BrushSettings {
            rows: Some(1),
            ..BrushSettings::default()
        };
        match self {
            Self::Row(_) => {}
            Self::Finer(_) => settings.filament.segments = SEGMENTS[1],
            Self::Sparse { around, .. } => settings.tool.filament_count = f64::from(around),
            Self::Space { tilt, .. } => {
                settings.tool.filament_count = AROUND * SPATIAL_ROWS as f64;
                settings.tool.width_m *= SPATIAL_ROWS as f64 / ROWS as f64;
                let rows = Some(SPATIAL_ROWS);
                brush = BrushSettings {
                    rows,
                    lateral_tilt_std_rad: 1e-3 * f64::from(tilt),
                    ..brush
                };
            }
            Self::Rough {
                workpiece,
                filaments,
                ..
            } => {
                settings.contact.friction_coefficient = if workpiece { FRICTION } else { 0.0 };
                brush.friction_coefficient = if filaments { FRICTION } else { 0.0 };
            }
            Self::Differing { scatter, apart, .. } => {
                settings.uncertainty = scatter.uncertainty();
                brush.columns = Some(MANY_COLUMNS);
                if apart {
                    let (around, columns) = APART;
                    settings.tool.filament_count = around;
                    brush = BrushSettings {
                        columns: Some(columns),
                        steady: false,
                        ..brush
                    };
                }
            }
            Self::Turning(_) => {
                settings.process.turns = Some(Turns::Count(TURNS));
                // Turns differ by some per cent along any stretch: `numbers::in_the_middle` takes
                // the mean.
                brush = BrushSettings {
                    columns: Some(MANY_COLUMNS),
                    steady: false,
                    ..brush
                };
            }
        }
        settings.brush = Some(brush);
        settings
    }

    fn frames(self) -> usize {
        let is_followed = matches!(self, Self::Row(place) if FOLLOWED.contains(&place));
        if is_followed
            || matches!(
                self,
                Self::Space {
                    tilt: USUAL_TILT,
                    ..
                }
            )
        {
            FRAMES
        } else {
            0
        }
    }

    fn simulate(self) -> Result<BrushResult, BrushError> {
        let mut settings = self.settings();
        let options = RunOptions {
            frames: self.frames(),
            ..RunOptions::default()
        };
        let mut run = BrushRun::new(&settings, options)?;
        if let (Self::Row(_), Some(brush)) = (self, &mut settings.brush) {
            // Columns that are stated are followed to the end of their contact: a table has the
            // last ones, too.
            brush.columns = Some(run.columns());
            run = BrushRun::new(&settings, options)?;
        }
        while run.advance()? {}
        run.finish()
    }
}

/// The results of all cases.
pub struct Results(BTreeMap<Case, BrushResult>);

impl Results {
    /// Simulates all cases on so many threads, one case on each at a time.
    ///
    /// # Errors
    /// If a case cannot be simulated.
    pub fn simulate(threads: usize) -> Result<Self, Box<dyn Error>> {
        let cases = Case::all();
        let waiting = Mutex::new(cases.iter());
        let work = || -> Result<Vec<(Case, BrushResult)>, String> {
            let next = || {
                waiting
                    .lock()
                    .expect("no thread panics while it takes a case")
                    .next()
            };
            let simulate = |case: &Case| {
                let result = case
                    .simulate()
                    .map_err(|error| format!("{case:?}: {error}"))?;
                eprintln!("{case:?}");
                Ok((*case, result))
            };
            std::iter::from_fn(next).map(simulate).collect()
        };
        let results: Result<Vec<_>, String> = std::thread::scope(|scope| {
            let threads: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
            threads
                .into_iter()
                .map(|thread| thread.join().expect("a simulation does not panic"))
                .collect()
        });
        Ok(Self(results?.into_iter().flatten().collect()))
    }

    /// That of a case.
    pub fn of(&self, case: Case) -> &BrushResult {
        &self.0[&case]
    }

    /// That of a brush in space with the usual tilts.
    pub fn space(&self, place: OperatingPoint) -> &BrushResult {
        self.of(Case::Space {
            place,
            tilt: USUAL_TILT,
        })
    }

    /// That of a planar row.
    pub fn row(&self, velocity: u32, depth: u32) -> &BrushResult {
        self.of(Case::Row(at(velocity, depth)))
    }
}
