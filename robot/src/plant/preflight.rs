//! What is looked at before a real robot may move: what it measures and says of itself, against what would stop it.
//!
//! The same thresholds as the supervisor's, so that nothing begins which would be ended in the next moment.

use super::{Health, Sensors};
use crate::{estimator::tilt_angle, supervisor::Thresholds};

/// One thing that was looked at.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// What was found, for people.
    pub found: String,
    /// What to do before the robot may move; nothing if it is in order.
    pub remedy: Option<&'static str>,
}

/// Looks at a robot that lies, damped.
pub fn inspect(sensors: &Sensors, health: &Health, thresholds: &Thresholds) -> Vec<Finding> {
    let finding = |found: String, in_order: bool, remedy: &'static str| Finding {
        found,
        remedy: (!in_order).then_some(remedy),
    };
    let tilt_rad = tilt_angle(&sensors.attitude);
    let fastest = sensors.velocity.iter().fold(0.0_f64, |fastest, speed| fastest.max(speed.abs()));
    vec![
        finding(
            "all numbers of the state are numbers".into(),
            sensors.is_finite(),
            "switch the robot off and on: its IMU or a motor says nothing sensible",
        ),
        finding(
            format!("leaning by {tilt_rad:.2} rad"),
            tilt_rad < thresholds.tilt_hold_rad,
            "lay it flat on its belly, legs folded",
        ),
        finding(
            format!("fastest joint {fastest:.2} rad/s"),
            fastest < STILL_RAD_S,
            "let it come to rest: nobody may hold or move it",
        ),
        finding(
            format!("battery {:.0} %, weakest cell {:.2} V", health.battery_percent, health.cell_v),
            health.battery_percent > thresholds.battery_empty_percent
                && health.cell_v > thresholds.cell_empty_v,
            "charge the battery",
        ),
        finding(
            format!("battery {:.0} °C, hottest motor {:.0} °C", health.battery_c, health.motor_c),
            health.battery_c < thresholds.battery_hot_c && health.motor_c < thresholds.motor_hot_c,
            "let it cool",
        ),
        finding(
            format!("motors {}", if health.motor_fault { "do not follow" } else { "follow" }),
            !health.motor_fault,
            "switch the robot off and on; if a motor protects itself again, let the maker look at it",
        ),
        finding(
            format!(
                "remote control {}",
                if health.remote_stop { "asks for a stop" } else { "does not stop" }
            ),
            !health.remote_stop,
            "let L2 and B go",
        ),
        finding(
            format!("servos {}, hottest {:.0} °C", word(health.servo_fault), health.servo_c),
            !health.servo_fault && health.servo_c < thresholds.servo_hot_c,
            "look at the arms' bus: `locoman-robot servo scan`",
        ),
    ]
}

/// A joint below this does not move, rad/s: five times the noise of a measured speed, and a person's hand is faster.
const STILL_RAD_S: f64 = 0.3;

fn word(fault: bool) -> &'static str {
    if fault { "with a fault" } else { "in order" }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::joints::JointVector;

    fn lying() -> Sensors {
        Sensors {
            time_ns: 1,
            position: JointVector::zeros(),
            velocity: JointVector::repeat(0.02),
            torque: JointVector::zeros(),
            opening: [0.0; 2],
            attitude: [1.0, 0.0, 0.0, 0.0],
            gyro: [0.0; 3],
            accelerometer: [0.0, 0.0, 9.81],
            foot_force: [0.0; 4],
        }
    }

    fn remedies(sensors: &Sensors, health: &Health) -> Vec<&'static str> {
        inspect(sensors, health, &Thresholds::default())
            .into_iter()
            .filter_map(|finding| finding.remedy)
            .collect()
    }

    #[test]
    fn a_robot_that_lies_and_is_well_may_move() {
        assert_eq!(remedies(&lying(), &Health::default()), Vec::<&str>::new());
    }

    #[test]
    fn r_safe_027_whatever_would_stop_it_keeps_it_from_beginning() {
        let well = Health::default();
        let unwell = [
            Health { remote_stop: true, ..well },
            Health { motor_fault: true, ..well },
            Health { motor_c: 75.0, ..well },
            Health { battery_percent: 9.0, ..well },
            Health { cell_v: 3.0, ..well },
            Health { battery_c: 61.0, ..well },
            Health { servo_fault: true, ..well },
        ];
        for health in unwell {
            assert_eq!(remedies(&lying(), &health).len(), 1, "{health:?}");
        }
        let on_its_side = Sensors { attitude: [0.7, 0.7, 0.0, 0.0], ..lying() };
        assert_eq!(remedies(&on_its_side, &well), ["lay it flat on its belly, legs folded"]);
        let mut moved = lying();
        moved.velocity[4] = 1.0;
        assert_eq!(remedies(&moved, &well).len(), 1);
        let mut broken = lying();
        broken.attitude = [f64::NAN; 4];
        assert!(!remedies(&broken, &well).is_empty());
    }
}
