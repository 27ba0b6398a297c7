//! The servos' driver against the virtual bus: the real thread, the real port, faults on demand.
//!
//! Waits are for conditions, with a watchdog; no figure depends on how busy the machine is.

use std::time::{Duration, Instant};

use locoman_robot::servo::{
    Place, SERVOS, ServoCommand, ServoDriver, ServoError, ServoSettings, ServoStates,
};
use locoman_sim::servo_bus::{ServoFault, VirtualBus, VirtualBusSetup};

/// Far longer than anything here takes.
const WATCHDOG: Duration = Duration::from_secs(20);
/// An answer may be as late as a busy machine makes it; the bus's own watchdog never trips for it.
const SLACK_MS: f64 = 50.0;

fn settings(bus: &VirtualBus) -> ServoSettings {
    ServoSettings {
        port: bus.path().to_owned(),
        rate_hz: 100.0,
        reply_slack_ms: SLACK_MS,
        watchdog_ms: 2540,
        missing_after: 4,
        ..ServoSettings::default()
    }
}

fn quick() -> VirtualBusSetup {
    VirtualBusSetup { line_time: false, ..VirtualBusSetup::default() }
}

/// The first states that are as wished.
fn wait(sut: &mut ServoDriver, what: &str, wished: impl Fn(&ServoStates) -> bool) -> ServoStates {
    let started = Instant::now();
    loop {
        let states = sut.latest();
        if wished(&states) {
            return states;
        }
        assert!(started.elapsed() < WATCHDOG, "{what}: {states:?}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn positions(states: &ServoStates) -> [f64; SERVOS] {
    states.servos.map(|servo| servo.position_rad)
}

fn near(states: &ServoStates, wished: &[f64; SERVOS]) -> bool {
    positions(states).iter().zip(wished).all(|(is, wish)| (is - wish).abs() < 0.01)
}

const RIGHT_2: Place = Place::ALL[1];
const LEFT_1: Place = Place::ALL[3];
const LEFT_2: Place = Place::ALL[4];
const LEFT_3: Place = Place::ALL[5];
const RIGHT_GRIPPER: Place = Place::ALL[6];

const READY: [f64; SERVOS] = [-2.8, -0.3, 0.2, -2.9, 0.4, -0.2, 0.5, 0.1];

#[test]
fn servos_go_where_they_are_told_whatever_turn_their_encoders_are_in() {
    for firmware in [44, 52] {
        // Zeros such that joints stand on both sides of the encoders' ends.
        let zero_counts = [2048, 10, 4090, 2048, 4000, 2000, 3, 4095];
        let bus = VirtualBus::open(&VirtualBusSetup { zero_counts, firmware, ..quick() }).unwrap();
        let mut sut = ServoDriver::start(&settings(&bus), &bus.zeros()).unwrap();
        let start = wait(&mut sut, "a sample", |states| states.counts.cycles > 2);
        assert!(near(&start, &VirtualBusSetup::default().positions_rad), "{:?}", positions(&start));
        // Nothing is taken hold of before a command.
        assert!(bus.goals().iter().all(|goal| goal.current_a == 0.0));
        sut.send(&READY.map(ServoCommand::at));
        let there = wait(&mut sut, "the goals", |states| near(states, &READY));
        assert!(
            !there.fault()
                && there.servos.iter().all(|servo| servo.voltage_v > 11.0 && servo.temperature_c == 30.0)
        );
    }
}

#[test]
fn r_safe_035_a_gripper_takes_no_more_current_than_its_limit_and_a_released_joint_takes_none() {
    let bus = VirtualBus::open(&quick()).unwrap();
    let mut sut = ServoDriver::start(&settings(&bus), &bus.zeros()).unwrap();
    let mut commands = READY.map(ServoCommand::at);
    commands[LEFT_1.index()] = ServoCommand::RELEASED;
    sut.send(&commands);
    let gripper = RIGHT_GRIPPER.index();
    wait(&mut sut, "the gripper", |states| (states.servos[gripper].position_rad - 0.5).abs() < 0.01);
    let goals = bus.goals();
    assert_eq!(goals[gripper].current_a, 0.4);
    assert_eq!(goals[0].current_a, 0.9);
    assert_eq!(goals[LEFT_1.index()].current_a, 0.0);
    // Numbers that are none are not handed over.
    let mut nonsense = commands;
    nonsense[0].position_rad = f64::NAN;
    sut.send(&nonsense);
    assert_eq!(sut.latest().counts.refused, 1);
    drop(sut);
    assert!(bus.goals().iter().all(|goal| goal.current_a == 0.0), "a driver that ends lets go");
}

#[test]
fn r_safe_030_lost_damaged_and_late_answers_are_counted_and_end_nothing() {
    let bus = VirtualBus::open(&quick()).unwrap();
    let mut sut = ServoDriver::start(&settings(&bus), &bus.zeros()).unwrap();
    sut.send(&READY.map(ServoCommand::at));
    let faults = [
        ServoFault::Mute(2),
        ServoFault::Damaged(2),
        ServoFault::Late(Duration::from_millis(3 * SLACK_MS as u64)),
    ];
    for fault in faults {
        let before = sut.latest();
        bus.inject(RIGHT_2, fault);
        let counted = wait(&mut sut, "losses", |states| states.counts.lost >= before.counts.lost + 2);
        assert!(counted.line_open);
        bus.inject(RIGHT_2, ServoFault::Late(Duration::ZERO));
        let lost = sut.latest().counts;
        wait(&mut sut, "its return", |states| {
            states.counts.cycles > lost.cycles + 10 && states.missing().next().is_none()
        });
    }
    wait(&mut sut, "the goals", |states| near(states, &READY));
}

#[test]
fn r_safe_031_a_servo_that_vanishes_is_named_the_others_go_on_and_it_is_taken_back() {
    for firmware in [44, 52] {
        let bus = VirtualBus::open(&VirtualBusSetup { firmware, ..quick() }).unwrap();
        let mut sut = ServoDriver::start(&settings(&bus), &bus.zeros()).unwrap();
        let gone = RIGHT_2;
        bus.inject(gone, ServoFault::Vanishes);
        sut.send(&READY.map(ServoCommand::at));
        let without = wait(&mut sut, "a missing servo", |states| states.missing().next().is_some());
        assert_eq!(without.missing().collect::<Vec<_>>(), [gone]);
        assert!(without.fault());
        let others = |states: &ServoStates| {
            Place::ALL
                .into_iter()
                .filter(|place| *place != gone)
                .all(|place| (states.of(place).position_rad - READY[place.index()]).abs() < 0.01)
        };
        wait(&mut sut, "the others", others);
        bus.inject(gone, ServoFault::Returns);
        let back = wait(&mut sut, "its return", |states| near(states, &READY));
        assert!(!back.fault() && back.counts.adopted >= 1);
    }
}

#[test]
fn r_safe_032_a_servo_that_overheats_is_told_and_the_others_go_on() {
    let bus = VirtualBus::open(&quick()).unwrap();
    let mut sut = ServoDriver::start(&settings(&bus), &bus.zeros()).unwrap();
    sut.send(&READY.map(ServoCommand::at));
    let hot = LEFT_3;
    bus.inject(hot, ServoFault::Overheats);
    let told = wait(&mut sut, "the error", |states| !states.of(hot).error.is_none());
    assert_eq!(told.of(hot).error.to_string(), "overheating");
    assert!(told.fault());
    wait(&mut sut, "its temperature", |states| states.hottest_c() > 70.0);
    wait(&mut sut, "the others", |states| (states.servos[0].position_rad - READY[0]).abs() < 0.01);
    // Power off and on: it is taken back by itself.
    bus.inject(hot, ServoFault::Returns);
    wait(&mut sut, "its return", |states| near(states, &READY) && !states.fault());
}

#[test]
fn r_safe_033_a_line_that_vanishes_is_opened_anew_and_all_servos_taken_back() {
    let folder = std::env::temp_dir().join(format!("locoman-servo-line-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let setup = VirtualBusSetup { link: Some(folder.join("line")), ..quick() };
    let bus = VirtualBus::open(&setup).unwrap();
    let mut sut = ServoDriver::start(&settings(&bus), &bus.zeros()).unwrap();
    sut.send(&READY.map(ServoCommand::at));
    drop(bus);
    let gone = wait(&mut sut, "a closed line", |states| !states.line_open);
    assert_eq!(gone.missing().count(), SERVOS);
    let bus = VirtualBus::open(&setup).unwrap();
    wait(&mut sut, "all servos", |states| states.missing().next().is_none() && near(states, &READY));
    drop((sut, bus));
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn r_safe_034_a_start_names_what_is_wrong_with_the_servos() {
    let start = |setup: &VirtualBusSetup, fault: Option<ServoFault>, wanted: &dyn Fn(&mut ServoSettings)| {
        let bus = VirtualBus::open(setup).unwrap();
        if let Some(fault) = fault {
            bus.inject(LEFT_2, fault);
        }
        let mut settings = settings(&bus);
        wanted(&mut settings);
        ServoDriver::start(&settings, &bus.zeros()).unwrap_err().to_string()
    };
    let missing = start(&quick(), Some(ServoFault::Vanishes), &|_| {});
    assert!(missing.contains("1 of 8 servos do not answer: left-2 (id 6)"), "{missing}");
    let hot = start(&quick(), Some(ServoFault::Overloads), &|_| {});
    assert!(hot.contains("servo 6 (left-2) reports: overload"), "{hot}");
    let mut outside = quick();
    outside.positions_rad[6] = 1.9;
    let outside = start(&outside, None, &|_| {});
    assert!(outside.contains("servo 4 (right-gripper) stands at 1.90 rad"), "{outside}");
    let old = start(&VirtualBusSetup { firmware: 44, ..quick() }, None, &|settings| {
        settings.read = locoman_robot::servo::ReadKind::Fast;
    });
    assert!(old.contains("firmware 44"), "{old}");
    let new = start(&VirtualBusSetup { new_servos: true, ..quick() }, None, &|_| {});
    assert!(new.contains("8 of 8 servos do not answer"), "{new}");
    assert!(matches!(
        ServoDriver::start(
            &ServoSettings { port: "/dev/nowhere".into(), ..ServoSettings::default() },
            &VirtualBus::open(&quick()).unwrap().zeros()
        ),
        Err(ServoError::Open { .. })
    ));
}
