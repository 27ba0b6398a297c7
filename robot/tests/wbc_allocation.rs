//! The control step takes no memory once it is running.

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
    path::Path,
};

use locoman_robot::{
    dynamics::State,
    joints::{JointVector, Leg, Side},
    model::Model,
    wbc::{
        ContactSet, Objective, PointReference, RotationReference, WbcOutput, WbcSettings, WholeBodyController,
    },
};
use nalgebra::{UnitQuaternion, Vector3};

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

/// The system's allocator, counting what each thread asks for.
struct Counting;

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        // SAFETY: the caller's promises are those of the system's allocator.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn stand() -> JointVector {
    let mut position = JointVector::zeros();
    for leg in Leg::ALL {
        position.fixed_rows_mut::<3>(leg.first_joint()).copy_from_slice(&[0.0, 0.9, -1.8]);
    }
    position
}

#[test]
fn the_control_step_allocates_nothing() {
    let model = Model::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/robot")).unwrap();
    let mut sut = WholeBodyController::new(WbcSettings::default());
    let mut state = State::at_rest(stand());
    let mut output = WbcOutput::hold(state.position);

    let mut counted = 0;
    for step in 0..2000_u32 {
        // Sways through all contact patterns, and far enough for the friction pyramid to act.
        let phase = f64::from(step) * 0.01;
        let sway = Vector3::new(phase.sin(), (0.7 * phase).cos(), (1.3 * phase).sin());
        state.position = stand() + JointVector::from_fn(|row, _| 0.05 * (phase + row as f64).sin());
        let objectives = [
            Objective::TorsoPosition(PointReference::hold(sway * 0.3)),
            Objective::TorsoOrientation(RotationReference::hold(UnitQuaternion::from_scaled_axis(
                sway * 0.2,
            ))),
            Objective::GripperPosition(Side::Right, PointReference::hold(sway)),
            Objective::GripperOrientation(Side::Right, RotationReference::hold(UnitQuaternion::identity())),
            Objective::ArmPosture(Side::Left, PointReference::hold(Vector3::zeros())),
        ];
        let contacts = match step % 3 {
            0 => ContactSet::STANCE,
            1 => ContactSet::without(Leg::FrontRight),
            _ => ContactSet::without(Leg::FrontLeft).with_share(Leg::RearLeft, 0.0),
        };

        let before = ALLOCATIONS.get();
        sut.step(&model, &state, &objectives, &contacts, &mut output);
        counted += ALLOCATIONS.get() - before;
        assert_eq!(output.status.fault, None);
    }
    assert_eq!(counted, 0);
}
