//! A workpiece of your own: a filament passes over a cylinder, and the program prints metrics of
//! the contact.
//!
//! ```sh
//! cargo run --release --example workpiece
//! ```

use bristle::model::settings::Settings;
use bristle::simulation::{Pass, Sampling, Simulation};
use bristle::tool::RotaryTool;
use bristle::workpiece::{Surface, Workpiece};

/// A cylinder at rest, parallel to the axis of the tool.
#[derive(Clone, Copy, Debug)]
struct Cylinder {
    /// Its axis in the plane of rotation, in m.
    centre: [f64; 2],
    /// Its radius in m.
    radius: f64,
}

impl Workpiece for Cylinder {
    fn surface(&self, [x, y, _]: [f64; 3], _: f64) -> Surface {
        let (along, above) = (x - self.centre[0], y - self.centre[1]);
        let distance = along.hypot(above);
        let normal = [along / distance, above / distance, 0.0];
        Surface {
            turn: 1.0 / distance,
            ..Surface::flat(distance - self.radius, normal, [0.0; 3])
        }
    }

    /// Nothing depends on `z`: the filament stays in the plane of rotation.
    fn is_planar(&self) -> bool {
        true
    }
}

/// The paper's brush at 10 m/s, 1 mm deep in a cylinder of the radius `radius` (m).
fn pass(radius: f64) -> Result<Simulation, Box<dyn std::error::Error>> {
    let settings = Settings::paper(10.0, 1e-3);
    let tool = RotaryTool::of(&settings);
    let reach =
        tool.root_radius + settings.filament.length_m - settings.process.penetration_depth_m;
    let cylinder = Cylinder {
        centre: [0.0, -reach - radius],
        radius,
    };
    Ok(Pass::with(&settings, tool, cylinder)?.simulate(Sampling::default())?)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("radius  contact angle  contacts  impulse   tool force");
    for radius in [0.02, 0.1, 0.5, 1e3] {
        let metrics = pass(radius)?.metrics;
        println!(
            "{radius:6} m  {:9.4} rad  {:8}  {:.3} mN s  {:.0} N",
            metrics.contact_angle_rad,
            metrics.contact_count,
            1e3 * metrics.contact_normal_impulse_n_s,
            metrics.tool_contact_normal_force_n,
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_large_cylinder_is_a_plane() {
        let plane = bristle::simulation::simulate(&Settings::paper(10.0, 1e-3))
            .expect("the pass ends")
            .metrics;
        let cylinder = pass(1e6).expect("the pass ends").metrics;
        for (cylinder, plane) in [
            (cylinder.contact_angle_rad, plane.contact_angle_rad),
            (
                cylinder.contact_normal_impulse_n_s,
                plane.contact_normal_impulse_n_s,
            ),
            (cylinder.contact_time_ratio, plane.contact_time_ratio),
        ] {
            assert!((cylinder / plane - 1.0).abs() < 1e-4, "{cylinder} {plane}");
        }
    }

    #[test]
    fn the_arc_on_a_cylinder_is_that_of_two_circles() {
        // Law of cosines in the triangle of both axes and the tip where it touches.
        let (tips, radius) = (0.18_f64, 0.02);
        let apart = tips - 1e-3 + radius;
        let half = ((tips * tips + apart * apart - radius * radius) / (2.0 * tips * apart)).acos();
        let metrics = pass(radius).expect("the pass ends").metrics;
        assert!((metrics.contact_angle_rad - 2.0 * half).abs() < 1e-9);
    }
}
