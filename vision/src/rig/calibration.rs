//! Where a rig's numbers come from: when and how well it was calibrated, and whether they were changed since.
//!
//! All of it is optional; files without it stay valid. What is stated is held to: a calibration older than it allows,
//! or numbers that no longer have the hash that was taken of them, are refused with the reason.

use std::fmt::Write;
use std::time::{SystemTime, UNIX_EPOCH};

use serde::Deserialize;

use super::CameraEntry;
use crate::config::Fault;

/// The `[calibration]` table of a rig file.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// The day, as `2026-11-28`.
    pub date: Option<String>,
    /// From this age on the file is refused.
    pub max_age_days: Option<u32>,
    /// Root mean square of the residuals, pixels.
    pub rms_px: Option<f64>,
    /// Of the cameras' numbers when they were calibrated; written by [`Rig::to_toml`](super::Rig::to_toml).
    pub hash: Option<String>,
}

impl Calibration {
    /// A calibration of today.
    pub fn of_today(rms_px: Option<f64>) -> Self {
        Self { date: Some(date_of_day(today())), rms_px, ..Self::default() }
    }

    /// Refuses what is stale on a day (counted from 1970-01-01) or does not belong to cameras of this hash.
    pub(super) fn check(&self, now: &str, today: i64) -> Result<(), Fault> {
        if let Some(date) = &self.date {
            let Some(day) = day_of_date(date) else {
                return Err(Fault::new(
                    format!("calibration.date = \"{date}\" is no day"),
                    "write it as \"2026-11-28\"",
                ));
            };
            let age_days = today - day;
            if let Some(most) = self.max_age_days.filter(|most| age_days > i64::from(*most)) {
                return Err(Fault::new(
                    format!("the calibration of {date} is {age_days} days old, it was meant for {most}"),
                    "check it with `locoman-calib check` and calibrate again, or raise calibration.max_age_days",
                ));
            }
        } else if self.max_age_days.is_some() {
            return Err(Fault::new("calibration.max_age_days without a date", "add `date = \"2026-11-28\"`"));
        }
        match &self.hash {
            Some(hash) if *hash != now => Err(Fault::new(
                format!("cameras were changed after their calibration: hash {hash} then, {now} now"),
                "restore the calibrated file; or, if the change is meant, remove calibration.hash",
            )),
            _ => Ok(()),
        }
    }
}

/// Tells whether the numbers of cameras are what they were: FNV-1a of 64 bits over names, sizes, intrinsics and poses
/// as the file has them. Comments, live sources and synchronisation may change.
pub(super) fn numbers_hash<'a>(cameras: impl IntoIterator<Item = &'a CameraEntry>) -> String {
    let mut text = String::new();
    for camera in cameras {
        let CameraEntry { id, width, height, model, fx, fy, cx, cy, .. } = camera;
        let (pose, line_time_us) = (&camera.world_from_camera, camera.line_time_us);
        let _ = writeln!(
            text,
            "{id} {width} {height} {model:?} {fx} {fy} {cx} {cy} {:?} {line_time_us} {:?} {:?}",
            camera.distortion, pose.xyz, pose.quat
        );
    }
    let hash = text.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    });
    format!("{hash:016x}")
}

/// Today, in days from 1970-01-01 (UTC).
pub(super) fn today() -> i64 {
    const DAY_S: u64 = 86_400;
    let since = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_secs());
    i64::try_from(since / DAY_S).unwrap_or(0)
}

/// Days from 1970-01-01 to a date of the Gregorian calendar.
fn day_of_date(date: &str) -> Option<i64> {
    let mut parts = date.split('-').map(|part| part.parse::<i64>().ok());
    let (year, month, day) = (parts.next()??, parts.next()??, parts.next()??);
    if parts.next().is_some() || !(1..=12).contains(&month) || !(1..=31).contains(&day) {
        return None;
    }
    // The year begins in March here, so that the leap day is its last.
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let leap_days = year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400);
    /// From 0000-03-01 to 1970-01-01.
    const TO_1970: i64 = 719_468;
    Some(365 * year + leap_days + (153 * month + 2) / 5 + day - 1 - TO_1970)
}

/// The inverse of [`day_of_date`].
fn date_of_day(day: i64) -> String {
    // Long division would do; looking for the day takes a few steps and shares the rules with the other direction.
    let mut year = 1970 + day.div_euclid(366);
    let start = |year: i64| day_of_date(&format!("{year}-01-01")).unwrap_or(0);
    while start(year + 1) <= day {
        year += 1;
    }
    let first = |month: i64| day_of_date(&format!("{year}-{month}-01")).unwrap_or(0);
    let month = (1..=12).rev().find(|month| first(*month) <= day).unwrap_or(1);
    format!("{year:04}-{month:02}-{:02}", day - first(month) + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_and_dates_agree() {
        assert_eq!(day_of_date("1970-01-01"), Some(0));
        // By `date -d 2026-11-28 +%s`.
        assert_eq!(day_of_date("2026-11-28"), Some(1_795_824_000 / 86_400));
        assert_eq!(day_of_date("2026-13-01"), None);
        for day in [0, 58, 59, 60, 365, 789, 11_016, 20_785, 47_541] {
            assert_eq!(day_of_date(&date_of_day(day)), Some(day), "{}", date_of_day(day));
        }
    }
}
