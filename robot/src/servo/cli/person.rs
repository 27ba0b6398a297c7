//! The person at the keyboard, or who stands for him in a test.

use std::io::{self, BufRead, Write};

/// Who is told and asked.
pub trait Person {
    /// Tells a line.
    fn tell(&mut self, text: &str);

    /// Asks a question that only a clear yes affirms.
    fn agrees(&mut self, question: &str) -> bool;

    /// Asks for something to be done; true when it has been, false to end.
    fn has_done(&mut self, what: &str) -> bool;
}

/// Stdout and stdin.
#[derive(Debug, Default)]
pub struct Terminal;

impl Person for Terminal {
    fn tell(&mut self, text: &str) {
        println!("{text}");
    }

    fn agrees(&mut self, question: &str) -> bool {
        answer(&format!("{question} [y/N] ")).is_some_and(|answer| matches!(answer.as_str(), "y" | "yes"))
    }

    fn has_done(&mut self, what: &str) -> bool {
        answer(&format!("{what}\n  Enter when done, q to end: ")).is_some_and(|answer| answer != "q")
    }
}

/// What was typed, in small letters; nothing at the end of the input.
fn answer(question: &str) -> Option<String> {
    print!("{question}");
    io::stdout().flush().ok()?;
    let mut line = String::new();
    let read = io::stdin().lock().read_line(&mut line).ok()?;
    (read > 0).then(|| line.trim().to_lowercase())
}
