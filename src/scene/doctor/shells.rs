//! The pieces of one mesh. In flows a mesh, out flow how many of them are hollows, and those that lie inside of others.

use super::super::Mesh;
use super::super::containment::winding_number;
use super::super::topology::{Shell, place, shells_of};
use super::{Ailment, Examined, Finding};

/// Triangles that may be visited to find out which shell lies inside of which: about a second.
const MOST_VISITS: usize = 30_000_000;

/// Pairs of shells whose boxes may be compared.
const MOST_PAIRS: usize = 100_000_000;

/// The connected pieces of a surface.
pub struct Shells<'a> {
    mesh: &'a Mesh,
    shells: Vec<Shell>,
}

impl<'a> Shells<'a> {
    pub fn new(mesh: &'a Mesh) -> Self {
        Self { mesh, shells: shells_of(&mesh.positions, &mesh.triangles) }
    }

    pub fn count(&self) -> usize {
        self.shells.len()
    }

    /// Those of a closed surface that are turned inwards.
    pub fn cavities(&self) -> usize {
        let is_cavity = |shell: &&Shell| shell.volume < -1e-9 * shell.bounds.extent().max_element().powi(3);
        if self.mesh.faults.is_closed() { self.shells.iter().filter(is_cavity).count() } else { 0 }
    }

    /// Bodies that lie inside of others, but for those of which a triangle crosses another one: they only overlap.
    pub fn nested(&self, crossing: &[usize]) -> Examined {
        let solids = || self.shells.iter().filter(|shell| shell.volume > 0.0);
        if !self.mesh.faults.is_closed() || solids().nth(1).is_none() {
            return Examined { finding: None, is_complete: true };
        }
        let count = self.shells.len();
        if count.saturating_mul(count) > MOST_PAIRS {
            return Examined { finding: None, is_complete: false };
        }
        let crosses =
            |shell: &Shell| shell.numbers.iter().any(|number| crossing.binary_search(&(*number as usize)).is_ok());
        let positions = &self.mesh.positions;
        let mut left = MOST_VISITS;
        let mut nested = Vec::new();
        for shell in solids() {
            let point = place(positions, shell.triangles[0][0]);
            let is_around = |other: &&Shell| !std::ptr::eq(*other, shell) && shell.bounds.is_within(&other.bounds);
            let around: Vec<_> = self.shells.iter().filter(is_around).collect();
            if !around.iter().any(|other| other.volume > 0.0) || crosses(shell) {
                continue;
            }
            left = left.saturating_sub(around.iter().map(|other| other.triangles.len()).sum());
            if left == 0 {
                break;
            }
            let winding = around.iter().map(|other| winding_number(positions, &other.triangles, point)).sum::<f64>();
            nested.extend((winding > 0.75).then_some((shell.numbers[0] as usize, point)));
        }
        let finding = nested.first().map(|&(triangle, place)| Finding {
            ailment: Ailment::NestedShells,
            count: nested.len(),
            place,
            triangle: Some(triangle),
            size: None,
        });
        Examined { finding, is_complete: left > 0 }
    }
}
