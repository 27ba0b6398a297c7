//! What a person does with `locoman-robot servo`, against the virtual bus: he is told clearly, asked before anything is
//! written or moves, and kept from what is dangerous.

use std::f64::consts::PI;

use locoman_robot::joints::Side;
use locoman_robot::modes::PoseSettings;
use locoman_robot::servo::cli::{Going, Person, find_zeros, go, scan, set_up};
use locoman_robot::servo::{Bus, Part, Place, SERVOS, SerialLine, ServoSettings};
use locoman_sim::servo_bus::{JointMotion, ServoFault, VirtualBus, VirtualBusSetup};

const RIGHT_1: Place = Place::ALL[0];
const LEFT_2: Place = Place::ALL[4];

/// Does what he is asked by a function of the words, agrees or not, and remembers what he was told.
struct Scripted<F> {
    acts: F,
    agrees: bool,
    told: Vec<String>,
}

impl<F: FnMut(&str)> Scripted<F> {
    fn new(agrees: bool, acts: F) -> Self {
        Self { acts, agrees, told: Vec::new() }
    }

    fn text(&self) -> String {
        self.told.join("\n")
    }
}

impl<F: FnMut(&str)> Person for Scripted<F> {
    fn tell(&mut self, text: &str) {
        self.told.push(text.to_owned());
    }

    fn agrees(&mut self, question: &str) -> bool {
        self.told.push(question.to_owned());
        self.agrees
    }

    fn has_done(&mut self, what: &str) -> bool {
        (self.acts)(what);
        true
    }
}

fn open(virtual_bus: &VirtualBus) -> anyhow::Result<(Bus<SerialLine>, ServoSettings)> {
    let settings = ServoSettings {
        port: virtual_bus.path().to_owned(),
        reply_slack_ms: 50.0,
        watchdog_ms: 2540,
        ..ServoSettings::default()
    };
    let line = SerialLine::open(&settings.port, settings.baud)?;
    Ok((Bus::new(line, settings.baud, settings.reply_slack()), settings))
}

fn quick() -> VirtualBusSetup {
    VirtualBusSetup { line_time: false, ..VirtualBusSetup::default() }
}

#[test]
fn a_scan_tells_who_is_ready_who_is_missing_and_what_a_cycle_takes() {
    let virtual_bus = VirtualBus::open(&quick()).unwrap();
    virtual_bus.inject(LEFT_2, ServoFault::Vanishes);
    virtual_bus.inject(RIGHT_1, ServoFault::Overloads);
    let (mut bus, settings) = open(&virtual_bus).unwrap();
    let mut person = Scripted::new(false, |_| {});
    scan(&mut bus, &settings, virtual_bus.path(), &mut person).unwrap();
    let text = person.text();
    assert_eq!(text.matches("ready").count(), 6, "{text}");
    assert!(text.contains("overload"), "{text}");
    assert!(text.contains("missing or not set up: left-2 (id 6)"), "{text}");
    assert!(text.contains("takes 2.44 ms of the line at 1000000 baud, 1.96 ms with the fast read"), "{text}");
}

/// One new servo on the line.
fn new_servo(place: Place) -> anyhow::Result<VirtualBus> {
    let virtual_bus = VirtualBus::open(&VirtualBusSetup { new_servos: true, ..quick() })?;
    for other in Place::ALL.into_iter().filter(|other| *other != place) {
        virtual_bus.inject(other, ServoFault::Vanishes);
    }
    Ok(virtual_bus)
}

#[test]
fn without_a_yes_nothing_is_written_into_a_servo() {
    let virtual_bus = new_servo(LEFT_2).unwrap();
    let (mut bus, settings) = open(&virtual_bus).unwrap();
    let mut person = Scripted::new(false, |_| {});
    let error = set_up(&mut bus, LEFT_2, &settings, &mut person).unwrap_err().to_string();
    assert!(error.contains("nothing was written for left-2"), "{error}");
    assert!(person.text().contains("servo 1 at 57600 baud gets id 6, 1000000 baud"), "{}", person.text());
    bus.set_baud(57_600).unwrap();
    assert_eq!(bus.ping(1).unwrap().id, 1);
}

#[test]
fn a_new_servo_gets_id_speed_and_settings_after_a_yes() {
    let virtual_bus = new_servo(LEFT_2).unwrap();
    let (mut bus, settings) = open(&virtual_bus).unwrap();
    let mut person = Scripted::new(true, |_| {});
    set_up(&mut bus, LEFT_2, &settings, &mut person).unwrap();
    assert!(person.text().contains("operating mode: 3 becomes 5"), "{}", person.text());
    assert_eq!(bus.baud(), settings.baud);
    assert_eq!(bus.ping(6).unwrap().model, 1220);
}

#[test]
fn two_servos_at_once_are_not_set_up() {
    let virtual_bus = VirtualBus::open(&quick()).unwrap();
    let (mut bus, settings) = open(&virtual_bus).unwrap();
    let mut person = Scripted::new(true, |_| {});
    let error = set_up(&mut bus, LEFT_2, &settings, &mut person).unwrap_err().to_string();
    assert!(error.contains("8 servos answer (id 1 at 1000000 baud, id 2 at"), "{error}");
    assert!(error.contains("connect the servo of left-2 alone"), "{error}");
}

/// Where the folded arms and closed jaws are, rad, in the order of places.
fn folded() -> [f64; SERVOS] {
    Place::ALL.map(|place| match (place.part, place.side) {
        (Part::Gripper, _) => 0.02,
        (Part::Joint(0), _) => -PI,
        (Part::Joint(1), Side::Right) => -0.05,
        (Part::Joint(1), Side::Left) => 0.05,
        (Part::Joint(_), _) => 0.0,
    })
}

#[test]
fn directions_and_zeros_are_found_by_hand_whatever_the_settings_believe() {
    // An assembly with its own counts, and one servo the other way round than the settings say.
    let mut assembled = ServoSettings::default();
    assembled.right.sign[1] = -1;
    let zero_counts = [17, 4000, 2048, 3000, 1, 4095, 100, 2000];
    let setup = VirtualBusSetup { settings: assembled, zero_counts, ..quick() };
    let virtual_bus = VirtualBus::open(&setup).unwrap();
    let (mut bus, settings) = open(&virtual_bus).unwrap();
    let mut positions = folded();
    let stand = |positions: &[f64; SERVOS]| {
        virtual_bus
            .feed(&positions.map(|position_rad| JointMotion { position_rad, ..JointMotion::default() }));
    };
    stand(&positions);
    let mut person = Scripted::new(true, |what| {
        if let Some(place) = Place::ALL.into_iter().find(|place| what.starts_with(&place.to_string())) {
            positions[place.index()] += 0.4;
            stand(&positions);
        }
    });
    let zeros = find_zeros(&mut bus, &settings, &PoseSettings::default(), &mut person).unwrap().unwrap();
    assert!(
        person.text().contains("right-2 turns the other way than servos.toml has it"),
        "{}",
        person.text()
    );
    for place in Place::ALL {
        let (found, true_zero) = (zeros.of(place), virtual_bus.zeros().of(place));
        assert_eq!(found.sign, true_zero.sign, "{place}");
        // An angle is known to a count.
        let off = (found.count - true_zero.count + 2048).rem_euclid(4096) - 2048;
        assert!(off.abs() <= 1, "{place}: {} in place of {}", found.count, true_zero.count);
    }
}

#[test]
fn a_joint_is_moved_after_a_yes_and_let_go_and_one_that_is_blocked_is_told() {
    let virtual_bus = VirtualBus::open(&quick()).unwrap();
    let (mut bus, settings) = open(&virtual_bus).unwrap();
    let zeros = virtual_bus.zeros();
    let going = Going { place: RIGHT_1, angle_rad: -2.9, speed_rad_s: 1.0 };
    let mut refusing = Scripted::new(false, |_| {});
    assert!(go(&mut bus, &going, &settings, &zeros, &mut refusing).is_err());
    assert!((virtual_bus.motions()[0].position_rad + PI).abs() < 0.01, "without a yes nothing moves");

    let mut agreeing = Scripted::new(true, |_| {});
    go(&mut bus, &going, &settings, &zeros, &mut agreeing).unwrap();
    assert!((virtual_bus.motions()[0].position_rad + 2.9).abs() < 0.06);
    assert_eq!(virtual_bus.goals()[0].current_a, 0.0, "it is let go at the end");

    let outside = Going { angle_rad: 2.5, ..going };
    let error = go(&mut bus, &outside, &settings, &zeros, &mut agreeing).unwrap_err().to_string();
    assert!(error.contains("right-1 reaches from -3.19 to 1.74 rad, 2.5 is outside"), "{error}");

    // Fed, it stands still whatever its goal: something is in its way.
    virtual_bus.feed(&virtual_bus.motions());
    let further = Going { angle_rad: -2.0, ..going };
    let error = go(&mut bus, &further, &settings, &zeros, &mut agreeing).unwrap_err().to_string();
    assert!(error.contains("does not follow"), "{error}");
    assert_eq!(virtual_bus.goals()[0].current_a, 0.0);

    virtual_bus.inject(RIGHT_1, ServoFault::Overheats);
    let error = go(&mut bus, &going, &settings, &zeros, &mut agreeing).unwrap_err().to_string();
    assert!(error.contains("let it cool"), "{error}");
}
