//! What the supervisor asks for, and why.

/// What must happen, the worst last. The order is that of the message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum Severity {
    /// All is well.
    #[default]
    None,
    /// Worth telling.
    Warn,
    /// Targets frozen; motion needs a fresh command.
    Hold,
    /// Engagement ended; motion needs a deliberate new one.
    Disengage,
    /// Return to standing on four feet.
    Stand,
    /// Settle on four feet, lie down, damp.
    LieDown,
    /// Damp at once.
    Damp,
}

/// A cause.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Reason {
    /// No operator has spoken yet.
    NoOperator,
    /// Commands are late.
    CommandLate,
    /// Commands have ceased.
    CommandLost,
    /// Commands have been gone so long that the robot goes back to four feet.
    OperatorGone,
    /// A sensor sample is late.
    SensorsLate,
    /// The robot says nothing.
    SensorsLost,
    /// Sensors hold numbers that are none.
    SensorsNotFinite,
    /// The torso leans further than it should.
    Tilted,
    /// The torso leans so far that nothing can be done.
    Fallen,
    /// Someone asked to settle.
    StopSettle,
    /// Someone asked to damp.
    StopDamp,
    /// A foot that should stand carries nothing.
    FootUnloaded,
    /// The whole-body controller gave up.
    Control,
    /// A foot that goes down finds no ground.
    NoGround,
    /// The remote control asks for a stop.
    RemoteStop,
    /// The sender has damped the motors by itself.
    SenderDamped,
    /// A motor does not do what it is told.
    MotorFault,
    /// A motor is warm.
    MotorWarm,
    /// A motor is too hot.
    MotorHot,
    /// The legs work too hard.
    Overpowered,
    /// The battery runs low.
    BatteryLow,
    /// The battery is empty.
    BatteryEmpty,
    /// The battery is too hot.
    BatteryHot,
    /// A servo of an arm has an error, or does not answer.
    ServoFault,
    /// A servo is warm.
    ServoWarm,
    /// A servo is too hot.
    ServoHot,
}

impl Reason {
    /// All of them, in order.
    pub const ALL: [Self; 26] = [
        Self::NoOperator,
        Self::CommandLate,
        Self::CommandLost,
        Self::OperatorGone,
        Self::SensorsLate,
        Self::SensorsLost,
        Self::SensorsNotFinite,
        Self::Tilted,
        Self::Fallen,
        Self::StopSettle,
        Self::StopDamp,
        Self::FootUnloaded,
        Self::Control,
        Self::NoGround,
        Self::RemoteStop,
        Self::SenderDamped,
        Self::MotorFault,
        Self::MotorWarm,
        Self::MotorHot,
        Self::Overpowered,
        Self::BatteryLow,
        Self::BatteryEmpty,
        Self::BatteryHot,
        Self::ServoFault,
        Self::ServoWarm,
        Self::ServoHot,
    ];

    /// For people.
    pub const fn text(self) -> &'static str {
        match self {
            Self::NoOperator => "no operator yet",
            Self::CommandLate => "commands are late",
            Self::CommandLost => "commands have ceased: engage anew",
            Self::OperatorGone => "the operator is gone: going back to four feet",
            Self::SensorsLate => "the robot's state is late",
            Self::SensorsLost => "no state from the robot",
            Self::SensorsNotFinite => "the robot's state holds numbers that are none",
            Self::Tilted => "the torso leans too far",
            Self::Fallen => "the robot has fallen",
            Self::StopSettle => "stopped: settle, lie down, damp",
            Self::StopDamp => "stopped: damped",
            Self::FootUnloaded => "a foot that should stand carries nothing",
            Self::Control => "the whole-body controller found no forces",
            Self::NoGround => "the foot finds no ground: still on three feet",
            Self::RemoteStop => "stopped by the remote control: damped",
            Self::SenderDamped => {
                "the sender has damped the motors: the controller was late, or the remote control said so"
            }
            Self::MotorFault => "a motor protects itself or does not follow",
            Self::MotorWarm => "a motor is warm",
            Self::MotorHot => "a motor is too hot: let it cool",
            Self::Overpowered => "the legs' motors are overloaded",
            Self::BatteryLow => "the battery is low",
            Self::BatteryEmpty => "the battery is empty: charge it",
            Self::BatteryHot => "the battery is too hot: let it cool",
            Self::ServoFault => "a servo of an arm has an error or does not answer",
            Self::ServoWarm => "a servo is warm",
            Self::ServoHot => "a servo is too hot: let it cool",
        }
    }
}

/// A set of causes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Reasons(u32);

impl Reasons {
    /// Adds one.
    pub fn insert(&mut self, reason: Reason) {
        self.0 |= 1 << reason as u32;
    }

    /// Whether it is one of them.
    pub fn contains(self, reason: Reason) -> bool {
        self.0 & (1 << reason as u32) != 0
    }

    /// All of them, in order.
    pub fn iter(self) -> impl Iterator<Item = Reason> {
        Reason::ALL.into_iter().filter(move |reason| self.contains(*reason))
    }
}
