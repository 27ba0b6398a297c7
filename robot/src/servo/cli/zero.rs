//! `servo zero`: directions and zero angles of the assembled arms, by hand.
//!
//! The person folds both arms and closes the jaws: there every angle is known. Then he turns each joint a little the
//! way that is positive in the robot's model; so the directions are measured, not believed.

use std::{thread, time::Duration};

use anyhow::{bail, ensure};

use super::Person;
use crate::{
    joints::Side,
    modes::PoseSettings,
    servo::{
        Angles, Bus, Found, Line, Part, Place, SERVOS, ServoError, ServoSettings, Zero, Zeros,
        registers::{self as reg, COUNTS_PER_TURN, RAD_PER_COUNT},
    },
};

/// A turn that shows a direction has at least so many counts: 5 degrees.
const TURN_COUNTS: i32 = 57;
/// A joint that moves more between two looks is not at rest, counts: half a degree.
const REST_COUNTS: i32 = 6;
/// Between two looks.
const LOOK: Duration = Duration::from_millis(150);

/// Leads through the procedure; nothing if the person does not agree to what was found.
pub fn find_zeros<L: Line>(
    bus: &mut Bus<L>,
    settings: &ServoSettings,
    poses: &PoseSettings,
    person: &mut dyn Person,
) -> anyhow::Result<Option<Zeros>> {
    all_present(bus, settings)?;
    if !person
        .agrees("The torque of all servos will be switched off and the arms may fall: hold them. Go on?")
    {
        return Ok(None);
    }
    for id in settings.ids() {
        bus.write(id, reg::TORQUE_ENABLE, 0)?;
    }
    if !person.has_done(
        "Fold both arms up along their calves: joint 1 all the way back, joints 2 and 3 straight as in the picture of \
         the README; close both jaws. Let go.",
    ) {
        return Ok(None);
    }
    let folded = at_rest(bus, settings)?;
    let mut zeros = Zeros::with_counts(settings, [0; SERVOS]);
    for place in Place::ALL {
        let Some(sign) = direction(bus, place, folded[place.index()], settings, person)? else {
            return Ok(None);
        };
        if sign != zeros.of(place).sign {
            person.tell(&format!(
                "  {place} turns the other way than servos.toml has it; what was measured counts"
            ));
        }
        let angle_rad = reference_rad(place, settings, poses);
        let zero = f64::from(folded[place.index()]) - f64::from(sign) * angle_rad / RAD_PER_COUNT;
        let count = (zero.round() as i32).rem_euclid(COUNTS_PER_TURN);
        zeros.0[place.index()] = Zero { sign, count, ..zeros.of(place) };
    }
    check(&zeros, settings, &folded)?;
    for place in Place::ALL {
        let Zero { id, sign, count } = zeros.of(place);
        person.tell(&format!("  {place:<14} id {id:3}  direction {sign:+}  zero at count {count}"));
    }
    Ok(person.agrees("Keep these zeros?").then_some(zeros))
}

/// A joint's angle in the folded pose, rad; jaws closed.
fn reference_rad(place: Place, settings: &ServoSettings, poses: &PoseSettings) -> f64 {
    match place.part {
        Part::Gripper => settings.gripper.closed_rad,
        Part::Joint(joint) => poses.stow(place.side)[usize::from(joint)],
    }
}

/// The way that is positive, for a person in front of the folded arms (axes of the URDF).
fn positive_way(place: Place) -> &'static str {
    match place.part {
        Part::Joint(0) => "swing the whole arm forward, away from the calf",
        Part::Joint(1) => "bend the arm to the robot's left",
        Part::Joint(_) => "turn the gripper counter-clockwise, seen from the elbow along the arm",
        Part::Gripper => "open the jaws",
    }
}

fn direction<L: Line>(
    bus: &mut Bus<L>,
    place: Place,
    before: i32,
    settings: &ServoSettings,
    person: &mut dyn Person,
) -> anyhow::Result<Option<i8>> {
    let side = match place.side {
        Side::Right => "right",
        Side::Left => "left",
    };
    loop {
        let what = format!("{place}, on the robot's {side}: {}, by 10 to 60 degrees.", positive_way(place));
        if !person.has_done(&what) {
            return Ok(None);
        }
        let turned =
            wrapped(bus.read_register(settings.id(place), reg::PRESENT_POSITION)?.cast_signed() - before);
        if turned.abs() >= TURN_COUNTS {
            return Ok(Some(if turned > 0 { 1 } else { -1 }));
        }
        let degrees = f64::from(turned.abs()) * 360.0 / f64::from(COUNTS_PER_TURN);
        person.tell(&format!(
            "  its servo {} has turned by {degrees:.1} degrees only: is it this joint's?",
            settings.id(place)
        ));
    }
}

/// A difference of counts, the short way round.
fn wrapped(counts: i32) -> i32 {
    (counts + COUNTS_PER_TURN / 2).rem_euclid(COUNTS_PER_TURN) - COUNTS_PER_TURN / 2
}

fn all_present<L: Line>(bus: &mut Bus<L>, settings: &ServoSettings) -> anyhow::Result<()> {
    let mut missing = Vec::new();
    for place in Place::ALL {
        match bus.ping(settings.id(place)) {
            Ok(Found { id, model, .. }) => {
                ensure!(model == reg::MODEL, ServoError::Model { id, place, model });
            }
            Err(ServoError::Silent { id, .. }) => missing.push((place, id)),
            Err(error) => return Err(error.into()),
        }
    }
    ensure!(missing.is_empty(), ServoError::Missing { missing });
    Ok(())
}

/// All counts, of joints that do not move.
fn at_rest<L: Line>(bus: &mut Bus<L>, settings: &ServoSettings) -> anyhow::Result<[i32; SERVOS]> {
    let mut look = || -> Result<[i32; SERVOS], ServoError> {
        let mut counts = [0; SERVOS];
        for (count, id) in counts.iter_mut().zip(settings.ids()) {
            *count = bus.read_register(id, reg::PRESENT_POSITION)?.cast_signed();
        }
        Ok(counts)
    };
    let first = look()?;
    thread::sleep(LOOK);
    let second = look()?;
    for place in Place::ALL {
        let moved = wrapped(second[place.index()] - first[place.index()]).abs();
        if moved > REST_COUNTS {
            bail!("{place} moved by {moved} counts between two looks: let it come to rest and begin anew");
        }
    }
    Ok(second)
}

/// With the zeros found, every joint stands where it can be.
fn check(zeros: &Zeros, settings: &ServoSettings, folded: &[i32; SERVOS]) -> anyhow::Result<()> {
    for place in Place::ALL {
        let range_rad = settings.range_rad(place);
        let resolved = Angles::new(zeros.of(place), range_rad).resolved(folded[place.index()]);
        if let Err(angle_rad) = resolved {
            bail!(ServoError::Range { id: settings.id(place), place, angle_rad, range_rad });
        }
    }
    Ok(())
}
