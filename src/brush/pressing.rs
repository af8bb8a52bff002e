//! Presses between filaments, and their effect on groups.

use super::candidates::{Candidates, Layout};
use super::field::{Changes, Field, GroupField, Nodes, wide};
use super::presses::{Coupling, Near, Press, PressLaw, PressTangent};
use super::team;
use crate::equations::LANES;

/// Sums the couplings of all groups.
fn fill<const D: usize>(
    all: &mut [OfGroup<D>],
    tangents: &[Vec<PressTangent>],
    incoming: &[Vec<[u32; 2]>],
) {
    let groups = all.iter_mut().zip(incoming).enumerate();
    team::for_each(groups, |(group, (of_group, incoming))| {
        of_group.fill(group, tangents, incoming);
    });
}

/// A press, with both filaments: the point's first.
pub type FilamentPress = ([usize; 2], Press);

/// All presses, by the group of the point.
pub struct Pressing {
    law: PressLaw,
    presses: Vec<Vec<FilamentPress>>,
    /// Presses in the evaluation before.
    earlier: Vec<Vec<FilamentPress>>,
    tangents: Vec<Vec<PressTangent>>,
    /// Presses on each group: the group of the point, and the index there.
    incoming: Vec<Vec<[u32; 2]>>,
    couplings: Couplings,
}

/// Tangents of the forces on the segments of each group by the displacements of others.
enum Couplings {
    Planar(Vec<OfGroup<2>>),
    Spatial(Vec<OfGroup<3>>),
}

/// Couplings of one group, one for each pair of segments.
#[derive(Clone)]
struct OfGroup<const D: usize> {
    couplings: Vec<Coupling<D>>,
    /// Last coupling with forces on the segment, by node of the group; and (`before`) by coupling,
    /// the one before it on the same segment.
    last: Vec<Option<u32>>,
    before: Vec<Option<u32>>,
}

impl<const D: usize> OfGroup<D> {
    /// Creates no couplings, on a group of `nodes` nodes.
    fn new(nodes: usize) -> Self {
        Self {
            couplings: Vec::new(),
            last: vec![None; nodes],
            before: Vec::new(),
        }
    }

    /// Sums the tangents of the presses on `group`.
    fn fill(&mut self, group: usize, tangents: &[Vec<PressTangent>], incoming: &[[u32; 2]]) {
        self.couplings.clear();
        self.before.clear();
        self.last.fill(None);
        tangents[group]
            .iter()
            .for_each(|tangent| self.add(tangent, 0));
        incoming
            .iter()
            .for_each(|&[from, index]| self.add(&tangents[from as usize][index as usize], 1));
    }

    fn add(&mut self, tangent: &PressTangent, side: usize) {
        let Self {
            couplings,
            last,
            before,
        } = self;
        let segments = [tangent.segments[side], tangent.segments[1 - side]];
        let node = segments[0].within(last.len());
        let last = &mut last[node];
        let mut known = *last;
        while let Some(index) =
            known.filter(|index| couplings[*index as usize].segments != segments)
        {
            known = before[index as usize];
        }
        let index = known.unwrap_or_else(|| {
            couplings.push(Coupling::new(segments));
            before.push(last.replace(couplings.len() as u32 - 1));
            couplings.len() as u32 - 1
        });
        couplings[index as usize].add(tangent, side);
    }

    /// Adds the change of the forces by the `displacements` to `forces`.
    fn apply(&self, displacements: &Field, forces: &mut GroupField<'_>) {
        wide(
            #[inline(always)]
            || {
                self.couplings
                    .iter()
                    .for_each(|coupling| coupling.apply(displacements, forces))
            },
        );
    }
}

impl Pressing {
    /// Creates an empty list for the filaments of a layout. In the plane, nothing moves along `z`.
    pub fn new(law: PressLaw, layout: &Layout, is_planar: bool) -> Self {
        let (groups, nodes) = (layout.groups(), (layout.segments + 1) * LANES);
        let none = vec![Vec::new(); groups];
        let couplings = if is_planar {
            Couplings::Planar(vec![OfGroup::new(nodes); groups])
        } else {
            Couplings::Spatial(vec![OfGroup::new(nodes); groups])
        };
        Self {
            law,
            presses: none.clone(),
            earlier: none,
            tangents: vec![Vec::new(); groups],
            incoming: vec![Vec::new(); groups],
            couplings,
        }
    }

    /// Returns all presses.
    pub fn iter(&self) -> impl Iterator<Item = &FilamentPress> {
        self.presses.iter().flatten()
    }

    /// Returns the presses whose points are on a group.
    pub fn of_points(&self, group: usize) -> &[FilamentPress] {
        &self.presses[group]
    }

    /// Returns `true` if there are presses on a group.
    pub fn is_any(&self, group: usize) -> bool {
        !self.presses[group].is_empty() || !self.incoming[group].is_empty()
    }

    /// Forgets the presses that the next ones would follow.
    pub fn forget(&mut self) {
        self.presses.iter_mut().for_each(Vec::clear);
    }

    /// Finds the presses among the `candidates`, whose nodes are at `nodes`; with `weights` of
    /// positions and rates also their tangents.
    pub fn find(
        &mut self,
        candidates: &mut Candidates,
        nodes: &Nodes,
        layout: &Layout,
        weights: Option<[f64; 2]>,
    ) {
        let Self {
            law,
            presses,
            earlier,
            tangents,
            incoming,
            couplings,
        } = self;
        std::mem::swap(presses, earlier);
        let parts = candidates
            .by_group()
            .zip(&mut *presses)
            .zip(&*earlier)
            .zip(&mut *tangents);
        team::for_each(parts, |(((watched, presses), earlier), tangents)| {
            presses.clear();
            // Only friction follows the presses before.
            let mut earlier = earlier.iter().filter(|_| law.friction > 0.0).peekable();
            watched.for_each_near(|filaments, near| {
                let mut press = Press::new(law, near, layout.part_length(filaments[0]), nodes);
                let key = (filaments, near.key());
                while earlier
                    .next_if(|(filaments, before)| (*filaments, before.near.key()) < key)
                    .is_some()
                {}
                let before =
                    earlier.next_if(|(filaments, before)| (*filaments, before.near.key()) == key);
                before
                    .into_iter()
                    .for_each(|(_, before)| press.follow(before));
                presses.push((filaments, press));
            });
            tangents.clear();
            if let Some(weights) = weights {
                tangents.extend(presses.iter().map(|(_, press)| press.tangent(law, weights)));
            }
        });
        incoming.iter_mut().for_each(Vec::clear);
        for (own, presses) in presses.iter().enumerate() {
            for (index, (_, press)) in presses.iter().enumerate() {
                incoming[press.near.nearest.segment.group(layout.segments)]
                    .push([own as u32, index as u32]);
            }
        }
        if weights.is_some() {
            let (tangents, incoming) = (&**tangents, &**incoming);
            match couplings {
                Couplings::Planar(all) => fill(all, tangents, incoming),
                Couplings::Spatial(all) => fill(all, tangents, incoming),
            }
        }
    }

    /// Adds the forces on a group. Calls `meet` with each press on it.
    pub fn load(&self, group: usize, forces: &mut GroupField<'_>, mut meet: impl FnMut(&Near)) {
        for (_, press) in &self.presses[group] {
            press.load_point(forces);
            meet(&press.near);
        }
        for &[from, index] in &self.incoming[group] {
            let (_, press) = &self.presses[from as usize][index as usize];
            press.load_nearest(forces);
            meet(&press.near);
        }
    }

    /// Adds the tangents of the forces on a group by its own motion.
    pub fn add_changes(&self, group: usize, changes: &mut Changes) {
        match &self.couplings {
            Couplings::Planar(_) => self.add_changes_in::<2>(group, changes),
            Couplings::Spatial(_) => self.add_changes_in::<3>(group, changes),
        }
    }

    fn add_changes_in<const D: usize>(&self, group: usize, changes: &mut Changes) {
        self.tangents[group]
            .iter()
            .for_each(|tangent| tangent.add_changes::<D>(0, changes));
        for &[from, index] in &self.incoming[group] {
            self.tangents[from as usize][index as usize].add_changes::<D>(1, changes);
        }
    }

    /// Adds the change of the `forces` on a group by the `displacements` of others.
    pub fn couple(&self, group: usize, displacements: &Field, forces: &mut GroupField<'_>) {
        match &self.couplings {
            Couplings::Planar(all) => all[group].apply(displacements, forces),
            Couplings::Spatial(all) => all[group].apply(displacements, forces),
        }
    }
}
