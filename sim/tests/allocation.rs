//! The control step allocates nothing, in any phase.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a panic in a test is the report")]

#[path = "../../tests/shared/counting_allocator.rs"]
mod counting_allocator;
mod session;

use counting_allocator::counted;
use locoman_robot::{
    control::Inputs,
    joints::Side,
    locomotion::Velocity,
    modes::{Arms, Mode, Phase},
    plant::Plant,
};
use nalgebra::{Isometry3, Vector2};
use session::Session;

/// Runs for a while with the operator as he is; returns what the control steps allocated.
fn allocations(session: &mut Session, seconds: f64) -> usize {
    let mut allocated = 0;
    for _ in 0..(seconds * 400.0) as usize {
        let sensors = session.plant.exchange(&session.command).unwrap();
        session.time_ns = sensors.time_ns;
        if let Some(operator) = &mut session.operator {
            operator.received_ns = sensors.time_ns;
            operator.sequence += 1;
        }
        let inputs = Inputs { command: session.operator, ..Inputs::default() };
        let taken;
        (session.command, taken) = counted(|| session.controller.tick(sensors.time_ns, &sensors, &inputs));
        allocated += taken;
    }
    allocated
}

#[test]
fn the_control_step_allocates_nothing_in_any_phase() {
    let mut sut = Session::new("lying", "hw", 1);
    let mut allocated = allocations(&mut sut, 7.0);
    assert_eq!(sut.snapshot().phase, Phase::Stance);
    sut.join();
    sut.operator().mode = Some(Mode::Gripper(Side::Right));
    sut.operator().mode_request = 1;
    allocated += allocations(&mut sut, 6.0);
    assert_eq!(sut.snapshot().phase, Phase::SingleGripper(Side::Right));
    sut.operator().engagement = 1;
    sut.operator().palms[0] = Some(Isometry3::translation(0.05, 0.0, 0.02));
    allocated += allocations(&mut sut, 1.0);
    sut.operator().mode = Some(Mode::LocoManipulation(Arms::Both));
    sut.operator().mode_request = 2;
    allocated += allocations(&mut sut, 12.0);
    assert_eq!(sut.snapshot().phase, Phase::WalkHolding(Arms::Both));
    sut.operator().engagement = 2;
    sut.operator().walk = Some(Velocity { linear: Vector2::new(0.3, 0.1), turn: 0.3 });
    allocated += allocations(&mut sut, 2.0);
    sut.operator().mode = Some(Mode::LieDown);
    sut.operator().mode_request = 3;
    allocated += allocations(&mut sut, 14.0);
    assert_eq!(sut.snapshot().phase, Phase::Damped);
    assert_eq!(allocated, 0);
}
