//! A rig, the standard shells and a scene, ready to be filmed and tracked.

use std::path::Path;

use locoman_vision::rig::Rig;
use locoman_vision::shells::ShellSet;
use locoman_vision::track::{Tracker, TrackerSettings};

use crate::operator::Inputs;
use crate::operator::scene::Scene;
use crate::operator::studio::Studio;

/// What an experiment is made with.
#[derive(Debug)]
pub struct Stage {
    /// The cameras, as the tracker believes them to be.
    pub rig: Rig,
    /// What the operator wears.
    pub shells: ShellSet,
    /// What is filmed.
    pub studio: Studio,
}

impl Stage {
    /// With a rig and a scene of the configurations, by their names without `.toml`.
    pub fn new(configs: &Path, rig: &str, scene: &str, seed: u64) -> anyhow::Result<Self> {
        let inputs = Inputs {
            rig: configs.join("rigs").join(rig).with_extension("toml"),
            scene: configs.join("scenes").join(scene).with_extension("toml"),
            ..Inputs::standard(configs)
        };
        Ok(Self {
            rig: Rig::load(&inputs.rig)?,
            shells: ShellSet::load(&inputs.shells)?,
            studio: inputs.studio(seed)?,
        })
    }

    /// The same cameras with another scene.
    pub fn with_scene(&self, scene: Scene) -> anyhow::Result<Self> {
        let studio = self.studio.with_scene(scene)?;
        Ok(Self { rig: self.rig.clone(), shells: self.shells.clone(), studio })
    }

    /// A tracker that has seen nothing yet.
    pub fn tracker(&self) -> anyhow::Result<Tracker> {
        self.tracker_with(self.rig.clone())
    }

    /// The same, with another belief about the cameras.
    pub fn tracker_with(&self, rig: Rig) -> anyhow::Result<Tracker> {
        Ok(Tracker::new(rig, self.shells.clone(), TrackerSettings::default())?)
    }
}
