//! Ways through the modes, as stories, and all of them.

use std::collections::HashSet;

use super::*;
use crate::modes::mode::Arms;

fn calm() -> Inputs {
    Inputs {
        request: None,
        severity: Severity::None,
        tilted: false,
        control_fault: false,
        arrived: false,
        airborne: true,
        start: Start::Down,
    }
}

fn ask(sut: &mut Machine, mode: Mode) -> Option<Refusal> {
    sut.step(&Inputs { request: Some(mode), ..calm() })
}

/// Lets every motion arrive until the phase no longer changes; returns the phases on the way.
fn run(sut: &mut Machine, inputs: &Inputs) -> Vec<Phase> {
    let mut way = vec![sut.phase()];
    for _ in 0..20 {
        sut.step(&Inputs { arrived: true, ..*inputs });
        if way.last() != Some(&sut.phase()) {
            way.push(sut.phase());
        }
    }
    way
}

fn standing() -> Machine {
    let mut sut = Machine::started(Start::Standing, false);
    run(&mut sut, &calm());
    sut
}

#[test]
fn a_robot_that_lies_stays_damped_until_asked_and_one_that_stands_goes_on_standing() {
    assert_eq!(Machine::started(Start::Down, false).phase(), Phase::Damped);
    assert_eq!(Machine::started(Start::Down, true).phase(), Phase::StandUp);
    assert_eq!(Machine::started(Start::Standing, false).phase(), Phase::Recentre);
    assert_eq!(Machine::started(Start::OnThree(Side::Left), false).phase(), Phase::Stow(Side::Left));
}

#[test]
fn from_lying_to_a_gripper_and_back_every_step_is_taken() {
    let mut sut = Machine::default();
    assert_eq!(ask(&mut sut, Mode::Gripper(Side::Right)), None);
    let right = Side::Right;
    assert_eq!(
        run(&mut sut, &calm()),
        [
            Phase::StandUp,
            Phase::Recentre,
            Phase::Stance,
            Phase::ShiftTorso(Effector::Gripper(right)),
            Phase::LiftFoot(Effector::Gripper(right)),
            Phase::SingleGripper(right)
        ]
    );
    assert_eq!(sut.mode(), Mode::Gripper(right));
    ask(&mut sut, Mode::LieDown);
    assert_eq!(
        run(&mut sut, &calm()),
        [
            Phase::Stow(right),
            Phase::LowerFoot(right),
            Phase::Recentre,
            Phase::Stance,
            Phase::LieDown,
            Phase::Damped
        ]
    );
}

#[test]
fn from_foot_to_gripper_of_one_side_the_foot_stays_in_the_air() {
    let mut sut = standing();
    let side = Side::Left;
    ask(&mut sut, Mode::Foot(side));
    run(&mut sut, &calm());
    assert_eq!((sut.phase(), sut.mode()), (Phase::SingleFoot(side), Mode::Foot(side)));
    for (goal, last) in [
        (Effector::Gripper(side), Phase::SingleGripper(side)),
        (Effector::Foot(side), Phase::SingleFoot(side)),
    ] {
        ask(&mut sut, goal.mode());
        let way = run(&mut sut, &calm());
        assert_eq!(way, [Phase::Stow(side), Phase::LiftFoot(goal), last]);
        assert_eq!(sut.mode(), goal.mode());
    }
}

#[test]
fn from_one_gripper_to_the_other_goes_through_stance() {
    let mut sut = standing();
    ask(&mut sut, Mode::Gripper(Side::Right));
    run(&mut sut, &calm());
    ask(&mut sut, Mode::Gripper(Side::Left));
    let way = run(&mut sut, &calm());
    assert!(way.contains(&Phase::Stance));
    assert_eq!(sut.phase(), Phase::SingleGripper(Side::Left));
}

#[test]
fn a_changed_mind_turns_back_without_standing_on_a_foot_that_is_up() {
    let mut sut = standing();
    ask(&mut sut, Mode::Gripper(Side::Left));
    sut.step(&Inputs { arrived: true, ..calm() });
    assert_eq!(sut.phase(), Phase::LiftFoot(Effector::Gripper(Side::Left)));
    ask(&mut sut, Mode::Stance);
    assert_eq!(sut.phase(), Phase::Stow(Side::Left));
    assert_ne!(sut.mode(), sut.goal(), "not there yet");
    assert_eq!(run(&mut sut, &calm()).last(), Some(&Phase::Stance));
}

#[test]
fn r_safe_010_damping_is_immediate_from_every_phase() {
    for phase in Phase::ALL {
        let mut sut = Machine { phase, mode: Mode::Stance, goal: Mode::Stance };
        sut.step(&Inputs { severity: Severity::Damp, ..calm() });
        assert_eq!(sut, Machine::default());
    }
}

#[test]
fn r_safe_011_a_leaning_robot_refuses_to_lift_a_foot_but_may_lie_down() {
    let mut sut = standing();
    let leaning = Inputs { tilted: true, severity: Severity::Stand, ..calm() };
    let ask = |mode| Inputs { request: Some(mode), ..leaning };
    assert_eq!(sut.step(&ask(Mode::Gripper(Side::Right))), Some(Refusal::Tilted));
    assert_eq!(sut.phase(), Phase::Stance);
    assert_eq!(sut.step(&ask(Mode::LieDown)), None);
    assert_eq!(sut.phase(), Phase::LieDown);
}

#[test]
fn r_safe_012_while_stopping_nothing_else_is_accepted() {
    let mut sut = standing();
    let stopping = Inputs { severity: Severity::LieDown, ..calm() };
    let ask = Inputs { request: Some(Mode::Gripper(Side::Right)), ..stopping };
    assert_eq!(sut.step(&ask), Some(Refusal::Stopping));
    assert_eq!(run(&mut sut, &stopping).last(), Some(&Phase::Damped));
}

const MODES: [Mode; 12] = [
    Mode::Damped,
    Mode::Stance,
    Mode::LieDown,
    Mode::Foot(Side::Right),
    Mode::Foot(Side::Left),
    Mode::Gripper(Side::Right),
    Mode::Gripper(Side::Left),
    Mode::Locomotion,
    Mode::LocoManipulation(Arms::One(Side::Right)),
    Mode::LocoManipulation(Arms::One(Side::Left)),
    Mode::LocoManipulation(Arms::Both),
    Mode::Bimanual,
];

#[test]
fn sitting_up_and_coming_down_turn_round_anywhere() {
    let mut sut = standing();
    ask(&mut sut, Mode::Bimanual);
    assert_eq!(
        run(&mut sut, &calm()),
        [Phase::Gather, Phase::Kneel, Phase::SitUp, Phase::Bimanual],
        "the request itself leaves the stance"
    );
    ask(&mut sut, Mode::Stance);
    assert_eq!(sut.phase(), Phase::SitDown);
    ask(&mut sut, Mode::Bimanual);
    assert_eq!(sut.phase(), Phase::SitUp);
    ask(&mut sut, Mode::LieDown);
    let way = run(&mut sut, &calm());
    let down = [Phase::SitDown, Phase::GetUp, Phase::Recentre, Phase::Stance, Phase::LieDown, Phase::Damped];
    assert_eq!(way, down);
}

/// All states that any inputs can lead to within `depth` steps.
fn reachable(from: Machine, depth: usize) -> HashSet<Machine> {
    let modes = MODES.into_iter().map(Some).chain([None]);
    let severities = [Severity::None, Severity::Stand, Severity::LieDown, Severity::Damp];
    let starts = [Start::Down, Start::Standing, Start::OnThree(Side::Right)];
    let mut known = HashSet::from([from]);
    let mut frontier = vec![from];
    for _ in 0..depth {
        let mut next = Vec::new();
        for machine in frontier {
            for request in modes.clone() {
                for severity in severities {
                    for start in starts {
                        for bits in 0..8 {
                            let mut sut = machine;
                            sut.step(&Inputs {
                                request,
                                severity,
                                tilted: bits & 1 != 0,
                                control_fault: false,
                                arrived: bits & 2 != 0,
                                airborne: bits & 4 != 0,
                                start,
                            });
                            if known.insert(sut) {
                                next.push(sut);
                            }
                        }
                    }
                }
            }
        }
        frontier = next;
    }
    known
}

#[test]
fn every_state_that_can_be_reached_can_lie_down_and_stand_up_again() {
    let states = reachable(Machine::default(), 12);
    assert!(states.len() > 30, "{}", states.len());
    for state in states {
        let mut sut = state;
        run(&mut sut, &Inputs { severity: Severity::LieDown, ..calm() });
        assert_eq!(sut.phase(), Phase::Damped, "{state:?}");
        ask(&mut sut, Mode::Stance);
        run(&mut sut, &calm());
        assert_eq!(sut.phase(), Phase::Stance, "{state:?}");
    }
}

/// A foot is in the air, or on its way there or back.
fn lifted(phase: Phase) -> Option<Side> {
    match phase {
        Phase::LiftFoot(effector) => Some(effector.side()),
        Phase::SingleFoot(side) | Phase::SingleGripper(side) | Phase::Stow(side) | Phase::LowerFoot(side) => {
            Some(side)
        }
        _ => None,
    }
}

#[test]
fn from_every_state_every_mode_is_reached_without_a_step_from_foot_to_foot() {
    for state in reachable(Machine::default(), 12) {
        for mode in MODES {
            let mut sut = state;
            assert_eq!(ask(&mut sut, mode), None, "{state:?}");
            let way = run(&mut sut, &calm());
            assert_eq!((sut.mode(), sut.goal()), (mode, mode), "{state:?}: {way:?}");
            for step in way.windows(2) {
                let (from, to) = (lifted(step[0]), lifted(step[1]));
                assert!(from.is_none() || to.is_none() || from == to, "{state:?}: {way:?}");
                // A foot that is up comes down on its own way, and only then do others go up.
                let down = matches!(step[0], Phase::LowerFoot(_) | Phase::LiftFoot(_));
                assert!(from.is_none() || to.is_some() || down, "{state:?}: {way:?}");
                // A robot that walks stands still before anything else begins, but for its other arm's work.
                if step[0].is_walking() && step[0] != Phase::Halt && step[1] != Phase::Kneel {
                    assert_eq!(step[1], Phase::Halt, "{state:?}: {way:?}");
                }
                // The arm is folded before the foot goes down.
                if let Phase::LowerFoot(side) = step[1] {
                    assert_eq!(step[0], Phase::Stow(side));
                }
            }
        }
    }
}
