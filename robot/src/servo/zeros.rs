//! Which count of a servo's encoder is its joint's zero: found once by a person, kept in a file of the user's.
//!
//! The encoder knows its angle within a turn when it is switched on, not how many turns there were. So the file
//! keeps the zero within a turn, and the driver takes the turn that puts the joint into its range
//! ([`super::Angles`]).

use std::{
    fmt::Write as _,
    fs, io,
    path::{Path, PathBuf},
};

use serde::Deserialize;

use super::{
    ServoError, ServoSettings,
    place::{Place, SERVOS},
    registers::COUNTS_PER_TURN,
};

/// The zero of one servo.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Zero {
    /// The servo that it was found with.
    pub id: u8,
    /// 1 if the servo's positive turn is the joint's, -1 if not.
    pub sign: i8,
    /// Count at joint angle 0, 0 to 4095.
    pub count: i32,
}

/// The zeros of all servos, in the order of places.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Zeros(pub [Zero; SERVOS]);

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    servo: Vec<Entry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    place: String,
    id: u8,
    sign: i8,
    zero_count: i32,
}

impl Zeros {
    /// Zeros as the settings' servos would have them with these counts.
    pub fn with_counts(settings: &ServoSettings, counts: [i32; SERVOS]) -> Self {
        Self(Place::ALL.map(|place| Zero {
            id: settings.id(place),
            sign: settings.limb(place.side).sign[place.in_limb()],
            count: counts[place.index()].rem_euclid(COUNTS_PER_TURN),
        }))
    }

    /// The zero of a servo.
    pub fn of(&self, place: Place) -> Zero {
        self.0[place.index()]
    }

    /// Reads a file; it must name all eight servos, with the settings' ids.
    pub fn load(file: &Path, settings: &ServoSettings) -> Result<Self, ServoError> {
        let text = fs::read_to_string(file).map_err(|source| match source.kind() {
            io::ErrorKind::NotFound => ServoError::NoZeros { file: file.to_owned() },
            _ => ServoError::Read { file: file.to_owned(), source },
        })?;
        let parsed: File = toml::from_str(&text)
            .map_err(|source| ServoError::Parse { file: file.to_owned(), source: Box::new(source) })?;
        Self::checked(&parsed, settings).map_err(|flaw| ServoError::Zeros { file: file.to_owned(), flaw })
    }

    fn checked(parsed: &File, settings: &ServoSettings) -> Result<Self, String> {
        let mut zeros = Self::with_counts(settings, [0; SERVOS]);
        for place in Place::ALL {
            let mut entries = parsed.servo.iter().filter(|entry| entry.place == place.to_string());
            let (Some(entry), None) = (entries.next(), entries.next()) else {
                return Err(format!("{place} must stand there once"));
            };
            let id = settings.id(place);
            if entry.id != id {
                return Err(format!(
                    "the zero of {place} is that of servo {}, servos.toml has {id}",
                    entry.id
                ));
            }
            if entry.sign.abs() != 1 || !(0..COUNTS_PER_TURN).contains(&entry.zero_count) {
                return Err(format!("sign (1 or -1) or zero_count (0 to 4095) of {place} cannot be"));
            }
            zeros.0[place.index()] = Zero { id, sign: entry.sign, count: entry.zero_count };
        }
        if parsed.servo.len() == SERVOS { Ok(zeros) } else { Err("there are more than eight servos".into()) }
    }

    /// Writes the file, whole or not at all; its folder is made if it is not there.
    pub fn save(&self, file: &Path) -> Result<(), ServoError> {
        let written = || -> io::Result<()> {
            if let Some(folder) = file.parent() {
                fs::create_dir_all(folder)?;
            }
            let partial = partial(file);
            fs::write(&partial, self.text()).and_then(|()| fs::rename(&partial, file)).inspect_err(|_| {
                // Nothing half-written is left; it may not have been begun.
                let _ = fs::remove_file(&partial);
            })
        };
        written().map_err(|source| ServoError::Write { file: file.to_owned(), source })
    }

    fn text(&self) -> String {
        let mut text = String::from(
            "# Zero angles of the servos, found by `locoman-robot servo zero`. `zero_count` is the encoder's count at\n\
             # the joint's angle 0 (0 to 4095); `sign` is 1 if the servo's positive turn is the joint's, -1 if not.\n",
        );
        for place in Place::ALL {
            let Zero { id, sign, count } = self.of(place);
            // Writing into a string cannot fail.
            let _ = write!(
                text,
                "\n[[servo]]\nplace = \"{place}\"\nid = {id}\nsign = {sign}\nzero_count = {count}\n"
            );
        }
        text
    }
}

fn partial(file: &Path) -> PathBuf {
    let mut name = file.file_name().unwrap_or_default().to_owned();
    name.push(".partial");
    file.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zeros_survive_their_file() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("new/zeros.toml");
        let settings = ServoSettings::default();
        assert!(matches!(Zeros::load(&file, &settings), Err(ServoError::NoZeros { .. })));
        let zeros = Zeros::with_counts(&settings, [0, 1, 2, 4095, 4, 5, 6, 7]);
        zeros.save(&file).unwrap();
        assert_eq!(Zeros::load(&file, &settings).unwrap(), zeros);
        assert_eq!(fs::read_dir(folder.path().join("new")).unwrap().count(), 1);
    }

    #[test]
    fn zeros_of_other_servos_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("zeros.toml");
        let mut settings = ServoSettings::default();
        Zeros::with_counts(&settings, [0; SERVOS]).save(&file).unwrap();
        settings.left.ids[0] = 21;
        let error = Zeros::load(&file, &settings).unwrap_err().to_string();
        assert!(error.contains("the zero of left-1 is that of servo 5, servos.toml has 21"), "{error}");
    }
}
