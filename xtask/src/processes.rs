//! A few child processes that live and die together.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};

/// How long a process may take to end by itself once asked to.
const GRACE: Duration = Duration::from_secs(5);

/// Processes in the order of their start; dropped, they are ended in the reverse order.
#[derive(Default)]
pub struct Processes(Vec<Process>);

struct Process {
    name: String,
    child: Child,
}

impl Processes {
    /// Starts a process; its log goes to `folder/NAME.log`.
    pub fn start(&mut self, name: &str, command: &mut Command, folder: &Path) -> Result<()> {
        let log = folder.join(format!("{name}.log"));
        let file = std::fs::File::create(&log).with_context(|| format!("cannot write {}", log.display()))?;
        let child =
            command.stdin(Stdio::null()).stdout(file.try_clone()?).stderr(file).spawn().with_context(
                || format!("cannot start {name} ({})", command.get_program().to_string_lossy()),
            )?;
        self.0.push(Process { name: name.to_owned(), child });
        Ok(())
    }

    /// The name of a process that has ended by itself, and whether it had succeeded.
    pub fn ended(&mut self) -> Result<Option<(String, bool)>> {
        for process in &mut self.0 {
            if let Some(status) = process.child.try_wait()? {
                return Ok(Some((process.name.clone(), status.success())));
            }
        }
        Ok(None)
    }

    /// Fails with the end of a process's log if one has ended.
    pub fn all_alive(&mut self, folder: &Path) -> Result<()> {
        if let Some((name, _)) = self.ended()? {
            bail!("{name} ended:\n{}", log_tail(folder, &name));
        }
        Ok(())
    }

    /// Asks all to end (the way Ctrl-C does), the last started first, and waits.
    pub fn end(&mut self) {
        for process in self.0.iter_mut().rev() {
            let pid = process.child.id().to_string();
            let _ = Command::new("kill").args(["-INT", &pid]).stderr(Stdio::null()).status();
            let deadline = Instant::now() + GRACE;
            while process.child.try_wait().is_ok_and(|status| status.is_none()) {
                if Instant::now() > deadline {
                    let _ = process.child.kill();
                    let _ = process.child.wait();
                    break;
                }
                std::thread::sleep(Duration::from_millis(20));
            }
        }
        self.0.clear();
    }
}

impl Drop for Processes {
    fn drop(&mut self) {
        self.end();
    }
}

/// The last lines of a process's log.
pub fn log_tail(folder: &Path, name: &str) -> String {
    let text = std::fs::read_to_string(folder.join(format!("{name}.log"))).unwrap_or_default();
    let lines: Vec<&str> = text.lines().collect();
    lines[lines.len().saturating_sub(15)..].join("\n")
}
