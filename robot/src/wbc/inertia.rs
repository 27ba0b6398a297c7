//! The mass matrix as A = LᵀL, keeping the tree's sparsity (Featherstone 2008, section 8.5).
//!
//! L has entries only between a joint and those between it and the torso, so rows of Jacobians keep theirs.

use crate::{
    dynamics::{DOF, MassMatrix},
    model::PARENT,
};

/// The degree of freedom before each: the torso's six in a row, then the joints' tree.
const BEFORE: [Option<usize>; DOF] = {
    let mut before = [None; DOF];
    let mut index = 1;
    while index < DOF {
        before[index] = if index < 6 {
            Some(index - 1)
        } else {
            match PARENT[index - 6] {
                Some(parent) => Some(6 + parent),
                None => Some(5),
            }
        };
        index += 1;
    }
    before
};

/// L of A = LᵀL, lower triangular.
#[derive(Debug, Clone)]
pub(super) struct InertiaFactor {
    lower: [[f64; DOF]; DOF],
}

impl InertiaFactor {
    pub(super) const fn new() -> Self {
        Self { lower: [[0.0; DOF]; DOF] }
    }

    /// Factors A. Gives entries that are not finite if A is not positive definite.
    pub(super) fn factor(&mut self, mass_matrix: &MassMatrix) {
        for row in 0..DOF {
            for column in 0..=row {
                self.lower[row][column] = mass_matrix[(row, column)];
            }
        }
        for pivot in (0..DOF).rev() {
            let root = self.lower[pivot][pivot].sqrt();
            self.lower[pivot][pivot] = root;
            for column in ancestors(pivot) {
                self.lower[pivot][column] /= root;
            }
            for row in ancestors(pivot) {
                let factor = self.lower[pivot][row];
                self.lower[row][row] -= factor * factor;
                for column in ancestors(row) {
                    self.lower[row][column] -= factor * self.lower[pivot][column];
                }
            }
        }
    }

    /// row ← row L⁻¹: a row of J becomes one of J L⁻¹.
    pub(super) fn weigh(&self, row: &mut [f64; DOF]) {
        for pivot in (0..DOF).rev() {
            if row[pivot] == 0.0 {
                continue;
            }
            row[pivot] /= self.lower[pivot][pivot];
            for column in ancestors(pivot) {
                row[column] -= row[pivot] * self.lower[pivot][column];
            }
        }
    }

    /// L⁻¹ y: q̈ from y = L q̈.
    pub(super) fn unweigh(&self, weighed: &[f64; DOF]) -> [f64; DOF] {
        let mut motion = *weighed;
        for index in 0..DOF {
            for above in ancestors(index) {
                motion[index] -= self.lower[index][above] * motion[above];
            }
            motion[index] /= self.lower[index][index];
        }
        motion
    }
}

/// Those between a degree of freedom and the root, nearest first.
fn ancestors(index: usize) -> impl Iterator<Item = usize> {
    std::iter::successors(BEFORE[index], |above| BEFORE[*above])
}
