//! The mass matrix as A = LᵀL, keeping the tree's sparsity (Featherstone 2008, section 8.5).
//!
//! L has entries only between a joint and those between it and the torso, so rows of Jacobians keep theirs.

use super::hierarchy::Rows;
use crate::{
    dynamics::{DOF, MassMatrix},
    joints::JOINTS,
    model::PARENT,
};

/// Degrees of freedom of the torso: they come first.
const TORSO: usize = 6;

/// The joints between each joint and the torso, nearest first, and how many they are.
static ABOVE: [([usize; 5], usize); JOINTS] = {
    let mut above = [([0; 5], 0); JOINTS];
    let mut joint = 0;
    while joint < JOINTS {
        let mut next = PARENT[joint];
        while let Some(parent) = next {
            above[joint].0[above[joint].1] = parent;
            above[joint].1 += 1;
            next = PARENT[parent];
        }
        joint += 1;
    }
    above
};

/// L of A = LᵀL, lower triangular.
#[derive(Debug, Clone)]
pub(super) struct InertiaFactor {
    /// The torso's block: L of its rows; unused above the diagonal.
    torso: [[f64; TORSO]; TORSO],
    /// For each joint the torso's columns.
    base: [[f64; TORSO]; JOINTS],
    /// For each joint the columns of the joints in [`ABOVE`].
    chain: [[f64; 5]; JOINTS],
    /// 1 / L_ii.
    inverse: [f64; DOF],
}

impl InertiaFactor {
    pub(super) const fn new() -> Self {
        Self {
            torso: [[0.0; TORSO]; TORSO],
            base: [[0.0; TORSO]; JOINTS],
            chain: [[0.0; 5]; JOINTS],
            inverse: [0.0; DOF],
        }
    }

    /// Factors A. Gives entries that are not finite if A is not positive definite.
    pub(super) fn factor(&mut self, mass_matrix: &MassMatrix) {
        let mut diagonal = [0.0; JOINTS];
        for joint in 0..JOINTS {
            let column = TORSO + joint;
            diagonal[joint] = mass_matrix[(column, column)];
            self.base[joint] = std::array::from_fn(|axis| mass_matrix[(axis, column)]);
            for (entry, above) in self.chain[joint].iter_mut().zip(above(joint)) {
                *entry = mass_matrix[(TORSO + above, column)];
            }
        }
        self.torso = std::array::from_fn(|row| std::array::from_fn(|column| mass_matrix[(row, column)]));

        for joint in (0..JOINTS).rev() {
            let inverse = 1.0 / diagonal[joint].sqrt();
            self.inverse[TORSO + joint] = inverse;
            let base = self.base[joint].map(|entry| entry * inverse);
            let chain = self.chain[joint].map(|entry| entry * inverse);
            (self.base[joint], self.chain[joint]) = (base, chain);
            for row in 0..TORSO {
                subtract(&mut self.torso[row], base[row], &base);
            }
            for (nearest, above) in above(joint).iter().enumerate() {
                diagonal[*above] -= chain[nearest] * chain[nearest];
                subtract(&mut self.base[*above], chain[nearest], &base);
                for further in nearest + 1..ABOVE[joint].1 {
                    self.chain[*above][further - nearest - 1] -= chain[nearest] * chain[further];
                }
            }
        }
        for pivot in (0..TORSO).rev() {
            let inverse = 1.0 / self.torso[pivot][pivot].sqrt();
            self.inverse[pivot] = inverse;
            let scaled = self.torso[pivot].map(|entry| entry * inverse);
            self.torso[pivot] = scaled;
            for row in 0..pivot {
                subtract(&mut self.torso[row], scaled[row], &scaled);
            }
        }
    }

    /// J ← J L⁻¹.
    pub(super) fn weigh(&self, rows: &mut Rows) {
        for joint in (0..JOINTS).rev() {
            for row in rows.iter_mut().filter(|row| row[TORSO + joint] != 0.0) {
                let entry = row[TORSO + joint] * self.inverse[TORSO + joint];
                row[TORSO + joint] = entry;
                for (column, base) in self.base[joint].iter().enumerate() {
                    row[column] -= entry * base;
                }
                for (chain, above) in self.chain[joint].iter().zip(above(joint)) {
                    row[TORSO + above] -= entry * chain;
                }
            }
        }
        for pivot in (0..TORSO).rev() {
            for row in rows.iter_mut() {
                let entry = row[pivot] * self.inverse[pivot];
                row[pivot] = entry;
                for column in 0..pivot {
                    row[column] -= entry * self.torso[pivot][column];
                }
            }
        }
    }

    /// L⁻¹ y: q̈ from y = L q̈.
    pub(super) fn unweigh(&self, weighed: &[f64; DOF]) -> [f64; DOF] {
        let mut motion = *weighed;
        for index in 0..TORSO {
            let known: f64 = (0..index).map(|above| self.torso[index][above] * motion[above]).sum();
            motion[index] = (motion[index] - known) * self.inverse[index];
        }
        for joint in 0..JOINTS {
            let torso: f64 = self.base[joint].iter().zip(&motion).map(|(base, motion)| base * motion).sum();
            let chain: f64 = (self.chain[joint].iter().zip(above(joint)))
                .map(|(chain, above)| chain * motion[TORSO + above])
                .sum();
            let index = TORSO + joint;
            motion[index] = (motion[index] - torso - chain) * self.inverse[index];
        }
        motion
    }
}

/// The joints between a joint and the torso, nearest first.
fn above(joint: usize) -> &'static [usize] {
    let (above, count) = &ABOVE[joint];
    &above[..*count]
}

/// a -= factor b
fn subtract(a: &mut [f64; TORSO], factor: f64, b: &[f64; TORSO]) {
    for (a, b) in a.iter_mut().zip(b) {
        *a -= factor * b;
    }
}
