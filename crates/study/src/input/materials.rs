//! Materials of filaments: density and Young's modulus from published sheets, which
//! `filament.material` states by name.
//!
//! Data sheets by ISO 527 state dry material at 23 °C. Tables of brush makers state neither
//! moisture nor temperature; they are taken for dry filaments at room temperature. A filament of a
//! brush may differ: by its grade, by how it was drawn, and by the water in it. Materials without a
//! published modulus are left out, except filaments with abrasive grains, which are computed from
//! their parts. A kpsi is 6.895 MPa.

use crate::text::columns;
use crate::text::layout::{aligned, left, wrap};
use crate::text::number::{short, significant};
use bristle::model::settings::ContactSettings;

use crate::input::mixture::{ALUMINIUM_OXIDE, Grain, Mixture, SILICON_CARBIDE};

/// Paths of the settings that a material states.
pub(crate) const DENSITY: &str = "filament.density_kg_m3";
/// See [`DENSITY`].
pub(crate) const MODULUS: &str = "filament.youngs_modulus_pa";

/// A brush maker's table of densities and water uptake.
const DENSITIES: &str = "Simoni, Filaments";

/// Young's modulus in Pa from which on a filament is a metal wire. Polymers have up to 10 GPa.
pub(crate) const WIRE_MODULUS_PA: f64 = 50e9;

/// Path of the contact stiffness.
pub(crate) const CONTACT_STIFFNESS: &str = "contact.stiffness_n_m";

/// Returns the contact stiffness in N/m of a file that states none: that of the paper. Metal wires
/// would penetrate too deep with it, and have one that grows with `E d`.
pub(crate) fn default_contact_stiffness(youngs_modulus_pa: f64, diameter_m: f64) -> f64 {
    if youngs_modulus_pa < WIRE_MODULUS_PA {
        return ContactSettings::default().stiffness_n_m;
    }
    ContactSettings::stiffness_of(youngs_modulus_pa, diameter_m)
}

/// A material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Name in the input file.
    pub name: &'static str,
    /// Density, in kg/m³.
    pub density_kg_m3: f64,
    /// Source of the density.
    pub density_source: &'static str,
    /// Young's modulus, in Pa.
    pub youngs_modulus_pa: f64,
    /// Source of the modulus.
    pub modulus_source: &'static str,
    /// Spread of the modulus.
    pub spread: Spread,
    /// Condition in which the modulus was measured: `"dry"` or `"wet"`.
    pub condition: &'static str,
    /// Influences that change the modulus; empty if a brush meets none.
    pub caution: &'static str,
}

/// Spread of a modulus about its value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spread {
    /// There is one sheet only.
    OneSheet,
    /// Moduli of all sheets, from the least to the largest, in Pa, and the source of the other end.
    Sheets([f64; 2], &'static str),
    /// There is no sheet: density and modulus are those of a polymer with grains.
    Mixture(Mixture),
}

/// Caution about each polyamide with much uptake of water.
const WATER: &str =
    "Water uptake about halves the modulus of polyamide, and heat lowers it further.";

/// Polymer of most abrasive filaments.
const PA6_12: Material = Material {
    name: "PA6.12",
    density_kg_m3: 1060.0,
    density_source: DENSITIES,
    youngs_modulus_pa: 3.31e9,
    modulus_source: "Carolina Brush, Fiber Property Comparisons (480 kpsi)",
    spread: Spread::OneSheet,
    condition: "dry",
    caution: "It takes up less water than PA6 and PA6.6, but when wet it is softer, too; heat lowers the modulus.",
};

/// Returns PA6.12 with a share of its mass in grains.
const fn abrasive(name: &'static str, grain: &Grain, mass_fraction: f64) -> Material {
    let mixture = Mixture::new(
        PA6_12.density_kg_m3,
        PA6_12.youngs_modulus_pa,
        grain,
        mass_fraction,
    );
    Material {
        name,
        density_kg_m3: mixture.density_kg_m3,
        density_source: "rule of mixtures",
        youngs_modulus_pa: mixture.youngs_modulus_pa,
        modulus_source: "Hashin and Shtrikman, J. Mech. Phys. Solids 11 (1963) 127, lower bound",
        spread: Spread::Mixture(mixture),
        condition: "dry",
        caution: PA6_12.caution,
    }
}

/// All materials, in the order in which they are listed.
pub const MATERIALS: &[Material] = &[
    Material {
        name: "PA6",
        density_kg_m3: 1130.0,
        density_source: DENSITIES,
        youngs_modulus_pa: 3.31e9,
        modulus_source: "Carolina Brush, Fiber Property Comparisons (480 kpsi)",
        spread: Spread::Sheets(
            [2.76e9, 3.31e9],
            "Polytech Industrial, Poly-Texx PA6 (400 kpsi, ASTM D638)",
        ),
        condition: "dry",
        caution: WATER,
    },
    Material {
        name: "PA6.6",
        density_kg_m3: 1140.0,
        density_source: DENSITIES,
        youngs_modulus_pa: 3.59e9,
        modulus_source: "Carolina Brush, Fiber Property Comparisons (520 kpsi)",
        spread: Spread::Sheets(
            [3.0e9, 3.59e9],
            "BASF, Ultramid A3K (ISO 527, dry; 1.1 GPa conditioned)",
        ),
        condition: "dry",
        caution: WATER,
    },
    Material {
        name: "PA6.6 wet",
        density_kg_m3: 1140.0,
        density_source: DENSITIES,
        youngs_modulus_pa: 1.5e9,
        modulus_source: "Toray, monofilaments of PA6.6, wet",
        spread: Spread::OneSheet,
        condition: "wet",
        caution: "Heat lowers the modulus further.",
    },
    PA6_12,
    Material {
        name: "PA12",
        density_kg_m3: 1010.0,
        density_source: "CR-3D, data sheet PA 12 of 2022 (ISO 1183)",
        youngs_modulus_pa: 1.4e9,
        modulus_source: "CR-3D, data sheet PA 12 of 2022 (ISO 527)",
        spread: Spread::Sheets([0.9e9, 1.4e9], "Matmatch, Polyamide 12 (0.9 to 1.2 GPa)"),
        condition: "dry",
        caution: "These are moulded specimens; drawn filaments are usually stiffer. Heat lowers the modulus, water little.",
    },
    Material {
        name: "PBT",
        density_kg_m3: 1310.0,
        density_source: DENSITIES,
        youngs_modulus_pa: 3.07e9,
        modulus_source: "Carolina Brush, Fiber Property Comparisons (polyester, 445 kpsi)",
        spread: Spread::OneSheet,
        condition: "dry",
        caution: "Heat lowers the modulus, water little.",
    },
    Material {
        name: "PP",
        density_kg_m3: 890.0,
        density_source: DENSITIES,
        youngs_modulus_pa: 5.10e9,
        modulus_source: "Carolina Brush, Fiber Property Comparisons (polypropylene, 740 kpsi)",
        spread: Spread::OneSheet,
        condition: "dry",
        caution: "Heat lowers the modulus, water little.",
    },
    Material {
        name: "steel",
        density_kg_m3: 7850.0,
        density_source: "Mollificio Modenese, carbon steel wire EN 10270-1",
        youngs_modulus_pa: 206e9,
        modulus_source: "Mollificio Modenese, carbon steel wire EN 10270-1",
        spread: Spread::OneSheet,
        condition: "dry",
        caution: "",
    },
    Material {
        name: "stainless steel",
        density_kg_m3: 8000.0,
        density_source: "Cecchi, wire AISI 302 EN 10270-3",
        youngs_modulus_pa: 185e9,
        modulus_source: "Cecchi, wire AISI 302 EN 10270-3",
        spread: Spread::Sheets([180e9, 185e9], "Cecchi, wire AISI 316 EN 10270-3"),
        condition: "dry",
        caution: "",
    },
    Material {
        name: "brass",
        density_kg_m3: 8440.0,
        density_source: "Wieland, M36 (CuZn36)",
        youngs_modulus_pa: 110e9,
        modulus_source: "Wieland, M36 (CuZn36)",
        spread: Spread::Sheets([97e9, 110e9], "E-Z LOK, free-cutting brass C36000"),
        condition: "dry",
        caution: "",
    },
    abrasive("PA6.12 + 20 % SiC", &SILICON_CARBIDE, 0.2),
    abrasive("PA6.12 + 30 % SiC", &SILICON_CARBIDE, 0.3),
    abrasive("PA6.12 + 40 % SiC", &SILICON_CARBIDE, 0.4),
    abrasive("PA6.12 + 20 % Al2O3", &ALUMINIUM_OXIDE, 0.2),
    abrasive("PA6.12 + 30 % Al2O3", &ALUMINIUM_OXIDE, 0.3),
    abrasive("PA6.12 + 40 % Al2O3", &ALUMINIUM_OXIDE, 0.4),
];

impl Material {
    /// Finds the material of a name, however it is written: `PA6.12`, `PA 612`, `nylon 6.12` or
    /// `Stainless-Steel`.
    #[must_use]
    pub fn find(name: &str) -> Option<&'static Self> {
        let plain = |name: &str| {
            let lower: String = name
                .to_lowercase()
                .chars()
                .filter(|letter| letter.is_alphanumeric())
                .collect();
            let words = [
                ("nylon", "pa"),
                ("polyamide", "pa"),
                ("polypropylene", "pp"),
                ("with", ""),
            ];
            words
                .iter()
                .fold(lower, |name, (word, instead)| name.replace(word, instead))
        };
        MATERIALS
            .iter()
            .find(|material| plain(material.name) == plain(name))
    }

    /// Returns the material's value of the setting at a path.
    #[must_use]
    pub fn value(&self, path: &str) -> Option<f64> {
        match path {
            DENSITY => Some(self.density_kg_m3),
            MODULUS => Some(self.youngs_modulus_pa),
            _ => None,
        }
    }

    /// Describes the origin of the values.
    #[must_use]
    pub fn provenance(&self) -> &'static str {
        match self.spread {
            _ if self.condition == "wet" => "as published for wet material",
            Spread::OneSheet | Spread::Sheets(..) => "as published for dry material",
            Spread::Mixture(_) => "computed from those of its parts when dry",
        }
    }

    /// Returns the values with their sources in sentences, with words on the `spread` of the
    /// modulus.
    fn statement(&self, spread: &str) -> String {
        let modulus = short(self.youngs_modulus_pa / 1e9);
        let density = short(self.density_kg_m3);
        let (of_modulus, of_density) = (self.modulus_source, self.density_source);
        format!(
            "E = {modulus} GPa: {of_modulus}; {spread}. ρ = {density} kg/m³: {of_density}. {}",
            self.caution
        )
        .trim_end()
        .to_owned()
    }
}

/// Lists all materials with their values and sources, in lines of at most `width` columns.
#[must_use]
pub fn material_list(width: usize) -> String {
    let mut text = String::new();
    let heading = [
        "with grains, by mass",
        "by volume",
        "ρ in kg/m³",
        "E in GPa",
        "Reuss",
        "Voigt",
    ];
    let mut mixtures = vec![heading.map(str::to_owned).to_vec()];
    for material in MATERIALS {
        let mut tell = |spread: &str| {
            wrap(
                width,
                &mut text,
                &format!("  {:17}", material.name),
                &material.statement(spread),
            )
        };
        match material.spread {
            Spread::OneSheet => tell("no other sheet was found"),
            Spread::Sheets(moduli, source) => {
                let [least, largest] = moduli.map(|modulus| short(modulus / 1e9));
                tell(&format!("sheets from {least} to {largest} GPa, {source}"));
            }
            Spread::Mixture(Mixture {
                volume_fraction,
                bounds_pa: [reuss, voigt],
                ..
            }) => {
                let [modulus, reuss, voigt] = [material.youngs_modulus_pa, reuss, voigt]
                    .map(|modulus| significant(modulus / 1e9));
                let share = format!("{:.1} %", 100.0 * volume_fraction);
                let density = short(material.density_kg_m3);
                mixtures.push(vec![
                    material.name.to_owned(),
                    share,
                    density,
                    modulus,
                    reuss,
                    voigt,
                ]);
            }
        }
    }
    let longest = mixtures
        .iter()
        .map(|row| columns(&row[0]))
        .max()
        .unwrap_or(0);
    mixtures
        .iter_mut()
        .for_each(|row| row[0] = left(&row[0], longest));
    text.push_str(&format!("{}\n", aligned(&mixtures).join("\n")));
    let note = format!(
        "Those with grains are computed from {} and the grains: SiC has {}; Al2O3 has {}. The density is exact without pores. E is the lower \
         bound of Hashin and Shtrikman (1963), with Poisson's ratio 0.4 of the polymer. Reuss and Voigt bound any mixture: parts in series, \
         parts in parallel. Grains that have come loose stiffen less.",
        PA6_12.name, SILICON_CARBIDE.source, ALUMINIUM_OXIDE.source
    );
    wrap(width, &mut text, "  ", &note);
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::document::Document;
    use crate::text::layout::WIDTH;
    use bristle::model::parameters::Parameter;

    #[test]
    fn materials_are_found_however_they_are_written() {
        for name in ["PA6.12", "pa612", "PA 6.12", "Nylon 6.12", "polyamide 6-12"] {
            assert_eq!(
                Material::find(name).map(|material| material.name),
                Some("PA6.12"),
                "{name}"
            );
        }
        assert_eq!(
            Material::find("nylon 6.12 with 30% SiC").map(|material| material.name),
            Some("PA6.12 + 30 % SiC")
        );
        for (name, expected) in [("polypropylene", "PP"), ("nylon 6.6, wet", "PA6.6 wet")] {
            let found = Material::find(name).map(|material| material.name);
            assert_eq!(found, Some(expected));
        }
        assert_eq!(
            Material::find("Stainless-Steel").map(|material| material.name),
            Some("stainless steel")
        );
        assert_eq!((Material::find("PA"), Material::find("")), (None, None));
        for material in MATERIALS {
            assert_eq!(
                Material::find(material.name),
                Some(material),
                "no two names are the same"
            );
        }
    }

    #[test]
    fn every_number_has_a_source_and_is_usual() {
        for material in MATERIALS {
            assert!(
                !material.density_source.is_empty() && !material.modulus_source.is_empty(),
                "{}",
                material.name
            );
            for path in [DENSITY, MODULUS] {
                let usual = Parameter::find(path)
                    .and_then(|parameter| parameter.usual)
                    .expect("it has a usual range");
                let value = material.value(path).expect("a material states it");
                assert!(
                    (usual.least..=usual.largest).contains(&value),
                    "{}: {path}",
                    material.name
                );
            }
            match material.spread {
                Spread::OneSheet => {}
                Spread::Sheets([least, largest], source) => {
                    assert!(
                        (least..=largest).contains(&material.youngs_modulus_pa)
                            && !source.is_empty()
                    );
                }
                Spread::Mixture(Mixture {
                    bounds_pa: [reuss, voigt],
                    ..
                }) => {
                    assert!(
                        PA6_12.youngs_modulus_pa < reuss
                            && (reuss..voigt).contains(&material.youngs_modulus_pa)
                    );
                }
            }
        }
        let list = material_list(WIDTH);
        assert!(
            list.lines().all(|line| line.chars().count() <= WIDTH),
            "{list}"
        );
    }

    #[test]
    fn a_material_states_what_the_file_does_not() {
        let file = |lines: &str| {
            format!(
                "[tool]\nbody_radius_m = 0.14\nwidth_m = 0.02\nfilament_count = 1000\n[filament]\nlength_m = 0.04\n\
                 diameter_m = 1e-3\n{lines}\n[process]\nbrushing_velocity_m_s = 10\npenetration_depth_m = 1e-3\n"
            )
        };
        let filament = |text: &str| {
            let document = Document::parse(text, "case.toml").expect("a document");
            let settings = document.settings().expect("settings");
            (
                settings.filament.density_kg_m3,
                settings.filament.youngs_modulus_pa,
            )
        };
        assert_eq!(filament(&file("material = \"PA6.6\"")), (1140.0, 3.59e9));
        assert_eq!(filament(&file("material = \"PA6.6 wet\"")), (1140.0, 1.5e9));
        assert_eq!(filament(&file("material = \"PP\"")), (890.0, 5.1e9));
        assert_eq!(
            filament(&file("material = \"steel\"\nyoungs_modulus_pa = 200e9")),
            (7850.0, 200e9)
        );
        assert_eq!(filament(&file("")), (1110.0, 3e9));
        let study = file("material = \"brass\"")
            + "[study]\n\"filament.youngs_modulus_pa\" = [90e9, 100e9]\n";
        let study = Document::parse(&study, "case.toml")
            .and_then(|document| document.study())
            .expect("a study");
        let moduli = [0, 1].map(|case| study.settings(case).filament.youngs_modulus_pa);
        assert_eq!(
            (moduli, study.settings(0).filament.density_kg_m3),
            ([90e9, 100e9], 8440.0)
        );
        for (line, expected) in [
            ("material = \"stele\"", "did you mean `steel`?"),
            ("material = 3", "`filament.material` is 3"),
            ("material = \"wood\"", "must be one of \"PA6\""),
        ] {
            let text = file(line);
            let error = Document::parse(&text, "case.toml")
                .expect_err(line)
                .to_string();
            assert!(
                error.contains(expected) && error.contains("case.toml:8"),
                "{error}"
            );
        }
        let option = ["filament.material=PA12".to_owned()];
        let text = file("");
        let document = Document::parse_with(&text, "case.toml", &option).expect("a document");
        assert_eq!(
            document
                .settings()
                .expect("settings")
                .filament
                .density_kg_m3,
            1010.0
        );
        assert_eq!(
            document.material().map(|material| material.name),
            Some("PA12")
        );
    }
}
