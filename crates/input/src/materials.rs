//! Materials of filaments: density and Young's modulus from published sheets, which `filament.material` states by name.
//!
//! Data sheets by ISO 527 state dry material at 23 °C. Tables of brush makers state neither moisture nor temperature; they are taken for
//! dry filaments at room temperature. A filament of a brush may differ: by its grade, by how it was drawn, and by the water in it.
//! Materials without a published modulus are left out. A kpsi is 6.895 MPa.

use bristle_text::layout::wrap;
use bristle_text::number::short;

/// Paths of the settings that a material states.
pub(crate) const DENSITY: &str = "filament.density_kg_m3";
/// See [`DENSITY`].
pub(crate) const MODULUS: &str = "filament.youngs_modulus_pa";

/// A brush maker's table of densities and water uptake.
const DENSITIES: &str = "Simoni, Filaments";

/// A material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Its name in the input file.
    pub name: &'static str,
    /// Density, in kg/m³.
    pub density_kg_m3: f64,
    /// Where the density comes from.
    pub density_source: &'static str,
    /// Young's modulus, in Pa.
    pub youngs_modulus_pa: f64,
    /// Where the modulus comes from.
    pub modulus_source: &'static str,
    /// Moduli of other sheets, from the least to the largest of all, in Pa, and where the other end comes from; none if there is one sheet
    /// only.
    pub others: Option<([f64; 2], &'static str)>,
    /// What changes the modulus; empty if nothing does that a brush meets.
    pub caution: &'static str,
}

/// What is said of each material that is a polyamide with much uptake of water.
const WATER: &str = "Water uptake about halves the modulus of polyamide, and heat lowers it further.";

/// All materials that have a source, in the order in which they are listed.
pub const MATERIALS: &[Material] = &[
    Material {
        name: "PA6",
        density_kg_m3: 1130.0,
        density_source: DENSITIES,
        youngs_modulus_pa: 3.31e9,
        modulus_source: "Carolina Brush, Fiber Property Comparisons (480 kpsi)",
        others: Some(([2.76e9, 3.31e9], "Polytech Industrial, Poly-Texx PA6 (400 kpsi, ASTM D638)")),
        caution: WATER,
    },
    Material {
        name: "PA6.6",
        density_kg_m3: 1140.0,
        density_source: DENSITIES,
        youngs_modulus_pa: 3.59e9,
        modulus_source: "Carolina Brush, Fiber Property Comparisons (520 kpsi)",
        others: Some(([3.0e9, 3.59e9], "BASF, Ultramid A3K (ISO 527, dry; 1.1 GPa conditioned)")),
        caution: WATER,
    },
    Material {
        name: "PA6.12",
        density_kg_m3: 1060.0,
        density_source: DENSITIES,
        youngs_modulus_pa: 3.31e9,
        modulus_source: "Carolina Brush, Fiber Property Comparisons (480 kpsi)",
        others: None,
        caution: "It takes up less water than PA6 and PA6.6, but when wet it is softer, too; heat lowers the modulus.",
    },
    Material {
        name: "PA12",
        density_kg_m3: 1010.0,
        density_source: "CR-3D, data sheet PA 12 of 2022 (ISO 1183)",
        youngs_modulus_pa: 1.4e9,
        modulus_source: "CR-3D, data sheet PA 12 of 2022 (ISO 527)",
        others: Some(([0.9e9, 1.4e9], "Matmatch, Polyamide 12 (0.9 to 1.2 GPa)")),
        caution: "These are moulded specimens; drawn filaments are usually stiffer. Heat lowers the modulus, water little.",
    },
    Material {
        name: "PBT",
        density_kg_m3: 1310.0,
        density_source: DENSITIES,
        youngs_modulus_pa: 3.07e9,
        modulus_source: "Carolina Brush, Fiber Property Comparisons (polyester, 445 kpsi)",
        others: None,
        caution: "Heat lowers the modulus, water little.",
    },
    Material {
        name: "steel",
        density_kg_m3: 7850.0,
        density_source: "Mollificio Modenese, carbon steel wire EN 10270-1",
        youngs_modulus_pa: 206e9,
        modulus_source: "Mollificio Modenese, carbon steel wire EN 10270-1",
        others: None,
        caution: "",
    },
    Material {
        name: "stainless steel",
        density_kg_m3: 8000.0,
        density_source: "Cecchi, wire AISI 302 EN 10270-3",
        youngs_modulus_pa: 185e9,
        modulus_source: "Cecchi, wire AISI 302 EN 10270-3",
        others: Some(([180e9, 185e9], "Cecchi, wire AISI 316 EN 10270-3")),
        caution: "",
    },
    Material {
        name: "brass",
        density_kg_m3: 8440.0,
        density_source: "Wieland, M36 (CuZn36)",
        youngs_modulus_pa: 110e9,
        modulus_source: "Wieland, M36 (CuZn36)",
        others: Some(([97e9, 110e9], "E-Z LOK, free-cutting brass C36000")),
        caution: "",
    },
];

impl Material {
    /// The material of a name, however it is written: `PA6.12`, `PA 612`, `nylon 6.12` or `Stainless-Steel`.
    #[must_use]
    pub fn find(name: &str) -> Option<&'static Self> {
        let plain = |name: &str| {
            let lower: String = name.to_lowercase().chars().filter(|letter| letter.is_alphanumeric()).collect();
            ["nylon", "polyamide"].iter().fold(lower, |name, word| name.replace(word, "pa"))
        };
        MATERIALS.iter().find(|material| plain(material.name) == plain(name))
    }

    /// What it states of the setting at a path.
    #[must_use]
    pub fn value(&self, path: &str) -> Option<f64> {
        match path {
            DENSITY => Some(self.density_kg_m3),
            MODULUS => Some(self.youngs_modulus_pa),
            _ => None,
        }
    }

    /// Its values with their sources, in sentences.
    #[must_use]
    pub fn statement(&self) -> String {
        let others = self.others.map_or_else(
            || "no other sheet was found".to_owned(),
            |([least, largest], source)| {
                format!("sheets from {} to {} GPa, {source}", short(least / 1e9), short(largest / 1e9))
            },
        );
        let modulus = short(self.youngs_modulus_pa / 1e9);
        let density = short(self.density_kg_m3);
        let (of_modulus, of_density) = (self.modulus_source, self.density_source);
        format!("E = {modulus} GPa: {of_modulus}; {others}. ρ = {density} kg/m³: {of_density}. {}", self.caution)
            .trim_end()
            .to_owned()
    }
}

/// All materials with their values and sources, in lines of at most `width` columns.
#[must_use]
pub fn material_list(width: usize) -> String {
    let mut text = String::new();
    for material in MATERIALS {
        wrap(width, &mut text, &format!("  {:17}", material.name), &material.statement());
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::Document;
    use bristle::model::parameters::Parameter;
    use bristle_text::layout::WIDTH;

    #[test]
    fn materials_are_found_however_they_are_written() {
        for name in ["PA6.12", "pa612", "PA 6.12", "Nylon 6.12", "polyamide 6-12"] {
            assert_eq!(Material::find(name).map(|material| material.name), Some("PA6.12"), "{name}");
        }
        assert_eq!(Material::find("Stainless-Steel").map(|material| material.name), Some("stainless steel"));
        assert_eq!((Material::find("PA"), Material::find("")), (None, None));
        for material in MATERIALS {
            assert_eq!(Material::find(material.name), Some(material), "no two names are the same");
        }
    }

    #[test]
    fn every_number_has_a_source_and_is_usual() {
        for material in MATERIALS {
            assert!(!material.density_source.is_empty() && !material.modulus_source.is_empty(), "{}", material.name);
            for path in [DENSITY, MODULUS] {
                let usual = Parameter::find(path).and_then(|parameter| parameter.usual).expect("it has a usual range");
                let value = material.value(path).expect("a material states it");
                assert!((usual.least..=usual.largest).contains(&value), "{}: {path}", material.name);
            }
            if let Some(([least, largest], source)) = material.others {
                assert!((least..=largest).contains(&material.youngs_modulus_pa) && !source.is_empty());
            }
        }
        let list = material_list(WIDTH);
        assert!(list.lines().all(|line| line.chars().count() <= WIDTH), "{list}");
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
            (settings.filament.density_kg_m3, settings.filament.youngs_modulus_pa)
        };
        assert_eq!(filament(&file("material = \"PA6.6\"")), (1140.0, 3.59e9));
        assert_eq!(filament(&file("material = \"steel\"\nyoungs_modulus_pa = 200e9")), (7850.0, 200e9));
        assert_eq!(filament(&file("")), (1110.0, 3e9));
        let study = file("material = \"brass\"") + "[study]\n\"filament.youngs_modulus_pa\" = [90e9, 100e9]\n";
        let study = Document::parse(&study, "case.toml").and_then(|document| document.study()).expect("a study");
        let moduli = [0, 1].map(|case| study.settings(case).filament.youngs_modulus_pa);
        assert_eq!((moduli, study.settings(0).filament.density_kg_m3), ([90e9, 100e9], 8440.0));
        for (line, expected) in [
            ("material = \"stele\"", "did you mean `steel`?"),
            ("material = 3", "`filament.material` is 3"),
            ("material = \"wood\"", "must be one of \"PA6\""),
        ] {
            let text = file(line);
            let error = Document::parse(&text, "case.toml").expect_err(line).to_string();
            assert!(error.contains(expected) && error.contains("case.toml:8"), "{error}");
        }
        let option = ["filament.material=PA12".to_owned()];
        let text = file("");
        let document = Document::parse_with(&text, "case.toml", &option).expect("a document");
        assert_eq!(document.settings().expect("settings").filament.density_kg_m3, 1010.0);
        assert_eq!(document.material().map(|material| material.name), Some("PA12"));
    }
}
