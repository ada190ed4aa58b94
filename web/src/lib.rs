//! What the page asks of Rust: a motor in closed loop that runs some ticks at a time, every setting and fault by its
//! words, and the digest of the microcontroller's loop.
//!
//! ```text
//! page ---- key=value lines ----> LoopView ---- rows, impacts, status ----> page
//! ```
//!
//! Everything is computed by `simulation`. Numbers go to JavaScript as flat arrays, texts as JSON.

mod columns;
mod loop_view;
mod parity;
mod rows;
mod settings;

pub use loop_view::LoopView;
pub use parity::parity;
pub use settings::{faults, settings};
