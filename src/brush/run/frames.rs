//! Frames of the motion that a run takes.

use super::super::result::Frame;
use super::BrushRun;

/// Largest number of nodes in all frames together.
const MAX_FRAME_NODES: usize = 1_000_000;

impl BrushRun {
    /// Returns the next sample after `sample` at which a frame is taken.
    pub(super) fn next_frame(&self, sample: usize) -> Option<usize> {
        let nodes = self.arrangement.roots.len() * (self.settings.filament.segments + 1);
        let frames = self.options.frames.min(MAX_FRAME_NODES / nodes);
        let stride = self.samples.div_ceil(frames.max(1)).max(1);
        (frames > 0)
            .then(|| (sample / stride + 1) * stride)
            .filter(|next| *next <= self.samples)
    }

    pub(super) fn frame(&mut self) -> Frame {
        let roots = &self.arrangement.roots;
        let n = self.settings.filament.segments;
        let time_s = self.sample_time(self.done);
        let forces: Vec<[Vec<f64>; 2]> = self
            .sectors
            .iter_mut()
            .map(|(_, sector)| sector.forces(time_s))
            .collect();
        let force = |kind: usize| {
            self.places
                .iter()
                .map(|&[number, index]| forces[number][kind][index] as f32)
                .collect()
        };
        let placed: Vec<_> = self
            .sectors
            .iter_mut()
            .map(|(group, sector)| (group, sector.placed_at(time_s)))
            .collect();
        let nodes = |(filament, &[number, index]): (usize, &[usize; 2])| {
            let (group, bundle) = &placed[number];
            let height = roots[filament].z - roots[group.members[index]].z;
            let node = |k| {
                let [x, y, z] = bundle.node(index, k);
                self.pass
                    .pose()
                    .from_tool([x, y, z + height])
                    .map(|component| component as f32)
            };
            (0..=n).map(node).collect()
        };
        Frame {
            time_s,
            tool_angle_rad: self.pass.tool().angle(time_s),
            nodes_m: self.places.iter().enumerate().map(nodes).collect(),
            contact_normal_force_n: force(0),
            press_force_n: force(1),
        }
    }
}
