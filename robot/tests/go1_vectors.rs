//! The Go1's datagrams against vectors that are not ours.
//!
//! `golden/go1_vectors.txt`: vectors B to E are what the maker's library (3.8.0 and 3.8.6) sent on loopback, F was
//! read by it; H and I were computed from the byte tables. A line is a name, a length and the bytes in hex.

#![expect(clippy::unwrap_used, reason = "in a test a panic is the report")]

use locoman_robot::go1::{Checksum, LowCommand, LowState, MotorCommand, MotorMode, checksum, command, state};

const VECTORS: &str = include_str!("golden/go1_vectors.txt");
const LEGS: usize = 12;

fn vector(name: &str) -> Vec<u8> {
    let line = VECTORS.lines().find(|line| line.split(' ').next() == Some(name)).unwrap();
    let hex = line.split(' ').nth(2).unwrap();
    (0..hex.len()).step_by(2).map(|at| u8::from_str_radix(&hex[at..at + 2], 16).unwrap()).collect()
}

fn with_legs(motor: impl Fn(usize) -> MotorCommand) -> LowCommand {
    let mut command = LowCommand::default();
    for (index, slot) in command.motors[..LEGS].iter_mut().enumerate() {
        *slot = motor(index);
    }
    command
}

#[test]
fn commands_are_the_makers_byte_for_byte() {
    let servo = with_legs(|index| {
        let i = index as f32;
        let sign = if index % 2 == 1 { 1.0 } else { -1.0 };
        let tau_n_m = sign * 0.65 * (i + 1.0);
        MotorCommand::servo(0.1 * i - 0.5, -0.01 * i, tau_n_m, 30.0 + 0.37 * i, 1.0 + 0.13 * i)
    });
    let hold = with_legs(|index| MotorCommand::servo([0.0, 0.9, -1.8][index % 3], 0.0, 0.0, 60.0, 2.0));
    let brake = with_legs(|_| MotorCommand { mode: command::BRAKE, ..MotorCommand::IDLE });
    for (name, command) in [
        ("B_init", LowCommand::default()),
        ("C_servo12", servo),
        ("D_damping", brake),
        ("H_hold_pose", hold),
        ("I_soft_damping", LowCommand::damping(2.0)),
    ] {
        assert_eq!(command.encode(Checksum::Plain).to_vec(), vector(name), "{name}");
    }
    for (name, command) in [
        ("B_init_encrypted", LowCommand::default()),
        ("C_servo12_encrypted", servo),
        ("H_hold_pose_encrypted", hold),
    ] {
        assert_eq!(command.encode(Checksum::Encrypted).to_vec(), vector(name), "{name}");
    }
}

#[test]
fn every_command_of_the_vectors_comes_back_as_it_was_but_never_switches_the_battery_off() {
    for name in
        VECTORS.lines().filter_map(|line| line.split(' ').next()).filter(|name| !name.starts_with("F_"))
    {
        let mut expected = vector(name);
        let (command, kind) = LowCommand::decode(&expected).unwrap();
        expected[562..566].fill(0);
        let sum = kind.seal(checksum::of_words(&expected));
        expected[610..].copy_from_slice(&sum.to_le_bytes());
        assert_eq!(command.encode(kind).to_vec(), expected, "{name}");
    }
}

#[test]
fn the_state_of_the_vectors_is_read_as_the_maker_reads_it_and_comes_back_as_it_was() {
    let raw = vector("F_lowstate_plain");
    let (state, kind) = LowState::decode(&raw).unwrap();
    assert_eq!(kind, Checksum::Plain);
    assert_eq!(state.encode(kind).to_vec(), raw);
    let motor = state.motors[5];
    assert_eq!((motor.q_rad, motor.torque_n_m(), motor.temperature_c), (0.5, 1.09375, 25));
    assert_eq!(motor.mode(), MotorMode::Servo);
    assert_eq!((state.battery.charge_percent, state.battery.current_ma), (87, -1234));
    assert_eq!((state.battery.cell_mv(0), state.battery.cell_mv(9)), (Some(3520), Some(3808)));
    assert_eq!((state.tick_ms, state.imu_temperature_c), (123_456, -5));
    assert_eq!(state.feet, [100, 101, 102, 103, -1, -2, -3, -4]);
    assert_eq!(state.remote(), None);
}

#[test]
fn a_state_as_long_as_the_board_sends_it_is_read() {
    let mut raw = vector("F_lowstate_plain");
    raw.resize(state::SENT, 0xA7);
    assert!(LowState::decode(&raw).is_ok());
}

/// The checksum bit by bit, written apart from the one under test.
fn slow_checksum(raw: &[u8]) -> u32 {
    let mut crc = u32::MAX;
    for word in raw[..raw.len() / 4 * 4 - 4].chunks_exact(4) {
        let word = u32::from_le_bytes([word[0], word[1], word[2], word[3]]);
        for bit in (0..32).rev() {
            let carry = (crc >> 31) ^ (word >> bit & 1);
            crc = (crc << 1) ^ (0x04C1_1DB7 * carry);
        }
    }
    crc
}

#[test]
fn of_a_million_random_and_mutated_datagrams_none_panics_and_none_passes_with_a_wrong_checksum() {
    let originals = [vector("C_servo12"), vector("C_servo12_encrypted"), vector("F_lowstate_plain")];
    let mut seed = 0x9E37_79B9_7F4A_7C15_u64;
    let mut random = move || {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        seed as usize
    };
    let mut passed = 0;
    for case in 0..1_000_000 {
        let mut raw = originals[case % 3].clone();
        for _ in 0..=random() % 4 {
            let at = random() % raw.len();
            raw[at] ^= random() as u8;
        }
        match random() % 8 {
            0 => raw.truncate(random() % raw.len()),
            1 => raw.resize(raw.len() + random() % 32, 0),
            2 => raw[2..].fill_with(|| random() as u8),
            _ => {}
        }
        for (accepted, length) in [
            (LowCommand::decode(&raw).is_ok(), command::LENGTH),
            (LowState::decode(&raw).is_ok(), state::LENGTH),
        ] {
            if accepted {
                let found = u32::from_le_bytes(raw[length - 4..length].try_into().unwrap());
                let plain = slow_checksum(&raw[..length]);
                assert!(found == plain || found == (plain ^ 0xEDCA_B9DE).rotate_right(8));
                passed += 1;
            }
        }
    }
    assert!(passed > 100, "only {passed} passed: the mutations leave nothing to check");
}
