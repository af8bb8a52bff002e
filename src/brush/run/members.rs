//! Filaments that are solved together.

use super::super::arrangement::Arrangement;

/// Filaments that are solved together.
pub(super) struct SectorMembers {
    /// Numbers in the arrangement, column by column.
    pub(super) members: Vec<usize>,
    /// Rows by which filaments like these are behind them; zero for these themselves.
    pub(super) shifts: Vec<usize>,
}

impl SectorMembers {
    /// Returns the number of times that its filaments count.
    pub(super) fn weight(&self) -> usize {
        self.shifts.len()
    }
}

/// Returns the filaments that are solved together, and the place of each filament in them: the
/// number of a group, and of its filament.
pub(super) fn coupled(
    arrangement: &Arrangement,
    is_planar: bool,
    differ: bool,
) -> (Vec<SectorMembers>, Vec<[usize; 2]>) {
    let (count, rows) = (arrangement.roots.len(), arrangement.rows);
    if !is_planar {
        let all = SectorMembers {
            members: (0..count).collect(),
            shifts: vec![0],
        };
        return (vec![all], (0..count).map(|index| [0, index]).collect());
    }
    // Rows of equal filaments at equal angles are alike.
    let angle = |row: usize| arrangement.roots[row].angle;
    let mut groups: Vec<SectorMembers> = Vec::new();
    let mut numbers = Vec::new();
    for row in 0..rows {
        let is_like = |group: &SectorMembers| angle(group.members[0]) == angle(row);
        let like = if differ {
            None
        } else {
            groups.iter().position(is_like)
        };
        let number = like.unwrap_or(groups.len());
        if number == groups.len() {
            groups.push(SectorMembers {
                members: (row..count).step_by(rows).collect(),
                shifts: Vec::new(),
            });
        }
        let first = groups[number].members[0];
        groups[number].shifts.push(row - first);
        numbers.push(number);
    }
    (
        groups,
        (0..count)
            .map(|index| [numbers[index % rows], index / rows])
            .collect(),
    )
}
