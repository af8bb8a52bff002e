//! Where filaments press on each other, and what that does to groups of them.

use super::candidates::{Candidates, Layout};
use super::field::{Changes, Field, GroupField, Nodes};
use super::presses::{Near, Press, PressLaw, PressTangent};
use super::team;

/// A press, with both filaments: that of the point first.
pub type Pair = ([usize; 2], Press);

/// All presses, by the group of the point.
pub struct Pressing {
    law: PressLaw,
    presses: Vec<Vec<Pair>>,
    /// The same in the evaluation before.
    earlier: Vec<Vec<Pair>>,
    tangents: Vec<Vec<PressTangent>>,
    /// By group, which presses are on it: the group of the point, and the index there.
    incoming: Vec<Vec<[u32; 2]>>,
}

impl Pressing {
    /// No presses, on so many groups.
    pub fn new(law: PressLaw, groups: usize) -> Self {
        let none = vec![Vec::new(); groups];
        Self {
            law,
            presses: none.clone(),
            earlier: none,
            tangents: vec![Vec::new(); groups],
            incoming: vec![Vec::new(); groups],
        }
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = &Pair> {
        self.presses.iter().flatten()
    }

    /// Those whose points are on a group.
    pub fn of_points(&self, group: usize) -> &[Pair] {
        &self.presses[group]
    }

    /// Whether there are any on a group.
    pub fn is_any(&self, group: usize) -> bool {
        !self.presses[group].is_empty() || !self.incoming[group].is_empty()
    }

    /// Forgets what the next ones would follow.
    pub fn forget(&mut self) {
        self.presses.iter_mut().for_each(Vec::clear);
    }

    /// Finds them among the `candidates`, whose nodes are at `nodes`; with `weights` of positions and rates also how their forces change.
    pub fn find(&mut self, candidates: &mut Candidates, nodes: &Nodes, layout: &Layout, weights: Option<[f64; 2]>) {
        let Self { law, presses, earlier, tangents, incoming } = self;
        std::mem::swap(presses, earlier);
        let parts = candidates.by_group().zip(&mut *presses).zip(&*earlier).zip(tangents);
        team::for_each(parts.enumerate(), |(((watched, presses), earlier), tangents)| {
            presses.clear();
            let mut earlier = earlier.iter().peekable();
            watched.for_each_near(|filaments, near| {
                let mut press = Press::new(law, near, layout.part_length(filaments[0]), nodes);
                let key = (filaments, near.point.key());
                while earlier.next_if(|(filaments, before)| (*filaments, before.near.point.key()) < key).is_some() {}
                let before = earlier.next_if(|(filaments, before)| (*filaments, before.near.point.key()) == key);
                before.into_iter().for_each(|(_, before)| press.follow(before));
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
                incoming[press.near.nearest.segment.group(layout.segments)].push([own as u32, index as u32]);
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

    /// Adds how the forces on a group change with its own motion.
    pub fn add_changes(&self, group: usize, changes: &mut Changes) {
        self.tangents[group].iter().for_each(|tangent| tangent.add_of_point(changes));
        self.on_nearest(group).for_each(|tangent| tangent.add_of_nearest(changes));
    }

    /// Adds to the `forces` on a group how they change with the `displacements` of others.
    pub fn couple(&self, group: usize, displacements: &Field, forces: &mut GroupField<'_>) {
        self.tangents[group].iter().for_each(|tangent| tangent.couple_point(displacements, forces));
        self.on_nearest(group).for_each(|tangent| tangent.couple_nearest(displacements, forces));
    }

    /// The tangents of the presses on a group of the points of others.
    fn on_nearest(&self, group: usize) -> impl Iterator<Item = &PressTangent> {
        self.incoming[group].iter().map(|&[from, index]| &self.tangents[from as usize][index as usize])
    }
}
