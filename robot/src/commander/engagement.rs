//! Who moves the robot: at most one engagement at a time, and never one that was there before us.

use super::command::{Command, EngagementId};

/// What a command means for the targets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Grip {
    /// Nobody moves the robot.
    Released,
    /// An engagement begins: anchor at displacement zero.
    Begins,
    /// One that began in another mode goes on in this: anchor at the displacement as it is.
    Resumes,
    /// It goes on, but nothing may move now.
    Frozen,
    /// It goes on.
    Holds,
}

/// Follows the engagements of the operator.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Engagement {
    active: Option<EngagementId>,
    /// Ended by us, or older than us: not taken again.
    barred: Option<EngagementId>,
    /// Was active when the robot went on to another mode.
    interrupted: Option<EngagementId>,
    source: Option<u64>,
}

impl Engagement {
    /// Takes in the latest command. Without permission nothing begins or moves, but nothing ends either.
    pub fn update(&mut self, command: &Command, permitted: bool) -> Grip {
        let id = command.engagement_id();
        if self.source.replace(command.source) != Some(command.source) {
            // An engagement that was under way when we met its sender was not made with this robot as it is.
            self.active = None;
            self.barred = id;
        }
        if id.is_none() || id == self.barred {
            self.active = None;
            self.interrupted = None;
            return Grip::Released;
        }
        if !permitted {
            return Grip::Frozen;
        }
        if self.active == id {
            return Grip::Holds;
        }
        self.active = id;
        if self.interrupted.take() == id { Grip::Resumes } else { Grip::Begins }
    }

    /// Ends the engagement for good: motion needs a new one.
    pub fn end(&mut self, command: Option<&Command>) {
        self.active = None;
        self.interrupted = None;
        self.barred = command.and_then(Command::engagement_id).or(self.barred);
    }

    /// The robot goes on to another mode: an engagement that outlasts the way there resumes then.
    pub fn interrupt(&mut self) {
        self.interrupted = self.active.take().or(self.interrupted);
    }

    /// The engagement that moves the robot; 0 for none.
    pub fn number(&self) -> u64 {
        self.active.map_or(0, |id| id.number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn command(source: u64, engagement: u64) -> Command {
        Command { sequence: 1, engagement, ..Command::idle(source) }
    }

    #[test]
    fn a_new_engagement_begins_once_and_holds_until_released() {
        let mut sut = Engagement::default();
        assert_eq!(sut.update(&command(1, 0), true), Grip::Released);
        assert_eq!(sut.update(&command(1, 5), true), Grip::Begins);
        assert_eq!(sut.update(&command(1, 5), true), Grip::Holds);
        assert_eq!(sut.update(&command(1, 6), true), Grip::Begins);
        assert_eq!(sut.update(&command(1, 0), true), Grip::Released);
        assert_eq!(sut.number(), 0);
    }

    #[test]
    fn an_engagement_that_we_ended_needs_a_new_number() {
        let mut sut = Engagement::default();
        sut.update(&command(1, 0), true);
        sut.update(&command(1, 5), true);
        sut.end(Some(&command(1, 5)));
        assert_eq!(sut.update(&command(1, 5), true), Grip::Released);
        assert_eq!(sut.update(&command(1, 6), true), Grip::Begins);
    }

    #[test]
    fn an_engagement_that_outlasts_a_change_of_modes_resumes_and_a_pause_does_not_end_it() {
        let mut sut = Engagement::default();
        sut.update(&command(1, 0), true);
        sut.update(&command(1, 5), true);
        assert_eq!(sut.update(&command(1, 5), false), Grip::Frozen);
        assert_eq!(sut.update(&command(1, 5), true), Grip::Holds);
        sut.interrupt();
        assert_eq!(sut.update(&command(1, 5), true), Grip::Resumes);
        sut.interrupt();
        assert_eq!(sut.update(&command(1, 6), true), Grip::Begins);
    }

    #[test]
    fn an_engagement_older_than_the_robot_is_not_taken_up() {
        let mut sut = Engagement::default();
        assert_eq!(sut.update(&command(1, 5), true), Grip::Released);
        assert_eq!(sut.update(&command(1, 6), true), Grip::Begins);
    }

    #[test]
    fn another_source_ends_the_engagement() {
        let mut sut = Engagement::default();
        sut.update(&command(1, 0), true);
        sut.update(&command(1, 5), true);
        assert_eq!(sut.update(&command(2, 5), true), Grip::Released);
        assert_eq!(sut.update(&command(2, 6), true), Grip::Begins);
    }
}
