//! What a robot says of itself, besides what it measures: for the supervisor.

/// The state of motors, servos, battery and line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Health {
    /// The remote control asks for a stop.
    pub remote_stop: bool,
    /// The sender has damped the motors by itself, because the controller was late or the remote control said so.
    pub sender_damped: bool,
    /// A leg's motor does not do what it is told: it protects itself, or brakes.
    pub motor_fault: bool,
    /// The hottest leg's motor, °C.
    pub motor_c: f64,
    /// Charge, percent.
    pub battery_percent: f64,
    /// The weakest cell, V.
    pub cell_v: f64,
    /// The battery at its hottest place, °C.
    pub battery_c: f64,
    /// What the legs' motors have done at least in each of the last samples, W: see [`SustainedPower`].
    pub leg_power_w: f64,
    /// A servo of the arms has an error, or does not answer.
    pub servo_fault: bool,
    /// The hottest servo, °C.
    pub servo_c: f64,
}

impl Default for Health {
    /// A robot that is well.
    fn default() -> Self {
        Self {
            remote_stop: false,
            sender_damped: false,
            motor_fault: false,
            motor_c: 30.0,
            battery_percent: 100.0,
            cell_v: 4.2,
            battery_c: 25.0,
            leg_power_w: 0.0,
            servo_fault: false,
            servo_c: 30.0,
        }
    }
}

/// The least power of the last six samples: a single peak is no overload (the maker's library counts alike).
#[derive(Debug, Clone, Copy, Default)]
pub struct SustainedPower {
    last_w: [f64; 6],
    next: usize,
}

impl SustainedPower {
    /// Takes a sample in, W, and returns what was exceeded by all of the last six.
    pub fn update(&mut self, power_w: f64) -> f64 {
        self.last_w[self.next] = power_w;
        self.next = (self.next + 1) % self.last_w.len();
        self.last_w.iter().copied().fold(f64::INFINITY, f64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn five_samples_of_overload_are_a_peak_and_six_are_not() {
        let mut sut = SustainedPower::default();
        for _ in 0..5 {
            assert_eq!(sut.update(1200.0), 0.0);
        }
        assert_eq!(sut.update(1100.0), 1100.0);
        assert_eq!(sut.update(10.0), 10.0);
    }
}
